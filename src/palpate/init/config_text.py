"""Text of a first configuration: every key with a comment."""

import json
import re
from collections.abc import Mapping
from os.path import relpath
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from palpate.init.choose import BED_THICKNESS, Choice
from palpate.init.recognise import Data

_HEAD = """\
# What accuracy costs for {name}: written by palpate init, to be changed by you. SI units: m, kg, s, N, Pa.
# In palpate's folder, run it with
#   {command}
# All other keys: docs/add-a-body.md; a scene in which this body moves can stand here, too: docs/add-a-scene.md.
"""
_TAIL = """\
regimes:  # how hard the body is pressed; every press ends where tissue would collapse
  small:  # a light touch of a fingertip
    peak_of_size: {small:g}  # largest displacement, as a share of the body's longest side: {small_mm:.2g} mm
    radius_m: {tip_m:g}  # radius [m] of the disc that is pressed
  deep:  # a firm press of a fingertip
    pressure_of_young: {deep:g}  # highest pressure, as a share of Young's modulus; beyond 0.15 to 0.3 tissue collapses
    radius_m: {tip_m:g}  # radius [m] of the disc that is pressed
  large:  # a firm press of several fingers
    peak_of_size: {large:g}  # {large_mm:.2g} mm; less where the pressure would exceed a quarter of Young's modulus
    radius_m: {hand_m:g}  # radius [m] of the disc that is pressed
tradeoff:  # the study: each model, its error and its time
  contacts: {contacts}  # places that are pressed; two fifths judge, the others are learnt from
  presses:  # at each contact: shares of the regime's depth or pressure, and angles to the inward normal
    - {{magnitude: 1.0, tilt_degrees: 0}}  # straight
    - {{magnitude: 0.8, tilt_degrees: 45}}  # oblique
    - {{magnitude: 0.6, tilt_degrees: 20}}  # gentler
  splits: [1]  # of five ways to divide the contacts; [1, 2, 3, 4, 5] judges models that learn at all contacts
  advice:  # for which times and errors a model is advised
    budgets_ms: [1, 16.7, 100]  # times of an answer [ms]: haptics, 60 pictures a second, an immediate reaction
    max_errors: [0.05, 0.01, 0.001]  # of nine answers in ten, shares of the peak displacement
press:  # the body in the report, to be pressed with the mouse or a finger
  radius_m: {hand_m:g}  # radius [m] of the disc that is pressed there
"""
_CT = """\
ct:  # pictures of the body in the CT, and its mass; look at results/figures/ct_slices_{name}.png first
  surface_nodes: {sizes}  # of the meshes that are weighed
"""
_COMMENTS = {
    "surface_nodes": "nodes of the coarse surface, which is made anew with that many",
    "snap": "whether the finer meshes follow the surface of the data",
    "young_pa": "Young's modulus [Pa], assumed",
    "poisson": "Poisson's ratio, assumed; tissue has 0.45 to 0.49, where linear elements are too stiff",
    "density_kg_m3": "density [kg/m³], assumed",
}
_BED = {
    "sphere": "springs fade to its rim",
    "facing": "only what faces this way, within 60 degrees, lies on it",
    "stiffness_n_m3": "in the middle: Young's modulus over thickness of the tissue below [N/m³]",
}
_OTHERS = "    # instead of a bed, to nail it: anchors: {plane: {axis: z, side: min, depth_m: 0.01}}\n"


def config_text(data: Data, choice: Choice, file: Path, command: str, schema: Path | None) -> str:
    """Return the configuration in YAML; its paths are relative to the folder of ``file``, where it will be.

    schema : the file that editors complete keys with, if there is a relative path to it
    """
    coarse, folder, entry = choice.coarse, file.parent, choice.entry
    sides = " × ".join(f"{1e3 * side:.3g}" for side in np.ptp(coarse.nodes, axis=0))
    elements = len(choice.body.coarse.tetrahedra)
    splits = f"1:8 splits of the {elements} coarse tetrahedra; each makes a run about 10 times as long"
    comments = _COMMENTS | data.comments | {"refinements": splits}
    parts = [
        f"# yaml-language-server: $schema={schema.as_posix()}\n" if schema else "",
        _HEAD.format(name=data.name, command=command),
        "bodies:  # lower-case letters, digits and underscores name a body\n",
        f"  {data.name}:  # {sides} mm, {1e6 * coarse.volumes.sum():.4g} mL\n",
        *(f"    {key}: {_yaml(value, folder)}  # {comments[key]}\n" for key, value in entry.items() if key != "bed"),
        _OTHERS,
        f"    bed:  # {lies_on(choice)}\n",
        *(f"      {key}: {_yaml(entry['bed'][key], folder)}  # {text}\n" for key, text in _BED.items()),
        _TAIL.format(contacts=choice.contacts, **_numbers(choice)),
    ]
    if data.entry["kind"] == "ct":
        parts.append(_CT.format(name=data.name, sizes=[factor * entry["surface_nodes"] for factor in (1, 2, 4)]))
    return _aligned("".join(parts))


def _numbers(choice: Choice) -> dict[str, float]:
    small, deep, large = (choice.regimes[name] for name in ("small", "deep", "large"))
    peaks = {"small": small["peak_of_size"], "large": large["peak_of_size"]}
    lengths = {f"{name}_mm": 1e3 * peak * choice.coarse.size for name, peak in peaks.items()}
    radii = {"tip_m": deep["radius_m"], "hand_m": large["radius_m"]}
    return peaks | lengths | radii | {"deep": deep["pressure_of_young"]}


def lies_on(choice: Choice) -> str:
    """Say in words what the body lies on."""
    bed, size = choice.entry["bed"], choice.coarse.size
    number = int(np.flatnonzero(bed["facing"])[0])
    end = "largest" if bed["facing"][number] > 0 else "smallest"
    thick = f"{1e3 * BED_THICKNESS * size:.2g} mm"
    return f"lies where its {'xyz'[number]} is {end} on {thick} of tissue as stiff as itself"


def _yaml(value: Any, folder: Path) -> str:
    """Write a value as YAML on one line; a path relative to ``folder``, in quotes where YAML needs some."""
    if isinstance(value, Path):
        text = Path(relpath(value, folder)).as_posix()
        plain = text.replace("/", "").replace(".", "").replace("_", "").replace("-", "")
        return text if plain.isascii() and plain.isalnum() else json.dumps(text, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_yaml(inner, folder)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_yaml(inner, folder) for inner in value) + "]"
    if isinstance(value, str) and yaml.safe_load(value) == value and re.fullmatch("[a-z][a-z_]*", value):
        return value
    return f"{value:g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False)


def _aligned(text: str) -> str:
    """Put comments of lines of usual length into one column."""
    found = []
    for line in text.splitlines():
        code, mark, comment = line.partition("  # ")
        found.append(f"{code:30}  # {comment}" if mark and code.strip() else line)
    return "\n".join(found) + "\n"
