"""The schema of the settings: read it, check settings against it, and fill in its defaults."""

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.errors import InputError, suggest
from palpate.files import read_yaml

if TYPE_CHECKING:
    from jsonschema import ValidationError

RENAMED = {
    "papers": "ask for a study with a block of its name, such as enrichment:",
    "soft_bodies": "write shape_matching",
    "calibration": "write springs",
    "node_mass": "write ct",
    "complexity_samples": "move it to enrichment",
}
"""Keys of versions before 0.2, and what to write instead."""
NAME = "^[a-z][a-z0-9_]*$"
"""The pattern of names that files and folders get."""
KINDS = {
    "object": "a block of keys",
    "array": "a list",
    "string": "a text",
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "null": "empty",
}
"""What a schema calls the kinds of values, in words."""
EXAMPLES = {r".+\.py": "the path of a Python file, such as law.py", "([2-9]|[1-9][0-9]+) iterations": "4 iterations"}
"""What parts of patterns mean, in words."""


def read_schema(path: Path) -> dict:
    """Read the schema of the settings with that of each study in its place."""
    schema = read_yaml(path)
    for name in studies(schema):
        study = read_yaml(path.parent / schema["properties"][name]["$ref"])
        schema["$defs"] |= study.pop("$defs", {})
        schema["properties"][name] = study | {"study": True}
    return schema


def studies(schema: dict) -> list[str]:
    """Return the names of the studies in the order of the report: the properties that have a file of their own."""
    return [
        name
        for name, inner in schema["properties"].items()
        if inner.get("study") or inner.get("$ref", "").startswith("studies/")
    ]


def defaults(schema: dict, name: str) -> dict:
    """Return what the schema gives a property of the settings that is left out."""
    return _fill({}, schema["properties"][name], schema)


def checked(config: dict, schema: dict, file: Path) -> dict:
    """Return ``config`` with the schema's defaults filled in; InputError naming ``file``, the key and the remedy."""
    from jsonschema import Draft202012Validator

    validator = Draft202012Validator(schema)
    for key, value in _leaves(config):
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError(f"{file}: {key} is {value}; give a finite number.")
    for error in sorted(validator.iter_errors(config), key=lambda error: len(error.absolute_path)):
        raise InputError(f"{file}: {_explain(error, schema)}")
    return _fill(config, schema, schema)


def _leaves(value: object, key: str = "") -> Iterator[tuple[str, object]]:
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _leaves(inner, f"{key}.{name}" if key else str(name))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from _leaves(inner, f"{key}[{i}]")
    else:
        yield key, value


def _resolve(schema: dict, root: dict, value: object) -> dict:
    """Follow ``$ref`` and the ``if``/``then`` branches that ``value`` takes to one flat schema."""
    from jsonschema import Draft202012Validator

    flat = dict(schema)
    if "$ref" in schema:
        flat |= root["$defs"][schema["$ref"].rpartition("/")[2]]
    for branch in flat.get("allOf", []):
        if Draft202012Validator(branch["if"]).is_valid(value):
            flat |= _resolve(branch["then"], root, value)
    return flat


def _fill(value: Any, schema: dict, root: dict) -> Any:
    schema = _resolve(schema, root, value)
    if isinstance(value, list):
        return [_fill(item, schema.get("items", {}), root) for item in value]
    if not isinstance(value, dict):
        return value
    properties = schema.get("properties", {})
    filled = {key: inner["default"] for key, inner in properties.items() if "default" in inner} | value
    others = schema.get("additionalProperties") or {}
    return {key: _fill(inner, properties.get(key, others), root) for key, inner in filled.items()}


def _explain(error: "ValidationError", root: dict) -> str:
    """Return one sentence for a jsonschema error: the key, the fault, the remedy."""
    key = error.json_path.removeprefix("$").removeprefix(".") or "the file"
    rule, wanted, found = error.validator, error.validator_value, error.instance
    if rule == "additionalProperties":
        return _unknown(key, found, error.schema["properties"])
    if rule == "required":
        missing = next(name for name in wanted if name not in found)
        known = _resolve(error.schema, root, found).get("properties", {})
        meaning = _resolve(known.get(missing, {}), root, None).get("description", "").rstrip(".")
        return f"{key} lacks {missing}; add it" + (f" ({meaning})." if meaning else ".")
    meaning = " ".join(error.schema.get("description", "").split()).rstrip(".")
    about = f" ({meaning})." if meaning else "."
    if error.schema.get("pattern") == NAME:
        return f"{key} has an entry {found!r}; name it in lower-case letters, digits and underscores."
    if "pattern" in error.schema and found is not None:
        return f"{key} is {found!r}; give {_allowed(error.schema)}{about}"
    if rule == "type" and isinstance(found, str) and (remedy := _text_for(wanted, found)):
        return f"{key} is the text {found!r}; {remedy}{about}"
    if found is None or (rule in ("minProperties", "minItems") and not found):
        return f"{key} is empty; give it {'a value' if found is None else 'an entry'}, or remove the key{about}"
    kinds = wanted if isinstance(wanted, list) else [str(wanted)]
    told = {
        "type": f"must be {' or '.join(KINDS.get(str(kind), '') for kind in kinds)}",
        "enum": f"must be one of {', '.join(map(str, wanted)) if isinstance(wanted, list) else wanted}",
        "minimum": f"must be at least {wanted}",
        "maximum": f"must be at most {wanted}",
        "exclusiveMinimum": f"must be above {wanted}",
        "exclusiveMaximum": f"must be below {wanted}",
        "minItems": f"must have at least {wanted} entries",
        "maxItems": f"must have at most {wanted} entries",
        "minProperties": f"must have at least {wanted} entry",
        "maxProperties": f"must have only {wanted} entry",
        "minLength": "must not be empty",
        "uniqueItems": "must not name one thing twice",
    }
    return f"{key} is {found!r}, but {told.get(rule, error.message)}{about}"


def _allowed(schema: dict) -> str:
    """Write what a text, or a whole number or a text, may be: the alternatives of its pattern."""
    pattern = schema["pattern"]
    for how, such in EXAMPLES.items():
        pattern = pattern.replace(how, such)
    words = pattern.strip("^$").removeprefix("(").removesuffix(")").split("|")
    if "integer" in schema.get("type", ""):
        words.insert(0, f"a whole number from {schema.get('minimum', 0)} on")
    return f"{', '.join(words[:-1])}, or {words[-1]}" if len(words) > 1 else words[0]


def _unknown(key: str, found: dict, known: dict) -> str:
    name = next(name for name in found if name not in known)
    if name in RENAMED:
        return f"{key} has the key {name} of an earlier version; {RENAMED[name]}."
    return f"{key} has an unknown key {name}; {suggest(str(name), list(known), 'it knows')}"


def _text_for(wanted: str | list[str], text: str) -> str:
    """Return the remedy for a text that stands where a number or a switch belongs; empty if none is known."""
    kinds = {wanted} if isinstance(wanted, str) else set(wanted)
    if kinds & {"number", "integer"}:
        if _is_number(text):
            return "write the number without quotes"
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
