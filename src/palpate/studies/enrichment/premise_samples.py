"""Make samples as paper 1's in another premise: with other anchors, hollow bodies, or one direction of all presses.

Responses are linear, so that one set of responses to unit forces serves any number of splits.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from palpate.benchmark.database import Database, database_of
from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, pressed_contacts
from palpate.bodies.make_body import make_body
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles
from palpate.bodies.settings import Body as BodySettings
from palpate.effects.bending import hinges
from palpate.effects.springs import Springs, rest_lengths, sum_around_edges
from palpate.effects.triangles import Triangles, shape_gradients
from palpate.errors import InputError
from palpate.linalg.block_pattern import scatter, shared_pattern
from palpate.linalg.multigrid import Factor
from palpate.solvers.compliance import compute_compliance

if TYPE_CHECKING:
    from palpate.studies.enrichment.settings import Case

RESIDUAL = 1e-6
"""Largest residual [N] under 1 N; of a surface that can move freely it is far larger, if there is an answer."""


def hollow_responses(body: Body, contacts: np.ndarray, thickness_m: float, springs: bool) -> np.ndarray:
    """Compute the displacements (contacts, 3, n_fine, 3) [m/N] of a body's surface, as a shell, under unit forces.

    contacts : coarse nodes; thickness_m : of the shell, which has the body's material
    springs : whether the shell stretches as springs along the edges do, in place of elastic triangles
    Inner nodes do not move. Raises InputError if the shell is free to move.
    """
    mesh, count = body.fine, len(contacts)
    free = np.setdiff1d(mesh.surface, body.anchors[len(body.levels) - 1])
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    stiffness = shell_stiffness(mesh.nodes, mesh.triangles, thickness_m, body.material, springs)[unknowns][:, unknowns]
    unit_loads = np.zeros((len(free), 3, count, 3))
    for axis in range(3):
        unit_loads[np.searchsorted(free, contacts), axis, np.arange(count), axis] = 1.0
    loads = unit_loads.reshape(len(unknowns), -1)
    try:
        displacements = Factor(stiffness).solve(loads.reshape(len(free), 3, -1)).reshape(loads.shape)
    except ValueError:  # singular
        displacements = np.full(loads.shape, np.nan)
    if not np.abs(stiffness @ displacements - loads).max() < RESIDUAL:
        raise InputError(f"{body.name}: its surface alone is free to move; hold more of it (anchors).")
    responses = np.zeros((count, 3, len(mesh.nodes), 3))
    responses[:, :, free] = displacements.reshape(unit_loads.shape).transpose(2, 3, 0, 1)
    return responses


def shell_stiffness(
    nodes: np.ndarray, triangles: np.ndarray, thickness_m: float, material: Material, springs: bool
) -> sparse.csr_array:
    """Assemble the stiffness (3n, 3n) [N/m] at rest of a shell that is stretched and bent.

    springs : whether springs along the edges resist stretch, in place of elastic triangles
    """
    stretch: Springs | Triangles
    if springs:
        stretch = edge_springs(nodes, triangles, thickness_m, material)
    else:
        empty = np.empty(0, dtype=np.int64)
        masses, no_tetrahedra = np.zeros(len(nodes)), empty.reshape(0, 4)
        stretch = Triangles(Particles("shell", nodes, masses, empty, triangles, no_tetrahedra, material, thickness_m))
    hinge_nodes, angle_gradients, bending_stiffness = hinge_angles(nodes, triangles, thickness_m, material)
    pattern = shared_pattern([stretch.couples, hinge_nodes], len(nodes))
    blocks = np.zeros((len(pattern.indices), 3, 3))
    stretch.add_stiffness(nodes, False, pattern.slots[0], blocks)
    folds = np.einsum("e,eai,ebj->eabij", bending_stiffness, angle_gradients, angle_gradients, optimize=True)
    scatter(pattern.slots[1].ravel(), folds.reshape(-1, 3, 3), blocks)
    return pattern.matrix(blocks).tocsr()


def edge_springs(nodes: np.ndarray, triangles: np.ndarray, thickness_m: float, material: Material) -> Springs:
    """Return springs along the edges, of stiffness E t ΣA/l² with A the areas beside an edge (Van Gelder 1998)."""
    _, areas = shape_gradients(nodes, triangles)
    pairs, areas_beside = sum_around_edges(triangles, areas, [(0, 1), (1, 2), (2, 0)])
    length = rest_lengths(nodes, pairs)
    return Springs(pairs, material.young_pa * thickness_m * areas_beside / length**2, length)


def hinge_angles(
    nodes: np.ndarray, triangles: np.ndarray, thickness_m: float, material: Material
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the nodes (h, 4) of each inner edge, its angle's gradient (h, 4, 3) and stiffness (h,) [N m].

    The stiffness is D l²/ΣA, l the edge's length and A the areas beside it, D = E t³/12(1 − ν²) (Grinspun et al. 2003).
    Trap: hinges of triangles do not converge to a plate; a strip of mirrored cells bends 1.3 times as far as it should.
    The gradient of the angle is that of Bridson, Marino and Fedkiw (2003); a rotation of both triangles costs nothing.
    """
    hinge_nodes = hinges(triangles)
    start, end, apex, other_apex = nodes[hinge_nodes].transpose(1, 0, 2)
    edge = end - start
    squared_lengths = np.einsum("hi,hi->h", edge, edge)
    lengths = np.sqrt(squared_lengths)
    normals, other_normals = np.cross(start - apex, end - apex), np.cross(end - other_apex, start - other_apex)
    areas = 0.5 * (np.linalg.norm(normals, axis=1) + np.linalg.norm(other_normals, axis=1))
    normals, other_normals = (n / np.einsum("hi,hi->h", n, n)[:, None] for n in (normals, other_normals))
    arms = (apex - end, other_apex - end, apex - start, other_apex - start)
    along_edge = [np.einsum("hi,hi->h", arm, edge) / lengths for arm in arms]
    at_start = along_edge[0][:, None] * normals + along_edge[1][:, None] * other_normals
    at_end = -along_edge[2][:, None] * normals - along_edge[3][:, None] * other_normals
    gradients = np.stack([at_start, at_end, lengths[:, None] * normals, lengths[:, None] * other_normals], axis=1)
    flexural = material.young_pa * thickness_m**3 / (12.0 * (1.0 - material.poisson**2))
    return hinge_nodes, gradients, flexural * squared_lengths / areas


TOWARD = 0.5
"""Least cosine between the direction of the presses and the inward normal of a contact that is pressed."""


@dataclass(frozen=True, eq=False)
class Premise:
    """Unit responses of a body in one premise.

    contacts : (c,) coarse nodes that are pressed, increasing; directions : (c, 3) unit vectors of the presses
    fine : (c, n, 3), coarse : (c, N, 3) [m/N] displacements of the fine surface and of all coarse nodes under these
    """

    name: str
    body: Body
    contacts: np.ndarray
    directions: np.ndarray
    fine: np.ndarray
    coarse: np.ndarray

    @cached_property
    def peaks(self) -> np.ndarray:
        """The largest displacement under each unit press, (c,) [m/N]."""
        return np.linalg.norm(self.fine, axis=2).max(axis=1)

    def database(self, count: int, magnitudes: list[float], peak_m: float, seed: int) -> Database:
        """Make samples of ``count`` random contacts, each pressed with all ``magnitudes``.

        A press of magnitude 1 has the largest displacement ``peak_m`` [m].

        Raises InputError if there are fewer contacts.
        """
        if count > len(self.contacts):
            raise InputError(
                f"enrichment.premises.{self.name}: {count} contacts are asked for and {len(self.contacts)} can be "
                "pressed; lower train and test of the body or of the premise."
            )
        chosen = np.random.default_rng(seed).choice(len(self.contacts), count, replace=False)
        rows, shares = np.repeat(chosen, len(magnitudes)), np.tile(magnitudes, count)
        newtons = shares * peak_m / self.peaks[rows]
        factors, empty = newtons[:, None, None], np.empty((0, *self.body.fine.nodes.shape))
        meshes = database_of(self.body, self.contacts[rows], newtons[:, None] * self.directions[rows], empty, empty)
        coarse = factors * self.coarse[rows]
        return replace(meshes, fine=factors * self.fine[rows], coarse_paper=coarse, coarse_live=coarse)


def prepare(name: str, premise: "Case", entry: BodySettings) -> Premise:
    """Make the body of a premise and compute its unit responses.

    premise : its settings, which replace anchors, bed and refinements of those of the body, ``entry``
    Raises InputError if the body cannot be made, or if no contact faces the direction of the presses.
    """
    replaced = {key: value for key in ("anchors", "bed", "refinements") if (value := getattr(premise, key)) is not None}
    without_anchors = {"anchors": None} if "bed" in replaced else {}  # a bed alone replaces anchors, too
    body = make_body(premise.body, entry.but(**without_anchors | replaced))
    contacts = pressed_contacts(body, contacts_of(body))
    inward = -body.fine.normals[contacts]
    if premise.direction is not None:
        press_direction = np.array(premise.direction, dtype=float)
        press_direction = press_direction / np.linalg.norm(press_direction)
        facing = inward @ press_direction >= TOWARD
        contacts, inward = contacts[facing], np.tile(press_direction, (facing.sum(), 1))
    if not len(contacts):
        raise InputError(f"enrichment.premises.{name}: no contact faces direction; turn it or hold the body elsewhere.")
    return Premise(name, body, contacts, inward, *_pressed(body, premise, contacts, inward))


THICKNESS_M = 0.002
"""Of a body that is its surface only [m]."""


def _pressed(body: Body, premise: "Case", contacts: np.ndarray, directions: np.ndarray) -> tuple:
    """Return the displacements of the fine surface and of the coarse nodes under unit presses ``directions`` (c, 3)."""
    if premise.made_of == "solid":
        compliance = compute_compliance(body, 0.0, contacts=contacts)
        fine, coarse = compliance.fine, compliance.restricted
    else:
        responses = hollow_responses(body, contacts, THICKNESS_M, premise.made_of == "springs")
        fine, coarse = responses[:, :, body.fine.surface], responses[:, :, : len(body.coarse.nodes)]
    return tuple(np.einsum("cd,cdnk->cnk", directions, each) for each in (fine, coarse))


def sample_counts(place: str, premise: "Case", entry: BodySettings) -> tuple[list[float], int, int]:
    """Return the magnitudes and the numbers of training and test samples of a premise, or of its body, ``entry``.

    Raises InputError, naming ``place``, if neither has them, or if whole contacts cannot be held out.
    """
    values: dict[str, Any] = {}
    for key in ("magnitudes", "train", "test"):
        values[key] = getattr(entry, key) if getattr(premise, key) is None else getattr(premise, key)
    if missing := [key for key, value in values.items() if value is None]:
        raise InputError(f"{place} lacks {missing[0]}, which its body does not have; give it here.")
    for key in ("train", "test"):
        if values[key] % len(values["magnitudes"]):
            raise InputError(
                f"{place}.{key} is {values[key]}; make it a multiple of the {len(values['magnitudes'])} magnitudes, so "
                "that whole contacts can be held out."
            )
    return values["magnitudes"], values["train"], values["test"]
