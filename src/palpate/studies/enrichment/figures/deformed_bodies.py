"""Deformed bodies, coloured by displacement, one row for each sample."""

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from palpate.benchmark.database import Database
from palpate.bodies.body import Body
from palpate.report import panels, render, style
from palpate.studies.enrichment.figures.predictions import Prediction

METHODS = [style.BASELINE, style.PAPERS, "detail_correction"]
"""Drawn after the rest state, the fine and the coarse simulation."""

_PIXELS, _INCHES = 480, 1.75


@style.styled
def draw(body: Body, database: Database, predictions: dict[str, Prediction], rows: int = 3) -> Figure:
    """Draw rest, fine FEM, coarse FEM and METHODS, for ``rows`` test samples from small to large peak.

    predictions : of METHODS, all for the same test samples. The colour scale is shared and ends at the largest
    displacement of fine FEM in the samples shown; the arrow is the load, dark balls are held nodes, grey lines the
    outline at rest. Displacements are to scale.
    """
    peaks = np.linalg.norm(database.fine, axis=2).max(axis=1)
    chosen = _spread(predictions["detail_correction"].sample, peaks, database.contact, rows)
    limit = peaks[chosen].max() * 1e3
    views = render.same_scale([_view(database, i) for i in chosen])
    aspect = views[0].width / views[0].height

    titles = ["rest,\nwith its load", "fine FEM", "coarse FEM", *map(style.short, METHODS)]
    figure, axes = panels.grid(len(chosen), len(titles), aspect, _INCHES)
    with render.Stage(_PIXELS, round(_PIXELS / aspect)) as stage:
        for row, i, view in zip(axes, chosen, views, strict=True):
            bare = stage.picture(view, [lambda s: _surface(s, body, database, "rest", 0.0, limit)])
            for axis, (what, moved) in zip(row, _states(database, predictions, i), strict=True):
                picture = _picture(stage, view, body, database, i, (what, moved), limit)
                panels.place(axis, picture, _caption(database, i, what, moved, peaks[i]))
                if what != "rest":
                    panels.outline(axis, bare)
    for axis, title in zip(axes[0], titles, strict=True):
        axis.set_title(title, loc="center")
    panels.colour_bar(figure, Normalize(0, limit), style.DISPLACEMENT, "displacement [mm]", extend="max")
    return figure


def _spread(samples: np.ndarray, peaks: np.ndarray, contacts: np.ndarray, rows: int) -> list[int]:
    """Choose ``rows`` of the samples from small to large peak, with different contacts as far as possible."""
    ranked = samples[np.argsort(peaks[samples], kind="stable")]
    chosen: list[int] = []
    for share in (np.arange(rows) + 0.5) / rows:
        fresh = [i for i in ranked if contacts[i] not in contacts[chosen] and i not in chosen]
        rest = fresh or [i for i in ranked if i not in chosen]
        if rest:
            target = np.quantile(peaks[ranked], share)
            chosen.append(int(min(rest, key=lambda i: abs(peaks[i] - target))))
    return sorted(chosen, key=lambda i: peaks[i])


def _states(database, predictions, i):
    """Yield the columns of one row: (kind, displacement of fine surface (n, 3) or all coarse nodes (N, 3) [m])."""
    yield "rest", np.zeros_like(database.nodes_fine_surface)
    yield "fine", database.fine[i]
    yield "coarse", database.coarse_live[i]
    for method in METHODS:
        at = np.flatnonzero(predictions[method].sample == i)[0]
        yield "method", predictions[method].predicted[at]


def _view(database, i) -> render.View:
    """Choose one camera for all pictures of a sample."""
    rest = database.nodes_fine_surface
    contact = database.contact[i]
    axes = render.directions(rest, _normal(database, i))
    force = database.force[i] / np.linalg.norm(database.force[i])
    tail = database.coarse_nodes[contact] - _arrow(rest) * force
    return render.frame(axes, [rest, rest + database.fine[i], tail[None]])


def _normal(database, i) -> np.ndarray:
    """Return the normal at rest at the contact of sample i, (3,)."""
    return database.contact_normals[np.searchsorted(database.coarse_surface, database.contact[i])]


def _arrow(nodes) -> float:
    """Return the length of the load's arrow [m]."""
    return 0.2 * float(np.ptp(nodes, axis=0).max())


def _picture(stage, view, body, database, i, state, limit) -> np.ndarray:
    """Render one panel, (height, width, 3) uint8."""
    rest = database.nodes_fine_surface
    held = body.coarse.nodes[np.intersect1d(body.anchors[0], body.coarse.surface)]
    actors = [
        lambda s: _surface(s, body, database, state[0], state[1], limit),
        lambda s: s.dots(held, 0.07 * _arrow(rest)),
    ]
    if state[0] == "rest":
        contact = database.coarse_nodes[database.contact[i]]
        actors.append(lambda s: s.arrow(contact, database.force[i], _normal(database, i), _arrow(rest)))
    return stage.picture(view, actors)


def _surface(stage, body, database, what, moved, limit) -> None:
    """Add the deformed surface; the rest state is grey, and it and the coarse mesh show their edges."""
    coarse = what == "coarse"
    nodes = database.coarse_nodes if coarse else database.nodes_fine_surface
    triangles = body.coarse.triangles if coarse else database.triangles
    millimetres = None if what == "rest" else np.linalg.norm(moved, axis=1) * 1e3
    edges = what in ("rest", "coarse")
    stage.surface(nodes + moved, triangles, millimetres, (0, limit), style.DISPLACEMENT, edges=edges)


def _caption(database, i, what, moved, peak) -> str:
    """Return the caption below a panel."""
    if what == "rest":
        return f"sample {i}: {np.linalg.norm(database.force[i]):.2g} N"
    if what == "fine":
        return f"peak {peak * 1e3:.1f} mm"
    if what == "coarse":
        return f"peak {np.linalg.norm(moved, axis=1).max() * 1e3:.1f} mm"
    error = np.sqrt(np.mean(np.sum((moved - database.fine[i]) ** 2, axis=1))) / peak
    return f"error {100 * error:.2g} % of peak"
