"""Find from the settings of scenes in which of them models can be compared in motion."""

from collections.abc import Mapping, Sequence

from palpate.bodies.settings import Body
from palpate.errors import InputError
from palpate.scenes.settings import Scene

LOADS = ("gravity", "push")
"""Effects that a compared scene takes over from its scene, and that can be made larger or smaller."""
TAKEN_OVER = (*LOADS, "contact", "plasticity")
"""All effects that a compared scene takes over from its scene."""
UNKNOWN_TO_MODELS = ("prony", "body_springs", "maxwell", "hooks", "threads", "cut")
"""Effects that not all models have, so that scenes with them are left out, even if models are fitted there."""
FITTED = ("springs", "springs_volume", "shape_matching")
"""Models that are fitted to another motion."""
CORRECTED = ("detail_correction", "moving_modes")
"""Models of one held solid that are built on its linear response to all loads."""
STROKED = ("path_modes", "region_modes")
"""Models of one held solid that is touched by instruments and nothing else."""
TRUTH = "truth"
"""The truth of a motion: it exists for one held solid under gravity, pushes, and spheres or capsules that touch it."""
LONGEST_S = 1.0
"""Time [s] up to which motions are compared in a scene, unless it is pressed later."""


def unfit(scene: Scene, kind: str = "", taught: bool = False) -> str:
    """Return why models cannot be compared in a scene, such as "has contact"; empty if they can.

    kind : of its body; taught : whether models have a motion to be fitted to
    """
    not_in_all = UNKNOWN_TO_MODELS if taught else ("plasticity", *UNKNOWN_TO_MODELS)
    lacking = [*(name for name in not_in_all if acts(name, scene)), *scene.own]
    driving = [*LOADS, "contact"] if taught else LOADS
    untaught = not taught  # then models are fitted to a share of the loads, which does not suffice for all scenes
    reasons = [
        ("has contact", untaught and acts("contact", scene)),
        ("has several bodies", untaught and bool(scene.others)),
        ("moves a sheet", untaught and kind == "sheet"),
        ("is not held", untaught and not scene.held),
        (f"has none of {' and '.join(driving)}", not any(acts(effect, scene) for effect in driving)),
        ("has bodies of several kinds", any(each.body != scene.body for each in scene.others)),
        ("does not start at rest", scene.start != "rest"),
        (f"has {' and '.join(lacking)}, which not all models have", bool(lacking)),
    ]
    return next((reason for reason, is_so in reasons if is_so), "")


def acts(name: str, scene: Scene) -> bool:
    """Return whether an effect that has a block acts in a scene."""
    return getattr(scene, name) is not None


def check_compared(place: str, name: str, scene: Scene, kind: str = "", taught: bool = False) -> None:
    """Raise InputError, naming ``place``, for a scene ``name`` in which models cannot be compared."""
    if reason := unfit(scene, kind, taught):
        cure = "" if taught or unfit(scene, kind, True) else "describe a motion to fit models to as its training, or "
        raise InputError(f"{place} names {name}, which {reason}; {cure}choose another scene.")


def unable(model: str, scene: Scene, kind: str = "") -> str:
    """Return why a model cannot do a compared scene, such as "has plasticity", or ""; kind : of the scene's body."""
    acting = {name for name in TAKEN_OVER if acts(name, scene)}
    corrected, stroked = model in CORRECTED, model in STROKED
    rounded = stroked or model == TRUTH
    one_solid = corrected or rounded
    known_effects = {*LOADS, "contact"} if model == TRUTH else set(LOADS) if corrected else {"contact"}
    not_known, tools = sorted(acting - known_effects), scene.contact.instruments if scene.contact else []
    shapes = sorted({tool.kind for tool in tools} - {"sphere", "capsule"})
    reasons = [
        ("has plasticity", model in ("springs", "springs_volume") and "plasticity" in acting),
        ("moves a sheet", (one_solid or model == "springs_volume") and kind == "sheet"),
        (f"has {' and '.join(not_known)}", one_solid and bool(not_known)),
        ("has several bodies", one_solid and bool(scene.others)),
        ("is not held", one_solid and not scene.held),
        ("has no instrument that moves", stroked and not any(tool.times_s for tool in tools)),
        ("has a body that touches itself", rounded and bool(scene.contact and scene.contact.self_contact)),
        (f"is touched by a {' and a '.join(shapes)} and not by spheres and capsules", rounded and bool(shapes)),
    ]
    return next((reason for reason, is_so in reasons if is_so), "")


def compared_scenes(scenes: Mapping[str, Scene], bodies: Mapping[str, Body]) -> tuple[dict[str, float], dict[str, str]]:
    """Return how long each scene is followed [s] in which models can be compared, and why the others are left out.

    A scene is followed to its end, but no longer than LONGEST_S or, if that is later, than until all is pressed.
    """
    reasons = {name: unfit(scene, bodies[scene.body].kind) for name, scene in scenes.items()}
    durations = {name: followed(scene) for name, scene in scenes.items() if not reasons[name]}
    return durations, {name: reason for name, reason in reasons.items() if reason}


def followed(scene: Scene) -> float:
    """Return how long a scene is followed [s] if nobody says so."""
    loads = scene.push.loads if scene.push else []
    return min(scene.duration_s, max([LONGEST_S, *(load.start_s + load.press_s for load in loads)]))


def fits(models: Sequence[str] | None) -> bool:
    """Return whether one of the models that are asked for, or of all, is fitted to a motion."""
    return any(name in FITTED for name in models or FITTED)
