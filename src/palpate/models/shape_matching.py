"""Answer with shape matching as fitted: clusters of particles that a force presses until they settle."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from palpate.benchmark.database import Database
from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, Solver, held_mb, refuse_regions
from palpate.bodies.mesh import Mesh
from palpate.bodies.particles import particles_of
from palpate.effects import shape_matching
from palpate.effects.bed import BedSprings
from palpate.effects.settings import Clusters, ShapeMatching
from palpate.errors import InputError, NotConverged
from palpate.models import kinds
from palpate.models.fem_statics import ContactShares, to_surface

LEFT = 0.01
"""What damping leaves of a swing after all steps: as little damping as that, or slow modes would not arrive."""
ALPHAS = (1.0, 0.5)
"""The α tried in each fit. At rest goals and load balance at α (x − g) = φ f/m, so only φ/α counts; on the way there
the training samples decide which is better."""
EDGE, SPAN, OVERLAP = 0.25, 2.5, 0.5
"""Of cubes that make clusters: their side in parts of the body's size, but not less than so many of its edges, below
which neighbours share too few particles to hold together; and what part neighbours share."""


def cubes(mesh: Mesh) -> Clusters:
    """Return clusters that suit a mesh."""
    ends = mesh.nodes[mesh.edges]
    mean = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean())
    return Clusters(kind="cubes", edge_m=max(EDGE * mesh.size, SPAN * mean), overlap=OVERLAP)


@dataclass(frozen=True)
class Softness:
    """``scale_s2``, φ = h² [s²] that forces over masses are multiplied by; ``beta``, how far goals follow; and α."""

    scale_s2: float
    beta: float
    alpha: float = 1.0


class Shapes:
    """Particles of the coarse level in clusters. Raises InputError for a body that nothing holds.

    up : (n_surface, n), from particles to the fine surface
    """

    def __init__(self, case: Case, mode: str, clusters: Clusters):
        self.particles = particles_of(case.body, 0, surface=False)
        refuse_regions(case, "shapes")
        # springs of the bed, all at the nodes: the stiffness (n, 1) [N/m] of each over its mass
        beds, nodes = self.particles.beds, len(self.particles.nodes)
        springs = BedSprings(self.particles, beds).lumped if beds else np.zeros(nodes)
        self._springs = (springs / self.particles.masses)[:, None]
        if not len(self.particles.held) and not beds:
            raise InputError(f"{case.body.name}: nothing is held, so shapes do not come to rest; give it anchors.")
        self.up = to_surface(case.body, 0)
        self._mode, self._clusters = mode, clusters
        self._shares = ContactShares(case, 0)

    def soften(self, softness: Softness) -> None:
        """Make its shapes as soft as that."""
        self._scale, self._alpha = softness.scale_s2, softness.alpha
        soft = {"alpha": softness.alpha, "beta": softness.beta}
        matching = ShapeMatching.model_validate({"mode": self._mode, "clusters": self._clusters} | soft)
        self._matching = shape_matching.make(self.particles, matching)

    def settle(self, contact: int, force: np.ndarray, steps: int) -> np.ndarray:
        """Return displacements (n, 3) [m] after so many steps from rest under ``force`` (3,) [N].

        InputError for a contact that cannot be pressed.

        The goal-position scheme in lengths a step, w = h v: w' = d w + α (g − x) + h² f/m, x' = x + w'. Springs of a
        bed are counted at x': they may be stiffer than such a step allows.
        """
        nodes, shares = self._shares.of(contact)
        push = np.zeros_like(self.particles.nodes)
        push[nodes] = self._scale * np.outer(shares / self.particles.masses[nodes], force)
        keep, held = LEFT ** (2.0 / steps), self.particles.held
        rest, springs = self.particles.nodes, self._scale * self._springs
        x, w, goals = self.particles.nodes.copy(), np.zeros_like(push), np.empty_like(push)
        for _ in range(steps):
            self._matching.goals(x, goals)
            goals -= x
            goals *= self._alpha
            w *= keep
            w += goals
            w += push
            w -= springs * (x - rest)
            w /= 1.0 + springs
            w[held] = 0.0
            x += w
        return x - self.particles.nodes


def fit(shapes: Shapes, samples: Database, steps: int, count: int, evaluations: int) -> Softness:
    """Find the softness with the least mean RMSE of peak after so many steps, by the simplex of Nelder and Mead.

    count : of ``samples`` that serve, evenly chosen; evaluations : of the misfit, beyond those of the starts; half of
        them find the better α
    A sample that leaves the finite numbers, or whose error is above its peak, counts as wrong by its peak. Raises
    NotConverged if no softness is better than no answer at all.
    """
    material, size = shapes.particles.material, shapes.particles.size
    chosen = np.unique(np.linspace(0, len(samples.contact) - 1, count).round().astype(int))

    def misfit(scale: float, beta: float, alpha: float) -> float:
        shapes.soften(Softness(float(np.exp(scale)), beta, alpha))
        return float(np.mean([_off(shapes, samples, i, steps) for i in chosen]))

    # how long sound takes across some part of the body: steps of that time move it as far as its material would
    whole = 2.0 * np.log(size * np.sqrt(material.density_kg_m3 / material.young_pa))
    starts = whole - np.arange(1.0, 10.0, 1.5)
    fits = []
    for alpha in ALPHAS:
        begin = np.array([min(starts, key=lambda scale: misfit(scale, 0.5, alpha)), 0.5])
        simplex = begin + np.array([[0.0, 0.0], [-0.7, 0.0], [0.0, 0.3]])
        fits.append((alpha, _descend(partial(misfit, alpha=alpha), simplex, evaluations // 4)))
    alpha, best = min(fits, key=lambda each: each[1].fun)
    simplex = best.x + np.array([[0.0, 0.0], [-0.3, 0.0], [0.0, -0.1 if best.x[1] > 0.5 else 0.1]])
    best = _descend(partial(misfit, alpha=alpha), simplex, evaluations // 2)
    if not best.fun < 1.0:
        raise NotConverged(f"{shapes.particles.name}: no softness of shapes fits the samples; lower the loads", [])
    return Softness(float(np.exp(best.x[0])), float(best.x[1]), alpha)


def _descend(misfit: Callable[[float, float], float], simplex: np.ndarray, evaluations: int) -> OptimizeResult:
    """Lower ``misfit`` of scale and β from a simplex (3, 2)."""
    options = {"maxfev": evaluations, "initial_simplex": simplex}
    bounds = [(None, None), (0.0, 0.99)]
    return minimize(lambda q: misfit(*q), simplex[0], method="Nelder-Mead", bounds=bounds, options=options)


def _off(shapes: Shapes, samples: Database, i: int, steps: int) -> float:
    """Return the RMSE of peak of one sample, 1 at most."""
    with np.errstate(over="ignore", invalid="ignore"):
        off = shapes.up @ shapes.settle(int(samples.contact[i]), samples.force[i], steps) - samples.fine[i]
        rmse = np.sqrt(np.mean(np.sum(off**2, axis=1)))
    return float(min(rmse / samples.peaks[i], 1.0)) if np.isfinite(rmse) else 1.0


SAMPLES, EVALUATIONS = 12, 40
"""Training samples that a fit takes, spread evenly, and evaluations of the misfit in it."""


def prepare(case: Case, model: kinds.ShapeMatching) -> "ShapesAtRest":
    """Fit the scale of forces and β to training samples after as many steps as will be taken.

    Raises InputError for a body that nothing holds, NotConverged if nothing fits.
    """
    shapes = Shapes(case, model.mode, cubes(case.body.coarse).but(kind=model.clusters))
    shapes.soften(fit(shapes, case.use_training(), model.steps, SAMPLES, EVALUATIONS))
    return ShapesAtRest(shapes, model.steps)


class ShapesAtRest(Solver):
    """Shapes that are given so many ``steps`` from rest to settle."""

    memory_mb = 0.0

    def __init__(self, shapes: Shapes, steps: int):
        self._shapes, self._steps = shapes, steps
        self.memory_mb = held_mb(self)

    def respond(self, load: Load) -> np.ndarray:
        return self._shapes.up @ self._shapes.settle(*load.single(), self._steps)
