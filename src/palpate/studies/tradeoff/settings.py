"""Settings of the trade-off between accuracy and time."""

import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from palpate.benchmark.settings import Regression, check_radii, check_refined, pressed_bodies
from palpate.errors import InputError, describe_unknown
from palpate.files import check_file
from palpate.models import kinds, model_registry
from palpate.setting_types import (
    Block,
    Count,
    Distinct,
    Index,
    Inside,
    NotNegative,
    Positive,
    Share,
    Some,
    Switch,
    Whole,
    key,
    rows,
)  # fmt: skip

MATCHED = (
    "Models by name, and for each a regular expression that is found in the names of the settings that are asked; an "
    "empty one takes all"
)


class Press(Block):
    magnitude: Share = key("Share of the regime's peak displacement or pressure")
    tilt_degrees: NotNegative = key("Angle of the force to the inward normal", le=45)


class LimitPoints(Block):
    body: str = key("Name of a body that is refined")
    contacts: Count | Annotated[list[Index], Field(min_length=1)] = key(
        "Coarse nodes that are pressed, or how many of them, spread over the surface", 4
    )


class _Asked(Block):
    regimes: Some[str] | None = key("Regimes by name; null takes all", None)


class AnyLoad(_Asked):
    samples: Count = key("Loads of each kind, each of which the fine operator is solved for to convergence", 6)
    models: dict[str, str] = key(
        f"{MATCHED}. The cheap ways to answer are tried, and models that refuse are named",
        {
            "fem_p1": "start=rest, tolerance=0.001",
            "fem_p2": "level=[01], start=rest, tolerance=0.001",
            "contact_modes": "(columns|snapshots), rings=50, thinned=0.003, target=operator",
            "interpolation": "linear|loose",
            "linear_fem": "",
            "warped_compliance": "samples=0",
        },
    )


class BeyondDesign(_Asked):
    samples: Count = key("Contacts, each of which is pressed in six ways", 6)
    models: dict[str, str] = key(
        MATCHED,
        {"contact_modes": "snapshots, rings=50, thinned=0.003, target=operator", "linear_fem": ""},
    )


class Truth(Block):
    check_samples: Index = key("Samples of a scene whose truth is found with another element too", 3)
    geometry_samples: Index = key("Samples of a scene on which facets are compared with a smooth shape", 3)


class Advice(Block):
    budgets_ms: Some[Positive] = key("Times [ms] of an answer to the slowest press, a fifth to spare", [1, 16.7, 100])
    max_errors: Some[Inside] = key(
        "Errors that nine answers in ten stay below, as shares of the peak displacement", [0.05, 0.01, 0.001]
    )


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


class Settings(Block):
    """What accuracy costs in time, for every model on every body that is pressed."""

    bodies: Some[str] | None = key("Bodies that are pressed, by name; null takes all that are refined", None)
    regimes: Some[str] | None = key("Regimes that bodies are pressed in, by name; null takes all", None)
    contacts: Whole = key(
        "Contacts of each body: half spread evenly over what of its surface can be pressed, half drawn by area",
        24,
        ge=5,
    )
    presses: Some[Press] = key(
        "What is pressed at each contact", rows("magnitude tilt_degrees", (1.0, 0), (0.8, 45), (0.6, 20))
    )
    splits: Some[Annotated[Count, Field(le=5)]] = key(
        "Which of five splits are measured: each tests on another fifth of the contacts, tries settings on a further "
        "fifth, and trains on the rest. With all five the bounds of models that learn rest on every contact, with one "
        "on two fifths",
        [1],
    )
    in_depth: Some[str] | None = key("Bodies that get all splits; the others get the first split. null: all", None)
    limit_points: LimitPoints | None = key(
        "A press that grows until the law itself gives way; null leaves it out", None
    )
    any_load: AnyLoad | None = key(
        "Loads that models were not prepared for: places between the prepared contacts, two contacts at once, and "
        "discs that are pushed to a depth; null leaves it out",
        None,
    )
    beyond_design: BeyondDesign | None = key(
        "Presses of 1.5, 2 and 3 times the designed force, along the surface and outward: how many answers are right, "
        "doubted by their model, or wrong without a word; null leaves it out",
        None,
    )
    truth: Truth = key("What models are judged by, Richardson's limit of nested quadratic elements", {})
    models: Distinct[str] | None = key("Models by name; null takes all that palpate has", None)
    answers: dict[str, Some[str]] = key(
        "Files of answers that engines gave elsewhere to the questions of palpate ask, by scene, relative to this "
        "configuration",
        {},
    )
    settings: Families = key("What each family of models is tried with: a point in the diagram for each", {})
    regression: Regression = key("How models that learn choose their widths; paper 1's own sweep: enrichment", {})
    budget_s: Positive = key("Time [s] for which each setting is asked again, beyond once for each test sample", 0.1)
    training_contacts_of: dict[str, str] = key(
        "Models that learn nothing, and for each a regular expression that is found in the names of its settings, an "
        "empty one in all: they are asked at one press of each training contact too, where a body has one split, so "
        "that bounds of their errors know more contacts. Models that learn are held to contacts that they have not "
        "seen",
        {
            "fast_fem": "",
            "contact_modes": "(columns|snapshots), rings=50, thinned=0.003",
            "linear_fem": "",
            "warped_compliance": "samples=0",
        },
    )
    advice: Advice = key("What is asked of the models; the command palpate advise takes any other limit", {})


def check(config: Any, file: Path) -> None:
    """Raise InputError for unknown or missing models, or nothing to sample."""
    place, names, own = f"{file}: tradeoff", config.tradeoff.models, config.own_models
    if wrong := model_registry.unknown(names or [], own):
        raise InputError(f"{place} names {wrong}")
    if names is not None and model_registry.SAVED_AGAINST not in names:
        raise InputError(
            f"{place}.models lacks {model_registry.SAVED_AGAINST}, which is what the others save time against; add it."
        )
    _check_models(f"{place}.training_contacts_of", config.tradeoff.training_contacts_of, own)
    _check_bodies(file, config)
    _check_answers(place, config, file)
    check_radii(config, file)
    for block in ("any_load", "beyond_design"):
        _check_asked(file, config, block)


def _check_answers(place: str, config: Any, file: Path) -> None:
    """Raise InputError for answers to scenes that are not measured, and for files that are not there."""
    scenes = [f"{body}_{regime}" for body in pressed_bodies(config) for regime in config.regimes]
    if wrong := describe_unknown(list(config.tradeoff.answers), scenes):
        raise InputError(f"{place}.answers names {wrong}")
    for scene, paths in config.tradeoff.answers.items():
        for path in paths:
            check_file(f"{place}.answers.{scene}", path, (file.parent / path).is_file())


def _check_asked(file: Path, config: Any, block: str) -> None:
    """Raise InputError for models, bodies and regimes of a ``block`` that there are not, or no regular expression."""
    settings, place = getattr(config.tradeoff, block), f"{file}: tradeoff.{block}"
    if settings is None:
        return
    _check_models(f"{place}.models", settings.models, config.own_models)
    if wrong := describe_unknown(settings.regimes or [], list(config.regimes)):
        raise InputError(f"{place}.regimes names {wrong}")


def _check_models(place: str, patterns: dict[str, str], own: dict) -> None:
    """Raise InputError for models that there are not, and for patterns of their settings that are none."""
    if wrong := model_registry.unknown(list(patterns), own):
        raise InputError(f"{place} names {wrong}")
    for name, pattern in patterns.items():
        try:
            re.compile(pattern)
        except re.error as error:
            raise InputError(f"{place}.{name}: {pattern} is no regular expression ({error}).") from error


def _check_bodies(file: Path, config: Any) -> None:
    """Raise InputError for bodies that cannot be pressed, or that nothing presses."""
    if not config.regimes:
        raise InputError(f"{file}: tradeoff is there and there are no regimes; add one that says how hard to press.")
    if wrong := describe_unknown(config.tradeoff.regimes or [], list(config.regimes)):
        raise InputError(f"{file}: tradeoff.regimes names {wrong}")
    grown = config.tradeoff.limit_points
    body_names = [*(config.tradeoff.bodies or []), *([grown.body] if grown else [])]
    check_refined(f"{file}: tradeoff", body_names, config.bodies)
    if not pressed_bodies(config):
        raise InputError(f"{file}: tradeoff is there and no body is refined; give one refinements of at least 1.")
    if wrong := describe_unknown(config.tradeoff.in_depth or [], pressed_bodies(config)):
        raise InputError(f"{file}: tradeoff.in_depth names {wrong}")
    for name, regime in config.regimes.items():
        if wrong := describe_unknown(list(regime.radius_of_body_m), list(config.bodies)):
            raise InputError(f"{file}: regimes.{name}.radius_of_body_m names {wrong}")
