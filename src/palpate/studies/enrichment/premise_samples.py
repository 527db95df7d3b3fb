"""Make paper 1's samples in another premise: a body held otherwise, or hollow, pressed along one direction or inward.

Responses are linear, so that one set of unit responses serves any number of splits.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from palpate.benchmark.database import Database
from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, pressed_contacts
from palpate.bodies.make_body import make_body
from palpate.errors import InputError
from palpate.solvers.compliance import compute_compliance
from palpate.studies.enrichment.hollow_responses import hollow_responses

TOWARD = 0.5
"""Cosine between the direction of the presses and the inward normal of contacts from which on they are pressed."""


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
        """Press ``count`` seeded random contacts with each magnitude, where 1 moves the body by ``peak_m`` [m] at most.

        Raises InputError if there are fewer contacts.
        """
        if count > len(self.contacts):
            raise InputError(
                f"enrichment.premises.{self.name}: {count} contacts are asked for and {len(self.contacts)} can be "
                "pressed; lower train and test of the body or of the premise."
            )
        chosen = np.random.default_rng(seed).choice(len(self.contacts), count, replace=False)
        row, share = np.repeat(chosen, len(magnitudes)), np.tile(magnitudes, count)
        newtons = share * peak_m / self.peaks[row]
        mesh, surface, scale = self.body.coarse, self.body.fine.surface, newtons[:, None, None]
        return Database(
            nodes_fine_surface=self.body.fine.nodes[surface],
            triangles=np.searchsorted(surface, self.body.fine.triangles),
            coarse_nodes=mesh.nodes,
            coarse_tetrahedra=mesh.tetrahedra,
            coarse_surface=mesh.surface,
            prolongation=self.body.prolongation[surface].tocsr(),
            contact_normals=mesh.normals[mesh.surface],
            contact=self.contacts[row],
            force=newtons[:, None] * self.directions[row],
            fine=scale * self.fine[row],
            coarse_paper=scale * self.coarse[row],
            coarse_live=scale * self.coarse[row],
            residual=np.zeros(len(row)),
            seconds=np.zeros(len(row)),
            material=self.body.material,
            config_digest=self.name,
        )


def prepare(name: str, premise: Mapping[str, Any], entry: Mapping[str, Any]) -> Premise:
    """Make the body of a premise and compute its unit responses.

    premise : its settings, which replace anchors, bed and refinements of the body's ``entry``
    Raises InputError if the body cannot be made, or if no contact faces the direction of the presses.
    """
    body = make_body(premise["body"], changed(premise, entry))
    contacts = pressed_contacts(body, contacts_of(body))
    inward = -body.fine.normals[contacts]
    if premise["direction"] is not None:
        along = np.array(premise["direction"], dtype=float)
        along = along / np.linalg.norm(along)
        facing = inward @ along >= TOWARD
        contacts, inward = contacts[facing], np.tile(along, (facing.sum(), 1))
    if not len(contacts):
        raise InputError(f"enrichment.premises.{name}: no contact faces direction; turn it or hold the body elsewhere.")
    return Premise(name, body, contacts, inward, *_pressed(body, premise, contacts, inward))


def changed(premise: Mapping[str, Any], entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entry of a premise's body with what the premise replaces; a bed alone takes the anchors' place."""
    own = {key: premise[key] for key in ("anchors", "bed", "refinements") if key in premise}
    left_out = {"anchors"} if "bed" in own and "anchors" not in own else set()
    return {key: value for key, value in entry.items() if key not in left_out} | own


def _pressed(body: Body, premise: Mapping[str, Any], contacts: np.ndarray, along: np.ndarray) -> tuple:
    """Return the displacements of the fine surface and of the coarse nodes under unit presses."""
    if premise["made_of"] == "solid":
        found = compute_compliance(body, 0.0, contacts=contacts)
        fine, coarse = found.fine, found.restricted
    else:
        fine = hollow_responses(body, contacts, premise["thickness_m"], premise["made_of"] == "springs")
        coarse = np.zeros((len(contacts), 3, len(body.coarse.nodes), 3))
        surface = body.coarse.surface
        coarse[:, :, surface] = fine[:, :, np.searchsorted(body.fine.surface, surface)]
    return tuple(np.einsum("cd,cdnk->cnk", along, each) for each in (fine, coarse))
