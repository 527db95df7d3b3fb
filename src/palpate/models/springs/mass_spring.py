"""Answer with mass-spring networks as fitted: springs on a level's edges, whose equilibrium is approached."""

from time import perf_counter
from weakref import WeakKeyDictionary

import numpy as np

from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, Setting
from palpate.models.memory import held_mb
from palpate.models.springs.fit_spring_moduli import Moduli, fit
from palpate.models.springs.spring_statics import Network

REDUCES, LAW = "p2", "springs"
"""They are fitted to its responses."""

_fits: WeakKeyDictionary = WeakKeyDictionary()
"""Moduli and what they took [s], by training samples, level and kind: the fit of one setting serves all."""


def settings(case: Case, nodal: bool, volume: bool) -> list[Setting]:
    """List iterations on the coarse level; of plain springs also on the middle one, where fits take long."""
    grid = case.grid["mass_spring"]
    found = [{"level": 0, "iterations": n} for n in grid["iterations"]]
    if len(case.body.levels) > 2 and not (nodal or volume):
        found += [{"level": 1, "iterations": n} for n in grid["middle_iterations"]]
    return found


def prepare(case: Case, setting: Setting, nodal: bool, volume: bool) -> "SpringsAtRest":
    """Fit moduli to the training samples, and factorise the stiffness at rest.

    nodal : a modulus a node, not one for all; volume : with paper 2's volume force
    Raises InputError for a body that nothing holds, NotConverged if no moduli fit.
    """
    network = Network(case, setting["level"])
    moduli = _fitted(case, network, setting["level"], nodal, volume)
    network.stiffen(moduli.young_pa, moduli.volume_n_m)
    return SpringsAtRest(network, setting["iterations"])


def _fitted(case: Case, network: Network, level: int, nodal: bool, volume: bool) -> Moduli:
    grid, kind = case.grid["mass_spring"], (level, nodal, volume)
    samples = (case.first(grid["middle_samples"]) if level else case).use_training()
    known = _fits.setdefault(case.database, {})
    if kind in known:
        moduli, seconds = known[kind]
        case.charge("moduli", seconds)  # spent before, for another setting
        return moduli
    begin = perf_counter()
    moduli = fit(network, samples, nodal, volume, (grid["evaluations_uniform"], grid["evaluations_nodal"]))
    known[kind] = moduli, perf_counter() - begin
    return moduli


class SpringsAtRest:
    """A network that makes so many quasi-Newton ``iterations`` from rest."""

    def __init__(self, network: Network, iterations: int):
        self._network, self._iterations = network, iterations
        self.memory_mb = held_mb(self)

    def respond(self, load: Load) -> np.ndarray:
        """Return the displacement (n_surface, 3) [m] under ``load``; errors as ``Solver``."""
        network = self._network
        network.press(*load.single())
        return network.up @ (network.approach(self._iterations) - network.rest)
