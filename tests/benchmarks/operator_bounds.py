"""Try bounds of single answers where no limit of nested levels is at hand: against the fine operator's answers.

    python tests/benchmarks/operator_bounds.py results/data/liver_bedded deep 0.012 [MODEL ...]

The folder is that of a body in any run, then regime and radius. Models that learn nothing are asked for every press of
its database. Bounds are estimated from nothing, by the model itself, and from a second answer of quadratic elements one
level coarser than the finest.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import spearmanr

from palpate.benchmark.accuracy import patch_nodes, truth_errors
from palpate.benchmark.conformal import Draws
from palpate.benchmark.database import read
from palpate.benchmark.load import Answer, displacement_of, loads_of
from palpate.benchmark.model import Case, FitOptions
from palpate.bodies.body_file import load
from palpate.errors import NotConverged
from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.model_registry import model
from palpate.run.settings import complete
from palpate.run.settings_file import read_settings
from palpate.solvers.equilibrium import FastEquilibrium

ROOT = Path(__file__).parents[2]
ASKED = {
    "fem_p1": {"level": 1, "start": "rest", "tolerance": 1e-3},
    "fem_p2": {"level": 0, "start": "rest", "tolerance": 1e-8},
    "fast_fem": {"level": 2, "start": "rest", "iterations": 4},
    "contact_modes": {"modes": "snapshots", "rings": 50, "thinned": 0.003, "target": "operator"},
}


def main(folder: Path, regime: str, radius_m: float, names: list[str]) -> None:
    """Print a line for each model, kind of error and estimate."""
    config = complete(read_settings(ROOT / "config.yaml"), ROOT / "config.yaml")
    body, db = load(folder / "body.h5"), read(folder / regime / "database.h5")
    options = FitOptions(**config["tradeoff"]["regression"], split="contacts", seed=config["seed"])
    grid, empty = config["tradeoff"]["settings"], db.take(np.empty(0, dtype=int))
    case = Case(body, regime, radius_m, empty, None, options, config["solver"]["tolerance"], grid)
    level, loads = len(body.levels) - 2, loads_of(db.contact, db.force)
    patch = [patch_nodes(body.fine, int(contact), radius_m) for contact in db.contact]
    coarser, up = Simulation(case, level, 1e-3, None, 2, FastEquilibrium), to_surface(body, level, 2)
    second = [up @ coarser.displacement(each) for each in loads]
    for name in names:
        solver, rows = model(name, {}).offline(case).online(ASKED[name]), []
        for i, each in enumerate(loads):
            try:
                getattr(solver, "precede", lambda load: None)(each)
                answer = solver.respond(each)
            except NotConverged as failure:
                print(f"{name}: press {i} at contact {db.contact[i]} is not answered: {failure}")
                continue
            moved, told = displacement_of(answer), answer.error if isinstance(answer, Answer) else None
            wrong, apart = (truth_errors(moved, other[i], patch[i]) for other in (db.fine, second))
            for kind in ("rmse_of_peak", "patch_rms_of_peak"):
                row = {"contact": db.contact[i], "kind": kind, "wrong": getattr(wrong, kind), "constant": 1.0}
                rows.append(row | {"own": told, "coarser": getattr(apart, kind)})
        for kind, found in pd.DataFrame(rows).groupby("kind", sort=False):
            errors, draws = found["wrong"].to_numpy(), Draws(found["contact"].to_numpy())
            for estimate in ("constant", "own", "coarser"):
                values = found[estimate].to_numpy(dtype=float)
                if np.isfinite(values).all():
                    rank = spearmanr(errors, values).statistic if np.ptp(values) > 0 else np.nan
                    held = draws.coverage(errors, np.maximum(values, 1e-9))
                    print(
                        f"{name}, {kind}, {estimate}: error {100 * np.median(errors):.2g} %, rank {rank:.2f}, "
                        f"coverage {held.coverage:.3f}, bound over error {held.sharpness:.2f}",
                        flush=True,
                    )


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], float(sys.argv[3]), sys.argv[4:] or list(ASKED))
