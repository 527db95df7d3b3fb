"""Paper 1's samples: forces of the presses, samples to train on and to test, and errors of predictions."""

import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import Errors, Method, errors, peak_of
from palpate.benchmark.database import SAMPLE_COLUMNS, Database
from palpate.benchmark.presses import LOAD_COLUMNS
from palpate.bodies.body import Body
from palpate.bodies.contacts import pressed_contacts
from palpate.effects.patch_load import nodal_load
from palpate.errors import InputError
from palpate.files import read_table
from palpate.solvers.compliance import Compliance
from palpate.solvers.equilibrium import Equilibrium
from palpate.table_declaration import Table

LOAD_TOLERANCE = 0.02
"""Relative difference from the wanted peak displacement up to which the search for a force has converged."""


def choose_loads(
    body: Body,
    compliance: Compliance,
    magnitudes: list[float],
    peak_of_size: float,
    radius_m: float,
    samples: int,
    seed: int,
) -> pd.DataFrame:
    """Choose ``samples`` presses along the inward normal at random contacts, at each contact with all ``magnitudes``.

    The force of magnitude 1 is such that the largest displacement is ``peak_of_size`` times the body's size. It is
    searched with the nonlinear coarse body, and corrected by how much softer the fine one is under small loads.
    Contacts in an element with a held node are left out: there the anchor is pressed and not the body.
    Warns of searches that did not converge, whose last force is taken.
    Raises InputError where ``samples`` is no multiple of the magnitudes or asks for more contacts than there are.
    """
    if samples % len(magnitudes):
        raise InputError(
            f"bodies.{body.name}: train + test is {samples}, which {len(magnitudes)} magnitudes do not divide; "
            "change train, test or magnitudes."
        )
    candidates = pressed_contacts(body, compliance.contacts)
    n_contacts = samples // len(magnitudes)
    if n_contacts > len(candidates):
        raise InputError(
            f"bodies.{body.name}: {n_contacts} contacts are asked for and {len(candidates)} can be pressed; "
            "lower train and test, give more magnitudes, or raise contacts where it is given."
        )
    contacts = np.random.default_rng(seed).choice(candidates, n_contacts, replace=False)
    solver = Equilibrium(body, 0)
    rows: list[list[float]] = []
    reached_shares: list[float] = []
    for contact in contacts:
        direction = -body.fine.normals[contact]
        row = compliance.row(contact)
        fine, coarse = (peak_of(np.tensordot(direction, each[row], 1)) for each in (compliance.fine, compliance.coarse))
        fine_over_coarse, stiffness = fine / coarse, 1.0 / fine
        unit_load = nodal_load(body, 0, contact, direction, radius_m)
        for magnitude in magnitudes:
            peak_m = magnitude * peak_of_size * body.fine.size
            newtons, reached_share = _force_for(solver, unit_load, peak_m / fine_over_coarse, stiffness * peak_m)
            rows.append([len(rows), contact, *(newtons * direction), radius_m])
            reached_shares.append(reached_share)
    _warn_of_missed(body.name, np.array(reached_shares))
    return pd.DataFrame(rows, columns=LOAD_COLUMNS)


def _force_for(solver: Equilibrium, unit_load: np.ndarray, peak_m: float, newtons: float) -> tuple[float, float]:
    """Search the factor of ``unit_load`` at which the largest displacement is ``peak_m`` [m], from ``newtons`` on.

    Returns it and the largest displacement over ``peak_m``, which is off 1 by more than LOAD_TOLERANCE if it fails.
    """
    for tries_left in reversed(range(13)):
        reached_m = peak_of(solver.solve(newtons * unit_load, 1e-6).x - solver.mesh.nodes)
        if not tries_left or abs(reached_m / peak_m - 1.0) < LOAD_TOLERANCE:
            break
        newtons *= np.clip(peak_m / reached_m, 0.5, 2.0)
    return newtons, reached_m / peak_m


def _warn_of_missed(name: str, shares: np.ndarray) -> None:
    """Warn if a load does not reach the wanted peak displacement; shares : (n,) peaks over the wanted ones."""
    missed = shares[np.abs(shares - 1.0) >= LOAD_TOLERANCE]
    if len(missed):
        least, most = (f"{100 * share:.3g} %" for share in (missed.min(), missed.max()))
        reach = least if least == most else f"{least} to {most}"
        warnings.warn(
            f"bodies.{name}: {len(missed)} of {len(shares)} loads do not move the coarse body by the peak that is "
            f"asked for, but by {reach} of it; lower peak_of_size of the regime.",
            stacklevel=3,
        )


def read_samples(path: Path | str) -> pd.DataFrame:
    """Read a table that ``sample_table`` made; InputError if it is missing or is no such table."""
    return read_table(path, SAMPLE_COLUMNS)


def sides(samples: pd.DataFrame, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the training and of the test samples of the split ``kind``, from ``sample_table``."""
    return tuple(samples.loc[samples[kind] == side, "sample"].to_numpy() for side in ("train", "test"))


ENRICHMENT_ACCURACY = Table(
    "enrichment_accuracy",
    "The test errors of each method in every body, regime, protocol and split; blends at their best width σ.",
    """
    body regime protocol split method: a database, what coarse nodes come from and what is held out, and a method
    sigma_m samples: width of its kernel [m], and number of test samples
    rmse_m rmse_of_peak: mean error [m], and over the peaks
    p95_of_peak max_of_peak: 95th percentile and largest error / peak
    """,
)


def predict(db: Database, method: Method, protocol: str, samples: np.ndarray) -> np.ndarray:
    """Predict the displacements (k, n, 3) [m] of the fine surface in each of k ``samples`` by one method."""
    coarse = db.coarse(protocol)
    return np.array([method.predict(coarse[i], int(db.contact[i]), db.force[i]) for i in samples])


def sample_errors(db: Database, method: Method, protocol: str, samples: np.ndarray) -> pd.DataFrame:
    """Tabulate the errors of one method, a row for each of ``samples``: the column sample, then those of ``Errors``."""
    predicted = predict(db, method, protocol, samples)
    rows = [errors(u, db.fine[i])._asdict() for u, i in zip(predicted, samples, strict=True)]
    return pd.DataFrame(rows).assign(sample=samples)[["sample", *Errors._fields]]


def accuracy_rows(
    db: Database, methods: Mapping[str, Method], protocol: str, test: np.ndarray, labels: Mapping[str, str]
) -> pd.DataFrame:
    """Tabulate enrichment_accuracy.csv, a row a method, in the order of ``methods``.

    labels : body, regime and split
    RMSE and 95th percentile are means over the test samples, max_of_peak is the largest at any node of any.
    """
    rows = []
    for name, method in methods.items():
        table = sample_errors(db, method, protocol, test)
        row = table[list(Errors._fields)].mean().to_dict() | {"max_of_peak": table["max_of_peak"].max()}
        row |= {"protocol": protocol, "method": name, "sigma_m": method.sigma_m, "samples": len(test)}
        rows.append({**labels, **row})
    return ENRICHMENT_ACCURACY.frame(rows)
