"""Pictures of paper 1's bodies: deformed samples, and where methods are wrong."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from palpate.benchmark.accuracy import errors
from palpate.benchmark.database import Database
from palpate.bodies.body import Body
from palpate.files import read_hdf5
from palpate.report import model_looks, render, style, turnable
from palpate.report.words import percent


class Prediction(NamedTuple):
    """One method's predictions.

    sample : (s,) int, row numbers into the samples of the same body and regime's database
    predicted : (s, n, 3) float64 [m], displacement of the fine surface nodes
    """

    sample: np.ndarray
    predicted: np.ndarray


def read(path: str | Path, protocol: str, split: str, methods: list[str]) -> dict[str, Prediction]:
    """Read ``sample`` and ``predicted`` of the groups ``/{protocol}/{split}/{method}`` of a predictions.h5.

    Raises InputError naming the file if it or one of the groups is missing.
    """
    with read_hdf5(path) as file:
        groups = {method: file[f"{protocol}/{split}/{method}"] for method in methods}
        return {method: Prediction(group["sample"][:], group["predicted"][:]) for method, group in groups.items()}


DEFORMED_BY = [model_looks.BASELINE, model_looks.PAPERS, "detail_correction"]
"""Drawn after the rest state, the fine and the coarse simulation."""
SAMPLES = 3

_PIXELS, _INCHES = 480, 1.75


@style.figure("deformed_bodies")
def draw_deformed_bodies(body: Body, database: Database, predictions: dict[str, Prediction]) -> Figure:
    """Draw rest, fine FEM, coarse FEM and DEFORMED_BY, for SAMPLES test samples from small to large peak.

    predictions : of DEFORMED_BY, all for the same test samples. The colour scale is shared and ends at the largest
    displacement of fine FEM in the samples shown; the arrow is the load, dark balls are held or lie on a bed, grey
    lines the outline at rest. Displacements are to scale.
    """
    peaks = database.peaks
    samples = _spread(predictions["detail_correction"].sample, peaks, database.contact)
    limit_mm = peaks[samples].max() * 1e3
    views = render.same_scale([camera(database, i, _clouds(database, i)) for i in samples])
    aspect = views[0].width / views[0].height

    titles = ["rest,\nwith its load", "fine FEM", "coarse FEM", *map(model_looks.short, DEFORMED_BY)]
    figure, axes = style.grid(len(samples), len(titles), aspect, _INCHES)
    with render.Stage(_PIXELS, round(_PIXELS / aspect)) as stage:
        for row, i, view in zip(axes, samples, views, strict=True):
            rest_picture = stage.picture(view, [lambda s: _surface(s, body, database, "rest", 0.0, limit_mm)])
            for axis, (state, displacement, caption) in zip(row, _states(database, predictions, i), strict=True):
                style.place(axis, _deformed(stage, view, body, database, i, (state, displacement), limit_mm), caption)
                if state != "rest":
                    style.outline(axis, rest_picture)
    for axis, title in zip(axes[0], titles, strict=True):
        axis.set_title(title, loc="center")
    style.colour_bar(figure, Normalize(0, limit_mm), style.DISPLACEMENT, "displacement [mm]", extend="max")
    return figure


def _spread(samples: np.ndarray, peaks: np.ndarray, contacts: np.ndarray) -> list[int]:
    """Choose SAMPLES of the samples from small to large peak, with different contacts as far as possible."""
    ranked = samples[np.argsort(peaks[samples], kind="stable")]
    chosen: list[int] = []
    for quantile in (np.arange(SAMPLES) + 0.5) / SAMPLES:
        at_new_contact = [i for i in ranked if contacts[i] not in contacts[chosen] and i not in chosen]
        candidates = at_new_contact or [i for i in ranked if i not in chosen]
        if candidates:
            target = np.quantile(peaks[ranked], quantile)
            chosen.append(int(min(candidates, key=lambda i: abs(peaks[i] - target))))
    return sorted(chosen, key=lambda i: peaks[i])


def _states(database, predictions, i):
    """Yield the columns of one row: their kind, displacement, of fine surface or all coarse nodes [m], and caption."""
    fine, coarse = database.fine[i], database.coarse_live[i]
    yield "rest", np.zeros_like(fine), f"sample {i}: {np.linalg.norm(database.force[i]):.2g} N"
    for state, displacement in (("fine", fine), ("coarse", coarse)):
        yield state, displacement, f"peak {np.linalg.norm(displacement, axis=1).max() * 1e3:.1f} mm"
    for method in DEFORMED_BY:
        row = np.flatnonzero(predictions[method].sample == i)[0]
        displacement = predictions[method].predicted[row]
        yield "method", displacement, f"error {100 * errors(displacement, fine).rmse_of_peak:.2g} % of peak"


def _clouds(database, i) -> list[np.ndarray]:
    """Return what a picture of a sample shows: the body at rest and deformed, and the tail of the load's arrow."""
    rest, force = database.nodes_fine_surface, database.force[i] / np.linalg.norm(database.force[i])
    tail = database.coarse_nodes[database.contact[i]] - _arrow(rest) * force
    return [rest, rest + database.fine[i], tail[None]]


def _normal(database, i) -> np.ndarray:
    """Return the normal at rest at the contact of sample i, (3,)."""
    return database.contact_normals[np.searchsorted(database.coarse_surface, database.contact[i])]


def _arrow(nodes) -> float:
    """Return the length of the load's arrow [m]."""
    return 0.2 * float(np.ptp(nodes, axis=0).max())


def _deformed(stage, view, body, database, i, state, limit) -> np.ndarray:
    """Render one panel, (height, width, 3) uint8."""
    kind, displacement = state
    actors = [lambda s: _surface(s, body, database, kind, displacement, limit), lambda s: _held(s, body)]
    if kind == "rest":
        contact, length = database.coarse_nodes[database.contact[i]], _arrow(database.nodes_fine_surface)
        actors.append(lambda s: s.arrow(contact, database.force[i], _normal(database, i), length))
    return stage.picture(view, actors)


def _held(stage, body) -> None:
    """Add a dark ball at each node that is held or lies on a bed."""
    mesh = body.coarse
    stage.dots(mesh.nodes[np.intersect1d(body.supported(0), mesh.surface)], 0.07 * _arrow(mesh.nodes))


def _surface(stage, body, database, kind, displacement, limit) -> None:
    """Add the deformed surface; the rest state is grey, and it and the coarse mesh show their edges."""
    coarse = kind == "coarse"
    nodes = database.coarse_nodes if coarse else database.nodes_fine_surface
    triangles = body.coarse.triangles if coarse else database.triangles
    millimetres = None if kind == "rest" else np.linalg.norm(displacement, axis=1) * 1e3
    edges = kind in ("rest", "coarse")
    stage.surface(nodes + displacement, triangles, millimetres, (0, limit), style.DISPLACEMENT, edges=edges)


JUDGED = ["interpolation", model_looks.PAPERS, "detail_correction"]
"""One row each: interpolation, which costs least, the paper's method, and detail correction."""


@style.figure("error_over_body")
def draw_error_over_body(body: Body, database: Database, groups: dict[str, dict[str, Prediction]]) -> Figure:
    """Draw three columns (best, median, worst) for each group and one row for each method, on one logarithmic scale.

    groups : maps a heading such as "paper protocol, samples held out" to predictions of JUDGED
    Samples are ranked for each method by itself, by RMSE over the fine surface nodes / peak.
    """
    shown = {(heading, judged): ranked(database, groups[heading][judged]) for heading in groups for judged in JUDGED}
    rest = database.nodes_fine_surface
    scale = limits([field for picks in shown.values() for _, field, _, _ in picks])
    views = render.same_scale([camera(database, i, [rest + moved]) for few in shown.values() for i, _, moved, _ in few])
    aspect = views[0].width / views[0].height
    figure, axes = style.grid(len(JUDGED), 3 * len(groups), aspect, _INCHES)
    cells = [(row, 3 * c + rank) for c in range(len(groups)) for row in range(len(JUDGED)) for rank in range(3)]
    picks = [pick for picks in shown.values() for pick in picks]
    with render.Stage(_PIXELS, round(_PIXELS / aspect)) as stage:
        for (row, c), view, (i, field, moved, error) in zip(cells, views, picks, strict=True):
            picture = _coloured(stage, view, body, database, 100 * field, moved, scale)
            style.place(axes[row, c], picture, f"sample {i}: {percent(error)} of peak")
    for axis, method in zip(axes[:, 0], JUDGED, strict=True):
        axis.set_ylabel(model_looks.short(method), fontweight="bold")
    for c, group in enumerate(groups):
        axes[0, 3 * c].set_title(f"{group}\nbest", loc="left")
        for rank, name in enumerate(("median", "worst"), 1):
            axes[0, 3 * c + rank].set_title(name, loc="left")
    label = "error at each node [% of the sample's peak displacement]"
    style.colour_bar(figure, LogNorm(*scale), style.ERROR, label, extend="min", format="%g")
    return figure


def limits(fields: list[np.ndarray]) -> tuple[float, float]:
    """Return the limits in % of three decades up to the largest of some errors / peak."""
    top = 100 * max(float(field.max()) for field in fields)
    return top / 1000, top


def ranked(database, prediction) -> list[tuple]:
    """Rank the samples: (sample, error / peak (n,), displacement (n, 3), RMSE / peak) of best, median and worst."""
    reference = database.fine[prediction.sample]
    peaks = np.linalg.norm(reference, axis=2).max(axis=1)
    error_fields = np.linalg.norm(prediction.predicted - reference, axis=2) / peaks[:, None]
    rmse = np.sqrt(np.mean(error_fields**2, axis=1))
    order = np.argsort(rmse, kind="stable")
    chosen = order[[0, (len(order) - 1) // 2, -1]]
    return [(int(prediction.sample[p]), error_fields[p], reference[p], float(rmse[p])) for p in chosen]


def camera(database, i, clouds) -> render.View:
    """Choose the camera of a sample: its contact is visible, and so are all points of ``clouds``, (n, 3) [m] each."""
    return render.frame(render.directions(database.nodes_fine_surface, _normal(database, i)), clouds)


def _coloured(stage, view, body, database, percent, moved, limits) -> np.ndarray:
    """Render the body as fine FEM deforms it, coloured by error."""
    moved = database.nodes_fine_surface + moved
    surface = moved, database.triangles, np.maximum(percent, limits[0]), limits, style.ERROR
    return stage.picture(view, [lambda s: s.surface(*surface, log=True), lambda s: _held(s, body)])


_START = 1  # the first method's median sample; its contact is visible in the chosen view


def write(database: Database, predictions: dict[str, Prediction], path: str | Path) -> None:
    """Write a view that readers turn: for each method of JUDGED its best, median and worst test sample.

    Surfaces are deformed as by fine FEM and coloured by the method's error, on one logarithmic scale of three decades
    [% of the sample's peak].
    """
    picks = [pick for method in JUDGED for pick in ranked(database, predictions[method])]
    scale = limits([field for _, field, _, _ in picks])
    norm = LogNorm(*scale)
    rest = database.nodes_fine_surface
    positions = np.array([rest + moved for _, _, moved, _ in picks])
    notes = [f"sample {sample}: {percent(error)} of peak" for sample, _, _, error in picks]
    methods = [model_looks.short(method).replace("\n", " ") for method in JUDGED]
    choices = {"method": methods, "test sample": ["best", "median", "worst"]}
    shown = turnable.Turnable(
        camera(database, picks[_START][0], list(positions)),
        positions,
        database.triangles,
        turnable.shades(100 * np.array([field for _, field, _, _ in picks]), norm),
        len(database.triangles),
        turnable.legend("error [% of the sample's peak displacement]", norm, style.ERROR),
        {"choices": choices, "notes": notes, "start": _START},
    )
    turnable.write(shown, path)
