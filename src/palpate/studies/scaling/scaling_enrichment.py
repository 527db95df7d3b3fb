"""Growth of enrichment: queries and fits of random deformations, whose values do not affect the cost."""

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from palpate.bodies.liver import liver
from palpate.studies.scaling.scaling_components import LENGTH_M, MATERIAL, Size

if TYPE_CHECKING:
    from palpate.benchmark.database import Database
    from palpate.benchmark.model import FitOptions
    from palpate.models.enrichment.fitting import Training
    from palpate.studies.scaling.measure_scaling import Meter

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
    from palpate.models.enrichment.paper_enrichment import Blend, Known

    def prepare() -> Blend:
        known = Known(kinds(db, settings.neighbours)["ordered"], training, settings)
        return Blend(known, "nonnegative_a", known.choose_sigma("nonnegative_a"))

    blend = meter.once("paper 1: prepare", prepare)
    meter.often("paper 1: query", blend.predict, db.coarse_live[0], int(db.contact[0]), db.force[0])


def _database(fine: int, count: int) -> tuple["Database", "Training", "FitOptions"]:
    """Make random displacements of the liver's coarse mesh and of a ball with ``fine`` nodes, and the fit's options.

    The cost of blending does not depend on the displacements.
    """
    from palpate.benchmark.database import Database
    from palpate.benchmark.model import FitOptions
    from palpate.bodies.surfaces.even_triangulation import fibonacci_sphere
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
