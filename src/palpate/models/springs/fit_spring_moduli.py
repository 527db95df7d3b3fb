"""Fit moduli of springs, and the stiffness of their volume force, to pressed samples, by the equilibrium's adjoint."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from palpate.benchmark.database import Database
from palpate.effects.volume_force import Volume
from palpate.errors import InputError, NotConverged
from palpate.models.springs.calibration.closed_forms import volume_stiffness
from palpate.models.springs.spring_statics import Network

WIDTH = 10.0
"""Moduli are sought up to so many times above and below the material's."""


@dataclass(frozen=True, eq=False)
class Moduli:
    """The result of a fit: ``young_pa`` (n,) of the nodes, ``volume_n_m``, and the ``misfit``, mean RMSE of peak."""

    young_pa: np.ndarray
    volume_n_m: float
    misfit: float


def fit(network: Network, samples: Database, nodal: bool, volume: bool, evaluations: tuple[int, int]) -> Moduli:
    """Find the moduli with the least mean RMSE of peak over ``samples``; ``network`` is left with some others.

    nodal : a modulus for each node, sought from the best one for all
    volume : with a volume force, whose stiffness is sought too
    evaluations : of the misfit and its gradient, for one modulus and for one a node
    A sample without equilibrium counts as wrong by its whole peak. Raises NotConverged if all are.
    """
    search = _Search(network, samples, volume)
    search.descend(1, evaluations[0], np.append(np.zeros(1), [1.0 / WIDTH] if volume else []))
    if nodal:
        found = search.best
        young = np.log(found.young_pa / network.particles.material.young_pa)
        start = np.append(young, [found.volume_n_m / search.stiff] if volume else [])
        search.descend(len(young), evaluations[1], start)
    if not search.best.misfit < 1.0:
        raise NotConverged(f"{network.particles.name}: no moduli of springs fit the samples; choose lower loads", [])
    return search.best


class _Search:
    """The misfit and its gradient by the unknowns: log E over the material's and, last, κ over ``stiff``."""

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

    def descend(self, count: int, evaluations: int, start: np.ndarray) -> None:
        """Improve on the best, with ``count`` moduli."""
        steepness = float(np.linalg.norm(self._evaluate(start, count)[1]))
        if steepness == 0.0:
            return
        widest = float(np.log(WIDTH))
        bounds = [(-widest, widest)] * count + [(0.0, 1.0)] * (len(start) - count)
        options = {"maxfun": evaluations, "ftol": 1e-4, "gtol": 0.0}

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
        """Return the RMSE of peak of one sample, and its gradient by the moduli (n,) [1/Pa] and by κ [m/N]."""
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
        adjoint = network.adjoint(x, network.up.T @ (off / (rmse * self._peaks[i] * len(off))))
        return (rmse / float(self._peaks[i]), *_slopes(network, x, adjoint))


def _slopes(network: Network, x: np.ndarray, adjoint: np.ndarray) -> tuple[np.ndarray, float]:
    """Multiply ``adjoint`` (n, 3) by the derivatives of the forces at ``x`` by the moduli and by κ."""
    pairs, model = network.model.pairs, network.model
    ends = x[pairs[:, 1]] - x[pairs[:, 0]]
    length = np.linalg.norm(ends, axis=1)
    stretch = np.divide(length - model.rest_m, length, out=np.zeros_like(length), where=length > 0.0)
    along = stretch * np.einsum("si,si->s", ends, adjoint[pairs[:, 0]] - adjoint[pairs[:, 1]])
    by_young = np.bincount(pairs.ravel(), np.repeat(0.5 * model.weights * along, 2), minlength=len(x))
    unit = np.zeros_like(x)
    Volume(network.particles, 1.0).add_force(x, None, unit)
    return by_young, float(np.vdot(adjoint, unit))
