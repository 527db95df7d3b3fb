"""Export contact modes to a portable file: prepare contacts all over the surface, and measure the file's error."""

from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np

from palpate.benchmark.model import Case, Setting
from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, pressed_contacts, spread_out
from palpate.bodies.material import LAWS
from palpate.errors import InputError
from palpate.files import write_whole
from palpate.models.contact_modes.contact_modes import FAR, GUARD, HARD, ContactModes, Prepared
from palpate.models.contact_modes.workshop import Workshop, bring_to_surface
from palpate.press.portable.calibrate import calibrate
from palpate.press.portable.runtimes.palpate_model import SCALARS, VERSION, PortableModel
from palpate.press.portable.surface_basis import SurfaceBasis, fitted_compliance, surface_basis
from palpate.press.portable.write import PackedContact, model_bytes

VECTORS = 240
"""Vectors of the surface's basis at most; with so many the linear part of the liver's answers is known to 0.25 %."""
SAMPLES, TOGETHER, NEAR = 300, 6, 1e-4
"""Places whose linear responses the compliance is fitted to, solved so many at once, and their relative residual."""
PREPARED_MOST = 5.0
"""How much more a contact's own columns count in that fit than those of places that are only solved for."""
CHECKED = 9, 24
"""Fewest and most places between the contacts at which the error is measured: a quarter of their number."""
FARTHEST = 1.5
"""Distance from the nearest contact, in radii of the disc, from which on answers are doubted."""
COLUMNS = {"modes": "columns", "rings": 50, "thinned": 0.003, "target": "limit"}
"""The setting that is exported if none is asked for: cheap, so that many contacts can be had."""


Progress = Callable[[str], Callable[[Sequence], Iterable]]
"""Return, for what is counted, a function that wraps a sequence and tells how far it has come."""


def _untold(_: str) -> Callable[[Sequence], Iterable]:
    return iter


def export_model(
    case: Case, setting: Setting, contacts: int | Sequence[int], path: Path | str, progress: Progress = _untold
) -> None:
    """Write contact modes of ``setting`` for any place of the body of ``case`` to the file ``path``.

    contacts : how many nodes of the fine surface, spread over it, or which
    InputError for a body or a disc that the file cannot hold, and for nodes that cannot be pressed.
    """
    _refuse(case)
    nodes, checked = _places(case.body, contacts)
    solver = ContactModes(case, setting)
    shop = solver.shop
    best = ContactModes(case, setting | {"modes": "snapshots"})
    prepared = [solver.prepare_contact(node) for node in progress("contact")(nodes)]
    seen, sampled = _linear_responses(case.body, shop, prepared, nodes, progress("linear responses, part"))
    columns = [each.columns for each in prepared]
    singles = [sampled[:, 3 * k : 3 * k + 3] for k in range(len(seen))]
    basis = surface_basis(case.body, case.radius_m, columns + singles, [each.rest for each in prepared], VECTORS)
    at = np.searchsorted(case.body.fine.surface, nodes)
    packed = [PackedContact(basis.nodes[i], basis.normals[i], each) for i, each in zip(at, prepared, strict=True)]
    scalars = _scalars(case, prepared)
    empty = np.zeros((basis.vectors.shape[1], basis.vectors.shape[1]))
    unmeasured = _info(case, setting, basis, prepared, scalars) | {"error": "not measured"}
    bare = PortableModel(model_bytes(unmeasured, scalars, basis, empty, packed))
    scalars["farthest_m"] = min(
        FARTHEST * case.radius_m, _farthest(bare, basis, np.searchsorted(case.body.fine.surface, _able(case.body)))
    )
    compliance = _compliance(bare, basis, np.searchsorted(case.body.fine.surface, seen), sampled, columns)
    first = PortableModel(model_bytes(unmeasured, scalars, basis, compliance, packed))
    between = progress("error at place")
    found = calibrate(first, case.body.fine.surface, solver, best, nodes, checked, between)
    scalars |= found.scalars()
    info = _info(case, setting, basis, prepared, scalars) | found.told()
    with write_whole(path) as temporary:
        temporary.write_bytes(model_bytes(info, scalars, basis, compliance, packed))


def _refuse(case: Case) -> None:
    """Raise InputError for what runtimes do not know."""
    name = case.body.name
    law = case.body.material.law
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


def _able(body: Body) -> np.ndarray:
    """Return the nodes of the fine surface that lie between coarse nodes which can be pressed."""
    good = np.zeros(len(body.coarse.nodes))
    good[pressed_contacts(body, contacts_of(body))] = 1.0
    return body.fine.surface[(body.prolongation @ good)[body.fine.surface] > 1.0 - 1e-9]


def _places(body: Body, contacts: int | Sequence[int]) -> tuple[list[int], list[int]]:
    """Return the nodes to prepare, and those between them at which errors are measured."""
    able = _able(body)
    points = body.fine.nodes[able]
    if isinstance(contacts, int):
        count = min(contacts, len(able) - 1)
        if count < 1:
            raise InputError(
                f"bodies.{body.name}: {contacts} contacts are asked for; give at least 1 of {len(able) - 1}."
            )
        first = int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))
        rows = [first, *spread_out(points, points[[first]], count - 1)]
        nodes = [int(able[row]) for row in rows]
    else:
        nodes = [int(node) for node in contacts]
    checked = min(max(len(nodes) // 4, CHECKED[0]), CHECKED[1], len(able) - len(nodes))
    between = spread_out(points, body.fine.nodes[nodes], max(checked, 0))
    return nodes, [int(able[row]) for row in between]


def _linear_responses(
    body: Body,
    shop: Workshop,
    prepared: Sequence[Prepared],
    nodes: Sequence[int],
    progress: Callable[[Sequence], Iterable],
) -> tuple[np.ndarray, np.ndarray]:
    """Return free surface nodes (k,), well spread, and their responses (3 n, 3 k) [m/N], of the contacts' target.

    They are those of the level that is reduced and of the one before, extrapolated as those of the contacts on average.
    """
    free = np.intersect1d(body.levels[shop.level].surface, sorted(shop.pressable))
    chosen = np.sort(free[spread_out(body.fine.nodes[free], body.fine.nodes[nodes[:1]], min(SAMPLES, len(free)))])
    reduced = _responses(shop, shop.level, chosen, progress)
    if shop.level == 0:
        return chosen, reduced
    own = [to_columns(shop.reduced_columns(node)) for node in nodes]
    steps = [mine - _responses(shop, shop.level - 1, [node]) for mine, node in zip(own, nodes, strict=True)]
    changes = [each.columns - mine for each, mine in zip(prepared, own, strict=True)]
    over = sum(float(np.vdot(step, step)) for step in steps)
    share = (
        sum(float(np.vdot(change, step)) for change, step in zip(changes, steps, strict=True)) / over if over else 0.0
    )
    return chosen, reduced + share * (reduced - _responses(shop, shop.level - 1, chosen))


def to_columns(moved: np.ndarray) -> np.ndarray:
    """Return (3 n, k) of displacements (n, 3, k)."""
    return moved.reshape(-1, moved.shape[2])


def _responses(
    shop: Workshop,
    level: int,
    nodes: Sequence[int] | np.ndarray,
    progress: Callable[[Sequence], Iterable] = iter,
) -> np.ndarray:
    """Return the responses (3 n, 3 k) [m/N] of a level to unit forces at ``nodes`` (k,)."""
    elements, parts = shop.elements(level), []
    for some in progress(np.array_split(np.asarray(nodes), -(-len(nodes) // TOGETHER))):
        loads = np.dstack([elements.nodal(*shop.disc(int(node), level), np.eye(3)) for node in some])
        parts.append(to_columns(bring_to_surface(shop.up(level), elements.solve(loads, NEAR))))
    return np.hstack(parts)


def _compliance(
    bare: PortableModel, basis: SurfaceBasis, seen: np.ndarray, sampled: np.ndarray, columns: Sequence[np.ndarray]
) -> np.ndarray:
    """Fit the compliance (b, b) of a file that has none yet to the responses at nodes ``seen`` and at its contacts."""
    discs = [bare.mean_over_disc(basis.nodes[i], basis.normals[i]).T for i in seen]
    discs += [PREPARED_MOST * each.here.T for each in bare.contacts]
    known = [basis.coordinates(sampled), *(PREPARED_MOST * basis.coordinates(each) for each in columns)]
    return fitted_compliance(np.hstack(discs), np.hstack(known))


def _farthest(bare: PortableModel, basis: SurfaceBasis, able: np.ndarray) -> float:
    """Return how far the nodes ``able`` are from the nearest contact at most, as runtimes measure it [m]."""
    return 1.05 * max(bare.apart(basis.nodes[i], basis.normals[i]).min() for i in able)


def _scalars(case: Case, prepared: Sequence[Prepared]) -> dict[str, float]:
    """Return the numbers of the file's head before its errors are known."""
    hardest = float(np.median([1.0 / np.linalg.norm(each.bearing[0]) for each in prepared]))
    found = dict.fromkeys(SCALARS, 0.0) | {"radius_m": float(case.radius_m), "hardest_n": hardest}
    return found | {"guard": GUARD, "far": FAR, "hard": HARD}


def _info(
    case: Case,
    setting: Setting,
    basis: SurfaceBasis,
    prepared: Sequence[Prepared],
    scalars: dict[str, float],
) -> dict:
    """Return the header."""
    sizes = {"n": len(basis.nodes), "t": len(basis.triangles), "contacts": len(prepared)}
    named = {"format": "palpate portable model", "version": VERSION, "palpate": version("palpate")}
    body = {"body": case.body.name, "regime": case.regime, "model": "contact_modes", "setting": dict(setting)}
    of_body = {"size_m": float(case.body.fine.size), "young_pa": float(case.body.material.young_pa)}
    hard = {"radius_m": float(case.radius_m), "peak_m": scalars["peak_m"], "hardest_n": scalars["hardest_n"]}
    return named | body | of_body | hard | sizes | {"vectors": basis.vectors.shape[1]}
