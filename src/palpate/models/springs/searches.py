"""Fit spring moduli to presses in every way: by closed forms, one modulus for all, evolution, and descent."""

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

from palpate.bodies.material import Material
from palpate.models.springs.descent import descend, descend_smoothly
from palpate.models.springs.evolution import Rules, cma_es, evolve
from palpate.models.springs.fitness import CLOSED, Fit, Fitness, Range, uniform
from palpate.models.springs.spring_motion import SpringModel

SEEDED = ("genetic", "cma_es")
"""Searches that draw random numbers, and are repeated."""


def find(
    method: str,
    presses: list[Fitness],
    material: Material,
    start_pa: np.ndarray,
    limits: Range,
    searches: Any,
    seed: int,
    report: Callable[[int, float], None] = lambda count, best: None,
) -> tuple[SpringModel, Fit]:
    """Find the moduli with the largest sum of the fitnesses of ``presses``, and the model that they belong to.

    method : one of CLOSED, uniform, genetic, cma_es, gradient_smooth, which regularises the differences of moduli and
        is fitted to the first press alone, or another name for descent along the gradient
    start_pa : (n,) [Pa], where CMA-ES and descents begin
    searches : population and generations of the genetic algorithm, evaluations of the others, as configs have them
    """
    model, nodes = presses[0].model, len(start_pa)

    def fitness(young: np.ndarray) -> np.ndarray:
        return np.sum([press(young) for press in presses], axis=0)

    if method in CLOSED:
        begin = perf_counter()
        model, young = CLOSED[method](model, material)
        seconds = perf_counter() - begin
        value = float(np.sum([press.of(model)(young[None]) for press in presses]))
        return model, Fit(young, value, np.array([[0, seconds, value]]))
    if method == "uniform":
        return model, uniform(fitness, nodes, limits)
    if method == "genetic":
        rules = Rules(searches.population, limits, seed)
        return model, evolve(fitness, nodes, rules, searches.generations, report)
    if method == "cma_es":
        return model, cma_es(fitness, start_pa, limits, searches.cma_es_evaluations, seed, report)
    if method == "gradient_smooth":
        return model, descend_smoothly(presses[0], start_pa, limits, searches.gradient_evaluations)
    return model, descend(presses, start_pa, limits, searches.gradient_evaluations)[0]
