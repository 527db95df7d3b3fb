"""Answer with mass-spring networks, whose moduli are fitted to samples, or forces to those of finite elements.

Pressed, moduli are fitted to training samples by the adjoint of the equilibrium. Under an instrument, kept out by a
penalty at nodes, and on a cut level springs have the moduli of the material (Van Gelder 1998), scaled by the share of
tissue in each element, and under an instrument with a volume force its bulk modulus, too. Forces are multiplied by one
factor, fitted to calibrating touches, or to the hooks before the cut. Springs that the blade crosses are deleted, or
nodes are doubled.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.optimize import minimize

from palpate.benchmark import cut_truth
from palpate.benchmark.cut_truth import Pulled
from palpate.benchmark.database import Database
from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, Setting, Solver, held_mb, on_own_levels, refuse_bed, refuse_regions
from palpate.benchmark.touch import Touch, TouchCase, Touched
from palpate.bodies.cutting.cut import Cut
from palpate.bodies.cutting.ways import Parted, whole
from palpate.bodies.particles import Particles, particles_of
from palpate.effects.bed import BedSprings
from palpate.effects.effect import Effect
from palpate.effects.held import Held
from palpate.effects.instrument import Pose
from palpate.effects.instrument_penalty import NodeContact
from palpate.effects.springs import Springs
from palpate.effects.springs import make as make_springs
from palpate.effects.volume_preservation import Volume
from palpate.errors import InputError, NotConverged
from palpate.linalg.block_pattern import hold, pattern_of, product
from palpate.linalg.minimiser import minimise_by_lbfgs
from palpate.linalg.multigrid import Factor, conjugate_gradients
from palpate.models import kinds
from palpate.models.cut.opened import CutCase, LevelModel, Opened, before_cut
from palpate.models.fem_statics import ContactShares, to_surface
from palpate.models.springs.fitness import volume_stiffness
from palpate.models.springs.spring_motion import spring_model, stiffnesses
from palpate.models.touch.pushing import NodeTouch, Relaxing, calibration, force_scale
from palpate.solvers.pressed_descent import STILL, PressedDescent
from palpate.solvers.system import System

LAW = "springs"
TOLERANCE, REQUIRED_RESIDUAL, MAX_ITERATIONS = 1e-6, 1e-3, 300
"""Residuals relative to the load at which a search ends and which it must reach; and after how many iterations."""


class LoadedSprings:
    """The energy of springs between ``particles``, of their supports and of a load, whose minimum is the equilibrium.

    rest : (n, 3) [m]
    Raises InputError for a body that nothing holds.
    """

    def __init__(self, particles: Particles):
        self.particles, self.rest = particles, particles.nodes
        self._supports: dict[str, Effect] = {"held": Held(particles.held)} if len(particles.held) else {}
        if particles.beds:
            self._supports["bed"] = BedSprings(particles, particles.beds)
        if not self._supports:
            raise InputError(f"{particles.name}: nothing is held, so springs have no equilibrium; give it anchors.")

    def act(self, springs: Effect, **more: Effect) -> None:
        """Replace the springs, and effects beside them; the load is zero."""
        self._system = System(self.particles, {"springs": springs} | self._supports | more)
        self.load(np.zeros_like(self.rest))

    def load(self, force: np.ndarray) -> None:
        """Replace the load by nodal forces ``force`` (n, 3) [N]; those at held nodes are left out."""
        self._load = np.where(self._system.free[:, None], force, 0.0)

    def energy(self, x: np.ndarray) -> float:
        """Return the energy [J] of springs and supports at ``x`` (n, 3) [m], minus the work of the load."""
        return self._system.energy(x) - float(np.vdot(self._load, x - self.rest))

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the force (n, 3) [N] of springs, supports and the load at ``x`` (n, 3) [m], zero at held nodes."""
        return self._system.potential_force(x) + self._load

    def stiffness(self, x: np.ndarray, definite: bool = False) -> sparse.bsr_array:
        """Return the stiffness (3n, 3n) [N/m] at ``x``, held nodes decoupled; ``definite``: clamped per spring."""
        stiffness = self._system.stiffness(x, definite)
        self._system.hold(stiffness)
        return stiffness


class Network(LoadedSprings):
    """Springs on the edges of a level's tetrahedra, and paper 2's volume force if it has a stiffness.

    model : the network without the springs' stiffness, which ``stiffen`` sets
    up : (n_surface, n), from nodes to the fine surface
    """

    def __init__(self, case: Case, level: int):
        refuse_regions(case, "springs")
        super().__init__(particles_of(case.body, level, surface=False))
        self.model = spring_model(self.particles)
        self.up = to_surface(case.body, level)
        self._shares = ContactShares(case, level)

    def stiffen(self, young_pa: np.ndarray, volume_n_m: float) -> None:
        """Set the moduli (n,) [Pa] of nodes (paper 2, eq. 5), and the stiffness of the volume force [N/m]."""
        volume = {"volume": Volume(self.particles, volume_n_m)} if volume_n_m > 0.0 else {}
        self.act(Springs(self.model.pairs, stiffnesses(self.model, young_pa), self.model.rest_m), **volume)
        self._factor = Factor(self.stiffness(self.rest))

    def press(self, contact: int, force: np.ndarray) -> None:
        """Load the network with ``force`` (3,) [N] at coarse node ``contact``; InputError if that cannot be pressed."""
        self.load(self._shares.spread([(contact, force)], len(self.rest)))

    def approach(self, iterations: int, start: np.ndarray | None = None) -> np.ndarray:
        """Return positions (n, 3) [m] after quasi-Newton ``iterations`` from ``start`` or rest.

        From rest the first iteration is the linear answer. NotConverged if not even the first lowers the energy.
        """
        tolerance_n, start = TOLERANCE * float(np.linalg.norm(self._load)), self.rest if start is None else start
        x = minimise_by_lbfgs(self, self._factor.solve, start, tolerance_n, iterations).x
        if x is start and not np.linalg.norm(self.force(x)) <= tolerance_n:
            raise NotConverged(f"{self.particles.name}: springs find no way to give in; check the force", [])
        return x

    def settle(self, start: np.ndarray) -> np.ndarray:
        """Return positions (n, 3) [m] at rest under the load; NotConverged if none are found."""
        x = self.approach(MAX_ITERATIONS, start)
        left = float(np.linalg.norm(self.force(x)) / max(float(np.linalg.norm(self._load)), 1e-300))
        if not left <= REQUIRED_RESIDUAL:
            raise NotConverged(f"{self.particles.name}: springs still move after {MAX_ITERATIONS} iterations", [left])
        return x

    def adjoint(self, x: np.ndarray, by_x: np.ndarray) -> np.ndarray:
        """Return the inverse of the stiffness at ``x`` times ``by_x`` (n, 3): the adjoint of the equilibrium.

        Where the stiffness is not positive definite, this is the last iterate of conjugate gradients.
        """
        stiffness, right = self.stiffness(x), by_x.copy()
        right[self.particles.held] = 0.0
        return conjugate_gradients(
            lambda p: (stiffness @ p.ravel()).reshape(p.shape), self._factor.solve, right, 1e-3, 200
        )[0]


WIDTH = 10.0
"""Moduli are sought up to so many times above and below the material's."""


@dataclass(frozen=True, eq=False)
class Moduli:
    """Fitted ``young_pa`` (n,) of nodes, ``volume_n_m`` of the volume force, and ``misfit``, the mean RMSE of peak."""

    young_pa: np.ndarray
    volume_n_m: float
    misfit: float


def fit_moduli(network: Network, samples: Database, nodal: bool, volume: bool, evaluations: tuple[int, int]) -> Moduli:
    """Return the moduli with the least mean RMSE of peak over ``samples``; ``network`` is left with other ones.

    nodal : whether each node has a modulus, searched for from the best one for all
    volume : whether there is a volume force, whose stiffness is searched for too
    evaluations : of the misfit and its gradient, for one modulus and for one a node
    A sample without equilibrium counts as wrong by its whole peak. NotConverged if all are.
    """
    search = _Search(network, samples, volume)
    search.descend(1, evaluations[0], np.append(np.zeros(1), [1.0 / WIDTH] if volume else []))
    if nodal:
        uniform = search.best
        young = np.log(uniform.young_pa / network.particles.material.young_pa)
        start = np.append(young, [uniform.volume_n_m / search.stiff] if volume else [])
        search.descend(len(young), evaluations[1], start)
    if not search.best.misfit < 1.0:
        raise NotConverged(f"{network.particles.name}: no moduli of springs fit the samples; choose lower loads", [])
    return search.best


class _Search:
    """The misfit of samples and its gradient by the unknowns: log E over the material's and, last, κ over ``stiff``."""

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
        """Lower the misfit by L-BFGS from ``start``, whose first ``count`` unknowns are moduli; ``best`` is updated."""
        steepness = float(np.linalg.norm(self._evaluate(start, count)[1]))  # gradient's norm at the start
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
        """Return the misfit and its gradient by ``unknowns``, and keep the best so far.

        The first ``count`` unknowns are moduli, of the whole body or of each node; the last is κ where there is one.
        """
        nodes, samples = len(self._network.rest), len(self._peaks)
        young = self._young * np.exp(np.broadcast_to(unknowns[:count], nodes))
        volume = float(unknowns[-1]) * self.stiff
        self._network.stiffen(young, volume)
        of_samples = [self._sample(i) for i in range(samples)]
        misfit = sum(sample[0] for sample in of_samples) / samples
        if misfit < self.best.misfit:
            self.best = Moduli(young, volume, misfit)
        slopes = young * sum(sample[1] for sample in of_samples)
        slopes = slopes if count > 1 else slopes.sum(keepdims=True)
        by_volume = [self.stiff * sum(sample[2] for sample in of_samples)] if self.stiff else []
        return misfit, np.append(slopes, by_volume) / samples

    def _sample(self, i: int) -> tuple[float, np.ndarray, float]:
        """Return sample ``i``'s RMSE of peak, and its gradient by the moduli (n,) [1/Pa] and by κ [m/N]."""
        network, no_gradient = self._network, (np.zeros(len(self._network.rest)), 0.0)
        network.press(int(self._samples.contact[i]), self._samples.force[i])
        try:
            x = network.settle(self._reached[i])
        except NotConverged:
            self._reached[i] = network.rest
            return (1.0, *no_gradient)
        self._reached[i] = x
        error = network.up @ (x - network.rest) - self._samples.fine[i]
        rmse = float(np.sqrt(np.mean(np.sum(error**2, axis=1))))
        if rmse == 0.0:
            return (0.0, *no_gradient)
        adjoint = network.adjoint(x, network.up.T @ (error / (rmse * self._peaks[i] * len(error))))
        return (rmse / float(self._peaks[i]), *_slopes(network, x, adjoint))


def _slopes(network: Network, x: np.ndarray, adjoint: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the derivatives of ``adjoint`` · f, f the forces at ``x`` (n, 3) [m], by the nodes' moduli and by κ."""
    pairs, model = network.model.pairs, network.model
    span = x[pairs[:, 1]] - x[pairs[:, 0]]
    length = np.linalg.norm(span, axis=1)
    stretch = np.divide(length - model.rest_m, length, out=np.zeros_like(length), where=length > 0.0)
    along = stretch * np.einsum("si,si->s", span, adjoint[pairs[:, 0]] - adjoint[pairs[:, 1]])
    by_young = np.bincount(pairs.ravel(), np.repeat(0.5 * model.weights * along, 2), minlength=len(x))
    unit_force = np.zeros_like(x)
    Volume(network.particles, 1.0).add_force(x, None, unit_force)
    return by_young, float(np.vdot(adjoint, unit_force))


EVALUATIONS = 8, 40
"""Evaluations of the misfit and its gradient, when one modulus serves all nodes and when each has its own."""


def prepare(case: Case, model: kinds.Springs) -> Solver:
    """Return springs fitted to the training samples, once for all iterations, with the stiffness at rest factorised.

    InputError for a body that nothing holds, NotConverged if no moduli fit.
    """
    network, kind = Network(case, model.level), (model.nodal, model.volume)
    samples = (case if model.samples is None else case.first(model.samples)).use_training()
    name = "moduli", case.database, model.level, model.samples, *kind
    moduli = case.share(name, lambda: fit_moduli(network, samples, *kind, EVALUATIONS), "moduli")
    network.stiffen(moduli.young_pa, moduli.volume_n_m)
    return SpringsAtRest(network, model.iterations)


class SpringsAtRest(Solver):
    """A network that makes so many quasi-Newton ``iterations`` from rest."""

    memory_mb = 0.0

    def __init__(self, network: Network, iterations: int):
        self._network, self._iterations = network, iterations
        self.memory_mb = held_mb(self)

    def respond(self, load: Load) -> np.ndarray:
        """Return the displacement (n_surface, 3) [m] under ``load``; errors as ``Solver``."""
        network = self._network
        network.press(*load.single())
        return network.up @ (network.approach(self._iterations) - network.rest)


PENALTY, MEMORY = 100.0, 8
"""Stiffness of a node's contact over its own, and steps remembered; the residual is relative to the push before."""
CALIBRATING_ITERATIONS = 100
"""Iterations with which springs are calibrated: a factor is that of springs at rest, whatever a setting affords."""


def settings(case: TouchCase, volume: bool) -> list[Setting]:
    """List levels that the body has, and iterations."""
    return on_own_levels(case, case.grid.springs)


class SpringsTouch(NodeTouch):
    """A network that makes so many quasi-Newton ``iterations`` at each step of the instrument.

    InputError for a body that nothing holds, LeftOut for one on a bed, NotConverged for one of several stiffnesses.
    """

    def __init__(self, case: TouchCase, level: int, iterations: int, volume: bool):
        refuse_bed(case, "springs that are calibrated under an instrument")  # a factor would stiffen the bed
        refuse_regions(case, "springs")
        super().__init__(case, level)
        particles = particles_of(case.body, level, surface=False)
        network, springs = LoadedSprings(particles), make_springs(particles, None)
        kappa = volume_stiffness(spring_model(particles), particles.material) if volume else 0.0
        volumes = {"volume": Volume(particles, kappa)} if kappa > 0.0 else {}
        network.act(springs, **volumes)
        matrix = network.stiffness(network.rest)
        self._penalty = PENALTY * matrix.diagonal().reshape(-1, 3).mean(axis=1)
        self._solve, self._own = Factor(matrix).solve, [springs, *volumes.values()]
        self._iterations, self._scale = CALIBRATING_ITERATIONS, 1.0
        self._scale = case.share(("factor of springs", level, volume), lambda: self._fitted(case))
        self._iterations = iterations

    def _fitted(self, case: TouchCase) -> float:
        touches, right = zip(*calibration(case), strict=True)
        return force_scale([self.respond(touch) for touch in touches], right)

    def respond(self, touch: Touch) -> Touched:
        touched = super().respond(touch)
        return touched._replace(force_n=self._scale * touched.force_n, reaction_n=self._scale * touched.reaction_n)

    def begin(self, nodes: np.ndarray, pose: Pose) -> Relaxing:
        contact = NodeContact(nodes, self._penalty[nodes], pose)
        descent = PressedDescent(self._own, contact, self.held, self._solve, isotropic=False)
        return Relaxing(contact, lambda x: descent.relax(x, self._iterations, MEMORY, TOLERANCE), contact.pushes)

    def supported(self, x: np.ndarray) -> np.ndarray:
        force = np.zeros_like(x)
        for effect in self._own:
            effect.add_force(x, STILL, force)
        return force[self.held].sum(axis=0)


online = SpringsTouch


DELETED = "deleted"
LIFT = 1e-4
"""Stiffness added to every node of the preconditioner, over the mean: where springs are deleted, nodes hang loosely."""


@dataclass(frozen=True, eq=False)
class Torn(Parted):
    """A cut level whose nodes are as before, while the springs that the cut crosses are deleted.

    Points of the skin follow those corners of their triangle that are on their own side of the ``cuts``.
    """

    cuts: Sequence[Cut]

    def interpolation(self, rows: sparse.csr_array, sides: np.ndarray) -> sparse.csr_array:
        """Return interpolation ``rows`` to k points, less corners on another side of a cut than ``sides`` (k, cuts)."""
        rows = sparse.csr_array(rows)
        entry_row, places = np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr)), rows @ self.whole.nodes
        same_side = np.ones(len(entry_row), dtype=bool)
        for c, cut in enumerate(self.cuts):
            node_sides = np.where(cut.across(self.whole.nodes) >= 0.0, 1, -1)
            same_side &= (node_sides[rows.indices] == sides[entry_row, c]) | (cut.within(places) <= 0.0)[entry_row]
        same_side |= (np.bincount(entry_row, same_side * rows.data, minlength=rows.shape[0]) <= 0.0)[entry_row]
        sums = np.bincount(entry_row, same_side * rows.data, minlength=rows.shape[0])
        return sparse.csr_array((same_side * rows.data / sums[entry_row], rows.indices, rows.indptr), shape=rows.shape)


class CutSprings(LevelModel):
    """Springs of a cut level, which make so many quasi-Newton ``iterations`` from their linear answer."""

    def __init__(self, case: CutCase, level: int, way: str, iterations: int):
        super().__init__(case, level, way)
        self._iterations, self._factor = CALIBRATING_ITERATIONS, 1.0
        self._ready(self._looked_at(whole(case.body, level, 0)))
        own_force, reference_force = self.pull().force, before_cut(case, level)[1]
        self._factor, self._iterations = float(own_force @ reference_force / (own_force @ own_force)), iterations

    def cut(self, cuts: Sequence[Cut]) -> None:
        if self._way != DELETED:
            self._ready(self._part(cuts))
            return
        before = whole(self.case.body, self._level, len(cuts))
        self._ready(self._looked_at(Torn(**vars(before), cuts=cuts), cuts), deleted=cuts)

    def _ready(self, cut: Opened, deleted: Sequence[Cut] = ()) -> None:
        """Build the springs of ``cut`` without those that the cuts ``deleted`` cross, and their preconditioner."""
        self._opened, rest = cut, cut.rest
        particles = particles_of(cut.parted.body, 0, surface=False)
        model = spring_model(particles)
        uncrossed = np.ones(len(model.pairs), dtype=bool)
        for each in deleted:
            uncrossed &= ~each.severs(*np.swapaxes(rest[model.pairs], 0, 1))
        stiffness = particles.material.young_pa * model.weights
        self._springs = Springs(model.pairs[uncrossed], stiffness[uncrossed], model.rest_m[uncrossed])
        self._still = cut.held | cut.moved
        # the stiffness at rest, lifted where nodes hang loosely, and its inverse with still nodes apart
        pattern = pattern_of(self._springs.couples, len(rest))
        values = np.zeros((len(pattern.indices), 3, 3))
        self._springs.add_stiffness(rest, True, pattern.slots[0], values)
        values[pattern.diagonal] += LIFT * np.trace(values[pattern.diagonal].mean(axis=0)) / 3.0 * np.eye(3)
        matrix = pattern.matrix(values)
        self._stiffness = product(matrix)
        clamped = matrix.copy()
        hold(clamped.indptr, clamped.indices, clamped.data, self._still)
        self._solve = Factor(clamped).solve

    def pull(self) -> Pulled:
        cut, start = self._opened, self._linear()
        tolerance_n = cut_truth.TOLERANCE * float(np.linalg.norm(self._free_force(start)[cut.moved]))
        descent = minimise_by_lbfgs(self, self._solve, start, tolerance_n, self._iterations)
        if not np.isfinite(descent.x).all():
            raise NotConverged("springs left the finite numbers", descent.forces)
        return cut.answer(descent.x, self._factor * self._free_force(descent.x))

    def _linear(self) -> np.ndarray:
        """Return the positions (n, 3) [m] of the linearised network under the hooks' motion."""
        cut = self._opened
        left = -self._stiffness(cut.shifts)
        left[self._still] = 0.0
        return cut.rest + cut.shifts + self._solve(left)

    def energy(self, x: np.ndarray) -> float:
        return self._springs.energy(x)

    def force(self, x: np.ndarray) -> np.ndarray:
        force = self._free_force(x)
        force[self._still] = 0.0
        return force

    def _free_force(self, x: np.ndarray) -> np.ndarray:
        force = np.zeros_like(x)
        self._springs.add_force(x, None, force)
        return force
