"""The settings of a run: what they may be, their defaults, and how a file of them is read."""

import json
import re
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, Literal

import yaml
from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError, create_model

from palpate.benchmark.settings import Regime
from palpate.bodies.settings import Body, check_body
from palpate.errors import InputError
from palpate.explain import explain
from palpate.setting_types import Block, Count, Name, Positive, Some, Whole, key, optional

STUDIES = (
    "tradeoff",
    "press",
    "touch",
    "cut",
    "law",
    "dynamic",
    "measured",
    "outside",
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
    studies: Some[Literal[STUDIES]] | None = key(  # type: ignore[valid-type]
        "Studies that are computed unless one is asked for by name; null: all whose block is there", None
    )
    bodies: dict[Name, Body] = key("The bodies, by name", {})
    regimes: dict[Name, Regime] = optional("How hard bodies are pressed in the trade-off, by name", min_length=1)
    solver: Solver = key("Newton's method for static equilibrium", {})
    timing: Timing = key("How online costs are timed", {})
    own_models: dict[Name, str] = key(
        "Python files of your own models, by name, relative to this configuration: each study whose kind of question "
        "one answers asks it",
        {},
    )


class _Loader(yaml.SafeLoader):
    """Numbers as in YAML 1.2, where 1e-8 is one and 010 is ten; no key twice, of which YAML takes the last."""

    yaml_implicit_resolvers: ClassVar[dict] = {
        first: [each for each in found if each[0].rpartition(":")[2] not in ("int", "float")]
        for first, found in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        return int(node.value)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        names: set[str] = set()
        for name, _ in node.value:
            if not isinstance(name, yaml.ScalarNode):
                raise yaml.MarkedYAMLError(problem="brackets where a key belongs", problem_mark=name.start_mark)
            if name.value in names:
                raise yaml.MarkedYAMLError(problem=f"the key {name.value} again", problem_mark=name.start_mark)
            names.add(name.value)
        return super().construct_mapping(node, deep)


_FLOAT = r"[-+]?(\.\d+|\d+(\.\d*)?)([eE][-+]?\d+)?$|[-+]?\.(inf|Inf|INF)$|\.(nan|NaN|NAN)$"
_Loader.add_implicit_resolver("tag:yaml.org,2002:int", re.compile(r"[-+]?\d+$"), [*"-+0123456789"])
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(_FLOAT), [*"-+.0123456789"])
_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_yaml_int)


def read_settings(file: Path) -> dict:
    """Return the settings in a YAML file as they are given; InputError naming the line if it cannot be read."""
    try:
        settings = yaml.load(file.read_text(encoding="utf-8-sig"), _Loader)
    except yaml.MarkedYAMLError as error:
        line = f"line {error.problem_mark.line + 1}" if error.problem_mark else "it"
        raise InputError(f"{file}: {line} has {error.problem}; correct its YAML.") from None
    except (OSError, ValueError, yaml.YAMLError) as error:
        why = " ".join(str(error).split())
        raise InputError(f"{file} cannot be read ({why}); give the path of a YAML file in UTF-8.") from None
    if not isinstance(settings, dict):
        raise InputError(f"{file} has no keys at the beginning of its lines; give it bodies: and the block of a study.")
    return settings


def complete(given: dict, file: Path, needs_study: bool = True) -> Any:
    """Return the settings ``given`` in a file as one object; raise InputError naming ``file``, the key and the remedy.

    needs_study : whether bodies alone are refused
    """
    given = {name: {} if value is None and name != "studies" else value for name, value in given.items()}
    studies = asked_for(given)
    try:
        config: Any = _model(*studies).model_validate(given)
    except ValidationError as error:
        raise InputError(f"{file}: {explain(error.errors(), given, json_schema())}") from None
    if place := _null(given, config):
        raise InputError(f"{file}: {place} is null; leave it out, or write what it is, {{}} for a block of defaults.")
    for name, body in config.bodies.items():
        check_body(f"{file}: bodies.{name}", body, file.parent)
    if config.own_models:
        from palpate.models.model_registry import check_own

        check_own(file, config.own_models)
    if needs_study and not studies:
        raise InputError(f"{file}: nothing is asked for; add the block of a study: {', '.join(STUDIES)}.")
    if lacking := [name for name in config.studies or [] if name not in studies]:
        raise InputError(
            f"{file}: studies names {lacking[0]}, which has no block; add {lacking[0]}:, or remove the name."
        )
    for study in studies:
        if check := getattr(_module(study), "check", None):
            check(config, file)
    return config


def asked_for(config: dict) -> list[str]:
    """Return the studies that have a block in ``config``, in the order of the report."""
    return [name for name in STUDIES if name in config]


def defaults(study: str, **given: Any) -> Any:
    """Return the block of a study in which nothing else is given."""
    return TypeAdapter(_module(study).Settings).validate_python(given)


def json_schema() -> dict:
    """Return the JSON schema of all settings, with which editors complete and explain keys."""
    return _model(*STUDIES).model_json_schema()


def _module(study: str) -> Any:
    return import_module(f"palpate.studies.{study}.settings")


@cache
def _model(*studies: str) -> type[BaseModel]:
    """Return the model of settings with the blocks of ``studies``; others are None, and are not imported."""
    blocks: dict[str, Any] = {
        study: (_module(study).Settings if study in studies else None, optional()) for study in STUDIES
    }
    return create_model("Config", __base__=Shared, __doc__=Shared.own_doc, **blocks)


def _null(given: Any, made: Any, place: str = "") -> str:
    """Return the place of the first null in what is given for a setting that may be left out; empty if there is none.

    A key without a value asks for defaults as well as for nothing, which are not the same.
    """
    if isinstance(given, list):
        parts = [(f"{place}[{i}]", *both) for i, both in enumerate(zip(given, made, strict=True))]
    elif not isinstance(given, dict):
        return ""
    elif isinstance(made, BaseModel):
        for name in given:
            if given[name] is None and type(made).model_fields[name].validate_default is False:
                return f"{place}.{name}".removeprefix(".")
        parts = [(f"{place}.{name}", given[name], getattr(made, name)) for name in given]
    else:
        parts = [(f"{place}.{name}", given[name], made[name]) for name in given]
    nulls = (_null(inner, made_inner, inner_place.removeprefix(".")) for inner_place, inner, made_inner in parts)
    return next(filter(None, nulls), "")


if __name__ == "__main__":
    [target] = sys.argv[1:]
    Path(target).write_text(json.dumps(json_schema(), ensure_ascii=False) + "\n", encoding="utf-8")
