"""Settings of models in motion."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from palpate.benchmark.comparable import check_compared, compared_scenes, fits, unable
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
    Index,
    Name,
    Positive,
    Share,
    Some,
    Whole,
    key,
    optional,
    plain,
    rows,
)  # fmt: skip

Change = Annotated[Positive, Field(le=0.2)]
Halvings = Annotated[Whole, Field(ge=2)]
Evaluations = Annotated[Whole, Field(ge=5)]
STEPS_HELP = "Steps in each frame"
EVALUATIONS = "Motions that a fit may compute"
TRIED: dict[str, dict[str, Any]] = {
    "fem_coarse": {"tolerances": [0.01], "gaps": [0.25, 4]},
    "fem_fine": {"steps_per_frame": [3], "tolerances": [0.01]},
    "moving_modes": {"steps_per_frame": [1, 2, 4], "vibrations": 10, "bent": 3, "missed": 0.02, "tolerances": [0.1]},
    "path_modes": plain(Touching()) | {"steps_per_frame": [2, 4]},
    "region_modes": plain(Touching(modes=30, states=60))
    | {"steps_per_frame": [2, 4], "half_width_m": 0.05, "strokes": 36},
}
"""What models are tried with besides ``dynamic.settings``, at the middle number of steps but for that number itself.

tolerances : relative residuals at which a step counts as found, beside the scene's; of modes other values of missed
gaps : distances at which contact begins to repel, in multiples of the scene's, where there is contact
vibrations, bent : vibration modes, slowest first, and how many of them get modes of second order, with each load's
missed : by how much the few cells that energy is taken from may misplace the body in motions held out, relative
half_width_m, strokes : how far the region reaches to each side of the path's middle, and random strokes in it
"""
OF_PLACES: dict[str, Any] = {"tilts_degrees": [0, 20, 45], "max_halvings": 4}
"""Angles between pushes elsewhere and the inward normal, in turn, and how often their reference's step is halved."""
MAX_HALVINGS = 6
"""The same of other references, unless a scene says so."""


class FemCoarse(Block):
    steps_per_frame: Some[Count] = key(STEPS_HELP, [1, 2, 4])


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


class Families(Block):
    fem_coarse: FemCoarse = key("Finite elements on the coarse level, stepped implicitly", {})
    relaxed: Relaxed = key(
        "Methods that relax elements one by one in each step, of graphics and games, from cheap to expensive; settings "
        "on levels that a scene lacks are left out",
        {},
    )
    springs: Springs = key(
        "Springs with and without a volume force, explicit, fitted at the longest of their steps", {}
    )
    shape_matching: ShapeMatching = key("Shape matching, fitted for each step", {})


def tried(asked: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    """Return what each model is tried with: as a scene's ``own`` settings say, else those of all.

    asked, own : plain ``dynamic.settings`` and those of a scene
    """
    return {name: TRIED.get(name, {}) | asked.get(name, {}) | own.get(name, {}) for name in asked | TRIED}


class Elsewhere(Block):
    places: Whole = key("How many, spread over the surface; a bound of 90 % needs 9, and one more to try it", ge=10)
    change_of_peak: Change = key("As for all scenes", 0.01)
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
    duration_s: Positive | None = optional("How long it is followed [s]")
    others: list[Other] | None = optional("Further bodies of the scene's kind")
    gravity: Gravity | None = optional("Weight")
    push: Push | None = optional("Loads that push")
    contact: Contact | None = optional("What the body meets")


class Followed(Block):
    duration_s: Positive | None = optional(
        "How long [s]; its own, but 1 s at most unless it is pressed later, if left out"
    )
    frames: Count | None = optional("As for all scenes")
    change_of_peak: Change | None = optional("As for all scenes")
    max_halvings: Halvings | None = optional(
        "Times that the reference's step is halved, from one a frame, before giving up; 6 if left out"
    )
    level: Index | None = optional(
        "The reference's level, 0 is the coarse one; if left out, the scene's, but at least 1. A sheet's level 0 has "
        "half of its divisions",
        le=3,
    )
    models: Some[
        Literal[
            "fem_coarse", "fem_fine", "detail_correction", "moving_modes", "path_modes", "region_modes", "springs",
            "springs_volume", "shape_matching", "xpbd", "projective_dynamics", "vertex_block_descent",
        ]
    ] | None = optional(
        "Models that are tried beside the reference's; all that can do the scene if left out"
    )  # fmt: skip
    settings: Annotated[Families, KEPT] | None = optional("What its models are tried with instead")
    truth: Truth | None = optional(
        "Say how well its motion is known, and judge its models by the limit of quadratic elements instead of linear "
        "elements of one mesh"
    )
    elsewhere: Elsewhere | None = optional(
        "The same scene with its push, of the same force and course, at other places and in other directions: what "
        "bounds of errors are made of. Of a scene with one push that moves one held body"
    )
    held_out: Whole | None = optional(
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
    scenes: dict[Name, Followed] | None = optional(
        "Scenes, and how each is followed; left out, all take part in which one held body that is no sheet moves "
        "under gravity or push alone. With contact, several bodies of a kind, a sheet, nothing held or plasticity, a "
        "scene takes part if its training is described",
        min_length=1,
    )
    settings: Families = key("What each family of models is tried with: there is one point in the diagram for each", {})


def check(config: Any, file: Path) -> None:
    """Raise InputError for a scene that is unknown, or on which models cannot be compared, or if there is none."""
    scenes, bodies, settings = config.scenes or {}, config.bodies, config.dynamic.scenes
    if settings is None:
        _check_any(file, scenes, bodies)
        return
    for name, own in settings.items():
        place = f"{file}: dynamic.scenes"
        if name not in scenes:
            names = ", ".join(scenes) or "there are none"
            raise InputError(f"{place} names {name}, which is not a scene; choose from scenes: {names}.")
        body = bodies.get(scenes[name].body)  # of others the scenes' check
        kind, bed, taught = getattr(body, "kind", ""), getattr(body, "bed", None), own.training or not fits(own.models)
        check_compared(place, name, scenes[name], kind, bool(taught))
        _check_followed(f"{place}.{name}", name, scenes[name], own, kind, bool(bed))


def _check_followed(place: str, name: str, scene: Scene, own: Followed, kind: str, bedded: bool) -> None:
    """Raise InputError, naming ``place``, for what cannot be asked of a scene and its body."""
    for model in own.models or []:
        if reason := unable(model, scene, kind):
            raise InputError(f"{place}.models names {model}, which cannot do it, as {name} {reason}; leave it out.")
    if own.training is not None:
        _check_training(f"{place}.training", scene, own.training)
    if own.truth is not None and own.truth.elements == "quadratic":
        if own.truth.levels < 3:
            raise InputError(f"{place}.truth.levels is 2, and quadratic elements need 3; give that.")
        on_bed = "lies on a bed, which models in motion do without" if bedded else ""
        if reason := unable("truth", scene, kind) or on_bed:
            raise InputError(
                f"{place} has truth, which is found of held solids alone, and {name} {reason}; leave it out."
            )
    if own.held_out is not None and "region_modes" not in (own.models or []):
        raise InputError(f"{place}.held_out is for region_modes; add that to its models, or leave it out.")
    if own.elsewhere is not None:
        _check_elsewhere(f"{place}.elsewhere", scene, kind)


def _check_training(place: str, scene: Scene, training: Training) -> None:
    """Raise InputError, naming ``place``, for a motion that models cannot be fitted to."""
    for name in ("gravity", "push", "contact"):
        if getattr(training, name) is not None and getattr(scene, name) is None:
            raise InputError(f"{place} describes {name}, which the scene has not; leave it out.")
    if any(other.body != scene.body for other in training.others or []):
        raise InputError(f"{place}.others names another body than {scene.body}; name that one.")
    if scene.contact and training.contact:
        check_instruments(place, scene.but(contact=scene.contact.but(instruments=training.contact.instruments)))
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
    """Raise InputError where models can be compared in none of the scenes."""
    with_body = {name: entry for name, entry in scenes.items() if entry.body in bodies}  # of others the scenes' check
    comparable, left_out = compared_scenes(with_body, bodies)
    if not comparable:
        reasons = "; ".join(f"{name} {reason}" for name, reason in left_out.items()) or "there is no scene"
        raise InputError(
            f"{file}: dynamic is there and models can be compared in no scene ({reasons}); "
            "add a scene of one held body with gravity or push and without contact, or remove dynamic."
        )
