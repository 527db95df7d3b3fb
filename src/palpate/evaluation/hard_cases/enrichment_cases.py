"""Hard cases of enrichment: samples, kernel widths and queries at which interpolation may fail."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from palpate.enrichment.gaussian_kernel import gaussian, squared_distances
from palpate.evaluation.hard_cases.hard_case import Case, finite
from palpate.evaluation.hard_cases.pressed_samples import (
    BLENDS,
    METHODS,
    PHYSICAL,
    SETTINGS,
    TRAIN,
    blends,
    chosen,
    methods,
    pressed,
    scaled,
)

ALL, ASKED = np.arange(TRAIN), np.arange(TRAIN, TRAIN + 4)
NEAREST = "largest difference from the nearest sample / its peak"
LARGEST = "largest predicted displacement / the largest in samples and query"
ERROR = "(error at new contacts + 1 %) / (that without the difficulty + 1 %)"


def cases() -> list[Case]:
    """Return the declared cases of this family."""
    refused = dict.fromkeys(METHODS, ("refused",))
    learnt = [method for method in METHODS if method != "interpolation"]
    # the weights of the paper's blends sum to one, so that they cannot predict zero displacement
    passive = ("interpolation", "ridge_upsampling", "kernel_ridge_detail", *PHYSICAL, "detail_correction")

    def case(name, scene, expected, measure, bound, run, models, declared=None):
        words = (name, "enrichment", "palpate", scene, expected, measure, bound)
        return Case.of(*words, run=run, models=models, declared=declared)

    return [
        case("duplicate_samples", "every training sample is present twice", "the errors without duplicates", ERROR,
             1.05, _duplicates, METHODS),
        case("one_sample", "k = 1", "that sample for every query", NEAREST, 1e-12, _one, BLENDS),
        case("one_sample_fitted", "k = 1, fitted by cross-validation", "refused: no sample can be held out",
             LARGEST, 1.0, lambda model: _largest(methods(pressed()[1], ALL[:1])[model]), METHODS, refused),
        case("zero_width", "kernel width 1e-300 of the features' distance", "the nearest sample", NEAREST, 1e-9,
             _nearest, BLENDS),
        case("infinite_width", "kernel width 1e200 of the features' distance", "a prediction between the samples",
             LARGEST, 1.0, lambda model: _largest(blends(pressed()[1], ALL, 1e200)[model]), BLENDS),
        case("far_query", "a query 1e6 kernel widths from every sample", "no more than linear growth", LARGEST, 2.0,
             lambda model: _largest(_fitted()[model], 1e6 * _noise()), METHODS),
        case("collinear_features", "all samples are one linear response times 0.5 to 1.6", "the responses in between",
             "largest error in between / the peak", 0.05, _collinear, learnt),
        case("tiny_features", "displacements and forces times 1e-300", "refused: squares underflow", LARGEST, 1.0,
             lambda model: _rescaled(model, 1e-300), METHODS, refused),
        case("huge_features", "displacements and forces times 1e300", "refused: squares overflow", LARGEST, 1.0,
             lambda model: _rescaled(model, 1e300), METHODS, refused),
        case("tiny_query", "a query of 1e-300 m", "no more than the samples' displacement", LARGEST, 1.0,
             lambda model: _largest(_fitted()[model], 1e-300 * _noise()), METHODS),
        case("huge_query", "a query of 1e300 m, as from a diverged simulation", "no more than linear growth",
             LARGEST, 2.0, lambda model: _largest(_fitted()[model], 1e300 * _noise()), METHODS),
        case("more_samples_than_features", "k > 3 l: 12 samples, 3 numbers a feature",
             "no more than the samples' displacement", LARGEST, 1.0, _narrow, BLENDS[4:]),
        case("near_singular", "two samples 1e-12 apart and a wide kernel: condition of Φ above 1e16",
             "no more than twice the samples' displacement", LARGEST, 2.0, _singular, BLENDS),
        case("body_at_rest", "zero force and zero coarse displacement", "zero displacement",
             "largest predicted displacement / the largest in samples", 1e-12,
             lambda model: _largest(_fitted()[model], 0.0 * _noise(), 0.0), passive),
    ]  # fmt: skip


@cache
def _fitted() -> dict:
    return methods(pressed()[1], ALL)


def _noise() -> np.ndarray:
    """Return a random coarse displacement (N, 3) [m], unlike any sample, of at most 1 m in each component."""
    return np.random.default_rng(0).uniform(-1.0, 1.0, pressed()[1].coarse_live[0].shape)


def _largest(method: Any, coarse: np.ndarray | None = None, newtons: float = 1.0, of: int = TRAIN) -> float:
    """Return the largest displacement predicted for sample ``of`` / the largest in samples and query.

    coarse : (N, 3) [m], replaces the sample's coarse displacement; newtons : factor of its force
    """
    db = pressed()[1]
    coarse = db.coarse_live[of] if coarse is None else coarse
    answer = method.predict(coarse, int(db.contact[of]), newtons * db.force[of])
    finite(answer)
    return float(np.abs(answer).max()) / max(float(np.abs(db.fine).max()), float(np.abs(coarse).max()))


def _error(method: Any) -> float:
    """Compute the mean error at contacts outside the training samples, RMSE / peak."""
    db, errors = pressed()[1], []
    for i in ASKED:
        error = method.predict(db.coarse_live[i], int(db.contact[i]), db.force[i]) - db.fine[i]
        errors.append(np.sqrt(np.mean(np.sum(error**2, axis=1))) / db.peaks[i])
    return float(np.mean(errors))


@cache
def _twice() -> dict:
    return methods(chosen(pressed()[1], np.repeat(ALL, 2)), np.arange(2 * TRAIN))


def _duplicates(model: str) -> float:
    return (_error(_twice()[model]) + 0.01) / (_error(_fitted()[model]) + 0.01)


def _one(model: str) -> float:
    db = pressed()[1]
    method = blends(db, ALL[:1], 1.0)[model]
    answer = method.predict(100.0 * _noise(), int(db.contact[0]), db.force[0])
    return float(np.abs(answer - db.fine[0]).max()) / db.peaks[0]


def _nearest(model: str) -> float:
    """Compare the prediction for a query close to the first sample with that sample."""
    db = pressed()[1]
    answer = blends(db, ALL, 1e-300)[model].predict(1.001 * db.coarse_live[0], int(db.contact[0]), db.force[0])
    return float(np.abs(answer - db.fine[0]).max()) / db.peaks[0]


@cache
def _line() -> tuple:
    """Make samples that are multiples of one linear response, and fit the methods to them."""
    _, db, compliance = pressed()
    row, force = compliance.row(int(db.contact[0])), db.force[0]
    coarse, fine = (np.tensordot(force, part[row], 1) for part in (compliance.coarse, compliance.fine))
    count = TRAIN + 1
    line = replace(
        chosen(db, np.zeros(count, dtype=int)),
        fine=np.repeat(fine[None], count, axis=0),
        coarse_live=np.repeat(coarse[None], count, axis=0),
    )
    line = scaled(line, np.append(np.linspace(0.5, 1.6, TRAIN), 1.03))
    return line, methods(line, ALL, replace(SETTINGS, split="samples"))


def _collinear(model: str) -> float:
    db, found = _line()
    answer = found[model].predict(db.coarse_live[-1], int(db.contact[-1]), db.force[-1])
    finite(answer)
    return float(np.abs(answer - db.fine[-1]).max()) / db.peaks[-1]


def _rescaled(model: str, factor: float) -> float:
    return _largest(methods(scaled(pressed()[1], factor), ALL)[model])


@cache
def _few() -> dict:
    return blends(pressed()[1], ALL, 1.0, replace(SETTINGS, neighbours=1))


def _narrow(model: str) -> float:
    return _largest(_few()[model])


@cache
def _close() -> dict:
    """Fit blends to samples of which two almost coincide, with a width at which cond(Φ) exceeds 1e16."""
    db = chosen(pressed()[1], np.append(ALL[:-1], 0))
    db.coarse_live[-1] *= 1.0 + 1e-12
    found = blends(db, ALL, 100.0)
    coarse = db.coarse_live[:, db.coarse_surface].reshape(TRAIN, -1)
    squared = squared_distances(coarse, coarse)
    if not np.linalg.cond(gaussian(squared, found["unordered_signed"].sigma_m)) > 1e16:
        raise AssertionError("the kernel matrix is not as ill-conditioned as this case requires")
    return found


def _singular(model: str) -> float:
    return _largest(_close()[model])
