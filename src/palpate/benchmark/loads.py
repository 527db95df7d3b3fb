"""Choose which contacts are pressed, and how hard: the load cases of a regime."""

import warnings

import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.bodies.contacts import pressed_contacts
from palpate.effects.patch_load import nodal_load
from palpate.errors import InputError
from palpate.solvers.compliance import Compliance
from palpate.solvers.equilibrium import Equilibrium

NEAR = 0.02
"""Relative difference from the wanted peak up to which a force counts as found."""
COLUMNS = ["sample", "contact", "force_x_n", "force_y_n", "force_z_n", "radius_m"]


def choose_loads(
    body: Body,
    compliance: Compliance,
    magnitudes: list[float],
    peak_of_size: float,
    radius_m: float,
    count: int,
    seed: int,
) -> pd.DataFrame:
    """Choose ``count`` presses along the inward normal at seeded random contacts, every magnitude at each contact.

    A press of magnitude 1 is meant to move the body by ``peak_of_size`` times its size at most: the force is
    found with the nonlinear coarse body, corrected by how much softer the fine one is for small loads.
    Contacts in an element with a held node are left out: there the anchor is pressed and not the body.

    Warns of forces that were not found, which the search leaves as large as it came to.

    Raises InputError where ``count`` is no multiple of the magnitudes or asks for more contacts than there are.
    """
    if count % len(magnitudes):
        raise InputError(
            f"bodies.{body.name}: train + test is {count}, which {len(magnitudes)} magnitudes do not divide; "
            "change train, test or magnitudes."
        )
    able = pressed_contacts(body, compliance.contacts)
    n_contacts = count // len(magnitudes)
    if n_contacts > len(able):
        raise InputError(
            f"bodies.{body.name}: {n_contacts} contacts are asked for and {len(able)} can be pressed; "
            "lower train and test, give more magnitudes, or raise contacts where it is given."
        )
    contacts = np.random.default_rng(seed).choice(able, n_contacts, replace=False)
    solver = Equilibrium(body, 0)
    rows: list[list[float]] = []
    found: list[float] = []
    for contact in contacts:
        direction = -body.fine.normals[contact]
        row = compliance.row(contact)
        softer = _peak(np.tensordot(direction, compliance.fine[row], 1)) / _peak(
            np.tensordot(direction, compliance.coarse[row], 1)
        )
        unit = nodal_load(body, 0, contact, direction, radius_m)
        start = 1.0 / _peak(np.tensordot(direction, compliance.fine[row], 1))
        for magnitude in magnitudes:
            peak = magnitude * peak_of_size * body.fine.size
            newtons, reached = _force_for(solver, unit, peak / softer, start * peak)
            rows.append([len(rows), contact, *(newtons * direction), radius_m])
            found.append(reached)
    _warn_of_missed(body.name, np.array(found))
    return pd.DataFrame(rows, columns=COLUMNS)


def force_of(load: pd.Series) -> np.ndarray:
    """Return the force (3,) [N] of one row."""
    return load[["force_x_n", "force_y_n", "force_z_n"]].to_numpy(dtype=float)


def nodal_forces(body: Body, level: int, load: pd.Series, order: int = 1) -> np.ndarray:
    """Return the nodal forces (n, 3) [N] of one row on one level of ``body``, as ``nodal_load`` does."""
    return nodal_load(body, level, int(load["contact"]), force_of(load), float(load["radius_m"]), order)


def _peak(displacement: np.ndarray) -> float:
    return float(np.linalg.norm(displacement, axis=-1).max())


def _force_for(solver: Equilibrium, unit: np.ndarray, peak: float, newtons: float) -> tuple[float, float]:
    """Find the factor of ``unit`` at which the coarse body's largest displacement is ``peak``, within NEAR.

    Returns it and the share of ``peak`` that it reaches, which is farther from 1 if the search fails.
    """
    for _ in range(12):
        reached = _peak(solver.solve(newtons * unit, 1e-6).x - solver.mesh.nodes)
        if abs(reached / peak - 1.0) < NEAR:
            return newtons, reached / peak
        newtons *= np.clip(peak / reached, 0.5, 2.0)
    return newtons, _peak(solver.solve(newtons * unit, 1e-6).x - solver.mesh.nodes) / peak


def _warn_of_missed(name: str, reached: np.ndarray) -> None:
    """Warn if a force is not what was asked for; reached : (n,) peak of each load in shares of the wanted one."""
    missed = reached[np.abs(reached - 1.0) >= NEAR]
    if len(missed):
        least, most = (f"{100 * share:.3g} %" for share in (missed.min(), missed.max()))
        reach = least if least == most else f"{least} to {most}"
        warnings.warn(
            f"bodies.{name}: {len(missed)} of {len(reached)} loads do not move the coarse body by the peak that is "
            f"asked for, but by {reach} of it; lower peak_of_size of the regime.",
            stacklevel=3,
        )
