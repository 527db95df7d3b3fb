"""Prepare the contacts of a load for answers: a reduced model, and how it is brought to the surface of its target."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from palpate.benchmark.model import Case, Setting
from palpate.bodies.contacts import refuse
from palpate.effects.patch_load import patch_at, patch_shares
from palpate.models.contact_modes.contact_limits import bearing
from palpate.models.contact_modes.contact_targets import target_change, target_columns
from palpate.models.contact_modes.contact_workshop import Workshop
from palpate.models.reduction.contact_snapshots import ContactSnapshots, basis_of, coordinates, thinned_model
from palpate.models.reduction.elements_at_rest import ElementsAtRest
from palpate.models.reduction.nested_targets import Change, fitted, to_surface
from palpate.models.reduction.reduced_contact import ReducedContact

RESIDUAL = 1e-3
"""Residual of an answer over its load."""


class Prepared(NamedTuple):
    """All that answers presses of k contacts at once, on n surface nodes, in r coordinates.

    reach : the largest energy norm that snapshots have, of all contacts together
    columns : (3 n, 3 k) [m/N], the linear part; rest : (3 n, r) of what is beyond it, in single precision
    discs : (3 k, 3 k) [m/N] and (3 k, r), the same parts of the displacements of the discs
    bearing : (k, 3) [1/N], whose products with forces are at most 1 where finer elements are known to have an answer
    together : (k, k), the part of one disc's product that adds to another's, as they press on the same tissue
    """

    reduced: ReducedContact
    reach: float
    columns: np.ndarray
    rest: np.ndarray
    discs: tuple[np.ndarray, np.ndarray]
    bearing: np.ndarray
    together: np.ndarray

    def beyond(self, q: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Return the coordinates (r,) less those of the linear answer to ``force`` (3 k,) [N]."""
        return q - self.reduced.loads @ force


def prepare_contacts(shop: Workshop, case: Case, setting: Setting, nodes: tuple[int, ...]) -> Prepared:
    """Return what answers presses at fine surface ``nodes``; InputError for one that cannot be pressed."""
    for node in nodes:
        if node not in shop.pressable:
            refuse(node)
    reduced_name, target_name = _names(setting, nodes)
    modes, reduced = shop.make(reduced_name, lambda: _reduced(shop, case, setting, nodes))
    return shop.make(target_name, lambda: _brought(shop, case, setting, nodes, modes, reduced))


def spent(shop: Workshop, setting: Setting, nodes: tuple[int, ...]) -> float:
    """Return the time [s] that these contacts have taken, whichever setting has made them."""
    kind = _shown(setting)
    parts = {"columns", kind, "columns before", f"from coarser {kind}", f"{kind} bear"}
    parts |= {"to finer"} if setting["modes"] == "finer" else set()
    names = [*_names(setting, nodes), *((part, node) for part in sorted(parts) for node in nodes)]
    return sum(shop.seconds.get(name, 0.0) for name in names)


def _shown(setting: Setting) -> str:
    """Return what the modes of ``setting`` are made of: "finer" has those of snapshots."""
    return "columns" if setting["modes"] == "columns" else "snapshots"


def _names(setting: Setting, nodes: tuple[int, ...]) -> tuple[tuple, tuple]:
    """Return what the reduced model of a setting is called, which several may share, and the whole."""
    reduced = (_shown(setting), setting["rings"], setting["thinned"])
    return ("reduced", nodes, reduced), ("target", nodes, reduced, setting["modes"], setting["target"])


def _reduced(shop: Workshop, case: Case, setting: Setting, nodes: Sequence[int]) -> tuple[np.ndarray, ReducedContact]:
    shown = [shop.shown(node, _shown(setting)) for node in nodes]
    modes = basis_of(shown)
    return modes, thinned_model(shown, modes, setting["rings"], setting["thinned"], case.options.seed)


def _brought(
    shop: Workshop, case: Case, setting: Setting, nodes: Sequence[int], modes: np.ndarray, reduced: ReducedContact
) -> Prepared:
    """Take a reduced model to the surface, as the target of ``setting`` has it."""
    kind, target = _shown(setting), setting["target"]
    shown, surface = [shop.shown(node, kind) for node in nodes], shop.up(shop.level)
    rest, linear, bent = to_surface(surface, modes), reduced.loads.T @ reduced.loads, reduced.loads.T
    weights, known = _disc_weights(case, nodes), bearing(shop, nodes, kind)
    hard = [
        float(-(row @ each.normal) * np.linalg.norm(each.forces[0])) for row, each in zip(known, shown, strict=True)
    ]
    changes = [target_change(shop, case, setting, node, 1.0 / h) for node, h in zip(nodes, hard, strict=True)]
    seen = [
        (_beyond(each, k, shown[0].elements, modes, reduced), each.change) for k, each in enumerate(changes) if each
    ]
    if seen:
        more = fitted(np.hstack([each for each, _ in seen]), np.dstack([change for _, change in seen]))
        rest, bent = rest + more, bent + _at_discs(weights, more)
    columns = np.dstack([target_columns(shop, case, target, node) for node in nodes])
    linear = linear + _at_discs(weights, columns - np.dstack([shop.reduced_columns(node) for node in nodes]))
    reach = sum(float(np.linalg.norm(_settled(reduced, k, each), axis=1).max()) for k, each in enumerate(shown))
    flat = np.ascontiguousarray(rest.reshape(-1, modes.shape[2]), dtype=np.float32)
    straight = np.ascontiguousarray(columns.reshape(len(flat), -1))
    return Prepared(reduced, reach, straight, flat, (linear, bent), known, _together(case, nodes))


def _together(case: Case, nodes: Sequence[int]) -> np.ndarray:
    """Return (k, k): 1 for discs whose centres are at most a radius apart, and 0 from two radii on."""
    at = case.body.fine.nodes[list(nodes)]
    apart = np.linalg.norm(at[:, None] - at[None], axis=2)
    return np.clip(2.0 - apart / case.radius_m, 0.0, 1.0) if case.radius_m else (apart == 0.0).astype(float)


def _settled(reduced: ReducedContact, k: int, shown: ContactSnapshots) -> np.ndarray:
    """Return the coordinates (s, r) of the snapshots of the k-th contact, by the reduced model."""
    forces = np.zeros((len(shown.forces), reduced.loads.shape[1]))
    forces[:, 3 * k : 3 * k + 3] = shown.forces
    return np.array([reduced.settle(force, RESIDUAL).q for force in forces])


def _beyond(change: Change, k: int, elements: ElementsAtRest, modes: np.ndarray, reduced: ReducedContact) -> np.ndarray:
    """Return the coordinates (r, s) of answers of the k-th contact, less those of their linear answers."""
    return coordinates(elements, change.answers, modes) - reduced.loads[:, 3 * k : 3 * k + 3] @ change.forces.T


def _disc_weights(case: Case, nodes: Sequence[int]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return, for each disc, rows of the fine surface nodes and their weights in its mean displacement."""
    fine = case.body.fine
    found = [patch_shares(fine, patch_at(case.body, node, case.radius_m)) for node in nodes]
    return [(np.searchsorted(fine.surface, at), weights) for at, weights in found]


def _at_discs(weights: list[tuple[np.ndarray, np.ndarray]], moved: np.ndarray) -> np.ndarray:
    """Return the mean displacement of each disc, (3 k, j), of ``moved`` (n_surface, 3, j)."""
    return np.concatenate([np.tensordot(share, moved[rows], 1) for rows, share in weights])
