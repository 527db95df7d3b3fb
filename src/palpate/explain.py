"""What is wrong with settings, in one sentence: the key, what was given, what is allowed, and what the key means."""

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Any

from palpate.errors import suggest

_OF_BLOCK = ("extra_forbidden", "missing")
"""Faults of a block, which pydantic places at one of its keys."""
GONE = {
    "scenes.*.effects": (
        "a scene's effects are its blocks; remove the list and the blocks that it does not name, write {} for what "
        "it names without a block, as rayleigh: {}, and held: false if it does not name held (auto also chose damping, "
        "which is rayleigh, of springs kelvin and of shape_matching velocity_damping; bending of sheets, body_springs "
        "of surfaces, and volume of springs with a Poisson's ratio above 1/4)"
    ),
    "cut.truth": "edges are as long as half of the cut's width, and half of that at its front; remove it",
    "dynamic.training_share": "it is one half; remove it, or describe a training of the scene",
    "dynamic.budgets_ms": "they are 1, 8 and 16.7 ms, and palpate advise takes any other; remove it",
    "dynamic.speeds": "they are 1 and 20, and palpate advise takes any other; remove it",
    "dynamic.scenes.*.truth.part": "it is 0.05; remove it",
    "measured.models.releases.creep.step_s": "it is 0.01 s; remove it",
    "organ_springs.radius_m": "it is 0.02 m; remove it",
    "organ_springs.peak_of_size": "it is 0.05; remove it",
    "organ_springs.damping_ratio": "it is 0.1; remove it",
    "outside.cells": "there are 4; remove it",
    "tradeoff.finger_radii_m": "a finger of another radius is a regime of its own; remove it",
    "tradeoff.own_models": "write it at the top level, own_models, as touches and motions are asked of it, too",
    "tradeoff.limit_points.radius_m": "it is 0.012 m; remove it",
    "tradeoff.settings.fem_local": "palpate knows what to try; remove it",
    "tradeoff.settings.detail_correction": "a quarter, half and all of the samples are tried; remove it",
    "tradeoff.settings.linear_residual": "a quarter, half and all of the samples are tried; remove it",
    "tradeoff.settings.ridge": "a quarter, half and all of the samples are tried; remove it",
    "tradeoff.settings.warped_compliance": "none, half and all of the samples are tried; remove it",
    "tradeoff.settings.mass_spring.iterations": "seven numbers are tried; remove it",
    "palpation.ball_radius_m": "it is 0.01 m; remove it",
    "palpation.pressure_of_young": "it is 0.1; remove it",
    "tradeoff.residual_of": "it is done of fem_p1 and fem_p2; remove it",
    "*.settings.mujoco*": "engines answer the questions of palpate ask (docs/engines.md); remove it",
    "*.settings.newton_vbd": "engines answer the questions of palpate ask (docs/engines.md); remove it",
    "tradeoff.settings.cascade": "models are asked by themselves, and have bounds of their own; remove it",
    "tradeoff.settings.fast_fem.frame_iterations": "there are 2 and 4; remove it",
    "tradeoff.settings.fem.*warm_iterations": "there is one; remove it",
    "tradeoff.settings.mass_spring.middle_samples": "there are 20; remove it",
    "tradeoff.settings.shape_matching": "palpate knows what to try; remove it",
}
"""Keys that are gone, by their place with * for a name: why, and what to write instead; the next release drops this."""


def explain(errors: Sequence[Any], config: dict, schema: dict, whole: str = "the file") -> str:
    """Return one sentence for the outermost of pydantic's ``errors`` in ``config``, the ``whole`` of settings.

    Of a misspelt key, which is unknown and lacks, it says that it is unknown. schema : what keys mean
    """
    placed = [(_place(error, config), error) for error in errors]
    # of a value that may be a list or a text, the error is the one inside it, not that of its type
    with_inner = {keys[:n] for keys, _ in placed for n in range(len(keys))}
    placed = [(keys, error) for keys, error in placed if not (error["type"].endswith("_type") and keys in with_inner)]
    depth = [(len(keys) - (error["type"] in _OF_BLOCK), error["type"] == "missing") for keys, error in placed]
    place, error = placed[depth.index(min(depth))]
    block, written = _written(place[:-1]) or whole, _written(place) or whole
    about = _described(place, config, schema)[1]
    about = f" ({about})." if about else "."
    if error["type"] == "extra_forbidden":
        if instead := next((text for pattern, text in GONE.items() if fnmatchcase(written, pattern)), ""):
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
        # a reference, or the only alternative that the value can be of, is what the schema means
        while len(references := [node.get("$ref")] if "$ref" in node else _alternatives(node, config)) == 1:
            description = {key: each for key, each in node.items() if key == "description"}
            node = schema["$defs"][str(references[0]).rpartition("/")[2]] | description
        about = node.get("description", about).partition("\n")[0]
        if step is not None:
            of_any = [*node.get("patternProperties", {}).values(), node.get("items"), node.get("additionalProperties")]
            inner = [node.get("properties", {}).get(step), *of_any]
            node = next((each for each in inner if isinstance(each, dict)), {})
            config = (
                config[step] if isinstance(config, list) else config.get(step) if isinstance(config, dict) else None
            )
    return node, about.rstrip(".")


def _alternatives(node: dict, config: Any) -> list[str]:
    """Return the references of the alternatives of a part of the schema that a value may be of."""
    if "discriminator" in node and isinstance(config, dict):
        return [reference] if (reference := node["discriminator"]["mapping"].get(str(config.get("kind")))) else []
    return [each["$ref"] for each in node.get("anyOf", []) if "$ref" in each] if isinstance(config, dict) else []
