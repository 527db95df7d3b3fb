"""Mass-spring models as fitted: springs on a level's edges, whose equilibrium under a force is approached."""

from time import perf_counter
from weakref import WeakKeyDictionary

import numpy as np

from palpate.models.memory import held_mb
from palpate.models.model import Case, Setting, checked
from palpate.models.spring_moduli import Moduli, fit
from palpate.models.spring_statics import Network

ITERATIONS = (1, 2, 3, 5, 8, 12, 20)
MIDDLE = (5, 12)
"""Iterations on the coarse level and, where the body has one, on the middle level."""

FEWER = 20
"""Training samples that serve one modulus on the middle level."""

_fits: WeakKeyDictionary = WeakKeyDictionary()
"""Moduli and what they took [s], by training samples, level and kind: what one setting setting has found serves all."""


def settings(case: Case, nodal: bool, volume: bool) -> list[Setting]:
    """Iterations on the coarse level; of plain springs also on the middle one, where fits take long."""
    found = [{"level": 0, "iterations": n} for n in ITERATIONS]
    if len(case.body.levels) > 2 and not (nodal or volume):
        found += [{"level": 1, "iterations": n} for n in MIDDLE]
    return found


def prepare(case: Case, setting: Setting, nodal: bool, volume: bool) -> "SpringsAtRest":
    """Fit moduli to the training samples, and factorise the stiffness at rest.

    nodal : a modulus a node, not one for all; volume : with paper 2's volume force
    Raises InputError for a body that nothing holds, NotConverged if no moduli fit.
    """
    network = Network(case, setting["level"])
    moduli = _fitted(case, network, setting["level"], nodal, volume)
    network.stiffen(moduli.young_pa, moduli.volume_n_m)
    return SpringsAtRest(network, setting["iterations"], case.n_surface)


def _fitted(case: Case, network: Network, level: int, nodal: bool, volume: bool) -> Moduli:
    samples, kind = (case.first(FEWER) if level else case).training, (level, nodal, volume)
    known = _fits.setdefault(case.database, {})
    if kind in known:
        moduli, seconds = known[kind]
        case.used["moduli"] = seconds  # paid before, and no cheaper for that
        return moduli
    begin = perf_counter()
    moduli = fit(network, samples, nodal, volume)
    known[kind] = moduli, perf_counter() - begin
    return moduli


class SpringsAtRest:
    """A network that is asked for so many quasi-Newton ``iterations`` from rest."""

    def __init__(self, network: Network, iterations: int, n_surface: int):
        self._network, self._iterations, self._n_surface = network, iterations, n_surface
        self.memory_mb = held_mb(self)

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Displacement (n_surface, 3) [m] under ``force`` (3,) [N]; NotConverged, InputError for a bad contact."""
        network = self._network
        network.press(contact, force)
        return checked(network.up @ (network.approach(self._iterations) - network.rest), self._n_surface)
