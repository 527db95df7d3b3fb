"""Answer with shape matching as fitted: clusters of particles that settle, pressed, under an instrument or cut.

Pressed, the stiffness of goals β, α and the scale of forces are fitted to training samples. Under an instrument, which
pushes particles out of itself in every step, the force is the momentum of these pushes over the time of a step, as a
mean over the later half of the steps; β is fitted to the displacement under calibrating touches, and the time of a step
to their forces. On a cut level, clusters that the cut severs are split; β is fitted to quadratic elements before the
cut, and one factor of the hooks' forces to theirs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from palpate.benchmark.cut_truth import Pulled
from palpate.benchmark.database import Database
from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, Setting, Solver, held_mb, on_own_levels, refuse_bed, refuse_regions
from palpate.benchmark.touch import TouchCase, Touched
from palpate.bodies.cutting.cut import Cut
from palpate.bodies.cutting.ways import VIRTUAL_NODES, Parted, whole
from palpate.bodies.mesh import Mesh
from palpate.bodies.particles import Particles, particles_of
from palpate.effects import settings as effects
from palpate.effects import shape_matching
from palpate.effects.bed import BedSprings
from palpate.effects.instrument import Pose
from palpate.effects.shape_matching import Clusters, ShapeMatching
from palpate.errors import InputError, NotConverged
from palpate.models import kinds
from palpate.models.cut.opened import CutCase, LevelModel, Opened, before_cut
from palpate.models.fem_statics import ContactShares, to_surface
from palpate.models.touch.pushing import NodeTouch, Relaxing, calibration, dragged, force_scale
from palpate.solvers.xpbd import InstrumentConstraints

LAW = "shape matching"
LEFT = 0.01
"""What damping leaves of a swing after all steps: as little damping as that, or slow modes would not arrive."""
ALPHAS = (1.0, 0.5)
"""The α tried in each fit. At rest goals and load balance at α (x − g) = φ f/m, so only φ/α counts; on the way there
the training samples decide which is better."""
BETAS = (0.0, 0.3, 0.6, 0.8, 0.95)
"""Shares of the deformation in the goals that are tried under an instrument and of a cut body."""
EDGE, SPAN, OVERLAP = 0.25, 2.5, 0.5
"""Of cubes that make clusters: their side in parts of the body's size, but not less than so many of its edges, below
which neighbours share too few particles to hold together; and what part neighbours share."""


def cubes(mesh: Mesh) -> effects.Clusters:
    """Return clusters of particles in overlapping cubes, of a size that suits ``mesh``."""
    ends = mesh.nodes[mesh.edges]
    mean = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean())
    return effects.Clusters(kind="cubes", edge_m=max(EDGE * mesh.size, SPAN * mean), overlap=OVERLAP)


def settle(
    matching: ShapeMatching,
    x: np.ndarray,
    still: np.ndarray,
    steps: int,
    load: Callable[[np.ndarray, np.ndarray], None] | None = None,
    keep_out: Callable[[int, np.ndarray], None] | None = None,
) -> np.ndarray:
    """Return positions (n, 3) [m] after so many ``steps`` of shape matching from rest at ``x``.

    The goal-position scheme in lengths a step, w = h v: w' = d w + α (g − x), x' = x + w'.
    still : nodes that do not move; load : changes w' (n, 3) [m] in place, called with x and w'
    keep_out : corrects x' in place, called with the step's number and x'; w' is then x' − x
    """
    keep, w, goals = LEFT ** (2.0 / steps), np.zeros_like(x), np.empty_like(x)
    for step in range(steps):
        matching.goals(x, goals)
        goals -= x
        goals *= matching.alpha
        w *= keep
        w += goals
        if load is not None:
            load(x, w)
        w[still] = 0.0
        moved = x + w
        if keep_out is not None:
            keep_out(step, moved)
            w = moved - x
        x = moved
    return x


def refuse_loose(particles: Particles, bedded: bool) -> None:
    """Raise InputError for a body that nothing holds."""
    if not len(particles.held) and not bedded:
        raise InputError(f"{particles.name}: nothing is held, so shapes do not come to rest; give it anchors.")


@dataclass(frozen=True)
class Softness:
    """Fitted numbers: ``scale_s2`` φ = h² [s²], which multiplies forces over masses, ``beta`` of goals, and α."""

    scale_s2: float
    beta: float
    alpha: float = 1.0


class Shapes:
    """Particles of the coarse level in clusters. InputError for a body that nothing holds.

    up : (n_surface, n), from particles to the fine surface
    """

    def __init__(self, case: Case, mode: str, clusters: effects.Clusters):
        self.particles = particles_of(case.body, 0, surface=False)
        refuse_regions(case, "shapes")
        # springs of the bed, all at the nodes: the stiffness (n, 1) [N/m] of each over its mass
        beds, nodes = self.particles.beds, len(self.particles.nodes)
        springs = BedSprings(self.particles, beds).lumped if beds else np.zeros(nodes)
        self._springs = (springs / self.particles.masses)[:, None]
        refuse_loose(self.particles, bool(beds))
        self.up = to_surface(case.body, 0)
        self._mode, self._clusters = mode, clusters
        self._shares = ContactShares(case, 0)

    def soften(self, softness: Softness) -> None:
        """Set how soft the shapes are."""
        self._scale = softness.scale_s2
        asked = {"mode": self._mode, "clusters": self._clusters, "alpha": softness.alpha, "beta": softness.beta}
        self._matching = shape_matching.make(self.particles, effects.ShapeMatching.model_validate(asked))

    def settle(self, contact: int, force: np.ndarray, steps: int) -> np.ndarray:
        """Return displacements (n, 3) [m] after so many ``steps`` from rest under ``force`` (3,) [N] at ``contact``.

        Springs of a bed act implicitly, as they may be stiffer than an explicit step allows. InputError for a contact
        that cannot be pressed.
        """
        nodes, shares = self._shares.of(contact)
        rest, springs = self.particles.nodes, self._scale * self._springs
        push = np.zeros_like(rest)
        push[nodes] = self._scale * np.outer(shares / self.particles.masses[nodes], force)

        def load(x: np.ndarray, w: np.ndarray) -> None:
            w += push
            w -= springs * (x - rest)
            w /= 1.0 + springs

        return settle(self._matching, rest, self.particles.held, steps, load) - rest


def fit(shapes: Shapes, samples: Database, steps: int, count: int, evaluations: int) -> Softness:
    """Return the softness with the least mean RMSE of peak after ``steps`` steps, by the simplex of Nelder and Mead.

    count : of ``samples`` that serve, evenly chosen
    evaluations : of the misfit, beyond those of the starts; half of them find the better α
    A sample with an error above its peak, or without a finite answer, counts as wrong by its peak. NotConverged if no
    softness is better than no answer at all.
    """
    material, size = shapes.particles.material, shapes.particles.size
    chosen = np.unique(np.linspace(0, len(samples.contact) - 1, count).round().astype(int))

    def misfit(scale: float, beta: float, alpha: float) -> float:
        shapes.soften(Softness(float(np.exp(scale)), beta, alpha))
        return float(np.mean([_off(shapes, samples, i, steps) for i in chosen]))

    # logs of h², h the time that sound takes across the body or a part of it: such steps move it as its material would
    log_crossing = 2.0 * np.log(size * np.sqrt(material.density_kg_m3 / material.young_pa))
    starts = log_crossing - np.arange(1.0, 10.0, 1.5)  # of log h²
    fits = []
    for alpha in ALPHAS:
        start = np.array([min(starts, key=lambda scale: misfit(scale, 0.5, alpha)), 0.5])
        simplex = start + np.array([[0.0, 0.0], [-0.7, 0.0], [0.0, 0.3]])
        fits.append((alpha, _descend(partial(misfit, alpha=alpha), simplex, evaluations // 4)))
    alpha, fitted = min(fits, key=lambda each: each[1].fun)
    simplex = fitted.x + np.array([[0.0, 0.0], [-0.3, 0.0], [0.0, -0.1 if fitted.x[1] > 0.5 else 0.1]])
    fitted = _descend(partial(misfit, alpha=alpha), simplex, evaluations // 2)
    if not fitted.fun < 1.0:
        raise NotConverged(f"{shapes.particles.name}: no softness of shapes fits the samples; lower the loads", [])
    return Softness(float(np.exp(fitted.x[0])), float(fitted.x[1]), alpha)


def _descend(misfit: Callable[[float, float], float], simplex: np.ndarray, evaluations: int) -> OptimizeResult:
    """Lower ``misfit`` of scale and β from a simplex (3, 2)."""
    options = {"maxfev": evaluations, "initial_simplex": simplex}
    bounds = [(None, None), (0.0, 0.99)]
    return minimize(lambda q: misfit(*q), simplex[0], method="Nelder-Mead", bounds=bounds, options=options)


def _off(shapes: Shapes, samples: Database, i: int, steps: int) -> float:
    """Return the RMSE of sample ``i`` over its peak, 1 at most."""
    with np.errstate(over="ignore", invalid="ignore"):
        error = shapes.up @ shapes.settle(int(samples.contact[i]), samples.force[i], steps) - samples.fine[i]
        rmse = np.sqrt(np.mean(np.sum(error**2, axis=1)))
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
    """Shapes that settle for so many ``steps`` from rest."""

    memory_mb = 0.0

    def __init__(self, shapes: Shapes, steps: int):
        self._shapes, self._steps = shapes, steps
        self.memory_mb = held_mb(self)

    def respond(self, load: Load) -> np.ndarray:
        return self._shapes.up @ self._shapes.settle(*load.single(), self._steps)


def settings(case: TouchCase) -> list[Setting]:
    """List level, mode, clusters and steps, from cheap to expensive."""
    return on_own_levels(case, case.grid.shape_matching)


class ShapesTouch(NodeTouch):
    """Shapes that settle for so many ``steps`` wherever the instrument stops on its way.

    InputError for a body that nothing holds, or that its clusters do not hold together; LeftOut for one on a bed;
    NotConverged for one of several stiffnesses, or whose calibrating touches are not felt.
    """

    def __init__(
        self, case: TouchCase, level: int, mode: Literal["rigid", "linear", "quadratic"], clusters: str, steps: int
    ):
        refuse_bed(case, "shapes")
        refuse_regions(case, "shapes")
        super().__init__(case, level)
        particles = particles_of(case.body, level, surface=False)
        refuse_loose(particles, False)
        self._steps, self._masses, self._step_s = steps, particles.masses, 1.0
        grouped = cubes(self.mesh).but(kind=clusters)
        touches, references = zip(*calibration(case), strict=True)
        trials = []
        for alpha in ALPHAS:
            for beta in BETAS:
                options = effects.ShapeMatching(mode=mode, alpha=alpha, beta=beta, clusters=grouped)
                self._matching = shape_matching.make(particles, options)
                answers = [self.respond(touch) for touch in touches]
                errors = [_rmse(answer, reference) for answer, reference in zip(answers, references, strict=True)]
                trials.append((float(np.mean(errors)), self._matching, answers))
        least_error, self._matching, answers = min(trials, key=lambda each: each[0])
        if not np.isfinite(least_error):
            raise NotConverged(f"{case.body.name}: shapes do not come to rest under any touch", [float("nan")])
        # a force is a momentum over a step's time, so that it grows with the inverse of the step's square
        self._step_s = 1.0 / np.sqrt(force_scale(answers, references))

    def begin(self, nodes: np.ndarray, pose: Pose) -> Relaxing:
        obstacle, inverse = InstrumentConstraints(nodes, pose), np.where(self.held, 0.0, 1.0 / self._masses)
        mean_pushes, first_averaged = np.zeros((len(nodes), 3)), self._steps // 2

        def keep_out(step: int, moved: np.ndarray) -> None:
            obstacle.multipliers = np.zeros(len(nodes))
            obstacle.keep_out(moved, inverse)
            if step >= first_averaged:  # particles bounce, so that single steps tell little
                mean_pushes[:] += obstacle.pushes(moved, self._step_s) / (self._steps - first_averaged)

        def relax(x: np.ndarray) -> np.ndarray:
            mean_pushes[:] = 0.0
            return settle(self._matching, x, self.held, self._steps, keep_out=keep_out)

        return Relaxing(obstacle, relax, lambda x: mean_pushes)

    def supported(self, x: np.ndarray) -> np.ndarray:
        goals = np.empty_like(x)
        self._matching.goals(x, goals)
        pulls = self._matching.alpha / self._step_s**2 * self._masses[:, None] * (goals - x)
        return pulls[self.held].sum(axis=0)


def _rmse(answer: Touched, reference: Touched) -> float:
    """Return the RMSE of ``one`` displacement from the ``other`` over its peak, ∞ if it is not a number."""
    rmse = np.sqrt(np.mean(np.sum((answer.displacement - reference.displacement) ** 2, axis=1)))
    peak = np.linalg.norm(reference.displacement, axis=1).max()
    return float(rmse / peak) if np.isfinite(rmse) else np.inf


online = ShapesTouch


class CutShapes(LevelModel):
    """Shapes of a cut body that settle for so many ``steps`` at each stop of the hooks."""

    def __init__(self, case: CutCase, level: int, mode: str, clusters: str, steps: int, way: str = VIRTUAL_NODES):
        super().__init__(case, level, way)
        self._steps, self._mode, uncut_body = steps, mode, whole(case.body, level, 0)
        refuse_regions(case, "shapes")
        self._clusters = shape_matching.make_clusters(
            particles_of(uncut_body.body, 0, surface=False), cubes(uncut_body.mesh).but(kind=clusters)
        )
        reference, reference_forces = before_cut(case, level)
        uncut, trials = self._looked_at(uncut_body), []
        for beta in BETAS:
            self._beta = beta
            self._ready(uncut, self._clusters)
            x, force = self._settled()
            trials.append((float(np.linalg.norm(x - uncut.rest - reference)), beta, uncut.answer(x, force).force))
        _, self._beta, own_forces = min(trials, key=lambda each: each[0])
        self._factor = float(own_forces @ reference_forces / (own_forces @ own_forces))

    def cut(self, cuts: Sequence[Cut]) -> None:
        cut = self._part(cuts)
        self._ready(cut, split(self._clusters, cut.parted, cuts))

    def _ready(self, cut: Opened, clusters: Clusters) -> None:
        particles = particles_of(cut.parted.body, 0, surface=False)
        self._opened, self._masses, self._still = cut, particles.masses[:, None], cut.held | cut.moved
        self._matching = ShapeMatching(particles, clusters, self._mode, 1.0, self._beta)

    def pull(self) -> Pulled:
        x, force = self._settled()
        return self._opened.answer(x, self._factor * force)

    def _settled(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m], and masses times displacements to goals (n, 3) [kg m]."""
        cut = self._opened
        relax = partial(settle, self._matching, still=self._still, steps=self._steps)
        x = dragged(cut.rest, cut.moved, cut.shifts, relax)
        goals = np.empty_like(x)
        self._matching.goals(x, goals)
        if not np.isfinite(goals).all():
            raise NotConverged("shapes left the finite numbers", [float("nan")])
        return x, self._masses * (goals - x)


def split(clusters: Clusters, parted: Parted, cuts: Sequence[Cut]) -> Clusters:
    """Return the clusters of a whole mesh on its ``parted`` one, divided where the cuts sever them.

    A cluster has all copies of its nodes. Nodes on the other side of a cut than the cluster's middle are another part
    if the cut is between (Steinemann, Otaduy and Gross 2006), or has doubled them.
    """
    # all copies of each cluster's nodes, in ``nodes``, and the cluster of each, its ``owner``
    copies = np.bincount(parted.origin, minlength=len(parted.whole.nodes))
    first_copy = np.cumsum(copies) - copies
    owner = np.repeat(np.arange(len(clusters.starts) - 1), np.diff(clusters.starts))
    middles = (
        np.add.reduceat(parted.whole.nodes[clusters.members], clusters.starts[:-1]) / np.diff(clusters.starts)[:, None]
    )
    counts = copies[clusters.members]
    copy_number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    nodes = np.argsort(parted.origin, kind="stable")[np.repeat(first_copy[clusters.members], counts) + copy_number]
    owner, places, part = np.repeat(owner, counts), parted.mesh.nodes, np.zeros(counts.sum(), dtype=np.int64)
    corners = parted.mesh.tetrahedra
    # the part of the cluster that each copy is in: a number whose binary digits say, cut by cut, whether it is severed
    for c, cut in enumerate(cuts):  # a digit for each
        side_sum = np.bincount(corners.ravel(), np.repeat(parted.sides[:, c], 4), minlength=len(places))
        side = np.where(side_sum == 0.0, cut.across(places), side_sum) >= 0.0
        opposite = side[nodes] != (cut.across(middles) >= 0.0)[owner]
        part = 2 * part + (opposite & (cut.severs(middles[owner], places[nodes]) | (copies[parted.origin[nodes]] > 1)))
    order = np.lexsort((nodes, part, owner))
    part_starts = np.flatnonzero(np.diff(owner[order]) + np.abs(np.diff(part[order]))) + 1
    return Clusters(nodes[order], np.concatenate([[0], part_starts, [len(nodes)]]))
