"""Draw the meshes of bodies, level by level."""

import numpy as np
from matplotlib.figure import Figure

from palpate.bodies.body import Body
from palpate.report import render, style
from palpate.report.words import spaced

_PIXELS, _INCHES = 640, 2.9
_MARGIN = 1.12  # the balls of held nodes reach beyond the mesh
_SIDE, _CAPTION, _GAP = 0.35, 0.62, 0.1  # [inch] for the body's name, for three lines below a picture, between them


@style.styled
def draw_mesh_levels(bodies: list[Body]) -> Figure:
    """Draw one row for each body, one column for each level; dark balls are nodes that are held or lie on a bed."""
    columns = max(len(body.levels) for body in bodies)
    clouds = [body.coarse.nodes for body in bodies]
    axes = [render.directions(nodes, np.zeros(3)) for nodes in clouds]
    views = render.same_scale([render.frame(ways, [nodes], _MARGIN) for ways, nodes in zip(axes, clouds, strict=True)])
    aspect = views[0].width / views[0].height
    picture = _INCHES - _GAP, (_INCHES - _GAP) / aspect
    row = picture[1] + _CAPTION
    width, height = _SIDE + _INCHES * columns, row * len(bodies)
    figure = Figure(figsize=(width, height))
    with render.Stage(_PIXELS, round(_PIXELS / aspect)) as stage:
        for number, (body, view) in enumerate(zip(bodies, views, strict=True)):
            bottom = height - (number + 1) * row + _CAPTION
            for level, mesh in enumerate(body.levels):
                left = _SIDE + _INCHES * level
                size = picture[0] / width, picture[1] / height
                axis = figure.add_axes((left / width, bottom / height, *size), xticks=[], yticks=[])
                axis.spines[:].set_visible(False)
                style.place(axis, stage.level(view, mesh, body.supported(level)), _level_caption(mesh, level))
                if level == 0:
                    axis.set_ylabel(spaced(body.name), fontweight="bold")
    return figure


def _level_caption(mesh, level: int) -> str:
    name = "coarse" if level == 0 else f"refined {level}×"
    return (
        f"{name}\n"
        f"surface: {len(mesh.surface):,} nodes, {len(mesh.triangles):,} triangles\n"
        f"volume: {len(mesh.nodes):,} nodes, {len(mesh.tetrahedra):,} tetrahedra"
    )
