"""Small bodies that tests of several packages share."""

import locale
import os
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import permutations
from pathlib import Path

from palpate.run.job import kernel_cache

os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())  # read when numba is imported
# linear algebra on one thread, as in the workflow's jobs: two processes of tests share the cores
os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.press_measure import ACCURACY_VS_TIME
from palpate.benchmark.ranking import COLUMNS as ERRORS_OF_SAMPLES
from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.simple_shapes import cylinder
from palpate.solvers.compliance import Compliance, compute_compliance
from palpate.studies.tradeoff.settings import Families

LETTERS = locale.setlocale(locale.LC_CTYPE)


@pytest.fixture(autouse=True)
def letters() -> None:
    """Read files as they were read at first. Trap: compiled libraries set the locale of the whole process to C."""
    if locale.setlocale(locale.LC_CTYPE) != LETTERS:
        locale.setlocale(locale.LC_CTYPE, LETTERS)


def pytest_terminal_summary(terminalreporter) -> None:
    """Say in one line what was not tested, and why."""
    skipped = terminalreporter.stats.get("skipped", [])
    reasons = Counter(report.longrepr[-1].removeprefix("Skipped: ") for report in skipped)
    if reasons:
        why = "; ".join(f"{reason} ({count})" for reason, count in reasons.most_common())
        terminalreporter.write_line(f"{len(skipped)} tests skipped: {why}")


@pytest.fixture(scope="session")
def soft() -> Material:
    return Material(3000.0, 0.3, 1000.0)


@pytest.fixture(scope="session")
def box() -> Callable[..., TetMesh]:
    """Make a box from the origin, of counts (3,) cells and lengths (3,) [m], each cell cut into six tetrahedra.

    ``jitter`` moves nodes by that part of a cell, those of a face within it.
    """

    def make(counts, lengths, jitter: float = 0.0) -> TetMesh:
        counts, lengths = np.array(counts), np.array(lengths, dtype=float)
        grid = np.stack(np.meshgrid(*(np.arange(c + 1) for c in counts), indexing="ij"), axis=-1).reshape(-1, 3)
        strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
        paths = np.array([np.cumsum([0, *strides[list(order)]]) for order in permutations(range(3))])
        odd = np.linalg.det(np.eye(3)[list(permutations(range(3)))]) < 0
        paths[odd] = paths[odd][:, [0, 1, 3, 2]]
        corners = grid[(grid < counts).all(axis=1)] @ strides
        move = jitter * np.random.default_rng(0).uniform(-1, 1, grid.shape)
        move[(grid == 0) | (grid == counts)] = 0.0
        mesh = TetMesh((grid + move) / counts * lengths, (corners[:, None, None] + paths).reshape(-1, 4))
        assert mesh.volumes.min() > 0
        return mesh

    return make


@pytest.fixture(scope="session")
def beam(soft) -> Body:
    """Paper 1's cylinder, 0.2 m long, refined once and held at one end."""
    return nest("beam", cylinder(0.2, 0.03), 1, np.arange(19), soft)


@pytest.fixture(scope="session")
def slab(box, soft) -> Body:
    """A crooked, skewed box of 96 coarse elements, refined once and held at one end: small, without any symmetry."""
    mesh = box([4, 2, 2], [0.2, 0.1, 0.08], jitter=0.2)
    mesh = TetMesh(mesh.nodes @ np.array([[1.0, 0.05, 0.1], [0.0, 1.0, 0.15], [0.0, 0.07, 1.0]]), mesh.tetrahedra)
    return nest("slab", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)


@pytest.fixture(scope="session")
def slab_compliance(slab) -> Compliance:
    return compute_compliance(slab, 0.0)


@pytest.fixture(scope="session")
def rotation() -> Callable[[float], np.ndarray]:
    """The rotation (3, 3) by an angle [rad] about a skew axis, by Rodrigues' formula."""
    x, y, z = np.array([1.0, -2.0, 3.0]) / np.sqrt(14.0)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return lambda angle: np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@pytest.fixture(scope="session")
def trade_off() -> tuple[pd.DataFrame, dict[str, pd.DataFrame]]:
    """Made-up accuracy_vs_time of two scenes, and the samples of each: a split of twelve contacts, four on a side.

    There are three forces at each contact. Errors are 1, 2, 3 and 2 parts at the contacts, and those of POD + RBF the
    other way round; at the patch they are 1.5 times as large, those of detail correction 5 times.
    """
    told = [  # model, setting, error, median and p95 [ms], offline [s], memory [MB], failures
        ("springs", "iterations=1", 0.3, 0.1, 0.11, 2.0, 1.0, 2),
        ("shape_matching", "steps=30", 0.2, 0.5, 0.6, 1.0, 1.0, 0),
        ("linear_fem", "default", 0.05, 0.01, 0.012, 3.0, 50.0, 0),
        ("detail_correction", "samples=10", 0.01, 4.0, 5.0, 8.0, 3.0, 0),
        ("pod_rbf", "modes=8", 0.00412, 4.5, 6.0, 30.0, 9.0, 0),
        ("detail_correction", "samples=60", 0.004, 5.0, 6.0, 40.0, 3.0, 0),
        ("fem_coarse", "iterations=8", 0.002, 12.0, 15.9, 0.1, 2.0, 0),
        ("fem_fine", "tolerance=1e-08", 1e-9, 400.0, 500.0, 0.5, 40.0, 0),
        ("truth", "own error", 0.0015, 5000.0, 5000.0, 0.0, 900.0, 0),
        ("zero", "default", 0.4, np.nan, np.nan, 0.0, 0.0, 0),
    ]
    parts = np.repeat([0.5, 1.0, 1.5, 1.0], 3)
    rows, samples = [], {}
    for body, regime, harder in (("liver", "small", 1.0), ("own", "large", 10.0)):
        scene, found = f"{body}_{regime}", []
        for model, setting, error, median, p95, offline, memory, failures in told:
            error *= harder if model not in ("fem_fine", "zero") else 1
            each, pressed = error * (2 - parts if model == "pod_rbf" else parts), 5 if "detail" in model else 1.5
            each[:failures] = np.nan
            mean, paid = np.nanmean(each), offline / (0.4 - 1e-3 * median) if median < 400 else np.inf
            row = {"scene": scene, "body": body, "regime": regime, "model": model, "setting": setting}
            row |= {"sees": "load", "prepared": model == "linear_fem", "law": "corotational", "protocol": "live"}
            row |= {"split": 1, "samples": 12, "failures": failures, "rejected": 0, "rejected_answered": 0}
            row |= {"rmse_m": 0.01 * mean, "p95_of_peak": 2 * mean}
            row |= {"relative_l2": 1.8 * mean, "max_of_peak": 4 * mean, "patch_max_of_peak": 2 * pressed * mean}
            for name, factor in (("rmse_of_peak", 1.0), ("relative_l2", 1.8), ("patch_rms_of_peak", pressed)):
                row |= {name: factor * mean, f"{name}_median": factor * mean, f"{name}_p95": 1.5 * factor * mean}
                row |= {f"validation_{name}": factor * mean}
            row |= {"online_median_s": 1e-3 * median, "online_p95_s": 1e-3 * p95, "online_max_s": 1e-3 * p95}
            row |= {"offline_s": offline, "memory_mb": memory}
            row |= {"break_even_queries": paid, "threads": 1, "commit": "made up"}
            rows.append(row | {"failure": "not found" if failures else ""})
            for side, first in (("validation", 0), ("test", 4), ("training", 8)):
                places = [(3 * first + 3 + i, first + i // 3) for i in range(12)]
                found += [
                    [model, setting, 1, side, *place, e, pressed * e] for place, e in zip(places, each, strict=True)
                ]
        samples[scene] = pd.DataFrame(found, columns=ERRORS_OF_SAMPLES)
    return pd.DataFrame(rows, columns=ACCURACY_VS_TIME.columns), samples


@pytest.fixture
def trade_off_folder(trade_off, tmp_path) -> Path:
    """The same as a run leaves it behind."""
    table, samples = trade_off
    (tmp_path / "tables").mkdir()
    table.to_csv(tmp_path / "tables/accuracy_vs_time.csv", index=False)
    for scene, errors in samples.items():
        place = tmp_path / "data" / scene.replace("_", "/")
        (place / "tradeoff/1").mkdir(parents=True)
        families = {"fem_coarse": "fem", "fem_fine": "fem"}
        for family, rows in errors.groupby(errors["model"].replace(families)):
            rows.to_csv(place / "tradeoff/1" / f"{family}_samples.csv", index=False)
    return tmp_path


@pytest.fixture(scope="session")
def grid() -> Families:
    """The settings that models are tried with, by family, where the config says nothing."""
    return Families()


@pytest.fixture(scope="session")
def slab_case(slab, slab_compliance) -> tuple:
    """A case of the slab with 12 training samples at 6 contacts, 6 test samples at 3 others, and their numbers."""
    from palpate.benchmark.database import split
    from palpate.benchmark.model import Case
    from palpate.benchmark.settings import FitOptions, Widths
    from palpate.benchmark.static_responses import assemble, press
    from palpate.studies.enrichment.samples import choose_loads

    loads = choose_loads(slab, slab_compliance, [0.8, 1.2], 0.1, 0.0, 18, 1)
    fine, coarse = press(slab, 1, loads, 1e-10), press(slab, 0, loads, 1e-8)
    db = replace(assemble(slab, loads, fine, coarse, "abc"), seconds=np.full(18, 2.0))
    train, test = split(db.contact, 12, 6, "contacts", 1)
    options = FitOptions(
        neighbours=5, sigma_relative=Widths(min=0.1, max=10, count=4), folds=3, split="contacts", seed=1
    )
    case = Case(slab, "large", 0.0, db.take(train), slab_compliance, options, 1e-8)
    return case, db.take(test), test


@pytest.fixture(scope="session")
def browser():
    """Chromium, started once in a process of tests."""
    from report.browser import started

    with started() as opened:
        yield opened
