"""Fit spring moduli to presses by any method: closed forms, one modulus for all, evolution, or descent.

Evolution is paper 2's genetic algorithm, or CMA-ES, its rival.
"""

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

from palpate.bodies.material import Material
from palpate.models.springs.descent import descend, descend_smoothly
from palpate.models.springs.fitness import CLOSED, LANES, Fit, Fitness, Range, Track, uniform
from palpate.models.springs.spring_motion import SpringModel

EXTENSION = 0.5
"""Extension of intermediate recombination beyond the parents, relative to their distance."""


class Genetic:
    """Generations of individuals, the best one first; the best fitness never falls, as the better half stays.

    individuals : (population, n) [Pa], at least 4; fitness : (population,) [m]; generation : number of them so far
    Each new one: any two parents; with probability 0.9 an intermediate recombination a + w (b − a), w uniform from
    −0.5 to 1.5 for each gene, else a copy of the first; then a mutation as in eq. 7 and 8. Moduli are clipped to the
    range. Not stated in the paper and chosen here: the population's size, the choice of parents, a uniform
    start, that only new ones mutate, and w. Trap: with w from −0.25 to 1.25, as usual (Mühlenbein and
    Schlierkamp-Voosen 1993), children vary less than their parents and, with as few mutations as eq. 7
    has late, all soon become alike; from −0.37 to 1.37 on the variance lasts (−0.5 to 1.5: Eshelman and Schaffer 1993).
    """

    def __init__(
        self, fitness: Callable[[np.ndarray], np.ndarray], nodes: int, population: int, limits: Range, seed: int
    ):
        self._track, self._limits = Track(fitness), limits
        self._random = np.random.default_rng(seed)
        young = self._random.uniform(*limits, (population, nodes))
        self._keep(young, self._track(young))
        self.generation = 0

    def advance(self) -> None:
        """Advance by one generation."""
        new = np.array([self._child() for _ in range(len(self.individuals) // 2)])
        fitness, survivors = self._track(new), len(self.individuals) - len(new)
        self._keep(np.vstack([self.individuals[:survivors], new]), np.concatenate([self.fitness[:survivors], fitness]))
        self.generation += 1

    def fit(self) -> Fit:
        """Return the best individual so far, with a row of history a generation."""
        return self._track.fit()

    def _keep(self, individuals: np.ndarray, fitness: np.ndarray) -> None:
        order = np.argsort(-fitness, kind="stable")
        self.individuals, self.fitness = individuals[order], fitness[order]

    def _child(self) -> np.ndarray:
        """Return a new individual (n,) [Pa]: two parents' recombination or a copy of one, perhaps mutated."""
        random, limits, n = self._random, self._limits, self.generation
        parent, other_parent = self.individuals[random.integers(len(self.individuals), size=2)]
        child = parent.copy()
        if random.random() < 0.9:
            child += random.uniform(-EXTENSION, 1.0 + EXTENSION, len(child)) * (other_parent - parent)
        if random.random() < 1.0 / (n + 2) + 0.002:  # eq. 7
            chosen = random.random(len(child)) < 0.5
            sigma = (limits.high_pa - limits.low_pa) * (1.0 / (n + 1) + 0.002)  # eq. 8
            child[chosen] = random.normal(child[chosen], sigma)
        return np.clip(child, *limits)


def evolve(
    fitness: Callable[[np.ndarray], np.ndarray],
    nodes: int,
    population: int,
    limits: Range,
    seed: int,
    generations: int,
    report: Callable[[int, float], None] = lambda generation, best: None,
) -> Fit:
    """Run ``generations`` of the genetic algorithm; ``report`` gets each one's number and best fitness [m]."""
    search = Genetic(fitness, nodes, population, limits, seed)
    while search.generation < generations:
        search.advance()
        report(search.generation, float(search.fitness[0]))
    return search.fit()


def cma_es(
    fitness: Callable[[np.ndarray], np.ndarray],
    start_pa: np.ndarray,
    limits: Range,
    evaluations: int,
    seed: int,
    report: Callable[[int, float], None] = lambda evaluations, best: None,
) -> Fit:
    """Search from moduli ``start_pa`` (n,) [Pa] in log E, until ``evaluations`` individuals or the library's own end.

    A generation has as many as are advanced together; the library would take 4 + 3 log n, 18 on paper 2's cube.
    Hansen 2016; Hansen, Akimoto, Baudis 2019 (pycma). Trap: the library replaces the seed 0 by the time of day.
    """
    import cma

    options = {
        "seed": seed + 1,
        "bounds": np.log(limits).tolist(),
        "maxfevals": evaluations,
        "popsize": len(LANES),
        "verbose": -9,
    }
    track, sigma = Track(fitness), 0.3  # of the first individuals, in log E: a factor of 1.35
    search = cma.CMAEvolutionStrategy(np.log(start_pa), sigma, options)
    while not search.stop():
        candidates = search.ask()
        search.tell(candidates, (-track(np.exp(np.array(candidates)))).tolist())
        report(len(track.history), track.best)
    return track.fit()


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
        started = perf_counter()
        model, young = CLOSED[method](model, material)
        seconds = perf_counter() - started
        value = float(np.sum([press.of(model)(young[None]) for press in presses]))
        return model, Fit(young, value, np.array([[0, seconds, value]]))
    if method == "uniform":
        return model, uniform(fitness, nodes, limits)
    if method == "genetic":
        return model, evolve(fitness, nodes, searches.population, limits, seed, searches.generations, report)
    if method == "cma_es":
        return model, cma_es(fitness, start_pa, limits, searches.cma_es_evaluations, seed, report)
    if method == "gradient_smooth":
        return model, descend_smoothly(presses[0], start_pa, limits, searches.gradient_evaluations)
    return model, descend(presses, start_pa, limits, searches.gradient_evaluations)[0]
