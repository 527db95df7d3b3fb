"""The settings of a run: what they may be, their defaults, and what is wrong with them in one sentence."""

import json
import math
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError, create_model

from palpate.benchmark.settings import Regime
from palpate.bodies.settings import Body, check_body
from palpate.errors import InputError
from palpate.run.settings_errors import explain
from palpate.setting_types import Block, Count, Name, Positive, Whole, key, optional

STUDIES = (
    "tradeoff",
    "press",
    "touch",
    "law",
    "dynamic",
    "measured",
    "hard_cases",
    "scaling",
    "scenes",
    "palpation",
    "ct",
    "enrichment",
    "springs",
    "organ_springs",
    "shape_matching",
    "collision",
)
"""The studies, in the order of the report: a line registers palpate.studies.<name>. Its ``settings.Settings`` says what
its block may hold, and ``settings.check(config, file)``, if there is one, refuses what single settings do not show."""


class Solver(Block):
    tolerance: Positive = key("Relative residual at which coarse (run-time) solves stop", 1e-8, le=1e-4)
    reference_tolerance: Positive = key(
        "Relative residual at which fine solves stop that models learn from", 1e-6, le=1e-4
    )
    samples_per_job: Count = key("Fine samples that one job simulates", 15)


class Timing(Block):
    repeats: Whole = key("Calls timed a deformation", 100, ge=5)


class Shared(Block):
    """Every setting of a run. Lengths in m, forces in N, stresses in Pa, masses in kg."""

    model_config = ConfigDict(title="palpate configuration")
    seed: Whole = key("Seed of every random choice (contacts, splits, folds)", 1, ge=0, le=2147483647)
    bodies: dict[Name, Body] = key("The bodies, by name", {})
    regimes: dict[Name, Regime] = optional("How hard bodies are pressed in the trade-off, by name", min_length=1)
    solver: Solver = key("Newton's method for static equilibrium", {})
    timing: Timing = key("How online costs are timed", {})


def complete(config: dict, file: Path) -> dict:
    """Return ``config`` with the defaults filled in; raise InputError naming ``file``, the key and the remedy."""
    config = {name: {} if value is None else value for name, value in config.items()}
    asked = asked_for(config)
    for place, value in _leaves(config):
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError(f"{file}: {place} is {value}; give a finite number.")
    try:
        config = _model(*asked).model_validate(config)  # type: ignore[assignment]
    except ValidationError as error:
        raise InputError(f"{file}: {explain(error.errors(), config, json_schema())}") from None
    for name, body in config["bodies"].items():
        check_body(f"{file}: bodies.{name}", body, file.parent)
    if not asked:
        raise InputError(f"{file}: nothing is asked for; add the block of a study: {', '.join(STUDIES)}.")
    for study in asked:
        if check := getattr(_module(study), "check", None):
            check(config, file)
    return config


def asked_for(config: dict) -> list[str]:
    """Return the studies that have a block in ``config``, in the order of the report."""
    return [name for name in STUDIES if name in config]


def defaults(study: str, **given: Any) -> dict:
    """Return the block of a study in which nothing else is given."""
    return TypeAdapter(_module(study).Settings).validate_python(given)


def json_schema() -> dict:
    """Return the JSON schema of all settings, with which editors complete and explain keys."""
    return _model(*STUDIES).model_json_schema()


def _module(study: str) -> Any:
    return import_module(f"palpate.studies.{study}.settings")


@cache
def _model(*studies: str) -> type[BaseModel]:
    """Return the model of settings with the blocks of ``studies``; no other study is imported, which takes long."""
    blocks: dict[str, Any] = {study: (_module(study).Settings, optional()) for study in studies}
    return create_model("Config", __base__=Shared, __doc__=Shared.__doc__, **blocks)


def _leaves(value: object, place: str = "") -> Iterator[tuple[str, object]]:
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _leaves(inner, f"{place}.{name}" if place else str(name))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from _leaves(inner, f"{place}[{i}]")
    else:
        yield place, value


if __name__ == "__main__":
    [target] = sys.argv[1:]
    Path(target).write_text(json.dumps(json_schema(), ensure_ascii=False) + "\n", encoding="utf-8")
