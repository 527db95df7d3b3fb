"""Check that a scene's entry suits a dynamic trial of models, before anything is made of it."""

from palpate.errors import InputError
from palpate.scenes.contact_settings import has_contact

LOADS = ("gravity", "push")
"""Effects that a trial takes over from its scene; it is held in any case."""


def check_trial(place: str, name: str, entry: dict) -> None:
    """Raise InputError, naming ``place``, for a scene ``name`` with contact, or whose loads are none of LOADS."""
    if has_contact(entry):
        raise InputError(f"{place} names {name}, which has contact; choose a scene without.")
    if not any(effect in entry for effect in LOADS):
        raise InputError(f"{place} names {name}, which has none of {' and '.join(LOADS)}; choose another scene.")
