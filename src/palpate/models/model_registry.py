"""Where each model lives. Names only: a module is imported when its model is asked for."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.errors import InputError, stranger

if TYPE_CHECKING:
    from palpate.models.model import Model

FEATURES = ("unordered", "ordered", "framed")
WEIGHTS = ("signed", "nonnegative_a", "nonnegative_b", "clipped")

# module, and what of it the model is: both functions get these as keywords
MODELS: dict[str, tuple[str, dict]] = {
    "fem_coarse": ("palpate.models.fem", {"level": 0}),
    "fem_middle": ("palpate.models.fem", {"level": 1}),
    "fem_fine": ("palpate.models.fem", {"level": -1}),
    "linear_fem": ("palpate.models.linear_fem", {}),
    "warped_compliance": ("palpate.models.warped_compliance", {}),
    "detail_correction": ("palpate.models.detail_correction", {}),
    "interpolation": ("palpate.models.interpolation", {}),
    "ridge_upsampling": ("palpate.models.ridge", {"kernel": False}),
    "kernel_ridge_detail": ("palpate.models.ridge", {"kernel": True}),
    "pod_rbf": ("palpate.models.pod_rbf", {}),
    "springs": ("palpate.models.springs", {"nodal": False, "volume": False}),
    "springs_volume": ("palpate.models.springs", {"nodal": False, "volume": True}),
    "springs_nodal": ("palpate.models.springs", {"nodal": True, "volume": False}),
    "springs_nodal_volume": ("palpate.models.springs", {"nodal": True, "volume": True}),
    "shape_matching": ("palpate.models.shape_matching", {}),
} | {
    f"{features}_{weights}": ("palpate.models.paper_enrichment", {"features": features, "weights": weights})
    for features in FEATURES
    for weights in WEIGHTS
}


SAVED_AGAINST = "fem_fine"
"""What is simulated by whoever prepares nothing, at the tightest of its tolerances, its last setting."""
RESERVED = ("reference",)
"""What the table calls the truth's own error, and models therefore are not."""


def model(name: str, own: Mapping[str, Path]) -> Model:
    """One of MODELS, or of the user's ``own`` by its file; InputError if ``name`` is neither."""
    if name in own:
        from palpate.models.own_model import load

        return load(name, own[name])
    if name not in MODELS:
        raise InputError(f"there is no model {unknown([name], own)}")
    from palpate.models.model import Model

    place, what = MODELS[name]
    module = importlib.import_module(place)
    return Model(partial(module.settings, **what), partial(module.prepare, **what))


def families(names: list[str], own: Mapping[str, object]) -> dict[str, list[str]]:
    """``names`` by the module they live in, as what one of them has prepared may serve the others; each of the
    user's ``own`` by itself."""
    found: dict[str, list[str]] = {}
    for name in names:
        family = name if name in own else MODELS[name][0].rpartition(".")[2]
        found.setdefault(family, []).append(name)
    return found


def unknown(names: list[str], own: Mapping[str, object]) -> str:
    """What is wrong with the ``names`` of models, or nothing; ``own`` are those that the user brings along."""
    modules = {place.rpartition(".")[2] for place, _ in MODELS.values()}
    for name in own:
        if name in (*MODELS, *modules, *RESERVED):
            return f"{name}, which palpate uses itself; call your own model something else"
    return stranger(names, [*MODELS, *own])
