"""Draw the meshes of bodies, level by level."""

import numpy as np
from matplotlib.figure import Figure

from palpate.bodies.body import Body
from palpate.report import render, style
from palpate.report.words import spaced

_PIXELS, _INCHES = 640, 2.9
_MARGIN = 1.12  # the balls of held nodes reach beyond the mesh
_CAPTION = 0.7  # [inch] of three lines below a picture


@style.styled
def draw_mesh_levels(bodies: list[Body]) -> Figure:
    """Draw one row for each body, one column for each level; dark balls are nodes that are held or lie on a bed."""
    columns = max(len(body.levels) for body in bodies)
    clouds = [body.coarse.nodes for body in bodies]
    ways = [render.directions(nodes, np.zeros(3)) for nodes in clouds]
    views = render.same_scale([render.frame(way, [nodes], _MARGIN) for way, nodes in zip(ways, clouds, strict=True)])
    aspect = views[0].width / views[0].height
    figure, axes = style.grid(len(bodies), columns, aspect, _INCHES, bare=True, caption=_CAPTION)
    with render.Stage(_PIXELS, round(_PIXELS / aspect)) as stage:
        for row, body, view in zip(axes, bodies, views, strict=True):
            row[0].set_ylabel(spaced(body.name), fontweight="bold")
            for axis in row[len(body.levels) :]:
                axis.remove()
            for level, mesh in enumerate(body.levels):
                style.place(row[level], stage.level(view, mesh, body.supported(level)), _level_caption(mesh, level))
    return figure


def _level_caption(mesh, level: int) -> str:
    name = "coarse" if level == 0 else f"refined {level}×"
    return (
        f"{name}\n"
        f"surface: {len(mesh.surface):,} nodes, {len(mesh.triangles):,} triangles\n"
        f"volume: {len(mesh.nodes):,} nodes, {len(mesh.tetrahedra):,} tetrahedra"
    )
