"""Read a portable model file, and say what it is, and what each of its errors is measured against."""

from pathlib import Path

from palpate.errors import InputError
from palpate.press.portable.runtimes.palpate_model import PortableModel

FOUR_ERRORS = (
    "Four errors are said of contact modes, each an RMSE over the peak.",
    "Advice has that at prepared contacts, against the truth: trust it to choose a model.",
    "press.csv has that of the file wherever a truth was simulated, against that truth: trust it for what the page "
    "shows.",
    "The file has that between its contacts, up to the hardest press, against contact modes prepared there, which have "
    "the first error themselves: trust it to choose how many contacts to prepare.",
    "An answer has a bound of its own error, which nine in ten keep: trust it for that answer.",
)
"""They stand wherever more than one of these errors is said."""


def read(path: Path | str) -> PortableModel:
    """Read a portable model; InputError naming the file if it is missing, cut off, damaged or of another version."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); give a file of palpate export.") from error
    try:
        return PortableModel(data)
    except ValueError as error:
        raise InputError(f"{path}: {error}; write it anew with palpate export.") from error


def describe(path: Path | str) -> str:
    """Return what a portable model file is, for the terminal; InputError as ``read``."""
    model, megabytes = read(path), Path(path).stat().st_size / 1e6
    info, setting = model.info, model.info.get("setting")
    setting_words = ", ".join(f"{name}={value}" for name, value in setting.items()) if isinstance(setting, dict) else ""
    lines = [
        f"{path}: {info.get('body')}, {info.get('regime')}: {info.get('model')} ({setting_words}), "
        f"{megabytes:.1f} MB, whole and sound",
        f"surface of {len(model.nodes)} nodes and {len(model.triangles)} triangles, {len(model.contacts)} contacts",
        f"pressed by discs of {1e3 * model.radius_m:g} mm radius, up to about {info.get('hardest_n', 0.0):.2g} N",
        "error: " + "\n  ".join(str(info.get("error")).split("; ")),
    ]
    if isinstance(stored := info.get("float32_error"), float):
        lines.append(f"at the contacts themselves the file costs {100 * stored:.2g} % of the peak")
    for kind, radius_m in dict.fromkeys((each.kind, each.radius_m) for each in model.touches):
        same = [each for each in model.touches if (each.kind, each.radius_m) == (kind, radius_m)]
        straight, tilted = (max(getattr(each, name) for each in same) for name in ("force_error", "tilted_force_error"))
        deepest = max(each.deepest_m for each in same)
        lines.append(
            f"{kind} of {1e3 * radius_m:.3g} mm at {len(same)} places, to {1e3 * deepest:.2g} mm; "
            f"force within {100 * straight:.2g} % straight in, {100 * tilted:.2g} % tilted, "
            "of elements of the same mesh"
        )
    return "\n".join([*lines, *FOUR_ERRORS])
