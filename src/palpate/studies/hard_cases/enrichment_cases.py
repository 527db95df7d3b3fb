"""Hard cases of enrichment, on samples of a small bar: widths and queries at which it may fail."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from palpate.benchmark.database import Database, database_of
from palpate.benchmark.settings import FitOptions, Widths
from palpate.bodies.body import Body, nest
from palpate.bodies.simple_shapes import box
from palpate.effects.patch_load import nodal_load
from palpate.models.enrichment.features import FEATURES
from palpate.models.enrichment.methods import METHODS, build
from palpate.models.enrichment.paper_enrichment import WEIGHTS, Blend, DescribedSamples, gaussian, squared_distances
from palpate.models.enrichment.training_samples import Training, gather
from palpate.solvers.compliance import Compliance, compute_compliance
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.hard_cases.stage import SOFT, Answer, Case, check_finite, refuses

PRESSED, TRAIN = 8, 12
"""Number of contacts that are pressed twice each to make samples, and how many of these are trained on."""
SETTINGS = FitOptions(
    neighbours=6, sigma_relative=Widths(min=0.01, max=100, count=7), folds=3, split="contacts", seed=1
)
BLENDS = tuple(f"{features}_{weights}" for features in FEATURES for weights in WEIGHTS)
PHYSICAL = ("linear_fem", "detail_correction_unturned", "detail_correction_untaught")

ALL, ASKED = np.arange(TRAIN), np.arange(TRAIN, TRAIN + 4)
ERROR = "largest difference from what is expected / its peak"
FAR_LINEAR = ("interpolation", "ridge_upsampling", "kernel_ridge_detail", *PHYSICAL[1:], "detail_correction")
"""Methods whose answer to a very large query is proportional to it; of the others it is constant."""
NEAR_LINEAR = ("interpolation", "ridge_upsampling", "kernel_ridge_detail")
"""Methods whose answer to a very small query at a fixed force is proportional to the query."""
AMBIGUOUS = [name for name in BLENDS if name.endswith("nonnegative_a")]
"""Blends by the non-negative matrix that is nearest to an inverse: where Φ is singular, many are as near."""
REFERENCE = {"far": 1e4, "tiny": 1e-12, "huge": 1e160}
"""Size [m] of a query that is less extreme, by the kind of extreme; squares of 1e160 overflow, too."""


ROUGH = ("unordered_clipped", "ordered_clipped", "framed_clipped", "detail_correction_untaught")
"""Methods whose own error is 4 % for samples that are multiples of one."""


def cases() -> list[Case]:
    refused = ("refused",)
    learnt = [method for method in METHODS if method != "interpolation"]
    # the weights of the paper's blends sum to one, so that they cannot predict zero displacement
    passive = ("interpolation", "ridge_upsampling", "kernel_ridge_detail", *PHYSICAL, "detail_correction")

    return [
        Case("duplicate_samples", "every training sample is present twice", "the answers without duplicates", ERROR,
             0.04, _duplicates, METHODS),
        Case("one_sample", "k = 1, for two samples", "that sample for every query", ERROR, 1e-12, _one_sample, BLENDS),
        Case("one_sample_fitted", "k = 1, fitted by cross-validation", "refused: no sample can be held out", ERROR, 0.0,
             refuses(lambda: methods(pressed()[1], ALL[:1])), ("shared_setup",), refused),
        Case("zero_width", "kernel width 1e-300 of the features' distance", "the nearest sample", ERROR, 1e-9,
             _zero_width, BLENDS),
        Case("infinite_width", "kernel width 1e200 of the features' distance", "the answer at a width of 1e9", ERROR,
             1e-6, _infinite_width, BLENDS),
        Case("far_query", "a query 1e6 kernel widths from every sample",
             "a hundred times the answer to a hundredth of it, or the same", ERROR, 0.01,
             lambda model: _extreme(model, 1e6, "far"), METHODS),
        Case("collinear_features", "all samples are one linear response times 0.5 to 1.6", "the responses in between",
             ERROR, 0.005, _collinear, learnt, bounds=dict.fromkeys(ROUGH, 0.05), blunt=ROUGH),
        Case("tiny_features", "displacements and forces times 1e-300", "refused: squares underflow", ERROR, 0.0,
             refuses(lambda: methods(scaled(pressed()[1], 1e-300), ALL)), ("shared_setup",), refused),
        Case("huge_features", "displacements and forces times 1e300", "refused: squares overflow", ERROR, 0.0,
             refuses(lambda: methods(scaled(pressed()[1], 1e300), ALL)), ("shared_setup",), refused),
        Case("tiny_query", "a query of 1e-300 m", "the answer to one of 1e-12 m, in proportion or the same", ERROR,
             0.01, lambda model: _extreme(model, 1e-300, "tiny"), METHODS),
        Case("huge_query", "a query of 1e300 m, as from a diverged simulation",
             "the answer to one of 1e160 m, in proportion or the same", ERROR, 0.01,
             lambda model: _extreme(model, 1e300, "huge"), METHODS),
        Case("more_samples_than_features", "k > 3 l: 12 samples, 3 numbers a feature", "the training samples", ERROR,
             1e-6, _few_features, [name for name in BLENDS[4:] if name.endswith(("_signed", "_b"))]),
        Case("near_singular", "two samples 1e-12 apart and a wide kernel: condition of Φ above 1e16",
             "the answers without the second of them; the non-negative matrix is known not to be unique", ERROR,
             0.01, _singular, BLENDS, dict.fromkeys(AMBIGUOUS, ("wrong",))),
        Case("body_at_rest", "zero force and zero coarse displacement, and a millionth of a press",
             "zero displacement, and a thousandth of that under a thousandth of a press", ERROR, 0.01, _at_rest,
             passive),
    ]  # fmt: skip


@cache
def pressed() -> tuple[Body, Database, Compliance]:
    """Simulate a bar of 0.2 m, held at one end and pressed at PRESSED contacts with 0.02 and with 0.04 N.

    Returns the body, its samples and its responses to unit forces.
    """
    mesh = box([0.2, 0.05, 0.05], [4, 2, 2])
    body = nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), SOFT)
    compliance = compute_compliance(body, 0.0)
    candidates = [c for c in compliance.contacts if mesh.nodes[c, 0] > 0.06]
    contacts = np.random.default_rng(1).choice(candidates, PRESSED, replace=False).repeat(2)
    forces = -np.tile([0.02, 0.04], PRESSED)[:, None] * body.fine.normals[contacts]
    displacements = []
    for level in (0, 1):
        solver = Equilibrium(body, level)
        loads = [nodal_load(body, level, c, f, 0.0) for c, f in zip(contacts, forces, strict=True)]
        displacements.append(np.array([solver.solve(load, 1e-8).x - solver.mesh.nodes for load in loads]))
    return body, database_of(body, contacts, forces, *displacements), compliance


def scaled(db: Database, factor: np.ndarray | float) -> Database:
    """Return a database of k samples with displacements and forces times ``factor``, a number or (k,)."""
    factor = np.reshape(factor, (-1, 1, 1))
    arrays = {name: getattr(db, name) * factor for name in ("fine", "coarse_paper", "coarse_live")}
    return replace(db, force=db.force * factor[:, 0], **arrays)


def methods(db: Database, train: np.ndarray, settings: FitOptions = SETTINGS) -> dict:
    """Fit all of METHODS with cross-validation on the samples ``train`` of the live protocol."""
    return build(gather(db.take(train), "live", settings, pressed()[2]))


def blends(db: Database, train: np.ndarray, sigma: float | dict[str, float], settings: FitOptions = SETTINGS) -> dict:
    """Fit BLENDS to samples with a width of ``sigma`` median distances between features, or widths [m] by name."""
    folds = np.zeros(len(train), dtype=int)  # the width is given, so that no fold is needed and one sample is enough
    training = Training(db.take(train), "live", settings, folds)
    fitted = {}
    for name in FEATURES:
        described = DescribedSamples(training, name)
        for weights in WEIGHTS:
            blend = f"{name}_{weights}"
            width = sigma[blend] if isinstance(sigma, dict) else sigma * described.scale
            fitted[blend] = Blend(described, weights, width)
    return fitted


@cache
def _fitted() -> dict:
    return methods(pressed()[1], ALL)


def _noise() -> np.ndarray:
    """Return a random coarse displacement (1, N, 3) [m] of at most 1 m in each component, unlike that of any sample."""
    return np.random.default_rng(0).uniform(-1.0, 1.0, (1, *pressed()[1].coarse_live[0].shape))


def _answers(method: Any, coarse: np.ndarray, samples: np.ndarray, factor: float = 1.0) -> np.ndarray:
    """Return the answers (q, n, 3) [m] of a method to coarse displacements (q, N, 3) [m].

    Contacts and forces are those of ``samples`` (q,), row numbers; forces are multiplied by ``factor``.
    """
    db = pressed()[1]
    return np.array(
        [method.predict(u, int(db.contact[i]), factor * db.force[i]) for u, i in zip(coarse, samples, strict=True)]
    )


def _compared(answers: np.ndarray, expected: np.ndarray) -> Answer:
    """Return ``answers`` (q, n, 3) [m] to q queries with their error, the largest difference from ``expected`` ones.

    The difference is over the peak of each expected answer. A frozen method gives the first answer to every query.
    """
    check_finite(expected)
    peaks = np.abs(expected).max(axis=(1, 2))
    peaks = np.where(peaks > 0.0, peaks, peaks.max())

    def error(answer: np.ndarray) -> float:
        return float((np.abs(answer - expected).max(axis=(1, 2)) / peaks).max())

    zero = np.zeros_like(answers)
    return Answer(answers, np.broadcast_to(answers[0], answers.shape), error, zero=zero, origin=zero)


@cache
def _fitted_to_duplicates() -> dict:
    return methods(pressed()[1].take(np.repeat(ALL, 2)), np.arange(2 * TRAIN))


def _duplicates(model: str) -> Answer:
    """Compare a method that is fitted to every sample twice with one that is fitted to each once."""
    coarse = pressed()[1].coarse_live[ASKED]
    return _compared(*(_answers(fit()[model], coarse, ASKED) for fit in (_fitted_to_duplicates, _fitted)))


def _one_sample(model: str) -> Answer:
    """Compare blends that are each fitted to a single sample with that sample, for a query of noise."""
    db, samples = pressed()[1], (0, 5)
    fitted = [blends(db, ALL[i : i + 1], 1.0)[model] for i in samples]
    answers = [_answers(method, 100.0 * _noise(), np.array([i]))[0] for method, i in zip(fitted, samples, strict=True)]
    return _compared(np.array(answers), db.fine[list(samples)])


def _zero_width(model: str) -> Answer:
    """Compare the answers of a blend without width to queries close to two samples with those samples."""
    db, samples = pressed()[1], np.array([0, 5])
    answers = _answers(blends(db, ALL, 1e-300)[model], 1.001 * db.coarse_live[samples], samples)
    return _compared(answers, db.fine[samples])


def _infinite_width(model: str) -> Answer:
    """Compare answers at a width of 1e200 with those at 1e9, of blends fitted to either half of the samples."""
    db, row = pressed()[1], ASKED[:1]
    at_1e9, at_1e200 = (
        np.array([_answers(blends(db, half, width)[model], db.coarse_live[row], row)[0] for half in (ALL[:6], ALL[6:])])
        for width in (1e9, 1e200)
    )
    return _compared(at_1e200, at_1e9)


def _extreme(model: str, size_m: float, kind: str) -> Answer:
    """Compare the answer to noise of ``size_m`` [m] with that to noise of REFERENCE, both over their size if linear."""
    method, row, reference = _fitted()[model], ASKED[2:3], REFERENCE[kind]
    linear = model in (NEAR_LINEAR if kind == "tiny" else FAR_LINEAR)
    usual = _answers(method, pressed()[1].coarse_live[ASKED[:1]], ASKED[:1])
    extreme, milder = (_answers(method, size * _noise(), row) for size in (size_m, reference))
    check_finite(extreme)
    if linear:  # divided by the size, so that the error of what is proportional can be computed
        extreme, milder = extreme / size_m, milder / reference
    return _compared(np.concatenate([usual, extreme]), np.concatenate([usual, milder]))


@cache
def _line() -> tuple:
    """Make samples that are multiples of one linear response, and fit all methods to the first TRAIN of them."""
    _, db, compliance = pressed()
    row, force = compliance.row(int(db.contact[0])), db.force[0]
    coarse, fine = (np.tensordot(force, responses[row], 1) for responses in (compliance.coarse, compliance.fine))
    count = TRAIN + 2
    samples = replace(
        db.take(np.zeros(count, dtype=int)),
        fine=np.repeat(fine[None], count, axis=0),
        coarse_live=np.repeat(coarse[None], count, axis=0),
    )
    samples = scaled(samples, np.append(np.linspace(0.5, 1.6, TRAIN), [0.73, 1.03]))
    return samples, methods(samples, ALL, SETTINGS.but(split="samples"))


def _collinear(model: str) -> Answer:
    """Compare the answers of a method that is fitted to ``_line`` with two samples of the line that it has not seen."""
    db, fitted = _line()
    method = fitted[model]
    answers = [method.predict(db.coarse_live[i], int(db.contact[i]), db.force[i]) for i in (TRAIN, TRAIN + 1)]
    return _compared(np.array(answers), db.fine[-2:])


@cache
def _of_one_neighbour() -> dict:
    return blends(pressed()[1], ALL, 0.1, SETTINGS.but(neighbours=1))


def _few_features(model: str) -> Answer:
    """Compare blends with features of a single coarse node with the training samples."""
    db, samples = pressed()[1], np.array([0, 5])
    return _compared(_answers(_of_one_neighbour()[model], db.coarse_live[samples], samples), db.fine[samples])


@cache
def _wide(half: tuple[int, int], twice: bool) -> dict:
    """Fit wide blends to one half of the samples (first, last row), of which the first is nearly present ``twice``."""
    db = pressed()[1]
    samples = ALL[slice(*half)]
    db = db.take(np.append(samples, samples[0]) if twice else samples)
    if twice:
        db.coarse_live[-1] *= 1.0 + 1e-12
    width = {name: blend.sigma_m for name, blend in _wide(half, False).items()} if twice else 100.0
    fitted = blends(db, np.arange(len(db.contact)), width)
    coarse = db.coarse_live[:, db.coarse_surface].reshape(len(db.contact), -1)
    phi = gaussian(squared_distances(coarse, coarse), fitted["unordered_signed"].sigma_m)
    if twice and not np.linalg.cond(phi) > 1e16:
        raise AssertionError("the kernel matrix is not as ill-conditioned as this case requires")
    return fitted


def _singular(model: str) -> Answer:
    """Compare blends of half the samples, one of them nearly present ``twice``, with those without that copy."""
    coarse, row, halves = pressed()[1].coarse_live[ASKED[:1]], ASKED[:1], ((0, 6), (6, TRAIN))
    answers, expected = (
        np.concatenate([_answers(_wide(half, twice)[model], coarse, row) for half in halves]) for twice in (True, False)
    )
    return _compared(answers, expected)


def _at_rest(model: str) -> Answer:
    """Compare the answer to no press with zero, and to 1e-6 of a press with that to 1e-3 of it, in proportion."""
    method, coarse, row = _fitted()[model], pressed()[1].coarse_live[ASKED[:1]], ASKED[:1]
    at_millionth, at_thousandth = (_answers(method, factor * coarse, row, factor) / factor for factor in (1e-6, 1e-3))
    nothing = _answers(method, 0.0 * coarse, row, 0.0)
    return _compared(np.concatenate([nothing, at_millionth]), np.concatenate([0.0 * nothing, at_thousandth]))
