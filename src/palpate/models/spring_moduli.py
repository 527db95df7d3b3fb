"""Moduli of springs, and the stiffness of their volume force, from pressed samples: by the equilibrium's adjoint."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from palpate.calibration.closed_forms import volume_stiffness
from palpate.effects.volume import Volume
from palpate.errors import InputError, NotConverged
from palpate.models.spring_statics import Network
from palpate.samples.database import Database

WIDTH = 10.0
"""Moduli are sought up to so many times above and below the material's."""
EVALUATIONS = {False: 8, True: 40}
"""Of the misfit and its slopes: for one modulus, and for one a node."""


@dataclass(frozen=True, eq=False)
class Moduli:
    """What was found: ``young_pa`` (n,) of the nodes, ``volume_n_m``, and the ``misfit``, mean RMSE of peak."""

    young_pa: np.ndarray
    volume_n_m: float
    misfit: float


def fit(network: Network, samples: Database, nodal: bool, volume: bool) -> Moduli:
    """The moduli with the least mean RMSE of peak over ``samples``; ``network`` is left with some others.

    nodal : a modulus a node, sought from the best one for all; volume : with a volume force, of a stiffness sought too
    A sample without equilibrium counts as wrong by its whole peak. Raises NotConverged if all are.
    """
    search = _Search(network, samples, volume)
    search.descend(1, np.append(np.zeros(1), [1.0 / WIDTH] if volume else []))
    if nodal:
        found = search.best
        young = np.log(found.young_pa / network.particles.material.young_pa)
        search.descend(len(young), np.append(young, [found.volume_n_m / search.stiff] if volume else []))
    if not search.best.misfit < 1.0:
        raise NotConverged(f"{network.particles.name}: no moduli of springs fit the samples; choose lower loads", [])
    return search.best


class _Search:
    """The misfit and its slopes by the unknowns: log E over the material's and, last, κ over ``stiff``."""

    def __init__(self, network: Network, samples: Database, volume: bool):
        self._network, self._samples = network, samples
        self._young = network.particles.material.young_pa
        # what springs need for the bulk modulus of a Poisson ratio of 0.4, ten times: they lack none at 1/4
        bulky = replace(network.particles.material, poisson=0.4)
        self.stiff = WIDTH * volume_stiffness(network.model, bulky) if volume else 0.0
        self._peaks = samples.peaks
        if not (self._peaks > 0.0).all():
            raise InputError(f"{network.particles.name}: a training sample moves nowhere; leave it out.")
        self._reached = [network.rest] * len(self._peaks)
        self.best = Moduli(np.full(len(network.rest), self._young), 0.0, np.inf)

    def descend(self, count: int, start: np.ndarray) -> None:
        """Better the best, with ``count`` moduli."""
        steepness = float(np.linalg.norm(self._evaluate(start, count)[1]))
        if steepness == 0.0:
            return
        widest = float(np.log(WIDTH))
        bounds = [(-widest, widest)] * count + [(0.0, 1.0)] * (len(start) - count)
        options = {"maxfun": EVALUATIONS[count > 1], "ftol": 1e-4, "gtol": 0.0}

        def cost(unknowns):  # steps of the order of 1, whatever the number of moduli
            value, slopes = self._evaluate(unknowns, count)
            return value / steepness, slopes / steepness

        minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options)

    def _evaluate(self, unknowns: np.ndarray, count: int) -> tuple[float, np.ndarray]:
        nodes, samples = len(self._network.rest), len(self._peaks)
        young = self._young * np.exp(np.broadcast_to(unknowns[:count], nodes))
        volume = float(unknowns[-1]) * self.stiff
        self._network.stiffen(young, volume)
        parts = [self._sample(i) for i in range(samples)]
        misfit = sum(part[0] for part in parts) / samples
        if misfit < self.best.misfit:
            self.best = Moduli(young, volume, misfit)
        slopes = young * sum(part[1] for part in parts)
        slopes = slopes if count > 1 else slopes.sum(keepdims=True)
        by_volume = [self.stiff * sum(part[2] for part in parts)] if self.stiff else []
        return misfit, np.append(slopes, by_volume) / samples

    def _sample(self, i: int) -> tuple[float, np.ndarray, float]:
        """RMSE of peak of one sample, and its slopes by the moduli (n,) [1/Pa] and by κ [m/N]."""
        network, nothing = self._network, (np.zeros(len(self._network.rest)), 0.0)
        network.press(int(self._samples.contact[i]), self._samples.force[i])
        try:
            x = network.settle(self._reached[i])
        except NotConverged:
            self._reached[i] = network.rest
            return (1.0, *nothing)
        self._reached[i] = x
        off = network.up @ (x - network.rest) - self._samples.fine[i]
        rmse = float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
        if rmse == 0.0:
            return (0.0, *nothing)
        pull = network.pull(x, network.up.T @ (off / (rmse * self._peaks[i] * len(off))))
        return (rmse / float(self._peaks[i]), *_slopes(network, x, pull))


def _slopes(network: Network, x: np.ndarray, pull: np.ndarray) -> tuple[np.ndarray, float]:
    """``pull`` (n, 3) times the slopes of the forces at ``x`` by the moduli and by κ."""
    pairs, model = network.model.pairs, network.model
    ends = x[pairs[:, 1]] - x[pairs[:, 0]]
    length = np.linalg.norm(ends, axis=1)
    stretch = np.divide(length - model.rest_m, length, out=np.zeros_like(length), where=length > 0.0)
    along = stretch * np.einsum("si,si->s", ends, pull[pairs[:, 0]] - pull[pairs[:, 1]])
    by_young = np.bincount(pairs.ravel(), np.repeat(0.5 * model.weights * along, 2), minlength=len(x))
    unit = np.zeros_like(x)
    Volume(network.particles, 1.0).add_force(x, None, unit)
    return by_young, float(np.vdot(pull, unit))
