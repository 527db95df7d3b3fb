"""Time and memory of each component over its size, far beyond what runs in real time, and fitted exponents."""

import gc
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from scipy import sparse

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.bodies.organs import liver
from palpate.run.job import powers
from palpate.table_declaration import Table

if TYPE_CHECKING:
    from palpate.models.enrichment.training_samples import Training

FITTED_SIZES = 4
"""Number of the largest sizes over which an exponent is fitted; at smaller ones the cost of the call matters."""
LEAST_MB = 10.0
"""Least memory [MB] for the fit of an exponent: less is hidden in the memory that the process already had."""


def exponents(table: pd.DataFrame) -> pd.DataFrame:
    """Fit the exponents of the size in the time and the memory of each stage.

    Returns the columns component, stage, seconds_exponent and memory_exponent; NaN for fewer than two sizes.
    """
    rows = []
    for (component, stage), group in table.groupby(["component", "stage"], sort=False):
        largest = group.sort_values("size").tail(FITTED_SIZES)
        with_memory = largest[largest["memory_mb"] >= LEAST_MB]
        rows.append((component, stage, _slope(largest, "seconds"), _slope(with_memory, "memory_mb")))
    return pd.DataFrame(rows, columns=["component", "stage", "seconds_exponent", "memory_exponent"])


def _slope(group: pd.DataFrame, column: str) -> float:
    if group["size"].nunique() < 2:
        return np.nan
    return float(np.polyfit(np.log(group["size"]), np.log(group[column]), 1)[0])


LONG_S = 0.2
"""A call that takes longer is timed once; a shorter one is repeated for this time, and the median counts."""


class Meter:
    """Measures time and memory of the stages of one component at one size.

    Memory is the growth of the process since the meter was made.
    clock : processor time of this thread, which excludes other processes, or ``time.perf_counter`` for several threads
    patience_s : how long short calls are repeated; None for LONG_S
    """

    def __init__(self, clock: Callable[[], float] = time.thread_time, patience_s: float | None = None):
        gc.collect()
        self.clock, self._patience_s = clock, LONG_S if patience_s is None else patience_s
        self.stages: list[dict[str, Any]] = []
        self._before = _resident_mb("VmRSS")

    def once(self, stage: str, call: Callable, *given: Any) -> Any:
        """Time one call and return its result."""
        return self._timed(stage, call, given, 0.0)

    def often(self, stage: str, call: Callable, *given: Any) -> Any:
        """Repeat and time a call until ``patience_s`` is over, and return the result of the last one."""
        return self._timed(stage, call, given, self._patience_s)

    def _timed(self, stage: str, call: Callable, arguments: tuple, patience_s: float) -> Any:
        with suppress(OSError):  # forget the peak of resident memory, where the operating system can
            Path("/proc/self/clear_refs").write_text("5")
        seconds: list[float] = []
        while not seconds or sum(seconds) < patience_s:
            start = self.clock()
            result = call(*arguments)
            seconds.append(self.clock() - start)
        grown_mb = max(0.0, _resident_mb("VmHWM") - self._before)
        self.stages.append({"stage": stage, "seconds": float(np.median(seconds)), "memory_mb": grown_mb})
        return result


def _resident_mb(field: str) -> float:
    """Return the resident memory of this process [1e6 bytes], now (VmRSS) or at its peak (VmHWM); 0 if unknown."""
    status = Path("/proc/self/status")
    lines = status.read_text().splitlines() if status.exists() else []
    return sum(1.024e-3 * float(line.split()[1]) for line in lines if line.startswith(f"{field}:"))


LENGTH_M = 0.2
MATERIAL = Material(3000.0, 0.3, 1000.0)
PEAK_OF_SIZE, RADIUS_M = 0.05, 0.02
"""Linear depth of the press on the coarse mesh over the liver's length, and radius of the disc [m]."""
TOLERANCE = 1e-8
OBJECT, CLUSTERS = 100, 8
"""Particles and clusters of each object of shape matching, as in paper 3."""
POPULATION = 60
CUBE = SimpleNamespace(
    side_m=0.01, material=SimpleNamespace(young_pa=1000, density_kg_m3=1000), force_n=0.001, rise_s=0.02,
    duration_s=0.016, step_s=0.00032, damping_ratio=0.1, key_points_m=[[0.005, 0.005, 0.01]], young_pa=[300, 3000],
)  # fmt: skip
"""Paper 2's experiment with a short duration, since only the time of a generation is measured."""
Size = tuple[str, int]


def fem(refinements: int, meter: Meter) -> Size:
    """Press the liver on a refined mesh by Newton's method and multigrid; the size is in tetrahedra."""
    from palpate.effects.patch_load import nodal_load
    from palpate.solvers.equilibrium import Equilibrium

    body = meter.once("mesh", _liver, refinements)
    contact = int(body.coarse.surface[body.coarse.nodes[body.coarse.surface, 0].argmax()])
    down = np.array([0.0, 0.0, -1.0])
    unit_load = nodal_load(body, 0, contact, down, RADIUS_M)
    softness = np.linalg.norm(Equilibrium(body, 0).linear_solver()(unit_load), axis=1).max()
    load = nodal_load(body, refinements, contact, down * PEAK_OF_SIZE * LENGTH_M / softness, RADIUS_M)
    solver = meter.once("set up", Equilibrium, body, refinements)
    meter.often("linearise", solver.linearise, body.fine.nodes)
    meter.often("respond", solver.solve, load, TOLERANCE)
    return "tetrahedra", len(body.fine.tetrahedra)


def _liver(refinements: int) -> Body:
    """Make the liver with its thick end held; normals and areas of its surface are computed and stored with it."""
    mesh = liver(LENGTH_M)
    held = np.flatnonzero(mesh.nodes[:, 0] < mesh.nodes[:, 0].min() + 0.2 * LENGTH_M)
    body = nest("liver", mesh, refinements, held, MATERIAL)
    _ = body.fine.normals, body.fine.areas
    return body


def triangles(count: int, meter: Meter) -> Size:
    """Build, refit and query composite trees of two crossing sheets, of about ``count`` triangles together."""
    from palpate.collision.trees.tree_query import RefittedTrees
    from palpate.studies.prescribed_motions import crossing_waves

    scene = crossing_waves(count)
    trees = meter.often("build", RefittedTrees, "composite", (1, 1), scene.triangles, scene.at(0.0))
    meter.often("refit", trees.update, scene.at(0.002))
    meter.often("query", trees.query)
    return "triangles", sum(map(len, scene.triangles))


def particles(count: int, meter: Meter) -> Size:
    """Step shape matching of ``count`` particles, in objects of OBJECT with CLUSTERS quadratic clusters each."""
    from palpate.studies.matched_boxes import stepper

    step = meter.once("set up", stepper, OBJECT, count // OBJECT, CLUSTERS, "quadratic")[0]
    meter.often("step", step)
    return "particles", count // OBJECT * OBJECT


def cores(count: int, meter: Meter) -> Size:
    """Compute a generation of paper 2's genetic algorithm on ``count`` cores."""
    import numba

    from palpate.models.springs.cube_experiment import experiment
    from palpate.models.springs.searches import Genetic

    cube = experiment(CUBE, 0.3)
    # a reference at rest costs as much as a moving one
    still = np.zeros((cube.settings.steps, len(cube.settings.keys.corners), 3))
    fitness = cube.fitness("top", {"top": (still, still)})
    threads_before = numba.get_num_threads()
    numba.set_num_threads(count)
    population = Genetic(fitness, len(cube.model.masses), POPULATION, cube.limits, 1)
    meter.often("generation", population.advance)
    numba.set_num_threads(threads_before)
    return "cores", count


SAMPLES, FINE_NODES, CONTACTS = 60, 2210, 20
"""Sizes of paper 1's liver, which are constant while another size grows, and number of its contacts that are used."""


def fine_nodes(count: int, meter: Meter) -> Size:
    """Measure the paper's enrichment and detail correction on a fine surface of ``count`` nodes."""
    from palpate.models.enrichment.detail_correction import DetailCorrection
    from palpate.solvers.compliance import Compliance

    training = _training(count, SAMPLES)
    db = training.db
    _paper(training, meter)
    contacts, coarse = db.coarse_surface[:CONTACTS], len(db.coarse_nodes)
    shapes = [(CONTACTS, 3, n, 3) for n in (count, coarse, coarse)]
    fine, restricted, middle = (np.random.default_rng(0).normal(size=shape) for shape in shapes)
    compliance = Compliance(contacts, fine, restricted, middle)
    corrected = meter.once("detail correction: prepare", DetailCorrection, db, compliance, "live")
    meter.often("detail correction: query", corrected.predict, db.coarse_live[0], int(db.contact[0]), db.force[0])
    return "fine surface nodes", count


def samples(count: int, meter: Meter) -> Size:
    """Measure the paper's enrichment with ``count`` samples."""
    _paper(_training(FINE_NODES, count), meter)
    return "training samples", count


def _paper(training: "Training", meter: Meter) -> None:
    """Measure a blend of contact-ordered features with non-negative weights (a), its width by cross-validation."""
    from palpate.models.enrichment.paper_enrichment import Blend, DescribedSamples

    def prepare() -> Blend:
        described = DescribedSamples(training, "ordered")
        return Blend(described, "nonnegative_a", described.choose_sigma("nonnegative_a"))

    blend, db = meter.once("paper 1: prepare", prepare), training.db
    meter.often("paper 1: query", blend.predict, db.coarse_live[0], int(db.contact[0]), db.force[0])


def _training(fine: int, count: int) -> "Training":
    """Make ``count`` samples of random displacements, of the liver's coarse mesh and of a ball with ``fine`` nodes.

    The cost of blending does not depend on the displacements.
    """
    from palpate.benchmark.database import Database
    from palpate.benchmark.settings import FitOptions, Widths
    from palpate.bodies.surfaces.remesh import fibonacci_sphere
    from palpate.models.enrichment.training_samples import gather

    random, mesh = np.random.default_rng(0), liver(LENGTH_M)
    skin, n = mesh.surface, len(mesh.nodes)
    ends = random.integers(n, size=(fine, 2)).ravel()
    prolongation = sparse.csr_array((np.full(2 * fine, 0.5), (np.repeat(np.arange(fine), 2), ends)), shape=(fine, n))
    moved, coarse = (1e-3 * random.normal(size=(count, n_nodes, 3)) for n_nodes in (fine, n))
    db = Database(
        LENGTH_M / 2 * fibonacci_sphere(fine), np.empty((0, 3), dtype=np.int64), mesh.nodes, mesh.tetrahedra, skin,
        prolongation, mesh.normals[skin], skin[np.arange(count) % CONTACTS], random.normal(size=(count, 3)), moved,
        coarse, coarse, np.zeros(count), np.zeros(count), MATERIAL, "none",
    )  # fmt: skip
    settings = FitOptions(
        neighbours=10, sigma_relative=Widths(min=0.1, max=10.0, count=5), folds=5, split="samples", seed=0
    )
    return gather(db, "live", settings)


COMPONENTS = {run.__name__: run for run in (fem, fine_nodes, samples, triangles, particles, cores)}
"""Functions that run a component at a size with a Meter and return unit and exact size, by key of the config."""


SCALING = Table(
    "scaling",
    "The time and the memory of each component over the size of its problem, with fitted exponents.",
    """
    component unit size: what grows, and its size in this unit
    stage seconds: a part of the work, and the time of one call [s]
    memory_mb: largest growth of the process' resident memory [1e6 bytes]
    threads: that worked
    seconds_exponent memory_exponent: fitted powers of the size, over the largest sizes
    """,
)


def measure(component: str, sizes: list[int], report: Callable[[int], None] = lambda size: None) -> pd.DataFrame:
    """Measure the rows of scaling.csv of one of COMPONENTS: one row for each size and stage.

    report : called with each size; memory of small sizes is hidden in what the process already had
    """
    run = COMPONENTS[component]
    clock = time.perf_counter if component == "cores" else time.thread_time
    run(sizes[0], Meter(clock, 0.0))  # compiles what is called
    rows = []
    for wanted in sizes:
        meter = Meter(clock)
        unit, size = run(wanted, meter)
        labels = {"component": component, "unit": unit, "size": size}
        threads = {"threads": size if component == "cores" else 1}
        rows += [labels | stage | threads for stage in meter.stages]
        report(size)
    table = pd.DataFrame(rows)
    return table.merge(exponents(table), on=["component", "stage"])


def doubling(most: int) -> list[int]:
    """Return 1, 2, 4 … up to and including ``most``."""
    return [2**k for k in range(most.bit_length()) if 2**k < most] + [most]


def measure_scaling(wildcards: Any, threads: int, say: Callable, sizes: list[int] | None) -> pd.DataFrame:
    """Measure one component, for the rule of this name; sizes : None for numbers of cores up to all."""
    component = wildcards.component
    # the component "cores" uses all cores; the others run on one
    table = measure(component, sizes or doubling(threads), lambda size: say(f"{component}: {size} done"))
    for row in table.drop_duplicates("stage").itertuples():
        growth = powers({"time": row.seconds_exponent, "memory": row.memory_exponent})
        say(f"{row.stage}: {growth or 'no growth to fit'}")
    return table
