"""Time of a step of shape matching (paper 3's figure 3.12), and how it grows with the number of particles."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.measuring import processor_seconds
from palpate.effects.shape_matching import TERMS
from palpate.report.tables import where
from palpate.studies.matched_boxes import DIVISIONS, stepper
from palpate.table_declaration import Table

OBJECTS = (1, 10, 30, 100, 300, 1000)
TIMED_S = 5e-3
"""About how long calls are repeated for each time."""

TIMING = Table(
    "shape_matching_timing",
    "The time of one step of shape matching, by particles, clusters, objects and kind of deformation.",
    """
    particles clusters mode objects: of an object, its mode, and how many there are
    all_particles memberships: of all objects together
    ms_per_step threads: time of a step [ms], and threads that worked
    """,
)


def measure(repeats: int) -> pd.DataFrame:
    """Measure the rows of TIMING: the time of a step on one thread, median of ``repeats`` passes over all rows.

    Objects of 100 particles vary in number, clusters and mode; one object of 8 clusters varies in particles. Times are
    processor times, which exclude other processes.
    """
    sizes_tried = [(100, objects, clusters) for clusters in (1, 8, 18) for objects in OBJECTS]
    sizes_tried += [(particles, 1, 8) for particles in DIVISIONS if particles > 100]
    rows, steppers = [], []
    for particles, objects, clusters in sizes_tried:
        for mode in TERMS:
            step, matched = stepper(particles, objects, clusters, mode)
            steppers.append(step)
            row = {"particles": particles, "clusters": len(matched.ranks) // objects, "mode": mode}
            members = len(matched.clusters.members)
            rows.append(row | {"objects": objects, "all_particles": particles * objects, "memberships": members})
    seconds = np.median([[processor_seconds(step, TIMED_S) for step in steppers] for _ in range(repeats)], axis=0)
    return pd.DataFrame(rows).assign(ms_per_step=1e3 * seconds, threads=1)


HEADLINE: dict[str, Any] = {"particles": 100, "clusters": 8, "mode": "quadratic", "objects": 100}
"""The case that the thesis ran at 50 steps a second."""

LEAST_PARTICLES = 3000
"""Least number of particles for the fit of exponents: below it the cost of calling compiled functions matters."""


def exponents(table: pd.DataFrame) -> pd.DataFrame:
    """Fit the exponent of all_particles in ms_per_step for objects of 100 particles, by mode and clusters."""
    large = table[(table["particles"] == 100) & (table["all_particles"] >= LEAST_PARTICLES)]
    rows = []
    for (mode, clusters), group in large.groupby(["mode", "clusters"], sort=False):
        slope = np.polyfit(np.log(group["all_particles"]), np.log(group["ms_per_step"]), 1)[0]
        rows.append({"mode": mode, "clusters": clusters, "exponent": slope})
    return pd.DataFrame(rows)


def headline(table: pd.DataFrame) -> float:
    """Return the time [ms] of a step of the case HEADLINE."""
    return float(where(table, **HEADLINE)["ms_per_step"].iloc[0])


def time_shape_matching(settings: Mapping[str, Any], say: Callable[[str], None]) -> pd.DataFrame:
    """Measure the rows of TIMING with these settings, and say the case of the thesis and the exponents."""
    table = measure(**settings)
    fits = ", ".join(f"{row.mode} {row.clusters}: {row.exponent:.3f}" for row in exponents(table).itertuples())
    say(f"100 objects of 100 particles in 8 quadratic clusters: {headline(table):.3f} ms a step")
    say(f"exponents of the cost in particles: {fits}")
    return table
