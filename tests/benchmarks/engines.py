"""Measure the optional engines beside palpate's own models, on presses of a run: the table in docs/engines.md.

    python tests/benchmarks/engines.py RESULTS OUT [SCENE ...]

RESULTS is the folder of a run of `make`, whose bodies, presses and truths are taken; SCENE is one of `cylinder_large`,
`liver_small` and so on, all of both bodies if none is given. Each becomes a file OUT/SCENE.csv, and is not measured
again if it is there; OUT/engines_table.md and OUT/engines.png show all that are. Four presses are asked for, at
contacts that no model learns from. Times are those that the processor spends on an answer, as other work may disturb
the clock. Errors are RMSE over the peak of what they are against: the truth of the body's law, median and `worst`;
quadratic elements on the finest nodes with the model's own law, `own_law`, if that is not the body's; the model's own
mesh with that law, converged, `own_mesh`. The exit code is 1 if the longest run of an engine ends more than 1 % from
the last.
"""

import os
import sys
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

from palpate.run.job import kernel_cache

# read when numpy and numba are imported
os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
os.environ.setdefault("NUMBA_CACHE_DIR", str(kernel_cache()))

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from palpate.benchmark.judge import Judge, read_judged
from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, Model, checked
from palpate.benchmark.settings import FitOptions, Widths
from palpate.bodies.material import LAWS
from palpate.effects.laws import quadratic_neo_hookean
from palpate.errors import NotConverged
from palpate.models.families import Families
from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.kinds import FEM, ContactModes
from palpate.models.model_registry import ENGINES, MODELS, absent
from palpate.report.model_looks import look
from palpate.report.style import plain_log
from palpate.report.words import percent, seconds
from palpate.run.settings import read_settings
from palpate.solvers.equilibrium import FastEquilibrium

ROOT, PRESSES, FARTHEST = Path(__file__).parents[2], 4, 0.01
SCENES = [f"{body}_{regime}" for body in ("cylinder", "liver") for regime in ("small", "deep", "large")]
OWN: dict[str, list[Model]] = {
    "fem_p1": [FEM(order=1, level=level, tolerance=0.001) for level in (0, 1)],
    "fem_p2": [FEM(order=2, level=0, tolerance=0.001)],
    "contact_modes": [ContactModes()],
}
"""What stands beside the engines."""
ERRORS = ("error", "worst", "own_law", "own_mesh")


class Reference:
    """Answers of a law, to what is asked of ``judge``: of the finest quadratic elements, and of linear ones."""

    def __init__(self, case: Case, loads: list[Load], law: str):
        material = replace(case.body.material, law=law)
        self._case, self._loads = replace(case, body=replace(case.body, material=material)), loads
        self._found: dict[tuple[int, int], np.ndarray] = {}

    def __call__(self, level: int, order: int) -> np.ndarray:
        """Return the surface's displacements (presses, n, 3) [m]; NaN for a press that has no answer."""
        if (level, order) not in self._found:
            kinds = {"solver": FastEquilibrium} if order == 2 else {}
            simulation = Simulation(self._case, level, 1e-6 if order == 2 else 1e-8, order=order, **kinds)
            up = to_surface(self._case.body, level, order)
            self._found[level, order] = np.array([_moved(simulation, up, load) for load in self._loads])
        return self._found[level, order]


def _moved(simulation: Simulation, up, load: Load) -> np.ndarray:
    try:
        return up @ simulation.displacement(load)
    except NotConverged:
        return np.full((up.shape[0], 3), np.nan)


def asked(results: Path, scene: str) -> tuple[Case, Judge, list[int], list[Load]]:
    """Read a scene of a run: its case, its judge, and which of the judge's samples are asked for."""
    body, regime = scene.split("_")
    place, regimes = results / "data" / body, read_settings(ROOT / "config.yaml")["regimes"]
    files = {"body": place / "body.h5"}
    files |= {name: place / regime / f"{name}.h5" for name in ("database", "truth")}
    files["samples"] = place / regime / "samples.csv"
    radius_m = regimes[regime].get("radius_of_body_m", {}).get(body, regimes[regime]["radius_m"])
    options = FitOptions(
        neighbours=10, sigma_relative=Widths(min=0.1, max=10.0, count=5), folds=3, split="contacts", seed=1
    )
    case, judge = read_judged(files, regime, 1, radius_m, options, 1e-8)
    rows = np.linspace(0, len(judge.numbers) - 1, PRESSES).astype(int).tolist()
    db = judge.samples
    return case, judge, rows, [Load.at(int(db.contact[i]), db.force[i]) for i in rows]


def measure(results: Path, scene: str) -> pd.DataFrame:
    """Measure a scene: a row for each model and setting."""
    case, judge, rows, loads = asked(results, scene)
    references = {law: Reference(case, loads, law) for law in (*LAWS, quadratic_neo_hookean.__file__)}
    table = []
    for name in [*OWN, *(engine for engine in ENGINES if engine not in absent())]:
        law = MODELS[name].law_of(case)
        reference = references[law if law in LAWS else quadratic_neo_hookean.__file__]
        for model in OWN.get(name) or MODELS[name].tried(case, Families()):
            solver = model.prepare(case)
            for load in loads if name not in ENGINES else loads[:1]:  # what the first call compiles or prepares
                answered(solver, load, case.n_surface)
            answers, took = zip(*(answered(solver, load, case.n_surface) for load in loads), strict=True)
            found = np.array(answers)
            errors = [judge.errors(i, each).rmse_of_peak for i, each in zip(rows, found, strict=True)]
            own = {} if law == case.body.material.law else {"own_law": reference(len(case.body.levels) - 2, 2)}
            if name != "contact_modes":
                own["own_mesh"] = reference(model.level, 2 if name == "fem_p2" else 1)
            table.append(
                {"scene": scene, "model": name, "setting": model.text, "law": law}
                | {"ms": 1e3 * float(np.median(took)), "failures": int(np.isnan(errors).sum())}
                | {"error": float(np.nanmedian(errors)), "worst": float(np.nanmax(errors))}
                | {each: float(np.nanmedian(apart(found, other))) for each, other in own.items()}
            )
            print(
                " ".join(f"{value:.3g}" if isinstance(value, float) else f"{value}" for value in table[-1].values()),
                flush=True,
            )
    return pd.DataFrame(table)


def answered(solver, load: Load, n_surface: int) -> tuple[np.ndarray, float]:
    """Return the displacement (n_surface, 3) [m], NaN for a failure, and what it took [s]."""
    began = process_time()
    try:
        return checked(solver.respond(load), n_surface), process_time() - began
    except NotConverged:
        return np.full((n_surface, 3), np.nan), np.nan


def apart(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return the RMS distance of answers (presses, n, 3) over the peaks of what is expected."""
    peaks = np.linalg.norm(expected, axis=2).max(axis=1)
    return np.sqrt(np.mean(np.sum((found - expected) ** 2, axis=2), axis=1)) / peaks


def rows_of(table: pd.DataFrame) -> str:
    """Write a table in Markdown."""
    head = ["scene", "model", "setting", "law", "time", *(name.replace("_", " ") for name in ERRORS)]
    lines = [" | ".join(head), " | ".join("---" for _ in head)]
    for row in table.to_dict("records"):
        cells = [row["scene"], row["model"], row["setting"], row["law"].replace("_", " "), seconds(row["ms"] / 1e3)]
        cells += ["" if np.isnan(row[name]) else percent(row[name]) for name in ERRORS]
        lines.append(" | ".join(cells))
    return "".join(f"| {line} |\n" for line in lines)


def picture(table: pd.DataFrame, file: Path) -> None:
    """Draw error against time in each scene, a line for each model on each level."""
    axes: Any
    figure, axes = plt.subplots(2, 3, figsize=(9.5, 5.6), layout="constrained", sharex=True, sharey=True)
    for axis, scene in zip(axes.flat, SCENES, strict=True):
        shown = table[table["scene"] == scene]
        levels = shown["setting"].str.extract(r"level=(\d)")[0].fillna("")
        for (name, level), rows in shown.groupby(["model", levels], sort=False):
            drawn = look(name)
            text = drawn.label + (f", level {level}" if level else "")
            inside = drawn.colour if level != "0" else "white"
            axis.loglog(
                rows["ms"], 100.0 * rows["error"], drawn.marker + "-", color=drawn.colour, mfc=inside, label=text
            )
        axis.set_title(scene.replace("_", ", "), fontsize=9)
        axis.grid(which="both", color="#e6e6e6", lw=0.5)
        plain_log(axis.yaxis)
    axes[1, 1].set_xlabel("time of the processor for an answer [ms]", fontsize=9)
    figure.supylabel("RMSE against the truth [% of the peak]", fontsize=9)
    handles = {text: line for axis in axes.flat for line, text in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=8)
    figure.savefig(file, dpi=110)


def main(results: str, out: str, *scenes: str) -> int:
    """Measure scenes, and show all that are in ``out``."""
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    for scene in scenes or SCENES:
        if not (folder / f"{scene}.csv").exists():
            measure(Path(results), scene).to_csv(folder / f"{scene}.csv", index=False)
    files = [folder / f"{scene}.csv" for scene in SCENES]
    table = pd.concat([pd.read_csv(file) for file in files if file.exists()])
    (folder / "engines_table.md").write_text(rows_of(table), encoding="utf-8")
    picture(table, folder / "engines.png")
    longest = table[table["model"].isin(ENGINES)].groupby(["scene", "model"])["own_mesh"].min()
    return int((longest > FARTHEST).any())


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
