"""Check of the settings of paper 2's springs."""

from pathlib import Path

from palpate.errors import InputError


def check(config: dict, file: Path) -> None:
    """Raise InputError for what would else be found only when the springs are simulated."""
    place, settings = f"{file}: springs", config["springs"]
    low, high = settings["young_pa"]
    if low >= high:
        raise InputError(f"{place}.young_pa is [{low:g}, {high:g}]; give the lower number first.")
    duration, step = settings["duration_s"], settings["step_s"]
    if duration < step:
        raise InputError(
            f"{place}.duration_s is {duration:g}, and step_s {step:g}; give the time of one step at least."
        )
    side = settings["side_m"]
    for number, point in enumerate(settings["key_points_m"]):
        if not all(0 <= coordinate <= side for coordinate in point):
            raise InputError(
                f"{place}.key_points_m[{number}] is {point}, which is outside the cube; "
                f"give coordinates from 0 to side_m, {side:g}."
            )
