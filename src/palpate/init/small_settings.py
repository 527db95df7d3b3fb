"""Small settings of a first run: one kind of press, few contacts, and the models that a first look needs."""

from hashlib import sha256
from pathlib import Path
from typing import Any

import yaml

from palpate.files import write_whole

CONTACTS, PRESSES = 8, 2
"""Places that are pressed, and presses at each; with fewer contacts bounds of errors say little."""
MODELS = ["linear_fem", "warped_compliance", "contact_modes", "fast_fem", "fem_p1", "fem_p2", "interpolation"]
"""Models that answer within 100 ms, or that others are measured by; those that learn need more contacts."""
PRESS = {"contacts": 32, "modes": "columns", "samples": 4}
"""Of the model in the report's page that can be pressed: on a liver from a CT 71 % of places are answered without a
doubt, and with 8 contacts 50 %, for 54 and 53 s of a core."""
_ABOUT = """\
# The small settings of palpate try, for a first look: {regime} presses only, {contacts} contacts, {models} models,
# and a mesh that is refined once. config.yaml beside this file has all; change that one, and go on with
#   {command}
"""
_MARK = "# palpate try wrote this and config.yaml: "


def small_settings(config: dict[str, Any]) -> dict[str, Any]:
    """Return what is asked of the body of a first configuration in a few minutes, on a mesh that is refined once."""
    regime = list(config["regimes"])[-1]
    tradeoff = config["tradeoff"]
    return {
        "bodies": {name: entry | {"refinements": 1} for name, entry in config["bodies"].items()},
        "regimes": {regime: config["regimes"][regime]},
        "tradeoff": {
            "contacts": min(CONTACTS, tradeoff["contacts"]),
            "presses": tradeoff["presses"][:PRESSES],
            "models": MODELS,
            "budget_s": 0.05,
            "truth": {"check_samples": 0},
            "advice": tradeoff["advice"],
        },
        "press": {"radius_m": config["regimes"][regime]["radius_m"], **PRESS},
    }


def write_small(config: Path, command: str) -> Path:
    """Write try.yaml beside a first configuration, marked with both files' contents; return its path.

    command : that runs the whole configuration
    """
    settings = small_settings(yaml.safe_load(config.read_text(encoding="utf-8")))
    (regime,) = settings["regimes"]
    counts = {"contacts": settings["tradeoff"]["contacts"], "models": len(settings["tradeoff"]["models"])}
    about = _ABOUT.format(regime=regime, command=command, **counts)
    text = about + yaml.safe_dump(settings, sort_keys=False, allow_unicode=True, width=120)
    file = config.with_name("try.yaml")
    with write_whole(file) as part:
        part.write_text(f"{_MARK}{_digest(config, text)}\n{text}", encoding="utf-8")
    return file


def is_unchanged(folder: Path) -> bool:
    """Return whether ``folder`` holds a config.yaml and a try.yaml as ``write_small`` left them."""
    try:
        mark, _, text = (folder / "try.yaml").read_text(encoding="utf-8").partition("\n")
        return mark == f"{_MARK}{_digest(folder / 'config.yaml', text)}"
    except (OSError, UnicodeDecodeError):
        return False


def _digest(config: Path, text: str) -> str:
    return sha256(config.read_bytes() + text.encode()).hexdigest()[:16]
