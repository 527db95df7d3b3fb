"""Classes of a CT's grey values, by thresholds or by probability, and how they look (paper 3, chapter 2)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

_ROUNDS, _BINS = 200, 1024
_SETTLED = 1e-4
"""Share of the range of grey values by which means still move when they count as found."""


class Tissue(NamedTuple):
    """A class: the grey value that it usually has [HU], its colour, and its opacity per millimetre."""

    name: str
    hu: float
    colour: tuple[float, float, float]
    per_mm: float


TISSUES = (
    Tissue("gap", -1000.0, (0.98, 0.85, 0.76), 0.0),
    Tissue("fat", -100.0, (0.98, 0.85, 0.76), 0.004),
    Tissue("soft tissue", 50.0, (0.66, 0.32, 0.26), 0.04),
    Tissue("bone", 400.0, (0.96, 0.95, 0.92), 0.6),
)
"""Paper 3's: gaps transparent, skin and fat light and transparent, muscle darker, bone grey-white."""


class Mixture(NamedTuple):
    """A sum of normal distributions: ``means``, rising, ``deviations`` and ``shares``, (k,) each."""

    means: np.ndarray
    deviations: np.ndarray
    shares: np.ndarray


class Transfer(NamedTuple):
    """Looks of grey values: ``values`` (n,), evenly spaced, ``colours`` (n, 3), opacity ``per_mm`` (n,)."""

    values: np.ndarray
    colours: np.ndarray
    per_mm: np.ndarray


def fit_mixture(grey: np.ndarray, starts: Sequence[float]) -> Mixture:
    """Fit a mixture of normal distributions to grey values by expectation and maximisation, on their histogram.

    Dempster, Laird, Rubin, J. R. Stat. Soc. B 39(1), 1977. Trap: voxels that two tissues share have any value between;
    a distribution that is even over the range takes them, or they would widen the others.
    """
    counts, edges = np.histogram(grey, _BINS)
    values, weights = (edges[1:] + edges[:-1]) / 2, counts / counts.sum()
    width, span = edges[1] - edges[0], edges[-1] - edges[0]
    means = np.array(starts, dtype=float)
    deviations = np.full(len(means), float(np.diff(means).min() / 4))
    shares, mixed = np.full(len(means), 1 / (len(means) + 1)), 1 / (len(means) + 1)
    for _ in range(_ROUNDS):
        away = (values - means[:, None]) / deviations[:, None]
        densities = (shares / deviations)[:, None] * np.exp(-(away**2) / 2) / np.sqrt(2 * np.pi)
        belongs = densities / (densities.sum(axis=0) + mixed / span) * weights
        amounts = np.maximum(belongs.sum(axis=1), 1e-12)
        moved = belongs @ values / amounts
        squares = (belongs * (values - moved[:, None]) ** 2).sum(axis=1) / amounts
        settled = np.abs(moved - means).max() <= _SETTLED * span
        means, deviations = moved, np.maximum(np.sqrt(squares), width)
        shares, mixed = amounts, max(1 - float(amounts.sum()), 0.0)
        if settled:
            break
    order = np.argsort(means)
    return Mixture(means[order], deviations[order], shares[order] / shares.sum())


def probabilities(mixture: Mixture, values: np.ndarray) -> np.ndarray:
    """Compute the probability of each class at grey values (…), by Bayes' rule: (k, …), which sum to 1.

    Only the two classes on either side of a value count, and beyond all of them the last one. Trap: far from all of
    them the widest one would win, so that a voxel that air and tissue share would be bone.
    """
    columns = (slice(None), *[None] * np.ndim(values))
    means, deviations = mixture.means[columns], mixture.deviations[columns]
    logs = np.log(np.maximum(mixture.shares, 1e-12))[columns] - ((values - means) / deviations) ** 2 / 2
    logs = logs - np.log(deviations)
    below = np.clip(np.searchsorted(mixture.means, values) - 1, 0, len(mixture.means) - 2)
    number = np.arange(len(mixture.means))[columns]
    beside = (number == below) & (values < mixture.means[-1]) | (number == below + 1) & (values > mixture.means[0])
    logs = np.where(beside, logs, -np.inf)
    odds = np.exp(logs - logs.max(axis=0))
    return odds / odds.sum(axis=0)


def thresholds() -> np.ndarray:
    """Return the grey values [HU] midway between neighbouring tissues."""
    usual = np.array([tissue.hu for tissue in TISSUES])
    return (usual[1:] + usual[:-1]) / 2


def by_threshold(values: np.ndarray) -> np.ndarray:
    """Return 1 for the class of each grey value (…) and 0 for all others, (k, …)."""
    number = np.searchsorted(thresholds(), values)
    return np.stack([number == k for k in range(len(TISSUES))]).astype(float)


def by_percentage(values: np.ndarray) -> np.ndarray:
    """Return how much of each of two neighbouring tissues mixes to each grey value (…): (k, …), which sum to 1.

    Drebin, Carpenter, Hanrahan, "Volume rendering", SIGGRAPH 1988, without noise: linear between the usual values.
    """
    usual = [tissue.hu for tissue in TISSUES]
    return np.stack([np.interp(values, usual, one) for one in np.eye(len(usual))])


def transfer_of(values: np.ndarray, shares: np.ndarray) -> Transfer:
    """Mix the tissues' looks by their shares (k, n) at evenly spaced grey values (n,); colours weighted by opacity."""
    opacities = np.array([tissue.per_mm for tissue in TISSUES])
    weights = shares * np.maximum(opacities, 1e-9)[:, None]
    colours = (weights / weights.sum(axis=0)).T @ np.array([tissue.colour for tissue in TISSUES])
    return Transfer(values, colours, opacities @ shares)
