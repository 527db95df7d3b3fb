"""The settings that the trade-off tries of each family of models: a point in the diagram for each."""

from typing import Literal

from palpate.models import kinds
from palpate.setting_types import Block, Count, Distinct, Inside, Share, Some, Switch, key, rows

RESIDUALS = "Relative residuals to stop at, from rest, after as many iterations as it takes"
SHARES = "Shares of the training samples to learn from"


class Fem(Block):
    iterations: Distinct[Count] = key("Caps on Newton's iterations from rest", [1])
    warm_tolerances: Distinct[Inside] = key("Relative residuals to stop at from the other starts, loosest first", [])
    tolerances: Some[Inside] = key("Relative residuals to stop at from rest, loosest first", [1e-3])


class FastFem(Block):
    iterations: Some[Count] = key("L-BFGS iterations from rest", [4, 8])
    finest_frame_iterations: Distinct[Count] = key(
        "Iterations from the frame before, the answer to 97 % of the load, on the finest level; elsewhere 2 and 4",
        [],
    )
    linear_iterations: Distinct[Count] = key("Iterations from the linear response, stored for each contact", [])
    tolerances: Distinct[Inside] = key(RESIDUALS, [])


class ContactModes(Block):
    finer: Switch = key(
        "Whether contacts are also pressed on the next level, if the body has one: that mends the worst node under a "
        "finger, and doubles the preparation",
        False,
    )
    targets: Some[Literal["operator", "limit"]] = key(
        "Which answer is meant: operator is that of quadratic elements on the finest level, limit that of ever finer "
        "levels, which is extrapolated to",
        ["operator", "limit"],
    )


class PodRbf(Block):
    modes: Distinct[Count] = key(
        "Modes kept, with the last coarse answer; as many as there are training samples but one are tried with each",
        [8, 32],
    )


class PodGalerkin(Block):
    modes: Some[Count] = key("Modes kept, at most as many as there are training samples", [8, 24, 48])
    tolerances: Some[Inside] = key(
        "Relative errors of the elastic forces of few cubature points, which stand for all, loosest first; fewer modes "
        "are tried with the last one",
        [0.1, 0.03],
    )


class MassSpring(Block):
    middle_iterations: Distinct[Count] = key(
        "Quasi-Newton iterations on the middle mesh, of plain springs only; fits take long", []
    )


class Relaxed(Block):
    xpbd: Distinct[kinds.XPBD] = key(
        "Extended position-based dynamics with accumulated multipliers (xpbd), from cheap to expensive",
        rows(
            "level start steps iterations step",
            (0, "frame", 2, 1, 4.0),
            (0, "frame", 4, 1, 4.0),
            (0, "frame", 5, 1, 3.0),
            (1, "frame", 5, 1, 3.0),
        ),
    )
    vertex_block_descent: Distinct[kinds.VertexBlockDescent] = key(
        "Vertex block descent (vertex_block_descent), from cheap to expensive",
        rows("level start sweeps radius", (0, "frame", 5, 0.9995), (0, "frame", 10, 0.9995)),
    )
    projective_dynamics: Distinct[kinds.ProjectiveDynamics] = key(
        "Projective dynamics (projective_dynamics), from cheap to expensive",
        rows(
            "level start iterations memory",
            (0, "frame", 2, 5),
            (0, "frame", 5, 5),
            (1, "frame", 5, 5),
            (1, "rest", 30, 5),
        ),
    )


class PaperEnrichment(Block):
    training_shares: Some[Share] = key(f"{SHARES}, with the last coarse answer; all are tried with each", [0.25, 1.0])
    neighbours: Distinct[Count] = key(
        "Coarse nodes in a contact-ordered feature, tried with all training samples and the last coarse answer beside "
        "those of tradeoff.regression",
        [1, 40],
    )


class Families(Block):
    coarse_answers: Some[kinds.CoarseAnswer] = key(
        "The coarse answers that every method which makes a fine one of it is tried with, cheapest first: linear is "
        "stored, iterations are Newton's from rest, loose stops at 1e-3, converged at solver.tolerance; shares of the "
        "samples are tried with the last one alone",
        ["linear", "2 iterations", "loose", "converged"],
    )
    fem: Fem = key("Linear (fem_p1) and quadratic (fem_p2) elements on all levels, stopped early or converged", {})
    fast_fem: FastFem = key("Quadratic finite elements by L-BFGS from the multigrid of the state at rest", {})
    contact_modes: ContactModes = key("A reduced model for each contact, made of presses that it simulates itself", {})
    pod_rbf: PodRbf = key("Proper orthogonal decomposition with radial basis functions", {})
    pod_galerkin: PodGalerkin = key("Galerkin projection on modes of training samples, the same for all contacts", {})
    mass_spring: MassSpring = key(
        "Mass-spring networks, of one modulus or nodal ones, with and without a volume force", {}
    )
    relaxed: Relaxed = key("Methods of graphics and games, to the equilibrium of linear elements on a level", {})
    paper_enrichment: PaperEnrichment = key("Paper 1's regressors, each kind of feature with each kind of weights", {})
