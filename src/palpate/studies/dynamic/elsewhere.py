"""Push a body at other places than its scene does, and measure models there, as bounds of errors need it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.presses import oblique
from palpate.bodies.contacts import kept_contacts
from palpate.errors import NotConverged
from palpate.studies.dynamic.dynamic_accuracy import measure
from palpate.studies.dynamic.dynamic_reference import reference
from palpate.studies.dynamic.dynamic_trial import Trial
from palpate.studies.dynamic.motion_bounds import MEASURED

UNTAUGHT = ("fem_coarse", "detail_correction", "moving_modes")
"""Models that are asked beside the reference's own steps: nothing was fitted to another place."""


def moved_pushes(trial: Trial, count: int, tilts_degrees: Sequence[float], seed: int) -> dict[int, Trial]:
    """Return, by the node that is pushed, trials that differ in the place and the direction of their only push.

    Places are ``count`` contacts spread over the surface; forces are as large as the scene's and follow the same
    course, inward, tilted by one of ``tilts_degrees`` after the other towards a seeded random side.
    """
    contacts, push = kept_contacts(trial.body, count), trial.loads["push"]["loads"][0]
    newtons = float(np.linalg.norm(push["force_n"]))
    sides = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(contacts))
    found = {}
    for number, (contact, side) in enumerate(zip(contacts, sides, strict=True)):
        fine = trial.body.fine
        along = oblique(fine.normals[contact], tilts_degrees[number % len(tilts_degrees)], side)
        there = {"at_m": fine.nodes[contact].tolist(), "force_n": (newtons * along).tolist()}
        found[int(contact)] = replace(trial, loads=trial.loads | {"push": {"loads": [push | there]}})
    return found


def measure_elsewhere(
    trial: Trial, own: Mapping[str, Any], grid: Mapping[str, Any], seed: int, progress: Callable = iter
) -> pd.DataFrame:
    """Tabulate errors and estimates of models at other places, a row a place, model and setting of the step.

    own : the scene's block ``elsewhere``
    grid : as for ``dynamic_accuracy.measure``, with the steps of ``own``; looser residuals and the like are left out
    A place whose reference is not resolved to the end has one row, without a model.
    """
    steps = own["steps_per_frame"]
    grid = dict(grid) | {name: grid[name] | {"steps_per_frame": steps} for name in ("fem_coarse", "moving_modes")}
    grid["fem_coarse"] |= {"tolerances": [], "gaps": []}
    rows = []
    for contact, moved in progress(list(moved_pushes(trial, own["places"], own["tilts_degrees"], seed).items())):
        try:
            truth = reference(moved, None, own["change_of_peak"], own["max_halvings"])
            if truth.frames < moved.frames:
                raise NotConverged(f"{trial.name}: steps at node {contact} are not resolved to the end", [])
        except NotConverged:
            rows.append(pd.DataFrame({"scene": [trial.name], "body": trial.body.name, "contact": contact}))
            continue
        table = measure(moved, None, truth, grid, UNTAUGHT)
        rows.append(table[table["varied"] == "step"].assign(contact=contact, peak_m=truth.peak))
    return pd.concat(rows, ignore_index=True).reindex(columns=MEASURED)
