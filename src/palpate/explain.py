"""What is wrong with settings, in one sentence: the key, what was given, what is allowed, and what the key means."""

from collections.abc import Sequence
from typing import Any

from palpate.errors import suggest
from palpate.gone_keys import gone

_OF_BLOCK = ("extra_forbidden", "missing")
"""Faults of a block, which pydantic places at one of its keys."""


def explain(errors: Sequence[Any], config: dict, schema: dict, whole: str = "the file") -> str:
    """Return one sentence for the outermost of pydantic's ``errors`` in ``config``, the ``whole`` of settings.

    Of a misspelt key, which is unknown and lacks, it says that it is unknown. schema : what keys mean
    """
    placed = [(_place(error, config), error) for error in errors]
    # of a list where a text may stand, too, what is wrong is inside it
    outer = {at[:n] for at, _ in placed for n in range(len(at))}
    placed = [(at, error) for at, error in placed if not (error["type"].endswith("_type") and at in outer)]
    depth = [(len(at) - (error["type"] in _OF_BLOCK), error["type"] == "missing") for at, error in placed]
    place, error = placed[depth.index(min(depth))]
    block, written = _written(place[:-1]) or whole, _written(place) or whole
    about = _described(place, config, schema)[1]
    about = f" ({about})." if about else "."
    if error["type"] == "extra_forbidden":
        if instead := gone(written):
            return f"{written} is gone: {instead}."
        known = list(_described(place[:-1], config, schema)[0].get("properties", {}))
        return f"{block} has an unknown key {place[-1]}; {suggest(str(place[-1]), known, 'it knows')}"
    if error["type"] == "missing":
        return f"{block} lacks {place[-1]}; add it{about}"
    if error["type"] == "lacks":
        return f"{written} lacks {error['ctx']['name']}; add it{about}"
    if error["loc"][-1:] == ("[key]",):
        return f"{block} has an entry {place[-1]!r}; name it in lower-case letters, digits and underscores."
    allowed, given = error["msg"].replace("Input tag", "its kind"), str(error["input"])
    given = f"is {error['input']!r}" if len(given) < 80 else "cannot be used"
    return f"{written} {given}: {allowed[:1].lower()}{allowed[1:]}{about}"


def _place(error: Any, config: Any) -> tuple:
    """Return keys and numbers of entries of a place of pydantic's, which also says which alternatives it tried."""
    place: list = []
    for step in error["loc"]:
        if step in config if isinstance(config, dict) else isinstance(config, list) and isinstance(step, int):
            place.append(step)
            config = config[step]
    return (*place, error["loc"][-1]) if error["type"] == "missing" else tuple(place)


def _written(place: tuple) -> str:
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in place).removeprefix(".")


def _described(place: tuple, config: Any, schema: dict) -> tuple[dict, str]:
    """Return the part of the JSON schema at ``place``, and what it or the block that it is in means."""
    node, about = {key: each for key, each in schema.items() if key != "description"}, ""
    for step in (*place, None):
        while len(found := [node.get("$ref")] if "$ref" in node else _alternatives(node, config)) == 1:
            own = {key: each for key, each in node.items() if key == "description"}
            node = schema["$defs"][str(found[0]).rpartition("/")[2]] | own
        about = node.get("description", about).partition("\n")[0]
        if step is not None:
            others = [*node.get("patternProperties", {}).values(), node.get("items"), node.get("additionalProperties")]
            inner = [node.get("properties", {}).get(step), *others]
            node = next((each for each in inner if isinstance(each, dict)), {})
            config = (
                config[step] if isinstance(config, list) else config.get(step) if isinstance(config, dict) else None
            )
    return node, about.rstrip(".")


def _alternatives(node: dict, config: Any) -> list[str]:
    """Return the references of the alternatives of a part of the schema that a value may be of."""
    if "discriminator" in node and isinstance(config, dict):
        return [found] if (found := node["discriminator"]["mapping"].get(str(config.get("kind")))) else []
    return [each["$ref"] for each in node.get("anyOf", []) if "$ref" in each] if isinstance(config, dict) else []
