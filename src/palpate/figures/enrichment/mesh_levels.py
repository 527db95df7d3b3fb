"""The nested meshes of every body, coarse to fine, with their numbers of nodes and elements."""

import numpy as np
from matplotlib.figure import Figure

from palpate.bodies.body import Body
from palpate.figures import panels, render, style

_PIXELS, _INCHES = 640, 2.9


@style.styled
def draw(bodies: list[Body]) -> Figure:
    """Draw one row for each body and one column for each level; dark balls are held nodes."""
    columns = max(len(body.levels) for body in bodies)
    views = render.same_scale([_view(body) for body in bodies])
    aspect = views[0].width / views[0].height
    figure, axes = panels.grid(len(bodies), columns, aspect, _INCHES, bare=True)
    with render.Stage(_PIXELS, round(_PIXELS / aspect)) as stage:
        for row, body, view in zip(axes, bodies, views, strict=True):
            triples = zip(row, body.levels, body.anchors, strict=False)
            for level, (axis, mesh, anchors) in enumerate(triples):
                panels.place(axis, stage.level(view, mesh, anchors), _caption(mesh, level))
            row[0].set_ylabel(body.name, fontweight="bold")
    return figure


def _view(body) -> render.View:
    """Choose a view of the body from above and to the side."""
    axes = render.directions(body.coarse.nodes, np.zeros(3))
    return render.frame(axes, [body.coarse.nodes])


def _caption(mesh, level) -> str:
    """Return the caption of one level, with its numbers of nodes and elements."""
    name = "coarse" if level == 0 else f"refined {level}×"
    return (
        f"{name}\n"
        f"surface: {len(mesh.surface):,} nodes, {len(mesh.triangles):,} triangles\n"
        f"volume: {len(mesh.nodes):,} nodes, {len(mesh.tetrahedra):,} tetrahedra"
    )
