"""Settings of models in motion."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from palpate.benchmark.comparable import check_compared, compared_scenes, taught, unable
from palpate.effects.settings import (
    Gravity,
    Instrument,
    Other,
    ProjectiveDynamics,
    Push,
    Touching,
    VertexBlockDescent,
    Xpbd,
)
from palpate.errors import InputError
from palpate.scenes.scene_check import check_instruments, check_loads
from palpate.scenes.settings import Scene
from palpate.setting_types import (
    KEPT,
    Block,
    Count,
    Distinct,
    Index,
    Inside,
    Name,
    NotNegative,
    Positive,
    Share,
    Some,
    Whole,
    key,
    optional,
    rows,
)  # fmt: skip

Change = Annotated[Positive, Field(le=0.2)]
Halvings = Annotated[Whole, Field(ge=2)]
Evaluations = Annotated[Whole, Field(ge=5)]
STEPS_HELP = "Steps in each frame"
TOLERANCES = (
    "Relative residuals at which a step counts as found, beside the scene's: Newton's method takes fewer iterations. "
    "Tried with the middle number of steps"
)
EVALUATIONS = "Motions that a fit may compute"


class FemCoarse(Block):
    steps_per_frame: Some[Count] = key(STEPS_HELP, [1, 2, 4])
    tolerances: Distinct[Inside] = key(TOLERANCES, [0.01])
    gaps: Distinct[Positive] = key(
        "Distances at which contact begins to repel, in multiples of the scene's, where there is contact. Tried with "
        "the middle number of steps",
        [0.25, 4],
    )


class FemFine(Block):
    steps_per_frame: Some[Count] = key(STEPS_HELP, [3])
    tolerances: Distinct[Inside] = key(TOLERANCES, [0.01])


class MovingModes(Block):
    steps_per_frame: Some[Count] = key(STEPS_HELP, [1, 2, 4])
    vibrations: Index = key("Vibration modes, slowest first", 10)
    bent: Index = key("How many of them get modes of second order, with those of each load", 3)
    missed: Inside = key(
        "By how much the few cells that energy is taken from may misplace the body in motions held out, of its "
        "displacement",
        0.02,
    )
    tolerances: Distinct[Inside] = key("Other values of that, tried with the middle number of steps", [0.1])


class Springs(Block):
    shares_of_stable_step: Some[Share] = key("Steps, in parts of the longest stable one at rest", [0.8, 0.4, 0.2])
    evaluations: Evaluations = key(EVALUATIONS, 20)


class ShapeMatching(Block):
    steps_per_frame: Some[Count] = key(STEPS_HELP, [4, 8, 16])
    evaluations: Evaluations = key(EVALUATIONS, 200)


class OnLevel(Block):
    level: Index = key("Which of the body's nested meshes, 0 is the coarse one", le=3)
    steps_per_frame: Count = key(STEPS_HELP)


class XpbdTried(OnLevel, Xpbd):
    pass


class ProjectiveDynamicsTried(OnLevel, ProjectiveDynamics):
    pass


class VertexBlockDescentTried(OnLevel, VertexBlockDescent):
    pass


class Relaxed(Block):
    xpbd: list[XpbdTried] = key(
        "Extended position-based dynamics, with small steps and with iterations",
        rows("level steps_per_frame iterations", (0, 10, 1), (0, 4, 10), (0, 80, 1), (1, 80, 1)),
    )
    projective_dynamics: list[ProjectiveDynamicsTried] = key(
        "Projective dynamics",
        rows("level steps_per_frame iterations memory", (0, 2, 5, 0), (0, 4, 10, 5), (0, 16, 10, 5), (1, 8, 10, 5)),
    )
    vertex_block_descent: list[VertexBlockDescentTried] = key(
        "Vertex block descent",
        rows(
            "level steps_per_frame sweeps radius",
            (0, 1, 10, 0.95),
            (0, 4, 20, 0.99),
            (0, 16, 10, 0.99),
            (1, 4, 20, 0.99),
        ),
    )


class PathModes(Touching):
    steps_per_frame: Some[Count] = key(STEPS_HELP, [2, 4])


class RegionModes(PathModes):
    modes: Count = key("As for path_modes", 30)
    states: Count = key("As for path_modes", 60)
    half_width_m: Positive = key("How far the region reaches from the middle of the path to each side [m]", 0.05)
    strokes: Count = key("Random strokes that modes are learnt from, in a square 1.3 times as wide", 36)


class Families(Block):
    fem_coarse: FemCoarse = key("Finite elements on the coarse level, stepped implicitly", {})
    fem_fine: FemFine = key("Finite elements on the reference's level, with looser residuals and other steps", {})
    moving_modes: MovingModes = key(
        "The limit of quadratic elements in vibration modes and modes of the places that are pushed, and once in those "
        "of the places of the training instead; for held bodies under gravity and pushes",
        {},
    )
    relaxed: Relaxed = key(
        "Methods that relax elements one by one in each step, of graphics and games, from cheap to expensive; settings "
        "on levels that a scene lacks are left out",
        {},
    )
    path_modes: PathModes = key(
        "Quadratic elements on the reference's level in modes of strokes beside the path; of scenes that name it", {}
    )
    region_modes: RegionModes = key(
        "The same in modes of random strokes of the region, which need not be those of the path", {}
    )
    springs: Springs = key(
        "Springs with and without a volume force, explicit, fitted at the longest of their steps", {}
    )
    shape_matching: ShapeMatching = key("Shape matching, fitted for each step", {})


class Elsewhere(Block):
    places: Whole = key("How many, spread over the surface; a bound of 90 % needs 9, and one more to try it", ge=10)
    tilts_degrees: list[Annotated[NotNegative, Field(le=80)]] = key(
        "Angles between the push and the inward normal, in turn", [0, 20, 45], min_length=1
    )
    change_of_peak: Change = key("As for all scenes", 0.01)
    max_halvings: Halvings = key("As for all scenes", 4)
    steps_per_frame: Some[Count] = key(STEPS_HELP, [1, 2, 4])


class Truth(Block):
    elements: Literal["quadratic", "linear"] = key(
        "Quadratic ones, by whose limit models are judged, of a held body that is no sheet, under gravity, pushes and "
        "instruments that are spheres or capsules; or linear ones of any scene, which say until when they agree",
        "quadratic",
    )
    levels: Whole = key("How many levels, from the coarsest on; 3 at least of quadratic elements", 3, ge=2, le=4)
    steps_per_frame: Count = key("Steps in each frame, and a half (and of quadratic ones a quarter) of their length", 2)


class Contact(Block):
    instruments: list[Instrument] = key("Instruments in place of the scene's")


class Training(Block):
    model_config = ConfigDict(json_schema_extra={"minProperties": 1})
    duration_s: Positive = optional("How long it is followed [s]")
    others: list[Other] | None = optional("Further bodies of the scene's kind")
    gravity: Gravity | None = optional("Weight")
    push: Push | None = optional("Loads that push")
    contact: Contact | None = optional("What the body meets")


class Followed(Block):
    duration_s: Positive = optional("How long [s]; its own, but 1 s at most unless it is pressed later, if left out")
    frames: Count = optional("As for all scenes")
    change_of_peak: Change = optional("As for all scenes")
    max_halvings: Halvings = optional("As for all scenes")
    level: Index = optional(
        "The reference's level, 0 is the coarse one; if left out, the scene's, but at least 1. A sheet's level 0 has "
        "half of its divisions",
        le=3,
    )
    models: Some[
        Literal[
            "fem_coarse", "fem_fine", "detail_correction", "moving_modes", "path_modes", "region_modes", "springs",
            "springs_volume", "shape_matching", "xpbd", "projective_dynamics", "vertex_block_descent",
        ]
    ] = optional("Models that are tried beside the reference's; all that can do the scene if left out")  # fmt: skip
    settings: Annotated[Families, KEPT] = optional("What its models are tried with instead")
    truth: Truth = optional(
        "Say how well its motion is known, and judge its models by the limit of quadratic elements instead of linear "
        "elements of one mesh"
    )
    elsewhere: Elsewhere = optional(
        "The same scene with its push, of the same force and course, at other places and in other directions: what "
        "bounds of errors are made of. Of a scene with one push that moves one held body"
    )
    held_out: Whole = optional(
        "Random strokes that region_modes is not shown: what bounds of its errors are made of; 9 for one of 90 %, and "
        "one more to try it",
        ge=10,
    )
    training: Training | None = optional(
        "The motion that models are fitted to, at another place and on another course: what differs from the scene; "
        "if left out, a share of the loads at the same place"
    )


class Settings(Block):
    """How wrong each model is in motion, against fine finite elements at steps halved until they suffice."""

    frames: Count = key("Equal parts of each scene, at whose ends motions are compared", 20)
    change_of_peak: Change = key("Change of the reference's worst frame by its last halved step, of the peak", 0.01)
    max_halvings: Halvings = key("Times that the reference's step is halved, from one a frame, before giving up", 6)
    scenes: dict[Name, Followed] = optional(
        "Scenes, and how each is followed; left out, all take part in which one held body that is no sheet moves "
        "under gravity or push alone. With contact, several bodies of a kind, a sheet, nothing held or plasticity, a "
        "scene takes part if its training is described",
        min_length=1,
    )
    settings: Families = key("What each family of models is tried with: there is one point in the diagram for each", {})


def check(config: dict, file: Path) -> None:
    """Raise InputError for a scene that is unknown, or on which models cannot be compared, or if there is none."""
    scenes, bodies, asked = config.get("scenes", {}), config["bodies"], config["dynamic"].get("scenes")
    if asked is None:
        _check_any(file, scenes, bodies)
        return
    place = f"{file}: dynamic.scenes"
    for name, own in asked.items():
        if name not in scenes:
            known = ", ".join(scenes) or "there are none"
            raise InputError(f"{place} names {name}, which is not a scene; choose from scenes: {known}.")
        entry, body = scenes[name], bodies.get(scenes[name]["body"], {})
        check_compared(place, name, entry, body.get("kind", ""), taught(own))
        for model in own.get("models") or []:
            if reason := unable(model, entry, body.get("kind", "")):
                raise InputError(
                    f"{place}.{name}.models names {model}, which cannot do it, as {name} {reason}; leave it out."
                )
        if own.training is not None:
            _check_training(f"{place}.{name}.training", entry, own.training)
        if own.get("truth", {}).get("elements") == "quadratic":
            if own["truth"]["levels"] < 3:
                raise InputError(f"{place}.{name}.truth.levels is 2, and quadratic elements need 3; give that.")
            bedded = "lies on a bed, which models in motion do without" if body.get("bed") else ""
            if reason := unable("truth", entry, body.get("kind", "")) or bedded:
                raise InputError(
                    f"{place}.{name} has truth, which is found of held solids alone, and {name} {reason}; leave it out."
                )
        if "held_out" in own and "region_modes" not in own.get("models", []):
            raise InputError(f"{place}.{name}.held_out is for region_modes; add that to its models, or leave it out.")
        if "elsewhere" in own:
            _check_elsewhere(f"{place}.{name}.elsewhere", entry, bodies.get(entry["body"], {}).get("kind", ""))


def _check_training(place: str, scene: Scene, training: Training) -> None:
    """Raise InputError, naming ``place``, for a motion that models cannot be fitted to."""
    for name in training:
        if name not in ("duration_s", "others") and getattr(scene, name) is None:
            raise InputError(f"{place} describes {name}, which the scene has not; leave it out.")
    if any(other.body != scene.body for other in training.others or []):
        raise InputError(f"{place}.others names another body than {scene.body}; name that one.")
    if scene.contact and training.contact:
        check_instruments(place, scene.but(contact=scene.contact.but(**training.contact)))
    if training.push:
        check_loads(place, scene.but(push=training.push, hooks=None))


def _check_elsewhere(place: str, scene: Scene, kind: str) -> None:
    """Raise InputError, naming ``place``, for a scene without one push, or one that models cannot be asked in."""
    pushes = len(scene.pushes)
    reason = unable("moving_modes", scene, kind) or ("" if pushes == 1 else f"has {pushes} pushes")
    if reason:
        raise InputError(
            f"{place} moves the one push of a held body to other places, and the scene {reason}; leave it out."
        )


def _check_any(file: Path, scenes: dict, bodies: dict) -> None:
    known = {name: entry for name, entry in scenes.items() if entry["body"] in bodies}  # of others the scenes' check
    found, left_out = compared_scenes(known, bodies)
    if not found:
        reasons = "; ".join(f"{name} {reason}" for name, reason in left_out.items()) or "there is no scene"
        raise InputError(
            f"{file}: dynamic is there and models can be compared in no scene ({reasons}); "
            "add a scene of one held body with gravity or push and without contact, or remove dynamic."
        )
