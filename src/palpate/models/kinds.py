"""Palpate's ways of answering presses: a class for each, whose fields are its setting.

What prepares one is imported by its name when it is asked to, so that the classes alone cost no solver's import.
"""

from collections.abc import Iterable
from typing import Annotated, Any, Literal, Self

from pydantic import Field

from palpate.benchmark.model import BODYS, LIMIT, Case, Model, distinct, training_counts
from palpate.benchmark.settings import ProjectiveDynamics as Projective
from palpate.benchmark.settings import VertexBlockDescent as Descent
from palpate.benchmark.settings import Xpbd
from palpate.errors import InputError
from palpate.setting_types import Count, Index, Inside, NotNegative, Positive, Switch, key

CoarseAnswer = Annotated[str, Field(pattern="^(linear|1 iteration|([2-9]|[1-9][0-9]+) iterations|loose|converged)$")]
FEATURES = Literal["unordered", "ordered", "framed"]
WEIGHTS = Literal["signed", "nonnegative_a", "nonnegative_b", "clipped"]
ITERATIONS = "Iterations after which it stops; null: as many as the tolerance takes"
TOLERANCE = "Relative residual to stop at; null: the tolerance of the case"
TARGET = "limit: brought to the limit of ever finer levels, which stored responses are extrapolated to; null: as it is"
SAMPLES = "Training samples that are learnt from; null: all"
THINNED = "Relative error of the elastic forces of few cubature points, which stand for all"
NODES = "Nodes that the level which is reduced has at most, edges' midpoints included; it is the finest such level"


WARM, FRAMES, MIDDLE_SAMPLES = 1, (2, 4), 20
"""Newton's iterations from a linear response or the frame before, the answer to 97 % of the load; those of L-BFGS; and
training samples that springs on the middle mesh are fitted to."""
SHARES = (0.25, 0.5, 1.0)
"""Of the training samples, that models learn from."""


class Elements(Model):
    """Finite elements on a level of the body, stopped early or converged."""

    law = BODYS
    level: Index | None = key("Level of the body, from 0, the coarsest; null: the finest", None)
    start: Literal["rest", "linear", "frame"] = key(
        "Where iterations start: at rest, at the stored linear response, or at the answer to 97 % of the load", "rest"
    )
    iterations: Count | None = key(ITERATIONS, None)
    tolerance: Inside | None = key(TOLERANCE, None)
    target: Literal["limit"] | None = key(TARGET, None)

    def level_of(self, case: Case) -> int:
        """Return the level of the body of ``case``; InputError for one that it has not."""
        finest = len(case.body.levels) - 1
        if self.level is not None and self.level > finest:
            raise InputError(f"{type(self).__name__}: level is {self.level}; the body has the levels 0 to {finest}.")
        return finest if self.level is None else self.level

    def stopped(self, iterations: Iterable[int], tolerances: Iterable[float] = ()) -> list[Self]:
        """Return this setting with each of these caps on ``iterations``, and with each of these ``tolerances``."""
        capped = [self.having(iterations=count) for count in iterations]
        return capped + [self.having(tolerance=tolerance) for tolerance in tolerances]


class FEM(Elements):
    """Linear or quadratic finite elements by Newton's method."""

    place, unsaid = "palpate.models.fem", ("order",)
    order: Literal[1, 2] = key("Linear elements, 1, or quadratic ones, 2", 2)

    @property
    def name(self) -> str:
        return f"fem_p{self.order}"

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return for each level, coarse first, the starts, and with each of them the caps on iterations and tolerances.

        Quadratic elements on the finest level, which have many more nodes than all others and take seconds, are solved
        from rest to the loosest tolerance, which is far below their own error. The answer of one iteration from the
        frame before is also extrapolated to the limit of the levels.
        """
        asked, last, variants = grid.fem, len(case.body.levels) - 1, []
        for level in range(last + 1):
            rest, linear, frame = (self.having(level=level, start=start) for start in ("rest", "linear", "frame"))
            if self.order == 2 and level == last:
                variants += rest.stopped([], asked.tolerances[:1])
                continue
            warm = [WARM], asked.warm_tolerances
            if len(case.prepared_contacts):
                to_limit = frame.having(iterations=WARM, target=LIMIT)
                variants += [*linear.stopped(*warm), *frame.stopped(*warm), to_limit]
            else:
                variants += frame.stopped(*warm)
            variants += rest.stopped(asked.iterations, asked.tolerances)
        return distinct(variants)


class FastFEM(Elements):
    """Quadratic finite elements by L-BFGS: no matrix of the deformed body, one multigrid cycle an iteration."""

    place, reduces = "palpate.models.fast_fem", "p2"

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return for the two finest levels, coarse first, each start with its caps on iterations, and tolerances.

        The settings with most iterations, from rest and from the frame before, are also extrapolated to the limit of
        levels.
        """
        asked, finest, variants = grid.fast_fem, len(case.body.levels) - 1, []
        for level in range(max(0, finest - 1), finest + 1):
            rest, linear, frame = (self.having(level=level, start=start) for start in ("rest", "linear", "frame"))
            frames = asked.finest_frame_iterations if level == finest else FRAMES
            warm, cold = frame.stopped(frames), rest.stopped(asked.iterations)
            if len(case.prepared_contacts):
                variants += linear.stopped(asked.linear_iterations)
                warm, cold = ([*caps, *(one.having(target=LIMIT) for one in caps[-1:])] for caps in (warm, cold))
            variants += [*warm, *cold, *rest.stopped([], asked.tolerances)]
        return distinct(variants)


class LocalFEM(Model):
    """Finite elements on a mesh for each contact, fine around it and coarse elsewhere."""

    place, law, prepared = "palpate.models.fem_local", BODYS, True
    depth: Count = key("Level that is reached near the contact, from 1; bodies with fewer levels leave it out", 1)
    reach: NotNegative = key(
        "Radius of what is refined, over that of the patch; 0 refines the elements at the contact", 1.5
    )
    order: Literal[1, 2] = key("Linear elements, 1, or quadratic ones, 2", 2)
    start: Literal["rest", "frame"] = key(
        "Where iterations start: at rest, or at the answer to 97 % of the load", "rest"
    )
    iterations: Count | None = key(ITERATIONS, None)
    tolerance: Positive | None = key(TOLERANCE, None)

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return the meshes from small to large; each is stopped early from the frame before."""
        finest, variants = len(case.body.levels) - 1, []
        for depth in (1, 2):
            if depth <= finest:
                setting = self.having(depth=depth, reach=1.5, order=2)
                variants.append(setting.having(start="frame", iterations=WARM))
        return variants


class ContactModes(Model):
    """A reduced model for each contact, made of presses that it simulates itself."""

    place, unsaid = "palpate.models.contact_modes.contact_modes", ("nodes",)
    law, prepared, reduces = BODYS, True, "p2"
    modes: Literal["columns", "snapshots", "finer"] = key(
        "Linear presses (columns), simulated ones (snapshots), or these pressed on the next level, too (finer)",
        "snapshots",
    )
    rings: Index = key(
        "Rings of elements around the disc whose integration points are candidates; 50 are all of a body", 50
    )
    thinned: Inside = key(THINNED, 0.003)
    target: Literal["operator", "limit"] = key(
        "operator: the answer of quadratic elements on the finest level; limit: that of ever finer levels", "operator"
    )
    nodes: Count = key(NODES, 12000)

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return columns alone; snapshots with fewer rings, fewer cubature points, and more of both; pressed finer.

        Presses on the next level are only tried if the grid asks for them, as they take long to prepare, and if the
        body has a level above the one that is reduced.
        """
        from palpate.models.contact_modes.offline import reduced_level

        asked = grid.contact_modes
        full = self.having(rings=50, thinned=0.003, modes="snapshots")
        variants = [full.having(modes="columns"), full.having(rings=1), full.having(thinned=0.01), full]
        if asked.finer and reduced_level(case.body, self.nodes) < len(case.body.levels) - 1:
            variants.append(full.having(modes="finer"))
        return [setting.having(target=target) for setting in variants for target in asked.targets]


class PODGalerkin(Model):
    """Galerkin projection of quadratic elements on modes of the training samples, the same for all contacts."""

    place, unsaid = "palpate.models.pod_galerkin", ("nodes",)
    law, reduces = BODYS, "p2"
    modes: Count = key("Modes kept, at most", 24)
    thinned: NotNegative = key(f"{THINNED}; 0: all are kept", 0.03, lt=1)
    nodes: Count = key(NODES, 12000)

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return numbers of modes, at most one a sample, with the last tolerance, and the most with the others."""
        asked = grid.pod_galerkin
        *fewer, largest = sorted({min(count, case.n_training) for count in asked.modes})
        *_, finest = asked.tolerances
        variants = [(count, finest) for count in fewer] + [(largest, tolerance) for tolerance in asked.tolerances]
        return [self.having(modes=count, thinned=tolerance) for count, tolerance in variants]


class LinearFEM(Model):
    """Linear responses of the fine mesh, computed in advance: three columns for each contact."""

    place, law, prepared, reduces = "palpate.models.linear_fem", "linear", True, "p2"
    target: Literal["limit"] | None = key(TARGET, None)

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return the responses of the fine mesh, and their limit."""
        return [self, self.having(target=LIMIT)]


class LinearResidual(Model):
    """Stored linear responses, and kernel ridge regression of what they lack; nothing is simulated."""

    place = "palpate.models.linear_residual"
    law, prepared, reduces = "linear", True, "p2"
    samples: Index | None = key(SAMPLES, None)

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return numbers of training samples that are learnt from."""
        return [self.having(samples=count) for count in training_counts(case, SHARES)]


class WarpedCompliance(Model):
    """Stored linear responses, turned with their own rotations, and kernel ridge regression of what they lack."""

    place = "palpate.models.warped_compliance"
    law, prepared, reduces = "warped linear", True, "p2"
    samples: Index | None = key(f"{SAMPLES}; with 0 it is the published method", 0)
    target: Literal["limit"] | None = key(TARGET, None)

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return numbers of training samples that are learnt from; with none the published method, and its limit."""
        counts = training_counts(case, (0, *SHARES[1:]))
        published, *learnt = [self.having(samples=count) for count in counts]
        return [published, self.having(samples=0, target=LIMIT), *learnt]


class OfCoarse(Model):
    """A method that makes a fine answer of a coarse one."""

    law = BODYS
    coarse: CoarseAnswer = key(
        "The coarse answer: linear is stored, iterations are Newton's from rest, loose stops at 1e-3, converged at the "
        "tolerance of the case",
        "converged",
    )

    def with_each(self, case: Case, grid: Any, fewer: Iterable[Self] = ()) -> list[Self]:
        """Return this setting with each kind of coarse answer, cheapest first, and ``fewer`` with the best kind.

        A stored answer is left out of a case that has none.
        """
        *cheaper, dearest = [kind for kind in grid.coarse_answers if kind != "linear" or case.response is not None]
        with_best = [setting.having(coarse=dearest) for setting in fewer if setting.text != self.text]
        return distinct([*(self.having(coarse=kind) for kind in cheaper), *with_best, self.having(coarse=dearest)])


class DetailCorrection(OfCoarse):
    """A coarse answer, corrected by the linear detail that it lacks, turned with the body, and by what is learnt."""

    place = "palpate.models.enrichment.detail_correction"
    prepared, reduces = True, "p2"
    samples: Index | None = key(SAMPLES, 0)
    turned: Switch = key("Whether detail turns with the body", True)
    target: Literal["limit"] | None = key(TARGET, None)

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return the coarse answers, and with the best of them the numbers of samples that are learnt from.

        Without samples neither scale nor residual is learnt, and in one setting nothing is turned. What is learnt from
        all of them is also brought to the limit of the levels.
        """
        counts = training_counts(case, SHARES)
        fewer = [self.having(samples=0, turned=False), *(self.having(samples=count) for count in (0, *counts))]
        *with_coarse, full = self.having(samples=case.n_training).with_each(case, grid, fewer)
        return [*with_coarse, full.having(target=LIMIT), full]


class Interpolation(OfCoarse):
    """The coarse answer, interpolated linearly."""

    place, sees = "palpate.models.interpolation", "deformation"

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return the coarse answers; simulated ones are those of linear elements on level 0."""
        return self.with_each(case, grid)


class Ridge(OfCoarse):
    """Ridge regression from coarse to fine displacements, linearly or of the detail by a kernel."""

    place, unsaid, sees, reduces = "palpate.models.enrichment.ridge", ("kernel",), "deformation", "p2"
    samples: Count | None = key(SAMPLES, None)
    kernel: Switch = key("Whether it is a kernel's, of what linear interpolation lacks", True)

    @property
    def name(self) -> str:
        return "kernel_ridge_detail" if self.kernel else "ridge_upsampling"

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return the coarse answers with all training samples, and with the best of them how many are used."""
        fewer = [self.having(samples=count) for count in training_counts(case, SHARES)]
        return self.having(samples=case.n_training).with_each(case, grid, fewer)


class PODRBF(OfCoarse):
    """Proper orthogonal decomposition, whose coefficients radial basis functions interpolate."""

    place, sees, reduces = "palpate.models.enrichment.pod_rbf", "deformation", "p2"
    modes: Count | None = key("Modes kept; null: chosen by cross-validation", None)

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return the coarse answers with as many modes as possible, and with the best answer fewer modes."""
        largest = case.n_training - 1
        fewer = [self.having(modes=count) for count in sorted({min(modes, largest) for modes in grid.pod_rbf.modes})]
        return self.having(modes=largest).with_each(case, grid, fewer)


class PaperEnrichment(OfCoarse):
    """Paper 1's regression: fine deformations of training samples, blended by their likeness."""

    place, unsaid = "palpate.models.enrichment.paper_enrichment", ("features", "weights")
    sees, reduces = "deformation", "p2"
    features: FEATURES = key("What is compared of two coarse deformations", "framed")
    weights: WEIGHTS = key("Kind of weights", "signed")
    samples: Count | None = key(SAMPLES, None)
    neighbours: Count | None = key("Coarse nodes in a contact-ordered feature; null: those of the regression", None)

    @property
    def name(self) -> str:
        return f"{self.features}_{self.weights}"

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return the coarse answers; with the best of them fewer training samples, and other numbers of neighbours."""
        asked, usual = grid.paper_enrichment, self
        if self.features != "unordered":
            usual = self.having(neighbours=case.options.neighbours)
        fewer = [usual.having(samples=count) for count in training_counts(case, asked.training_shares)]
        full = usual.having(samples=case.n_training)
        if self.features == "ordered":
            available = len(case.meshes.coarse_surface)
            fewer += [full.having(neighbours=count) for count in asked.neighbours if count < available]
        return full.with_each(case, grid, fewer)


class PODOfLoads(Model):
    """Proper orthogonal decomposition whose coefficients are learnt from place and force alone."""

    place, unsaid, law, reduces = "palpate.models.pod_of_loads", ("learner",), BODYS, "p2"
    modes: Count = key("Modes kept, at most", 12)
    hidden: Count | None = key("Units of each of the network's two hidden layers; null: 8", None)
    learner: Literal["gaussian", "network"] = key("A Gaussian process or a network", "gaussian")

    @property
    def name(self) -> str:
        return f"pod_{self.learner}"

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return numbers of modes, at most as many as training samples, and of a network hidden units."""
        modes = sorted({min(count, case.n_training) for count in (4, 12, 36)})
        if self.learner == "gaussian":
            return [self.having(modes=count) for count in modes]
        return [self.having(modes=modes[len(modes) // 2], hidden=count) for count in (4, 8, 16)]


class Springs(Model):
    """Mass-spring networks, whose moduli are fitted to training samples."""

    place, unsaid = "palpate.models.springs.mass_spring", ("nodal", "volume", "samples")
    law, reduces = "springs", "p2"
    level: Index = key("Level of the body, from 0, the coarsest", 0)
    iterations: Count = key("Quasi-Newton iterations from rest", 20)
    nodal: Switch = key("Whether each node has a modulus, and not one serves all", False)
    volume: Switch = key("Whether a force preserves volume, too (paper 2)", False)
    samples: Count | None = key(SAMPLES, None)

    @property
    def name(self) -> str:
        return f"springs{'_nodal' * self.nodal}{'_volume' * self.volume}"

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return iterations on the coarse level; of plain springs also on the middle one, where fits take long."""
        asked = grid.mass_spring
        variants = [self.having(level=0, iterations=count) for count in (1, 2, 3, 5, 8, 12, 20)]
        if len(case.body.levels) > 2 and not (self.nodal or self.volume):
            middle = self.having(level=1, samples=MIDDLE_SAMPLES)
            variants += [middle.having(iterations=count) for count in asked.middle_iterations]
        return variants


class ShapeMatching(Model):
    """Shape matching on the coarse mesh, fitted to training samples."""

    place, law, reduces = "palpate.models.shape_matching", "shape matching", "p2"
    mode: Literal["rigid", "linear", "quadratic"] = key("How a cluster may deform", "quadratic")
    clusters: Literal["one", "tetrahedra", "cubes"] = key("How particles are grouped", "cubes")
    steps: Count = key("Steps from rest", 300)

    def tried(self, case: Case, grid: Any) -> list[Self]:
        """Return modes, clusters and steps, from cheap to expensive."""
        of_one = [self.having(mode="quadratic", clusters="one", steps=steps) for steps in (30, 100)]
        linear = [self.having(mode="linear", clusters="cubes", steps=steps) for steps in (100, 300)]
        return [*of_one, *linear, self.having(mode="quadratic", clusters="cubes", steps=300)]


class Relaxing(Model):
    """What games relax bodies with, to the equilibrium of corotational linear elements on a level."""

    place, law = "palpate.models.relaxed", "corotational"
    start: Literal["rest", "frame"] = key(
        "Where an answer starts: at rest, or at the frame before, to which the method has come by itself in 33 frames "
        "of the same steps",
        "rest",
    )

    def tried(self, case: Case, grid: Any) -> list[Model]:
        """Return those that the grid lists, on levels that the body has."""
        return [each for each in getattr(grid.relaxed, self.called) if each.level < len(case.body.levels)]


class XPBD(Xpbd, Relaxing):
    """Extended position-based dynamics with accumulated multipliers."""

    called = "xpbd"


class VertexBlockDescent(Descent, Relaxing):
    """Vertex block descent."""

    called = "vertex_block_descent"


class ProjectiveDynamics(Projective, Relaxing):
    """Projective dynamics."""

    called = "projective_dynamics"
