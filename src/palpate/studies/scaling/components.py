"""The components whose growth is measured: each runs at one size and passes its stages to a meter."""

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.bodies.organs import liver

if TYPE_CHECKING:
    from palpate.benchmark.database import Database
    from palpate.benchmark.model import FitOptions
    from palpate.models.enrichment.fitting import Training
    from palpate.studies.scaling.measure_scaling import Meter

LENGTH_M = 0.2
MATERIAL = Material(3000.0, 0.3, 1000.0)
PEAK_OF_SIZE, RADIUS_M = 0.05, 0.02
"""Depth of the press / the liver's length, by linear elasticity on the coarse mesh, and radius of the disc [m]."""
TOLERANCE = 1e-8
OBJECT, CLUSTERS = 100, 8
"""Particles and clusters of each object of shape matching, as in paper 3."""
POPULATION = 60
CUBE = {
    "side_m": 0.01,
    "material": {"young_pa": 1000.0, "density_kg_m3": 1000.0},
    "force_n": 0.001,
    "rise_s": 0.02,
    "duration_s": 0.016,
    "step_s": 0.00032,
    "damping_ratio": 0.1,
    "key_points_m": [[0.005, 0.005, 0.01]],
    "young_pa": [300.0, 3000.0],
}
"""Paper 2's experiment with a short duration, since only the time of a generation is measured."""

Size = tuple[str, int]


def fem(refinements: int, meter: "Meter") -> Size:
    """Press the liver on a mesh of so many ``refinements`` by Newton's method and multigrid; the size in tetrahedra."""
    from palpate.effects.patch_load import nodal_load
    from palpate.solvers.equilibrium import Equilibrium

    body = meter.once("mesh", _liver, refinements)
    contact = int(body.coarse.surface[body.coarse.nodes[body.coarse.surface, 0].argmax()])
    down = np.array([0.0, 0.0, -1.0])
    unit = nodal_load(body, 0, contact, down, RADIUS_M)
    softness = np.linalg.norm(Equilibrium(body, 0).linear_solver()(unit), axis=1).max()
    load = nodal_load(body, refinements, contact, down * PEAK_OF_SIZE * LENGTH_M / softness, RADIUS_M)
    solver = meter.once("set up", Equilibrium, body, refinements)
    meter.often("linearise", solver.linearise, body.fine.nodes)
    meter.often("respond", solver.solve, load, TOLERANCE)
    return "tetrahedra", len(body.fine.tetrahedra)


def _liver(refinements: int) -> Body:
    """Make the liver with its thick end held, and its surface computed."""
    mesh = liver(LENGTH_M)
    held = np.flatnonzero(mesh.nodes[:, 0] < mesh.nodes[:, 0].min() + 0.2 * LENGTH_M)
    body = nest("liver", mesh, refinements, held, MATERIAL)
    _ = body.fine.normals, body.fine.areas  # computed once and kept by the mesh
    return body


def triangles(count: int, meter: "Meter") -> Size:
    """Build, refit and query composite trees of two crossing sheets of together about ``count`` triangles."""
    from palpate.collision.moving_surfaces import crossing_waves
    from palpate.collision.trees.tree_query import RefittedTrees

    scene = crossing_waves(count)
    trees = meter.often("build", RefittedTrees, "composite", (1, 1), scene.triangles, scene.at(0.0))
    meter.often("refit", trees.update, scene.at(0.002))
    meter.often("query", trees.query)
    return "triangles", sum(map(len, scene.triangles))


def particles(count: int, meter: "Meter") -> Size:
    """Step shape matching of ``count`` particles, in objects of OBJECT with CLUSTERS quadratic clusters each."""
    from palpate.scenes.matched_boxes import stepper

    step = meter.once("set up", stepper, OBJECT, count // OBJECT, CLUSTERS, "quadratic")[0]
    meter.often("step", step)
    return "particles", count // OBJECT * OBJECT


def cores(count: int, meter: "Meter") -> Size:
    """Compute a generation of paper 2's genetic algorithm on ``count`` cores."""
    import numba

    from palpate.models.springs.evolution import Genetic, Rules
    from palpate.models.springs.experiment import experiment

    found = experiment(CUBE, 0.3)
    # a reference at rest costs as much as a moving one
    still = np.zeros((found.settings.steps, len(found.settings.keys.corners), 3))
    fitness = found.fitness("top", {"top": (still, still)})
    before = numba.get_num_threads()
    numba.set_num_threads(count)
    population = Genetic(fitness, len(found.model.masses), Rules(POPULATION, found.limits, 1))
    meter.often("generation", population.advance)
    numba.set_num_threads(before)
    return "cores", count


SAMPLES, FINE_NODES, CONTACTS = 60, 2210, 20
"""Sizes of paper 1's liver, kept while another size grows; a part of its contacts is enough."""


def fine_nodes(count: int, meter: "Meter") -> Size:
    """Measure the paper's enrichment and detail correction on a fine surface of ``count`` nodes."""
    from palpate.models.enrichment.detail_correction import DetailCorrection
    from palpate.solvers.compliance import Compliance

    db, training, settings = _database(count, SAMPLES)
    _paper(db, training, settings, meter)
    contacts, coarse = db.coarse_surface[:CONTACTS], len(db.coarse_nodes)
    shapes = [(CONTACTS, 3, n, 3) for n in (count, coarse, coarse)]
    fine, restricted, middle = (np.random.default_rng(0).normal(size=shape) for shape in shapes)
    compliance = Compliance(contacts, fine, restricted, middle)
    corrected = meter.once("detail correction: prepare", DetailCorrection, db, compliance, "live")
    meter.often("detail correction: query", corrected.predict, db.coarse_live[0], int(db.contact[0]), db.force[0])
    return "fine surface nodes", count


def samples(count: int, meter: "Meter") -> Size:
    """Measure the paper's enrichment with ``count`` samples."""
    db, training, options = _database(FINE_NODES, count)
    _paper(db, training, options, meter)
    return "training samples", count


def _paper(db: "Database", training: "Training", settings: "FitOptions", meter: "Meter") -> None:
    """Measure contact-ordered features and non-negative weights (a), with σ by cross-validation."""
    from palpate.models.enrichment.features import kinds
    from palpate.models.enrichment.paper_enrichment import Blend, DescribedSamples

    def prepare() -> Blend:
        known = DescribedSamples(kinds(db, settings.neighbours)["ordered"], training, settings)
        return Blend(known, "nonnegative_a", known.choose_sigma("nonnegative_a"))

    blend = meter.once("paper 1: prepare", prepare)
    meter.often("paper 1: query", blend.predict, db.coarse_live[0], int(db.contact[0]), db.force[0])


def _database(fine: int, count: int) -> tuple["Database", "Training", "FitOptions"]:
    """Make random displacements of the liver's coarse mesh and of a ball with ``fine`` nodes, and the fit's options.

    The cost of blending does not depend on the displacements.
    """
    from palpate.benchmark.database import Database
    from palpate.benchmark.model import FitOptions
    from palpate.bodies.surfaces.decimate import fibonacci_sphere
    from palpate.models.enrichment.fitting import gather

    random, mesh = np.random.default_rng(0), liver(LENGTH_M)
    among, n = mesh.surface, len(mesh.nodes)
    ends = random.integers(n, size=(fine, 2)).ravel()
    prolongation = sparse.csr_array((np.full(2 * fine, 0.5), (np.repeat(np.arange(fine), 2), ends)), shape=(fine, n))
    moved, coarse = (1e-3 * random.normal(size=(count, m, 3)) for m in (fine, n))
    db = Database(
        LENGTH_M / 2 * fibonacci_sphere(fine), np.empty((0, 3), dtype=np.int64), mesh.nodes, mesh.tetrahedra, among,
        prolongation, mesh.normals[among], among[np.arange(count) % CONTACTS], random.normal(size=(count, 3)), moved,
        coarse, coarse, np.zeros(count), np.zeros(count), MATERIAL, "none",
    )  # fmt: skip
    settings = FitOptions(10, {"min": 0.1, "max": 10.0, "count": 5}, 5, "samples", 0)
    return db, gather(db, np.arange(count), "live", settings), settings
