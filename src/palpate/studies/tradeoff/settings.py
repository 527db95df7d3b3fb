"""Settings of the trade-off between accuracy and time."""

import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from palpate.benchmark.model import Model
from palpate.benchmark.settings import FINGER, Regression, check_radii, check_refined, pressed_bodies
from palpate.errors import InputError, describe_unknown
from palpate.files import check_file
from palpate.models import kinds, model_registry
from palpate.own_file import MODEL_FUNCTIONS, check_source
from palpate.setting_types import (
    Block,
    Count,
    Distinct,
    Index,
    Inside,
    Name,
    NotNegative,
    Number,
    Positive,
    Share,
    Some,
    Switch,
    Whole,
    key,
    rows,
)  # fmt: skip

RESIDUALS = "Relative residuals to stop at, from rest, after as many iterations as it takes"
SHARES = "Shares of the training samples to learn from"
RUNS = "Runs from rest, from cheap to expensive"
MATCHED = (
    "Models by name, and for each a regular expression that is found in the names of the settings that are asked; an"
)


class Press(Block):
    magnitude: Share = key("Share of the regime's peak displacement or pressure")
    tilt_degrees: NotNegative = key("Angle of the force to the inward normal", le=45)


class LimitPoints(Block):
    body: str = key("Name of a body that is refined")
    radius_m: Positive = key("Radius [m] of the disc", 0.012)
    contacts: Count | Annotated[list[Index], Field(min_length=1)] = key(
        "Coarse nodes that are pressed, or how many of them, spread over the surface", 4
    )


class _Asked(Block):
    bodies: Some[str] | None = key("Bodies by name; null takes all that are pressed", None)
    regimes: Some[str] | None = key("Regimes by name; null takes all", None)


class AnyLoad(_Asked):
    samples: Count = key("Loads of each kind, each of which the fine operator is solved for to convergence", 6)
    models: dict[str, str] = key(
        f"{MATCHED} empty one takes all. The cheap ways to answer are tried, and models that refuse are named",
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
        f"{MATCHED} empty one takes all",
        {"contact_modes": "snapshots, rings=50, thinned=0.003, target=operator", "linear_fem": ""},
    )


class Truth(Block):
    tolerance: Positive = key("Relative residual on the finest level", 1e-3, le=1e-2)
    check_samples: Index = key("Samples of a scene whose truth is found with another element too", 3)
    geometry_samples: Index = key("Samples of a scene on which facets are compared with a smooth shape", 3)


class Fem(Block):
    iterations: Distinct[Count] = key("Caps on Newton's iterations from rest", [1])
    warm_iterations: Some[Count] = key(
        "Caps on Newton's iterations from the stored linear response, and from the frame before: the answer to 97 % "
        "of the load",
        [1],
    )
    finest_warm_iterations: Distinct[Count] = key(
        "The same from the frame before for quadratic elements on the finest level, which are solved from rest to the "
        "loosest tolerance otherwise: each answer takes seconds, and each frame too",
        [],
    )
    warm_tolerances: Distinct[Inside] = key("Relative residuals to stop at from the other starts, loosest first", [])
    tolerances: Some[Inside] = key("Relative residuals to stop at from rest, loosest first", [1e-3])


class FastFem(Block):
    levels: Count = key("How many of the body's levels, counted from the finest", 2)
    iterations: Some[Count] = key("L-BFGS iterations from rest", [4, 8])
    frame_iterations: Distinct[Count] = key("Iterations from the frame before: the answer to 97 % of the load", [2, 4])
    finest_frame_iterations: Distinct[Count] = key("The same on the finest level, where frames take long to find", [])
    linear_iterations: Distinct[Count] = key("Iterations from the linear response, stored for each contact", [])
    tolerances: Distinct[Inside] = key(RESIDUALS, [])


class FemLocal(Block):
    meshes: Distinct[kinds.LocalMesh] = key(
        "Meshes and elements, from small to large: how many of the body's levels are refined, the radius of what is "
        "refined over that of the patch, and the order of the elements",
        rows("depth reach order", (1, 1.5, 2), (2, 1.5, 2)),
    )
    warm_iterations: Distinct[Count] = key("Caps on Newton's iterations from the frame before", [1])
    tolerances: Distinct[Inside] = key("Relative residuals to stop at, from rest, tried beside", [])


class ContactModes(Block):
    nodes: Count = key(kinds.NODES, 12000)
    rings: Some[Index] = key("Rings of elements around the disc with cells of their own; 50 are all of a body", [1, 50])
    tolerances: Some[Inside] = key(
        "Error, relative to the whole, by which few cells may pull otherwise than all do, loosest first; columns "
        "alone are tried with the last one",
        [0.01, 0.003],
    )
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


class Learning(Block):
    training_shares: Some[Share] = key(f"{SHARES}, where there are coarse answers with the last one", [0.25, 0.5, 1.0])


class WarpedCompliance(Block):
    training_shares: Some[Annotated[NotNegative, Field(le=1)]] = key(
        "Shares of the training samples that the residual is learnt from", [0, 0.5, 1.0]
    )


class PodRbf(Block):
    modes: Distinct[Count] = key(
        "Modes kept, with the last coarse answer; as many as there are training samples but one are tried with each",
        [8, 32],
    )


class MujocoFlex(Block):
    runs: Distinct[kinds.MuJoCo] = key(
        RUNS,
        rows("level steps iterations", (0, 3, 30), (0, 5, 100), (0, 14, 100), (1, 5, 100), (1, 15, 100), (1, 60, 100)),
    )


class PodGalerkin(Block):
    nodes: Count = key(kinds.NODES, 12000)
    modes: Some[Count] = key("Modes kept, at most as many as there are training samples", [8, 24, 48])
    tolerances: Some[Inside] = key(
        "Error, relative to the whole, by which few cells may pull otherwise than all do, loosest first; fewer modes "
        "are tried with the last one",
        [0.1, 0.03],
    )


class NewtonVbd(Block):
    runs: Distinct[kinds.NewtonVBD] = key(
        RUNS,
        rows(
            "level steps sweeps step", (0, 30, 10, 3), (0, 120, 10, 3), (0, 300, 20, 3), (1, 60, 10, 3), (1, 240, 10, 3)
        ),
    )


class PodOfLoads(Block):
    modes: Some[Count] = key("Modes kept, at most the training samples; a network has the middle number", [4, 12, 36])
    hidden: Distinct[Count] = key("Units of each of the network's two hidden layers", [4, 8, 16])


class MassSpring(Block):
    iterations: Some[Count] = key("Quasi-Newton iterations from rest on the coarse mesh", [1, 2, 3, 5, 8, 12, 20])
    middle_iterations: Distinct[Count] = key("The same on the middle mesh, of plain springs only; fits take long", [])
    middle_samples: Count = key("Training samples that a fit on the middle mesh takes", 20)


class ShapeMatching(Block):
    combinations: Some[kinds.ShapeMatching] = key(
        "Mode, clusters and steps from rest, from cheap to expensive",
        rows(
            "mode clusters steps",
            ("quadratic", "one", 30),
            ("quadratic", "one", 100),
            ("linear", "cubes", 100),
            ("linear", "cubes", 300),
            ("quadratic", "cubes", 300),
        ),
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


class Stage(Block):
    model: str = key("A model of palpate's")
    setting: dict[str, str | Number | Switch] = key(
        "Its setting, as in accuracy_vs_time.csv; level last is the finest", {}
    )

    def made(self, **usual: int) -> Model:
        """Return the model; ``usual`` fields hold where none are given. ValidationError for a setting that is none."""
        found = model_registry.MODELS[self.model]
        given = {name: None if (name, value) == ("level", "last") else value for name, value in self.setting.items()}
        return type(found)(**usual | {name: getattr(found, name) for name in found.model_fields_set} | given)


class Cascade(Block):
    asked_errors: Some[Positive] = key("RMSE of nine answers in ten, of the peak", [0.1, 0.05, 0.02, 0.01, 0.005])
    budgets_ms: list[Positive] = key(
        "Times [ms] of an answer with the least of these errors, each a setting of its own: a stage that does not fit "
        "is left out, and the answer doubted",
        [1],
    )
    stages: list[Stage] = key(
        "Models that learn nothing from samples, each with its setting, cheapest first; where no bound meets what is "
        "asked for, the model of the least one answers",
        [{"model": stage.name, "setting": stage.said} for stage in kinds.Cascade().stages],
        min_length=1,
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
    fem_local: FemLocal = key("Corotational finite elements on a mesh for each contact, fine around it", {})
    contact_modes: ContactModes = key("A reduced model for each contact, made of presses that it simulates itself", {})
    detail_correction: Learning = key("Every coarse answer, corrected by linear detail and by what is learnt", {})
    warped_compliance: WarpedCompliance = key("Stored linear responses, turned with their own rotations", {})
    linear_residual: Learning = key("Stored linear responses, and kernel ridge regression of what they lack", {})
    ridge: Learning = key(
        "Ridge regression from coarse to fine displacements (ridge_upsampling, kernel_ridge_detail)", {}
    )
    pod_rbf: PodRbf = key("Proper orthogonal decomposition with radial basis functions", {})
    mujoco_flex: MujocoFlex = key("Flex bodies of MuJoCo (mujoco), if that engine is installed", {})
    pod_galerkin: PodGalerkin = key("Galerkin projection on modes of training samples, the same for all contacts", {})
    newton_vbd: NewtonVbd = key("Vertex block descent of Newton (newton_vbd), if that engine is installed", {})
    pod_of_loads: PodOfLoads = key(
        "Proper orthogonal decomposition whose coefficients are learnt from place and force alone, by a Gaussian "
        "process (pod_gaussian) or a network (pod_network)",
        {},
    )
    mass_spring: MassSpring = key(
        "Mass-spring networks, of one modulus or nodal ones, with and without a volume force", {}
    )
    shape_matching: ShapeMatching = key("Shape matching, fitted to training samples for each combination", {})
    relaxed: Relaxed = key("Methods of graphics and games, to the equilibrium of linear elements on a level", {})
    paper_enrichment: PaperEnrichment = key("Paper 1's regressors, each kind of feature with each kind of weights", {})
    cascade: Cascade = key("The cheapest of several models whose bound of the error meets what is asked for", {})

    @property
    def stages(self) -> tuple[Model, ...]:
        """The models of the cascade, contact modes on the level that these are tried on by themselves."""
        usual = {"contact_modes": {"nodes": self.contact_modes.nodes}}
        return tuple(stage.made(**usual.get(stage.model, {})) for stage in self.cascade.stages)


class Advice(Block):
    budgets_ms: Some[Positive] = key("Times [ms] of an answer to the slowest press, a fifth to spare", [1, 16.7, 100])
    max_errors: Some[Inside] = key(
        "Errors that nine answers in ten stay below, as shares of the peak displacement", [0.05, 0.01, 0.001]
    )


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
    finger_radii_m: Distinct[Positive] = key("Radii [m] for which the advice is asked for again", [])
    in_depth: Some[str] | None = key(
        "Bodies that get all splits and fingers; the others get the first split. null: all", None
    )
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
    own_models: dict[Name, str] = key("Python files of your own models, by name, relative to this configuration", {})
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
    residual_of: Distinct[Literal["linear_fem", "fem_p1", "fem_p2"]] = key(
        "Models whose error is also estimated from one fine residual: of the linear response inside the body, and of "
        "the elements on the coarse level",
        ["fem_p1", "fem_p2"],
    )
    advice: Advice = key("What is asked of the models; the command palpate advise takes any other limit", {})


def check(config: Any, file: Path) -> None:
    """Raise InputError for unknown or missing models, or nothing to sample."""
    place, names, own = f"{file}: tradeoff", config.tradeoff.models, config.tradeoff.own_models
    if wrong := model_registry.unknown(names or [], own):
        raise InputError(f"{place} names {wrong}")
    if names is not None and model_registry.SAVED_AGAINST not in names:
        raise InputError(
            f"{place}.models lacks {model_registry.SAVED_AGAINST}, which is what the others save time against; add it."
        )
    _check_stages(f"{place}.settings.cascade.stages", config.tradeoff.settings.cascade.stages)
    _check_models(f"{place}.training_contacts_of", config.tradeoff.training_contacts_of, own)
    for name, path in own.items():
        check_file(f"{place}.own_models.{name}", path, (file.parent / path).is_file())
        check_source(f"{place}.own_models.{name}", file.parent / path, MODEL_FUNCTIONS, "see docs/add-a-model.md")
    _check_bodies(file, config)
    _check_answers(place, config, file)
    check_radii(config, file)
    for block in ("any_load", "beyond_design"):
        _check_asked(file, config, block)


def _check_stages(place: str, stages: list[Stage]) -> None:
    """Raise InputError for models of stages that there are not, and for settings that these do not have."""
    names = [stage.model for stage in stages]
    staged = [name for name in model_registry.MODELS if name != "cascade"]
    if wrong := model_registry.unknown(names, {}) or describe_unknown(names, staged):
        raise InputError(f"{place} names {wrong}")
    for i, stage in enumerate(stages):
        try:
            stage.made()
        except ValidationError as error:
            first, known = error.errors()[0], type(model_registry.MODELS[stage.model]).model_fields
            told = f"{place}[{i}].setting.{first['loc'][0]}: {first['msg'][:1].lower()}{first['msg'][1:]}"
            raise InputError(f"{told}; {stage.model} has {', '.join(known)}.") from None


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
    asked, place = getattr(config.tradeoff, block), f"{file}: tradeoff.{block}"
    if asked is None:
        return
    _check_models(f"{place}.models", asked.models, config.tradeoff.own_models)
    for part, known in (("bodies", pressed_bodies(config)), ("regimes", list(config.regimes))):
        if wrong := describe_unknown(getattr(asked, part) or [], known):
            raise InputError(f"{place}.{part} names {wrong}")


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
    named = [*(config.tradeoff.bodies or []), *([grown.body] if grown else [])]
    check_refined(f"{file}: tradeoff", named, config)
    if not pressed_bodies(config):
        raise InputError(f"{file}: tradeoff is there and no body is refined; give one refinements of at least 1.")
    if wrong := describe_unknown(config.tradeoff.in_depth or [], pressed_bodies(config)):
        raise InputError(f"{file}: tradeoff.in_depth names {wrong}")
    fingers = {FINGER.format(1e6 * radius) for radius in config.tradeoff.finger_radii_m}
    for name, regime in config.regimes.items():
        if name in fingers:
            raise InputError(f"{file}: regimes.{name} has the name of a regime of finger_radii_m; give it another.")
        if wrong := describe_unknown(list(regime.radius_of_body_m), list(config.bodies)):
            raise InputError(f"{file}: regimes.{name}.radius_of_body_m names {wrong}")
