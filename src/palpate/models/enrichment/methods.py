"""Register every way of enriching a coarse deformation, by names."""

from collections.abc import Callable
from functools import partial

from palpate.benchmark.accuracy import Method
from palpate.models.enrichment import detail_correction, paper_enrichment
from palpate.models.enrichment.features import FEATURES
from palpate.models.enrichment.paper_enrichment import WEIGHTS
from palpate.models.enrichment.pod_rbf import PodRbf
from palpate.models.enrichment.ridge import KernelRidgeDetail, RidgeUpsampling
from palpate.models.enrichment.training_samples import Training
from palpate.models.interpolation import Interpolation
from palpate.models.warped_response import LinearFem

METHODS: dict[str, Callable[[Training], Method]] = {
    f"{features}_{weights}": partial(paper_enrichment.fit, features=features, weights=weights)
    for features in FEATURES
    for weights in WEIGHTS
} | {
    "interpolation": lambda training: Interpolation(training.db),
    "ridge_upsampling": RidgeUpsampling,
    "kernel_ridge_detail": KernelRidgeDetail,
    "pod_rbf": PodRbf,
    "linear_fem": lambda training: LinearFem(training.linear()),
    "detail_correction_unturned": partial(detail_correction.fit, turned=False, learnt=False),
    "detail_correction_untaught": partial(detail_correction.fit, learnt=False),
    "detail_correction": detail_correction.fit,
}
"""What fits each method to training samples, by the names, and in the order, of the tables."""


def build(training: Training) -> dict[str, Method]:
    """Fit every method to the samples of ``training``; the names and order are those of METHODS."""
    return {name: fit(training) for name, fit in METHODS.items()}
