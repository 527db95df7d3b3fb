"""Find the scenes in which models can be compared in motion, before anything is made of them."""

from palpate.errors import InputError
from palpate.scenes.contact_settings import has_contact

LOADS = ("gravity", "push")
"""Effects that a trial takes over from its scene; it is held in any case."""
UNKNOWN_TO_MODELS = ("plasticity", "prony", "body_springs")
"""Effects that not all models have."""
LONGEST_S = 1.0
"""Up to when a scene is followed whose duration is not given for the comparison, unless it is pressed later."""


def unfit(entry: dict, kind: str = "") -> str:
    """Return why models cannot be compared in a scene, such as "has contact"; empty if they can.

    entry : the scene's, complete; kind : of its body
    """
    listed = entry.get("effects", "auto")
    own = entry.get("own", {})
    acting = [*entry, *own] if listed == "auto" else listed
    other = [name for name in [*UNKNOWN_TO_MODELS, *own] if name in acting]
    reasons = {
        "has contact": has_contact(entry),
        f"has none of {' and '.join(LOADS)}": not any(effect in entry for effect in LOADS),
        "has several bodies": bool(entry.get("others")),
        "moves a sheet": kind == "sheet",
        "is not held": not entry.get("held", True),
        "does not start at rest": entry.get("start", "rest") != "rest",
        f"has {' and '.join(other)}, which not all models have": bool(other),
    }
    return next((reason for reason, holds in reasons.items() if holds), "")


def check_trial(place: str, name: str, entry: dict, kind: str = "") -> None:
    """Raise InputError, naming ``place``, for a scene ``name`` in which models cannot be compared."""
    if reason := unfit(entry, kind):
        raise InputError(f"{place} names {name}, which {reason}; choose another scene.")


def trials(scenes: dict, bodies: dict) -> tuple[dict[str, float], dict[str, str]]:
    """Return how long each scene is followed [s] in which models can be compared, and why the others are left out.

    A scene is followed to its end, but no longer than LONGEST_S or, if that is later, than until all is pressed.
    """
    left_out = {name: unfit(entry, bodies[entry["body"]]["kind"]) for name, entry in scenes.items()}
    left_out = {name: reason for name, reason in left_out.items() if reason}
    kept = {name: entry for name, entry in scenes.items() if name not in left_out}
    return {name: min(entry["duration_s"], max(LONGEST_S, _pressed(entry))) for name, entry in kept.items()}, left_out


def _pressed(entry: dict) -> float:
    """Return when all loads of a scene are pressed [s]."""
    return max((load["start_s"] + load["press_s"] for load in entry.get("push", {}).get("loads", [])), default=0.0)
