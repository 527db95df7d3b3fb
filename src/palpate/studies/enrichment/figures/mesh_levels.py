"""Draw the nested meshes of every body, coarse to fine, with their counts."""

import numpy as np
from matplotlib.figure import Figure

from palpate.bodies.body import Body
from palpate.report import panels, render, style

_PIXELS, _INCHES = 640, 2.9
_MARGIN = 1.12  # the balls of held nodes reach beyond the mesh
_SIDE, _CAPTION, _GAP = 0.35, 0.62, 0.1  # [inch] for the body's name, for three lines below a picture, between them


@style.styled
def draw(bodies: list[Body]) -> Figure:
    """Draw one row for each body, one column for each level; dark balls are held nodes."""
    columns = max(len(body.levels) for body in bodies)
    views = render.same_scale([_view(body) for body in bodies])
    aspect = views[0].width / views[0].height
    picture = _INCHES - _GAP, (_INCHES - _GAP) / aspect
    row = picture[1] + _CAPTION
    width, height = _SIDE + _INCHES * columns, row * len(bodies)
    figure = Figure(figsize=(width, height))
    with render.Stage(_PIXELS, round(_PIXELS / aspect)) as stage:
        for number, (body, view) in enumerate(zip(bodies, views, strict=True)):
            bottom = height - (number + 1) * row + _CAPTION
            for level, (mesh, anchors) in enumerate(zip(body.levels, body.anchors, strict=True)):
                left = _SIDE + _INCHES * level
                size = picture[0] / width, picture[1] / height
                axis = figure.add_axes((left / width, bottom / height, *size), xticks=[], yticks=[])
                axis.spines[:].set_visible(False)
                panels.place(axis, stage.level(view, mesh, anchors), _caption(mesh, level))
                if level == 0:
                    axis.set_ylabel(body.name.replace("_", " "), fontweight="bold")
    return figure


def _view(body: Body) -> render.View:
    """Return the view of a body from above and to the side."""
    axes = render.directions(body.coarse.nodes, np.zeros(3))
    return render.frame(axes, [body.coarse.nodes], _MARGIN)


def _caption(mesh, level: int) -> str:
    """Return the counts of one level."""
    name = "coarse" if level == 0 else f"refined {level}×"
    return (
        f"{name}\n"
        f"surface: {len(mesh.surface):,} nodes, {len(mesh.triangles):,} triangles\n"
        f"volume: {len(mesh.nodes):,} nodes, {len(mesh.tetrahedra):,} tetrahedra"
    )
