"""Estimate the error of answers: from the linear response alone, from one fine residual, or from a second answer.

The second answer is that of quadratic elements one level coarser than the finest: ``Judge.from_coarser`` compares any
answer with it, and what it takes is measured here. The residual is that of quadratic elements on the finest level, as
training samples are simulated with; one multigrid cycle makes a displacement of it. What these elements cannot
represent it does not see.
"""

from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import Judge
from palpate.benchmark.load import Load, loads_of
from palpate.benchmark.model import Case
from palpate.errors import NotConverged
from palpate.models.fem_statics import Simulation, to_fine, to_surface, with_unknowns
from palpate.models.kinds import FEM
from palpate.models.warped_response import LinearFem, WarpedResponse
from palpate.solvers.equilibrium import FastEquilibrium
from palpate.studies.tradeoff.error_bounds import COARSER, EVERY, RESIDUAL

CHEAP = ("linear", "turned", "distance")
COLUMNS = ["split", "sample", "contact", "model", "setting", "estimate", "rms", "patch", "seconds"]
"""``rms`` and ``patch``: the estimate of the error over the surface and at the patch, up to a factor."""
SOLVED = ("fem_p1", "fem_p2")
"""The models on the coarse level whose residual is looked at: of others only the surface is known."""
_ENOUGH, _TIMED = 1e-3, 5
"""Residual over the load at which a second answer is exact enough, and how many of these answers are timed."""


def estimates(case: Case, judge: Judge) -> pd.DataFrame:
    """Tabulate estimates of the errors of answers to all samples of ``judge``, at training contacts too: COLUMNS.

    linear : largest displacement of the linear response, over the size of the body
    turned : RMS change of the linear response when it is turned with its own rotations, over its largest displacement
    distance : of the contact from the nearest other one that is learnt from, over the size of the body
    residual : RMS of the displacement that one cycle of multigrid makes of the fine residual, over the answer's largest
        one, of SOLVED
    coarser : the time of a second answer, without a value, as that differs from model to model
    """
    tables = [_of_samples(case, part) for part in (judge, judge.training) if part]
    return pd.concat(tables, ignore_index=True)


def read_estimates(path: str | Path) -> pd.DataFrame:
    """Read a file of ``estimates``; an empty setting stays a text, and an empty value is NaN."""
    return pd.read_csv(path, keep_default_na=False, na_values=dict.fromkeys(("rms", "patch"), ""))


def _of_samples(case: Case, judge: Judge) -> pd.DataFrame:
    loads = loads_of(judge.samples.contact, judge.samples.force)
    rows = [*_of_stored_response(case, loads), *_second(case, loads), *_residuals(case, judge, loads)]
    table = pd.DataFrame(rows, columns=["i", "model", "setting", "estimate", "rms", "patch", "seconds"])
    number = table.pop("i").to_numpy(dtype=int)
    asked_of = {"split": judge.split, "sample": judge.numbers[number], "contact": judge.samples.contact[number]}
    return table.assign(**asked_of)[COLUMNS]


def _of_stored_response(case: Case, loads: list[Load]) -> Iterator[tuple]:
    """Yield a row for each load and each of CHEAP, with one value for surface and patch.

    The seconds are those of the linear and the turned response together.
    """
    compliance, size = case.use_compliance(), case.body.fine.size
    linear, turned = LinearFem(compliance), WarpedResponse(case.meshes, compliance)
    nodes = case.body.coarse.nodes
    training = np.unique(case.database.contact)
    for i, load in enumerate(loads):
        contact, force = load.single()
        begin = perf_counter()
        straight, warped = linear.predict(None, contact, force), turned.answer(contact, force)[0]
        peak = float(np.linalg.norm(straight, axis=1).max())
        change = float(np.sqrt(np.mean(np.sum((warped - straight) ** 2, axis=1)))) / peak
        seconds = perf_counter() - begin
        others = training[training != contact]
        distance = float(np.linalg.norm(nodes[others] - nodes[contact], axis=1).min())
        for name, value in zip(CHEAP, (peak / size, change, distance / size), strict=True):
            yield i, EVERY, "", name, value, value, seconds


def _second(case: Case, loads: list[Load]) -> Iterator[tuple]:
    """Yield rows of the time of an answer one level below the finest; none where the body has no such level."""
    level = len(case.body.levels) - 2
    if level < 0:
        return
    coarser, surface_map = Simulation(case, level, _ENOUGH, None, 2, FastEquilibrium), to_surface(case.body, level, 2)
    chosen = np.unique(np.linspace(0, len(loads) - 1, _TIMED).round().astype(int))
    for call, i in enumerate((chosen[0], *chosen)):
        begin = perf_counter()
        try:
            surface_map @ coarser.displacement(loads[i])
        except NotConverged:
            continue
        if call:  # the first call compiles, and fills caches
            yield i, EVERY, "", COARSER, np.nan, np.nan, perf_counter() - begin


def _residuals(case: Case, judge: Judge, loads: list[Load]) -> Iterator[tuple]:
    """Yield a row of the residual estimate for each load and each of SOLVED, elements on the coarse level."""
    finest = len(case.body.levels) - 1
    fine, surface = Simulation(case, finest, case.tolerance, order=2), case.body.fine.surface
    setting = FEM(level=0, tolerance=case.tolerance).text
    for model in SOLVED:
        for i, (load, answer) in enumerate(zip(loads, _coarse(case, loads, int(model[-1])), strict=True)):
            begin = perf_counter()
            lengths = np.linalg.norm(fine.correction(load, answer)[surface], axis=1)
            peak = float(np.linalg.norm(answer[surface], axis=1).max())
            seconds = perf_counter() - begin
            rms, patch = (float(np.sqrt(np.mean(part**2))) / peak for part in (lengths, lengths[judge.patch[i]]))
            yield i, model, setting, RESIDUAL, rms, patch, seconds


def _coarse(case: Case, loads: list[Load], order: int) -> Iterator[np.ndarray]:
    """Yield answers (n_nodes, 3) [m] of coarse elements of ``order``, at the nodes of the finest quadratic ones."""
    whole = with_unknowns(case.body, len(case.body.levels) - 1, 2)
    coarse, up = Simulation(case, 0, case.tolerance, order=order), to_fine(whole, 0, order)
    return (up @ coarse.displacement(load) for load in loads)
