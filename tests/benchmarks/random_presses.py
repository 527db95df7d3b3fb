"""Press bodies of a finished run at places drawn by area, in any direction and at any depth, and compare with elements.

    python tests/benchmarks/random_presses.py config.yaml results cylinder_deep liver_deep --count 100

For each scene and model: presses that it answers more than 2 % wrong and does not doubt, and those that it doubts
though it is right. Elements are quadratic, on the finest level, and stable. Contacts that are drawn get
linear responses of their own first.
"""

import argparse
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, Kept, answered
from palpate.benchmark.presses import PRESSURE, oblique
from palpate.bodies.contacts import contacts_by_area
from palpate.errors import NotConverged
from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.kinds import ContactModes
from palpate.press.finished_run import FinishedRun
from palpate.solvers.compliance import Compliance, compute_compliance
from palpate.solvers.equilibrium import FastEquilibrium

MODELS = {"contact_modes": ContactModes(target="limit")}
WRONG = 0.02
"""RMSE over peak above which an answer is wrong."""
TOLERANCE, LOWER, SOUND = 1e-4, 0.7, 0.0
"""Residual of the elements; factor by which a press without a sound answer is lowered; least det F of a sound one."""
DEEPEST = 0.2
"""Peak over the body's size that presses may reach, up to which models are made to answer."""
STEEPEST = 45.0
"""Largest tilt [degrees]; every third press is straight."""


def main() -> None:
    """Measure what the command line asks for, and print it."""
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("config", type=Path)
    asked.add_argument("results", type=Path)
    asked.add_argument("scenes", nargs="+")
    asked.add_argument("--count", type=int, default=100, help="presses of each scene")
    asked.add_argument("--at-once", type=int, default=1, help="presses of each contact")
    asked.add_argument("--models", nargs="+", default=list(MODELS))
    asked.add_argument("--seed", type=int, default=1)
    asked.add_argument("--table", type=Path, default=Path("random_presses.csv"))
    given = asked.parse_args()
    rows: list[dict] = []
    for scene in given.scenes:
        case = FinishedRun(given.config, given.results).case(scene)
        drawn = contacts_by_area(case.body, -(-given.count // given.at_once), given.seed)
        case = with_contacts(case, drawn)
        rows += measure(scene, case, np.resize(drawn, given.count), given.models, given.seed)
        pd.DataFrame(rows).to_csv(given.table, index=False)
    print(summary(pd.DataFrame(rows)).to_string())


def with_contacts(case: Case, drawn: np.ndarray) -> Case:
    """Return the case with linear responses at the contacts that samples have, and at those ``drawn``."""
    new = np.setdiff1d(drawn, case.prepared_contacts)
    if not len(new) or case.response is None:
        return case
    more, own = compute_compliance(case.body, case.radius_m, contacts=new, order=2), case.response
    contacts = np.append(own.contacts, new)
    order = np.argsort(contacts)
    parts = [np.concatenate([getattr(each, name) for each in (own, more)])[order] for name in ARRAYS]
    return replace(case, response=Compliance(contacts[order], *parts), used={}, kept=Kept())


ARRAYS = ("fine", "restricted", "coarse")


def measure(scene: str, case: Case, contacts: np.ndarray, models: list[str], seed: int) -> list[dict]:
    """Return a row for each press and model."""
    last, rng = len(case.body.levels) - 1, np.random.default_rng(seed)
    # a press that is too hard is told in a second by the coarse level, and in minutes by the finest
    coarse, elements = (Simulation(case, level, TOLERANCE, order=2, solver=FastEquilibrium) for level in (0, last))
    up, rows = to_surface(case.body, last, 2), []
    solvers = {name: MODELS[name].prepare(case) for name in models}
    most = PRESSURE * case.body.material.young_pa * np.pi * case.radius_m**2 / 2.0
    for number, contact in enumerate(contacts):
        tilt = 0.0 if number % 3 == 0 else rng.uniform(0.0, STEEPEST)
        way = oblique(case.body.fine.normals[contact], tilt, rng.uniform(0.0, 2.0 * np.pi))
        newtons, deepest = rng.uniform(0.05, 1.0) * most, DEEPEST * case.body.fine.size
        while reference(coarse, Load.at(int(contact), newtons * way), deepest) is None:
            newtons *= LOWER
        right = None
        while right is None:
            load = Load.at(int(contact), newtons * way)
            right = reference(elements, load, deepest)
            newtons *= LOWER
        right = up @ right
        peak = float(np.linalg.norm(right, axis=1).max())
        press = {
            "scene": scene,
            "contact": int(contact),
            "tilt_degrees": tilt,
            "peak_of_size": peak / case.body.fine.size,
        }
        press["force_n"] = newtons / LOWER
        for name, solver in solvers.items():
            rows.append(press | {"model": name} | asked_once(solver, load, right))
        for row in rows[-len(solvers) :]:
            print(*[f"{key}={value}" for key, value in row.items()], flush=True)
    return rows


def reference(elements: Simulation, load: Load, deepest: float) -> np.ndarray | None:
    """Return displacements (n, 3) [m] of the elements, or None where they are not sound or above ``deepest`` [m]."""
    try:
        moved = elements.displacement(load)
    except NotConverged:
        return None
    sound = elements.least_det(moved) > SOUND and np.linalg.norm(moved, axis=1).max() <= deepest
    return moved if sound else None


def asked_once(solver, load: Load, right: np.ndarray) -> dict:
    """Return the error of a model's answer to one press, its doubt, and its time [s]; the error is NaN without one."""
    solver.precede(load)
    begin = perf_counter()
    try:
        answer, doubt = answered(solver, load, len(right))
    except NotConverged as failure:
        return {"error": np.nan, "stated": np.nan, "doubt": str(failure), "seconds": perf_counter() - begin}
    seconds = perf_counter() - begin
    error = errors(answer.displacement, right).rmse_of_peak
    return {"error": error, "stated": answer.error, "doubt": doubt, "seconds": seconds}


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Count the presses of each scene and model, those wrong without a doubt, and needless doubts."""
    doubted, wrong = table["doubt"] != "", table["error"] > WRONG
    counted = pd.DataFrame({"presses": 1, "wrong_undoubted": wrong & ~doubted, "doubted": doubted})
    counted["needless"] = doubted & (table["error"] <= WRONG)
    counted = counted.groupby([table["scene"], table["model"]]).sum()
    errors_of = table[~doubted].groupby(["scene", "model"])["error"]
    return counted.assign(mean_error=errors_of.mean(), largest_error=errors_of.max())


if __name__ == "__main__":
    main()
