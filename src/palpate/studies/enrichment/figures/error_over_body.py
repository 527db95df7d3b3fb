"""Error of each method over the body, for its best, median and worst test sample."""

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from palpate.benchmark.database import Database
from palpate.bodies.body import Body
from palpate.report import panels, render, style
from palpate.studies.enrichment.figures.predictions import Prediction

METHODS = ["interpolation", style.PAPERS, "detail_correction"]
"""One row each: interpolation, which costs least, the paper's method, and detail correction."""

_PIXELS, _INCHES = 480, 1.75
_DECADES = 3


@style.styled
def draw(body: Body, database: Database, groups: dict[str, dict[str, Prediction]]) -> Figure:
    """Draw three columns (best, median, worst) for each group and one row for each method, on one logarithmic scale.

    groups : maps a heading such as "paper protocol, samples held out" to predictions of METHODS
    Samples are ranked for each method by itself, by RMSE over the fine surface nodes / peak.
    """
    shown = {(g, m): ranked(database, groups[g][m]) for g in groups for m in METHODS}
    scale = limits([field for picks in shown.values() for _, field, _, _ in picks])
    views = render.same_scale([camera(database, i, moved) for p in shown.values() for i, _, moved, _ in p])
    aspect = views[0].width / views[0].height
    figure, axes = panels.grid(len(METHODS), 3 * len(groups), aspect, _INCHES)
    cells = [(r, 3 * c + k) for c in range(len(groups)) for r in range(len(METHODS)) for k in range(3)]
    picks = [pick for picks in shown.values() for pick in picks]
    with render.Stage(_PIXELS, round(_PIXELS / aspect)) as stage:
        for (r, c), view, (i, field, moved, error) in zip(cells, views, picks, strict=True):
            picture = _picture(stage, view, body, database, 100 * field, moved, scale)
            panels.place(axes[r, c], picture, f"sample {i}: {percent(100 * error)} % of peak")
    for axis, method in zip(axes[:, 0], METHODS, strict=True):
        axis.set_ylabel(style.short(method), fontweight="bold")
    for c, group in enumerate(groups):
        axes[0, 3 * c].set_title(f"{group}\nbest", loc="left")
        for k, name in enumerate(("median", "worst"), 1):
            axes[0, 3 * c + k].set_title(name, loc="left")
    label = "error at each node [% of the sample's peak displacement]"
    panels.colour_bar(figure, LogNorm(*scale), style.ERROR, label, extend="min", format="%g")
    return figure


def limits(fields: list[np.ndarray]) -> tuple[float, float]:
    """Return the limits in % of three decades up to the largest of some errors / peak."""
    top = 100 * max(float(field.max()) for field in fields)
    return top / 10**_DECADES, top


def percent(value: float) -> str:
    """Format a number with two significant digits without an exponent."""
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def ranked(database, prediction) -> list[tuple]:
    """Rank the samples: (sample, error / peak (n,), displacement (n, 3), RMSE / peak) of best, median and worst."""
    reference = database.fine[prediction.sample]
    peaks = np.linalg.norm(reference, axis=2).max(axis=1)
    fields = np.linalg.norm(prediction.predicted - reference, axis=2) / peaks[:, None]
    errors = np.sqrt(np.mean(fields**2, axis=1))
    order = np.argsort(errors, kind="stable")
    picks = order[[0, (len(order) - 1) // 2, -1]]
    return [(int(prediction.sample[p]), fields[p], reference[p], float(errors[p])) for p in picks]


def camera(database, i, moved) -> render.View:
    """Choose the camera of a sample: its contact is visible, its deformed body complete."""
    normal = database.contact_normals[np.searchsorted(database.coarse_surface, database.contact[i])]
    rest = database.nodes_fine_surface
    return render.frame(render.directions(rest, normal), [rest + moved])


def _picture(stage, view, body, database, percent, moved, limits) -> np.ndarray:
    """Render the body as fine FEM deforms it, coloured by error; dark balls are held nodes."""
    rest = database.nodes_fine_surface
    held = body.coarse.nodes[np.intersect1d(body.anchors[0], body.coarse.surface)]
    ball = 0.014 * float(np.ptp(rest, axis=0).max())
    clipped = np.maximum(percent, limits[0])
    return stage.picture(
        view,
        [
            lambda s: s.surface(rest + moved, database.triangles, clipped, limits, style.ERROR, log=True),
            lambda s: s.dots(held, ball),
        ],
    )
