"""Register every way of enriching a coarse deformation. Names only: a module is imported when its method is fitted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.models.enrichment.blend_kinds import FEATURES, WEIGHTS

if TYPE_CHECKING:
    import numpy as np

    from palpate.benchmark.database import Database
    from palpate.models.enrichment.fit_inputs import FitOptions, Method
    from palpate.solvers.compliance import Compliance

# module, and the keywords that its function ``fit`` gets beside a ``Fitting``
METHODS: dict[str, tuple[str, dict]] = {
    f"{features}_{weights}": ("palpate.models.enrichment.blend", {"features": features, "weights": weights})
    for features in FEATURES
    for weights in WEIGHTS
} | {
    "interpolation": ("palpate.models.enrichment.interpolation", {}),
    "ridge_upsampling": ("palpate.models.enrichment.ridge", {"kernel": False}),
    "kernel_ridge_detail": ("palpate.models.enrichment.ridge", {"kernel": True}),
    "pod_rbf": ("palpate.models.enrichment.pod_rbf", {}),
    "linear_fem": ("palpate.models.enrichment.linear_fem", {}),
    "detail_correction_unturned": ("palpate.models.enrichment.detail_correction", {"turned": False, "learnt": False}),
    "detail_correction_untaught": ("palpate.models.enrichment.detail_correction", {"learnt": False}),
    "detail_correction": ("palpate.models.enrichment.detail_correction", {}),
}
"""The methods by the names, and in the order, of the tables; ``models.model_registry`` takes its own from here."""


def build(
    db: Database, compliance: Compliance, train: np.ndarray, protocol: str, options: FitOptions
) -> dict[str, Method]:
    """Fit every method to the samples ``train`` of one protocol; the names and order are those of METHODS.

    compliance : linear responses of the fine and coarse meshes, for the methods that use physics
    """
    # imported here, so that names alone cost nothing, and by name, so that whoever reads imports finds them
    from palpate.models.enrichment import blend, detail_correction, interpolation, linear_fem, pod_rbf, ridge
    from palpate.models.enrichment.fit_inputs import Fitting

    modules = (blend, detail_correction, interpolation, linear_fem, pod_rbf, ridge)
    fits = {module.__name__: module.fit for module in modules}
    fitting = Fitting.of(db, train, protocol, options, compliance)
    return {name: fits[place](fitting, **what) for name, (place, what) in METHODS.items()}
