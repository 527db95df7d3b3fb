"""Hard cases of the way of an organ from its image into a model: segmentation, and the search for its stiffness."""

import numpy as np

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.masses import density
from palpate.bodies.ct.segmentation import segment
from palpate.models.springs.evolution import Rules, cma_es, evolve
from palpate.models.springs.fitness import Range
from palpate.studies.hard_cases.hard_case import Answer, Case

RADIUS_M = 0.03
"""Radius of the organ, a ball."""
LIVER_HU, AROUND_HU = 60.0, -100.0
VOLUME = "relative error of volume or mass"


def cases() -> list[Case]:
    return [
        Case("ct_thick_slices", "a ball in slices ten times as thick as the pixels", "its volume and mass", VOLUME,
             0.05, lambda model: _ball([0.001, 0.001, 0.01], 20.0), ("segmentation",), blunt=("segmentation",)),
        Case("ct_noise", "a ball in noise of half the contrast", "its volume and mass", VOLUME, 0.05,
             lambda model: _ball([0.002, 0.002, 0.002], 80.0), ("segmentation",), blunt=("segmentation",)),
        Case("ct_bridge", "a ball that a rod of 4 mm joins to another", "the volume and mass of one ball", VOLUME,
             0.03, lambda model: _ball([0.0015, 0.0015, 0.0015], 20.0, bridge=True), ("segmentation",)),
        Case("ct_of_one_value", "an image of air alone", "refused: no voxel in the range", VOLUME, 0.05,
             lambda model: _empty(), ("segmentation",), {"segmentation": ("refused",)}),
        Case("search_where_most_diverge", "moduli of six nodes; one individual in twenty does not diverge",
             "the moduli of which the best fitness is known", "largest relative error of a modulus", 0.05, _search,
             ("genetic_algorithm", "cma_es")),
    ]  # fmt: skip


def _ball(spacing_m: list[float], noise_hu: float, bridge: bool = False) -> Answer:
    """Segment a ball and compute its volume [m³] and mass [kg], relative to the true ones."""
    spacing, half = np.array(spacing_m), np.array([0.09 if bridge else 0.045, 0.045, 0.045])
    counts = np.ceil(2.0 * half / spacing).astype(int)
    x, y, z = (s * (np.arange(n) - (n - 1) / 2.0) for s, n in zip(spacing, counts, strict=True))
    grid = x[None, None, :], y[None, :, None], z[:, None, None]
    share = _share_of_ball(grid, spacing, -0.04 if bridge else 0.0)
    if bridge:
        rod = (np.hypot(grid[1], grid[2]) < 0.002) & (np.abs(grid[0]) < 0.02)
        smaller = _share_of_ball(grid, spacing, 0.04, 0.8 * RADIUS_M)
        share = np.maximum(np.maximum(share, smaller), rod)
    noise = noise_hu * np.random.default_rng(1).normal(size=share.shape)
    image = Image((AROUND_HU + (LIVER_HU - AROUND_HU) * share + noise).astype(np.float32), np.zeros(3), spacing, "ball")
    mask = segment(image, {"threshold_hu": [-20.0, 140.0]})
    volume = 4.0 / 3.0 * np.pi * RADIUS_M**3
    expected = np.array([volume, volume * float(density(np.array(LIVER_HU)))])
    every = image.voxel_m3 * np.array([mask.size, density(image.hu).sum()])
    found = image.voxel_m3 * np.array([mask.sum(), density(image.hu[mask]).sum()])
    return Answer(found, every, lambda a: float(np.abs(a / expected - 1.0).max()), np.zeros(2), np.zeros(2))


def _share_of_ball(grid: tuple, spacing: np.ndarray, center: float, radius: float = RADIUS_M) -> np.ndarray:
    """Compute the share of each voxel in a ball around (center, 0, 0) [m], from 4³ points in it."""
    offsets = (np.arange(4) + 0.5) / 4.0 - 0.5
    total = np.zeros(np.broadcast_shapes(*(axis.shape for axis in grid)))
    for a, b, c in np.stack(np.meshgrid(*[offsets] * 3), axis=-1).reshape(-1, 3) * spacing:
        total = total + ((grid[0] + a - center) ** 2 + (grid[1] + b) ** 2 + (grid[2] + c) ** 2 < radius**2)
    return total / 64.0


def _empty() -> Answer:
    image = Image(np.full((20, 20, 20), -1000.0, dtype=np.float32), np.zeros(3), np.full(3, 0.002), "air")
    segment(image, {"threshold_hu": [-20.0, 140.0]})
    raise AssertionError("a segmentation of air was not refused")


def _search(model: str) -> Answer:
    """Search six moduli whose fitness is known, and minus infinity where any of them is too large."""
    limits, best = Range(100.0, 10_000.0), np.array([300.0, 500.0, 800.0, 400.0, 600.0, 900.0])

    def fitness(young: np.ndarray) -> np.ndarray:
        away = -np.abs(np.log(young / best)).sum(axis=1)
        return np.where((young > 6000.0).any(axis=1), -np.inf, away)

    start = np.full(6, 1000.0)
    if model == "cma_es":
        found = cma_es(fitness, start, limits, 3000, 1).young
    else:
        found = evolve(fitness, 6, Rules(60, limits, 1), 400).young
    return Answer(found, start, lambda a: float(np.abs(a / best - 1.0).max()), np.zeros(6), np.zeros(6))
