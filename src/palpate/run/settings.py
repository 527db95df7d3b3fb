"""The settings of a run: what they may be, their defaults, and what is wrong with them in one sentence."""

import json
import math
import re
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError, create_model

from palpate.benchmark.settings import Regime
from palpate.bodies.material import NAMED, PATTERN_EXPONENTIAL
from palpate.bodies.settings import Body, check_body
from palpate.errors import InputError, suggest
from palpate.setting_types import NAME, Block, Count, Name, Positive, Some, Whole, key, optional

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


def complete(config: dict, file: Path, needs_study: bool = True) -> dict:
    """Return ``config`` with the defaults filled in; raise InputError naming ``file``, the key and the remedy.

    needs_study : whether bodies alone are refused
    """
    config = {name: {} if value is None and name != "studies" else value for name, value in config.items()}
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
    if needs_study and not asked:
        raise InputError(f"{file}: nothing is asked for; add the block of a study: {', '.join(STUDIES)}.")
    if lacking := [name for name in config["studies"] or [] if name not in asked]:
        raise InputError(
            f"{file}: studies names {lacking[0]}, which has no block; add {lacking[0]}:, or remove the name."
        )
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


KINDS = {
    "object": "a block of keys",
    "array": "a list",
    "string": "a text",
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "null": "empty",
}
"""What a JSON schema calls the kinds of values, in words."""
LIMITS = {
    "greater_than_equal": "must be at least {ge:.12g}",
    "less_than_equal": "must be at most {le:.12g}",
    "greater_than": "must be above {gt:.12g}",
    "less_than": "must be below {lt:.12g}",
    "too_short": "must have at least {min_length} entries",
    "too_long": "must have at most {max_length} entries",
    "string_too_short": "must not be empty",
}
"""What pydantic calls the faults of a value, in words."""
WHOLE = ("extra_forbidden", "missing")
"""Faults of a block, which pydantic finds at one of its keys."""
PATTERNS = {
    r".+\.py": "the path of a Python file, such as law.py",
    PATTERN_EXPONENTIAL: NAMED[-1],
    "([2-9]|[1-9][0-9]+) iterations": "4 iterations",
}
"""What parts of patterns mean, in words."""


def explain(errors: Sequence[Any], config: dict, schema: dict) -> str:
    """Return one sentence for the outermost of the ``errors`` that pydantic found in ``config``.

    schema : the JSON schema of all settings, which has what keys mean
    """
    placed = [(_place(error, config), error) for error in errors]
    # where a list is given that may also be a text, what is wrong is inside it
    outer = {at[:n] for at, _ in placed for n in range(len(at))}
    placed = [(at, error) for at, error in placed if not (error["type"].endswith("_type") and at in outer)]
    place, error = min(placed, key=lambda each: (len(each[0]) - (each[1]["type"] in WHOLE), _rank(each[1])))
    if error["type"] in WHOLE:
        return _of_block(error["type"], place, config, schema)
    return _of_value(error, place, config, schema)


def _rank(error: Any) -> int:
    """Return what is said first of a place: of the alternatives that a value may be, the one of its kind says most."""
    return WHOLE.index(error["type"]) if error["type"] in WHOLE else 3 if error["type"].endswith("_type") else 2


def _of_value(error: Any, place: tuple, config: dict, schema: dict) -> str:
    """Explain a value that a key cannot have."""
    node, about, found = _described(place, config, schema)
    key, kind, limits = _written(place), error["type"], error.get("ctx", {})
    about = f" ({about})." if about else "."
    if kind == "lacks":
        return _of_block("missing", (*place, limits["name"]), config, schema)
    if kind == "union_tag_not_found" and isinstance(found, dict):
        return f"{key} lacks kind; add it{about}"
    if kind == "union_tag_invalid" and found["kind"] is not None:
        tags = limits["expected_tags"].replace("'", "")
        return f"{key}.kind is {found['kind']!r}, but must be one of {tags}{about}"
    if kind == "union_tag_invalid":
        key, found = f"{key}.kind", None
    if error["loc"][-1] == "[key]" or limits.get("pattern") == NAME:
        key, name = (_written(place[:-1]), place[-1]) if error["loc"][-1] == "[key]" else (key, found)
        return f"{key} has an entry {name!r}; name it in lower-case letters, digits and underscores."
    kinds, words = _kinds(node), _words(node)
    if words and found is not None:
        if "pattern" not in limits and set(kinds) <= {"string", "null"}:
            return f"{key} is {found!r}, but must be one of {', '.join(words)}{about}"
        return f"{key} is {found!r}; give {', '.join(words[:-1])}, or {words[-1]}{about}"
    if isinstance(found, str) and (remedy := _text_for(kinds, found)):
        return f"{key} is the text {found!r}; {remedy}{about}"
    if found is None or (kind in ("too_short", "entries") and not found):
        return f"{key} is empty; give it {'a value' if found is None else 'an entry'}, or remove the key{about}"
    told = LIMITS[kind].format(**limits) if kind in LIMITS else error["msg"]
    if kind not in LIMITS and kind not in ("entries", "distinct"):
        told = f"must be {' or '.join(KINDS[each] for each in kinds)}"
    return f"{key} is {found!r}, but {told}{about}"


def _of_block(kind: str, place: tuple, config: dict, schema: dict) -> str:
    """Explain a key that a block lacks, or does not know."""
    *outer, name = place
    key = _written(tuple(outer)) or "the file"
    if kind == "missing":
        meaning = _described(place, config, schema)[1]
        return f"{key} lacks {name}; add it" + (f" ({meaning})." if meaning else ".")
    known = list(_described(tuple(outer), config, schema)[0]["properties"])
    return f"{key} has an unknown key {name}; {suggest(str(name), known, 'it knows')}"


def _place(error: Any, config: Any) -> tuple:
    """Return the keys and numbers of entries in a place of pydantic's, which also says what alternatives it tried."""
    place: list = []
    for step in error["loc"]:
        inside = step in config if isinstance(config, dict) else isinstance(config, list) and isinstance(step, int)
        if inside:
            place.append(step)
            config = config[step]
    if error["type"] == "missing":
        place.append(error["loc"][-1])
    return tuple(place)


def _written(place: tuple) -> str:
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in place).removeprefix(".")


def _described(place: tuple, config: Any, schema: dict) -> tuple[dict, str, Any]:
    """Return the part of the JSON schema at ``place``, what it or the list that it is in means, and the value there."""
    node, about = _resolved(schema, schema, config), ""
    for step in place:
        config = config.get(step) if isinstance(config, dict) else config[step]
        named = isinstance(step, str) and step in node.get("properties", {})
        others = [*node.get("patternProperties", {}).values()]
        others.append(node.get("items" if isinstance(step, int) else "additionalProperties") or {})
        node = _resolved(node["properties"][step] if named else others[0], schema, config)
        about = node.get("description", "" if named else about)
    return node, about.rstrip("."), config


def _resolved(node: dict, schema: dict, value: Any) -> dict:
    """Follow references, and choose the alternative that ``value`` is of, if it is a block or a list."""
    if "$ref" in node:
        own = {key: each for key, each in node.items() if key != "$ref"}
        return _resolved(schema["$defs"][node["$ref"].rpartition("/")[2]] | own, schema, value)
    wanted = "object" if isinstance(value, dict) else "array" if isinstance(value, list) else ""
    alternatives = [_resolved(each, schema, value) for each in node.get("anyOf", []) if set(each) != {"required"}]
    if "discriminator" in node and isinstance(value, dict):
        tagged = node["discriminator"]["mapping"].get(str(value.get("kind")))
        alternatives = [_resolved({"$ref": tagged}, schema, value)] if tagged else []
    for each in alternatives:
        if each.get("type") == wanted:
            return each | node
    return node


def _kinds(node: dict) -> list[str]:
    """Return what JSON schema calls the kinds that a value may be of."""
    alternatives = [kind for each in node.get("anyOf", []) for kind in _kinds(each)]
    return alternatives or ["object" if "$ref" in node or "oneOf" in node else node.get("type", "string")]


def _words(node: dict) -> list[str]:
    """Return what a value may be if only some texts are allowed: the alternatives of an enumeration or a pattern."""
    branches = node.get("anyOf", [node])
    words = [str(word) for each in branches for word in each.get("enum", [each["const"]] if "const" in each else [])]
    for pattern in (each["pattern"] for each in branches if each.get("pattern", NAME) != NAME):
        for how, such in PATTERNS.items():
            pattern = pattern.replace(how, such)
        words += pattern.strip("^$").removeprefix("(").removesuffix(")").split("|")
    numbers = [f"a whole number from {each.get('minimum', 0)} on" for each in branches if each.get("type") == "integer"]
    return [*numbers, *words] if words else []


def _text_for(kinds: Sequence[str], text: str) -> str:
    """Return the remedy for a text that stands where a number or a switch belongs; empty if none is known."""
    if {"number", "integer"} & set(kinds) and "string" not in kinds:
        if _is_number(text):
            return "write the number without quotes"
        if re.fullmatch(r"[-+]?\d{1,3}(,\d{3})+(\.\d*)?", text):
            said = f"write the number without separators, {text.replace(',', '')}"
            decimal = re.fullmatch(r"[^,.]+,\d+", text)
            return f"{said}, or {text.replace(',', '.')} if the comma is a decimal one" if decimal else said
        if _is_number(text.replace(",", ".")):
            return f"write the number with a point, {text.replace(',', '.')}"
        if re.match(r"[-+]?\.?\d", text):
            return "write the number alone, in the unit that the key's name ends with"
    if "boolean" in kinds and text.lower() in ("yes", "no", "on", "off"):
        return f"write {'true' if text.lower() in ('yes', 'on') else 'false'}"
    return ""


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
