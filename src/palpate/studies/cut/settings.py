"""Settings of the study of cuts."""

from pathlib import Path
from typing import Any

from palpate.benchmark.settings import check_refined
from palpate.bodies.cutting.settings import CutSettings
from palpate.errors import InputError
from palpate.setting_types import Block, Name, Positive, Vector, key


class Hook(Block):
    at_m: Vector = key("Point [m] whose nearest surface node of the coarsest level is grasped, with what is around it")
    radius_m: Positive = key("Radius [m] of what is grasped")
    shift_m: Vector = key("How far that is moved [m]")


class Pull(Block):
    body: str = key("Body that is cut, by name")
    cut: CutSettings = key("The cut")
    hooks: list[Hook] = key("What pulls the lips apart", min_length=1)


class Settings(Block):
    """Bodies that are cut and whose lips hooks pull apart, for every model that can follow a cut."""

    cuts: dict[Name, Pull] = key("Cuts and what pulls, by name", {})
    budget_s: Positive = key("Time [s] for which each setting is cut and asked again, beyond once", 1.0)


def check(config: Any, file: Path) -> None:
    """Raise InputError where nothing is cut, or bodies that there are not or that are not refined."""
    place, cuts = f"{file}: cut.cuts", config.cut.cuts
    if not cuts:
        raise InputError(f"{place} is empty; give it an entry, or remove the block cut.")
    for name, entry in cuts.items():
        check_refined(f"{place}.{name}.body", [entry.body], config.bodies)
