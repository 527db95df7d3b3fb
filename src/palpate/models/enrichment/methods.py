"""Register every way of enriching a coarse deformation, by names.

No module is imported before its method is fitted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from palpate.benchmark.accuracy import Method
    from palpate.benchmark.database import Database
    from palpate.benchmark.settings import FitOptions
    from palpate.solvers.compliance import Compliance


# module, and the keywords that its function ``fit`` gets beside a ``Fitting``
METHODS: dict[str, tuple[str, dict]] = {
    f"{features}_{weights}": ("palpate.models.enrichment.paper_enrichment", {"features": features, "weights": weights})
    for features in ("unordered", "ordered", "framed")
    for weights in ("signed", "nonnegative_a", "nonnegative_b", "clipped")
} | {
    "interpolation": ("palpate.models.interpolation", {}),
    "ridge_upsampling": ("palpate.models.enrichment.ridge", {"kernel": False}),
    "kernel_ridge_detail": ("palpate.models.enrichment.ridge", {"kernel": True}),
    "pod_rbf": ("palpate.models.enrichment.pod_rbf", {}),
    "linear_fem": ("palpate.models.linear_fem", {}),
    "detail_correction_unturned": ("palpate.models.enrichment.detail_correction", {"turned": False, "learnt": False}),
    "detail_correction_untaught": ("palpate.models.enrichment.detail_correction", {"learnt": False}),
    "detail_correction": ("palpate.models.enrichment.detail_correction", {}),
}
"""The methods by the names, and in the order, of the tables."""


def build(
    db: Database, compliance: Compliance, train: np.ndarray, protocol: str, options: FitOptions
) -> dict[str, Method]:
    """Fit every method to the samples ``train`` of one protocol; the names and order are those of METHODS.

    compliance : linear responses of the fine and coarse meshes, for the methods that use physics
    """
    # imported here, so that names alone cost nothing, and by name, so that whoever reads imports finds them
    from palpate.models import interpolation, linear_fem
    from palpate.models.enrichment import detail_correction, paper_enrichment, pod_rbf, ridge
    from palpate.models.enrichment.training_samples import Fitting

    modules = (paper_enrichment, detail_correction, interpolation, linear_fem, pod_rbf, ridge)
    fits = {module.__name__: module.fit for module in modules}
    fitting = Fitting.of(db, train, protocol, options, compliance)
    return {name: fits[place](fitting, **what) for name, (place, what) in METHODS.items()}
