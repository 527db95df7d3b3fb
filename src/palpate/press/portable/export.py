"""Export contact modes to a portable file: prepare contacts all over the surface, and measure the file's error.

Its bound is calibrated between contacts, so that nine answers in ten keep it.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import nnls

from palpate.benchmark.conformal import bound_factor
from palpate.benchmark.load import Load, Press
from palpate.benchmark.model import Case
from palpate.bodies.body import Body
from palpate.bodies.contacts import between_contacts, spread_out, spread_over
from palpate.bodies.material import LAWS
from palpate.errors import InputError, NotConverged
from palpate.files import write_whole
from palpate.models.contact_modes.contact_modes import LARGEST_NORM, LARGEST_PRESS, LEAST_DET, ContactSolver, Prepared
from palpate.models.contact_modes.offline import Offline, bring_to_surface
from palpate.models.kinds import ContactModes
from palpate.press.portable.runtimes.palpate_model import APART, SCALARS, VERSION, PortableModel, TouchPlace
from palpate.press.portable.touches import Touches, measured, prepare_places
from palpate.press.portable.write import PackedContact, SurfaceBasis, model_bytes, surface_basis

EVERY = 4
"""Step through the presses of a contact's snapshots, of which every so many-th is compared."""
AT_CONTACTS, PAIRS = 12, 6
"""Contacts at which the file is compared with what it was made of, and pairs of places that are pressed at once."""
LEAST_ERROR = 1e-3
"""Smallest error that is said."""

BELIEVED, ALONE, BEYOND = 0.0, 1.0, 2.0
"""Doubt of an answer: none, one for its distance from every contact, and any other."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Measured errors of a portable file, as RMSE over peak, and the factors of its answers' error bounds.

    floor, share, spread, several : factors of the bound, see docs/portable-model.md
    peak_m : median peak of the hardest presses [m]; stored : largest error at the contacts themselves
    errors : (k,) of presses at ``places`` places between the contacts; paired : (p,) of two presses at once
    held : fraction of the answers whose error is below a bound that is fitted without their place
    answered : fraction of the presses between the contacts that the file does not doubt; if it is 0, errors are of
        doubted ones
    """

    floor: float
    share: float
    spread: float
    several: float
    peak_m: float
    stored: float
    errors: np.ndarray
    places: int
    held: float
    paired: np.ndarray
    answered: float

    def header(self) -> dict[str, object]:
        """Return the entries of the file's header on its errors, in words."""
        between = "not measured: there is no place between the contacts"
        if len(self.errors):
            measured = f"{len(self.errors)} presses at {self.places} places"
            if len(self.paired):
                measured += f"; {100 * self.paired.mean():.1f} % for two presses at once, of {len(self.paired)}"
            mean, worst = 100 * self.errors.mean(), 100 * self.errors.max()
            kept = f"{100 * self.held:.0f} % of the answers keep the bound they give"
            between = (
                f"between contacts {mean:.1f} % on average, {worst:.1f} % at worst, of {measured}; RMSE over peak, "
                f"against contact modes that were prepared there; {kept}; {100 * self.answered:.0f} % of the presses "
                "tried are believed, more with more contacts"
            )
        return {"error": between, "float32_error": self.stored}


def calibrate(
    model: PortableModel,
    surface: np.ndarray,
    solver: ContactSolver,
    best: ContactSolver,
    nodes: Sequence[int],
    checked: Sequence[int],
    progress: Callable[[Sequence], Iterable] = iter,
) -> Calibration:
    """Measure the errors of the file's ``model`` between its contacts and at them, and fit the bound of its answers.

    solver : the contact modes that the file was made of, compared at some of its ``nodes``
    best : the most accurate contact modes, prepared at the nodes ``checked`` between these, which ``progress`` wraps
    surface : (n,) the numbers of the fine surface nodes
    """
    rows: list[dict] = []
    peaks = []
    for node in progress(checked):
        for i, force in enumerate(best.offline.contact(node, "snapshots").forces[::EVERY]):
            if (row := _compared(model, surface, best, ((node, force),))) is not None:
                rows.append({"node": node, **row._asdict()})
                peaks += [row.peak_m] if i == 0 else []
    half_presses = [(node, 0.5 * _hardest(solver, node)) for node in nodes[:AT_CONTACTS]]
    at_contacts = [_compared(model, surface, solver, (press,)) for press in half_presses]
    stored = max((row.error for row in at_contacts if row is not None), default=0.0)
    least_error = stored + LEAST_ERROR
    peak = float(np.median(peaks)) if peaks else 0.0
    if not rows:
        return Calibration(least_error, 0.1, 1.0, 1.0, peak, stored, np.empty(0), 0, 0.0, np.empty(0), 1.0)
    table = pd.DataFrame(rows)
    answered = float((table["doubt"] == BELIEVED).mean())
    table = table[table["doubt"] == table["doubt"].min()]
    places, errors = table["node"].to_numpy(), table["error"].to_numpy()
    bound_terms = np.column_stack([np.full(len(errors), least_error), table[["size", "spread"]]])
    weights = _bound_weights(bound_terms, errors, places)
    every_other = np.isin(places, np.unique(places)[::2])
    kept_bounds = [
        errors[~fitted] <= bound_terms[~fitted] @ _bound_weights(bound_terms[fitted], errors[fitted], places[fitted])
        for fitted in (every_other, ~every_other)
        if fitted.any()
    ]
    pairs, several = _pairs(model, surface, best, solver, checked, weights, least_error)
    floor, share, spread = weights * [least_error, 1.0, 1.0]
    held = float(np.concatenate(kept_bounds).mean()) if len(kept_bounds) else 0.0
    return Calibration(floor, share, spread, several, peak, stored, errors, len(set(places)), held, pairs, answered)


def _bound_weights(terms: np.ndarray, errors: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Fit weights (3,) to errors (k,) such that ``terms`` (k, 3) @ weights bounds nine of ten errors at new places."""
    weights, _ = nnls(terms / errors[:, None], np.ones(len(errors)))
    weights[0] = max(weights[0], 1.0)
    scores = errors / (terms @ weights)
    factor = bound_factor(scores, places)
    return weights * (factor if np.isfinite(factor) else float(scores.max()))


def _pairs(
    model: PortableModel,
    surface: np.ndarray,
    best: ContactSolver,
    solver: ContactSolver,
    checked: Sequence[int],
    weights: np.ndarray,
    floor: float,
) -> tuple[np.ndarray, float]:
    """Return errors (p,) of two presses at once, each half as hard as it may be, and the bound's factor for these."""
    errors: list[float] = []
    factors: list[float] = []
    for first_node, second_node in list(pairwise(checked))[:PAIRS]:
        presses = tuple((node, 0.5 * _hardest(solver, node)) for node in (first_node, second_node))
        if (row := _compared(model, surface, best, presses)) is not None:
            errors.append(row.error)
            missing = max(0.0, row.error - float(weights @ np.array([floor, row.size, row.spread])))
            factors.append(missing / max(row.others, 1e-9))
    return np.array(errors), float(np.max(factors, initial=0.0))


def _hardest(solver: ContactSolver, node: int) -> np.ndarray:
    """Return the hardest press (3,) [N] straight in at a contact that finer elements are known to stand."""
    bearing = solver.prepare_contact(node).bearing[0]
    return bearing / float(bearing @ bearing)


class _Compared(NamedTuple):
    """A portable file's answer against that of contact modes.

    error : RMSE over peak; peak_m : of the contact modes' answer [m]; doubt : BELIEVED, ALONE or BEYOND
    size, spread, others : over the answer's own peak, of what is beyond its linear part: the size of all presses, how
        far contacts differ about it, and the size of all presses but the largest
    """

    error: float
    size: float
    spread: float
    peak_m: float
    others: float
    doubt: float


def _compared(
    model: PortableModel, surface: np.ndarray, solver: ContactSolver, presses: Sequence[tuple[int, np.ndarray]]
) -> _Compared | None:
    """Compare the file's answer to ``presses``, by node and force (3,) [N], with the solver's; None if it has none."""
    try:
        truth = solver.respond(Load(tuple(Press(node, force) for node, force in presses))).displacement
    except NotConverged:
        return None
    requests = [model.press_at(int(np.searchsorted(surface, node)), force) for node, force in presses]
    answer, (sizes, spreads) = model.respond(requests), model.beyond(requests)
    moved = answer.displacement
    peak, file_peak = (float(np.linalg.norm(each, axis=1).max()) for each in (truth, moved))
    rmse = float(np.sqrt(np.mean(np.sum((moved - truth) ** 2, axis=1))))
    doubt = (ALONE if answer.doubt.startswith(APART) else BEYOND) if answer.doubt else BELIEVED
    others = sum(sizes) - float(np.max(sizes))
    return _Compared(rmse / peak, sum(sizes) / file_peak, sum(spreads) / file_peak, peak, others / file_peak, doubt)


VECTORS = 240
"""Vectors of the surface's basis at most; with so many the linear part of the liver's answers is known to 0.25 %."""
SAMPLES, TOGETHER, RESPONSE_TOLERANCE = 300, 6, 1e-4
"""Places whose linear responses the compliance is fitted to, solved so many at once, and their relative residual."""
CHECKED = 9, 24
"""Fewest and most places between the contacts at which the error is measured: a quarter of their number."""
FARTHEST = 1.5
"""Distance from the nearest contact, in radii of the disc, from which on answers are doubted."""
COLUMNS = ContactModes(modes="columns", target="limit")
"""The model that is exported if none is asked for: cheap, so that many contacts can be had."""

Progress = Callable[[str], Callable[[Sequence], Iterable]]
"""From a word for the items to a function that wraps a sequence of them and reports progress."""


def export_model(
    case: Case,
    model: ContactModes,
    contacts: int,
    path: Path | str,
    progress: Progress = lambda _: iter,
    touches: Touches | None = None,
) -> None:
    """Write a portable file that answers presses anywhere on the body of ``case``, by contact modes as in ``model``.

    contacts : number of fine surface nodes to prepare, spread over the surface
    touches : rigid instruments, and at how many places they are prepared
    InputError for a body or a disc that the file cannot hold.
    """
    _refuse(case)
    nodes, checked = _places(case.body, contacts)
    solver, best = ContactSolver(case, model), ContactSolver(case, model.having(modes="snapshots"))
    offline, surface = solver.offline, case.body.fine.surface
    prepared = [solver.prepare_contact(node) for node in progress("contact")(nodes)]
    sampled, responses = _linear_responses(case.body, offline, prepared, nodes, progress("linear responses, part"))
    columns = [each.columns for each in prepared]
    singles = [responses[:, 3 * k : 3 * k + 3] for k in range(len(sampled))]
    basis = surface_basis(case.body, case.radius_m, columns + singles, [each.rest for each in prepared], VECTORS)
    rows = np.searchsorted(surface, nodes)
    packed = [PackedContact(basis.nodes[i], basis.normals[i], each) for i, each in zip(rows, prepared, strict=True)]
    hardest = float(np.median([1.0 / np.linalg.norm(each.bearing[0]) for each in prepared]))
    scalars = dict.fromkeys(SCALARS, 0.0) | {"radius_m": float(case.radius_m), "hardest_n": hardest}
    scalars |= {"guard": LEAST_DET, "far": LARGEST_NORM, "hard": LARGEST_PRESS}
    no_compliance = np.zeros((basis.vectors.shape[1], basis.vectors.shape[1]))
    unmeasured = _info(case, model, basis, prepared, scalars) | {"error": "not measured"}
    without_compliance = PortableModel(model_bytes(unmeasured, scalars, basis, no_compliance, packed))
    # how far the nodes that can be pressed are from the nearest contact at most, as runtimes measure it
    pressable = np.searchsorted(surface, between_contacts(case.body))
    farthest_apart = 1.05 * max(without_compliance.apart(basis.nodes[i], basis.normals[i]).min() for i in pressable)
    scalars["farthest_m"] = min(FARTHEST * case.radius_m, farthest_apart)
    compliance = _compliance(without_compliance, basis, np.searchsorted(surface, sampled), responses, columns)
    uncalibrated = PortableModel(model_bytes(unmeasured, scalars, basis, compliance, packed))
    calibration = calibrate(uncalibrated, surface, solver, best, nodes, checked, progress("error at place"))
    scalars |= {name: getattr(calibration, name) for name in ("floor", "share", "spread", "several", "peak_m")}
    info = _info(case, model, basis, prepared, scalars) | calibration.header()
    places: list[TouchPlace] = []
    if touches is not None:
        places, trials = prepare_places(case.body, touches, case.options.seed, progress("place to touch"))
        uncalibrated_touches = PortableModel(model_bytes(info, scalars, basis, compliance, packed, places))
        places = measured(uncalibrated_touches, places, trials)
    with write_whole(path) as temporary:
        temporary.write_bytes(model_bytes(info, scalars, basis, compliance, packed, places))


def _refuse(case: Case) -> None:
    """Raise InputError for a body that runtimes cannot answer for: another law, no disc, or a sheet."""
    name, law = case.body.name, case.body.material.law
    if law != LAWS[0]:
        raise InputError(
            f"bodies.{name}.law is {law}, and a portable model has the law {LAWS[0]}; export a body of that."
        )
    if not case.radius_m > 0.0:
        raise InputError(
            f"{name}: a portable model presses discs, and the radius is {case.radius_m:g}; give one above 0."
        )
    if not hasattr(case.body.fine, "tetrahedra"):
        raise InputError(f"bodies.{name} is a sheet, of which no portable model is made; export a solid body.")


def _places(body: Body, contacts: int) -> tuple[list[int], list[int]]:
    """Return the nodes to prepare, and those between them at which errors are measured."""
    candidates = between_contacts(body)
    points = body.fine.nodes[candidates]
    count = min(contacts, len(candidates) - 1)
    if count < 1:
        raise InputError(
            f"bodies.{body.name}: {contacts} contacts are asked for; give at least 1 of {len(candidates) - 1}."
        )
    nodes = candidates[spread_over(points, count)].tolist()
    checked = min(max(len(nodes) // 4, CHECKED[0]), CHECKED[1], len(candidates) - len(nodes))
    rows = spread_out(points, body.fine.nodes[nodes], checked)
    return nodes, candidates[rows].tolist()


def _linear_responses(
    body: Body,
    offline: Offline,
    prepared: Sequence[Prepared],
    nodes: Sequence[int],
    progress: Callable[[Sequence], Iterable],
) -> tuple[np.ndarray, np.ndarray]:
    """Return free surface nodes (k,), well spread, and the body's linear responses (3 n, 3 k) [m/N] to discs there.

    The responses are those of the level that contacts are reduced from, extrapolated to the contacts' target: by the
    change from the level before, times the factor that fits the ``prepared`` contacts best.
    """
    free = np.intersect1d(body.levels[offline.level].surface, sorted(offline.pressable))
    chosen = np.sort(free[spread_out(body.fine.nodes[free], body.fine.nodes[nodes[:1]], min(SAMPLES, len(free)))])
    reduced = _responses(offline, offline.level, chosen, progress)
    if offline.level == 0:
        return chosen, reduced
    at_contacts = [to_columns(offline.reduced_columns(node)) for node in nodes]
    level_changes = [
        each - _responses(offline, offline.level - 1, [node]) for each, node in zip(at_contacts, nodes, strict=True)
    ]
    target_changes = [contact.columns - each for contact, each in zip(prepared, at_contacts, strict=True)]
    squares = sum(float(np.vdot(step, step)) for step in level_changes)
    products = sum(float(np.vdot(change, step)) for change, step in zip(target_changes, level_changes, strict=True))
    factor = products / squares if squares else 0.0
    return chosen, reduced + factor * (reduced - _responses(offline, offline.level - 1, chosen))


def to_columns(moved: np.ndarray) -> np.ndarray:
    """Return (3 n, k) of displacements (n, 3, k)."""
    return moved.reshape(-1, moved.shape[2])


def _responses(
    offline: Offline, level: int, nodes: Sequence[int] | np.ndarray, progress: Callable[[Sequence], Iterable] = iter
) -> np.ndarray:
    """Return the responses (3 n, 3 k) [m/N] of a level to unit forces at ``nodes`` (k,)."""
    elements, blocks = offline.elements(level), []
    for batch in progress(np.array_split(np.asarray(nodes), -(-len(nodes) // TOGETHER))):
        loads = np.dstack([elements.nodal(*offline.disc(int(node), level), np.eye(3)) for node in batch])
        blocks.append(to_columns(bring_to_surface(offline.up(level), elements.solve(loads, RESPONSE_TOLERANCE))))
    return np.hstack(blocks)


def _compliance(
    bare: PortableModel, basis: SurfaceBasis, sampled: np.ndarray, responses: np.ndarray, columns: Sequence[np.ndarray]
) -> np.ndarray:
    """Fit the compliance (b, b) from means of the basis over a disc to coordinates of the response to a force there.

    bare : the file without it; responses : (3 n, 3 k) [m/N] to forces on discs at the k nodes ``sampled``
    columns : responses (3 n, 3) [m/N] at each contact
    Each response is divided by the size of its coordinates; by reciprocity the compliance is symmetric.
    """
    mean_blocks = [bare.mean_over_disc(basis.nodes[i], basis.normals[i]).T for i in sampled]
    mean_blocks += [contact.here.T for contact in bare.contacts]
    coordinate_blocks = [basis.coordinates(responses), *map(basis.coordinates, columns)]
    means, coordinates = np.hstack(mean_blocks), np.hstack(coordinate_blocks)
    sizes = np.linalg.norm(coordinates, axis=0)
    compliance = np.linalg.lstsq((means / sizes).T, (coordinates / sizes).T, rcond=1e-8)[0].T
    return 0.5 * (compliance + compliance.T)


def _info(
    case: Case, model: ContactModes, basis: SurfaceBasis, prepared: Sequence[Prepared], scalars: dict[str, float]
) -> dict:
    """Return the header of the file, but for its errors."""
    sizes = {"n": len(basis.nodes), "t": len(basis.triangles), "contacts": len(prepared)}
    file_words = {"format": "palpate portable model", "version": VERSION, "palpate": version("palpate")}
    body = {"body": case.body.name, "regime": case.regime, "model": "contact_modes", "setting": dict(model.said)}
    body_numbers = {"size_m": float(case.body.fine.size), "young_pa": float(case.body.material.young_pa)}
    press_words = {"radius_m": float(case.radius_m), "peak_m": scalars["peak_m"], "hardest_n": scalars["hardest_n"]}
    return file_words | body | body_numbers | press_words | sizes | {"vectors": basis.vectors.shape[1]}
