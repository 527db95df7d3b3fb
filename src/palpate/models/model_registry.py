"""Register where each model lives. Names only: a module is imported when its model is loaded."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from palpate.errors import InputError, describe_unknown
from palpate.models.enrichment.methods import METHODS

if TYPE_CHECKING:
    from palpate.benchmark.model import Model

_VARIANTS = ("palpate.models.enrichment.paper_enrichment", "palpate.models.springs.mass_spring")
"""Modules whose models are variants of one method: twelve blends, four networks of springs."""


def _enriched(*modules: str) -> dict[str, tuple[str, dict]]:
    """Take methods of enrichment, by their names and keywords, as models."""
    return {name: recipe for name, recipe in METHODS.items() if recipe[0].rpartition(".")[2] in modules}


ENGINES = {"mujoco": "mujoco", "newton_vbd": "newton"}
"""Models that an engine answers which is not in the environment, and the package that must be installed for each."""
INSTALL = 'type .venv/bin/pip install -e ".[engines]"'
RELAXED = ("xpbd", "vertex_block_descent", "projective_dynamics")
"""Methods that graphics and games relax bodies with."""

# module, and what of it the model is: both functions get these as keywords
MODELS: dict[str, tuple[str, dict]] = {
    "fem_p1": ("palpate.models.fem", {"order": 1}),
    "fem_p2": ("palpate.models.fem", {"order": 2}),
    "fast_fem": ("palpate.models.fast_fem", {}),
    "fem_local": ("palpate.models.fem_local", {}),
    "contact_modes": ("palpate.models.contact_modes.contact_modes", {}),
    "pod_galerkin": ("palpate.models.pod_galerkin", {}),
    "linear_fem": ("palpate.models.linear_fem", {}),
    "linear_residual": ("palpate.models.linear_residual", {}),
    "warped_compliance": ("palpate.models.warped_compliance", {}),
    "detail_correction": ("palpate.models.enrichment.detail_correction", {}),
    **_enriched("interpolation", "ridge", "pod_rbf"),
    **{f"pod_{name}": ("palpate.models.pod_of_loads", {"learner": name}) for name in ("gaussian", "network")},
    "springs": ("palpate.models.springs.mass_spring", {"nodal": False, "volume": False}),
    "springs_volume": ("palpate.models.springs.mass_spring", {"nodal": False, "volume": True}),
    "springs_nodal": ("palpate.models.springs.mass_spring", {"nodal": True, "volume": False}),
    "springs_nodal_volume": ("palpate.models.springs.mass_spring", {"nodal": True, "volume": True}),
    "shape_matching": ("palpate.models.shape_matching", {}),
    **{name: ("palpate.models.relaxed", {"method": name}) for name in RELAXED},
    "mujoco": ("palpate.models.mujoco_flex", {}),
    "newton_vbd": ("palpate.models.newton_vbd", {}),
    **_enriched("paper_enrichment"),
    "cascade": ("palpate.models.cascade", {}),
}

TOUCH_MODELS: dict[str, tuple[str, dict]] = {
    "fem": ("palpate.models.touch.fem", {}),
    "modes": ("palpate.models.touch.modes", {}),
    "linear": ("palpate.models.touch.linear", {}),
    "xpbd": ("palpate.models.touch.relaxed", {"method": "xpbd"}),
    "vertex_block_descent": ("palpate.models.touch.relaxed", {"method": "vertex_block_descent"}),
    "projective_dynamics": ("palpate.models.touch.relaxed", {"method": "projective_dynamics"}),
    "springs": ("palpate.models.touch.springs", {"volume": False}),
    "springs_volume": ("palpate.models.touch.springs", {"volume": True}),
    "shape_matching": ("palpate.models.touch.shape_matching", {}),
    "mujoco": ("palpate.models.touch.mujoco_flex", {}),
}
"""Models of touches: modules with ``settings(case)`` and ``online(case, setting)``, as ``TouchSolver`` says. Those of
an engine have its name in ENGINES."""

BESIDE = (
    {"cascade": "contact_modes"}
    | dict.fromkeys(("linear_residual", "warped_compliance", "detail_correction"), "linear_fem")
    | dict.fromkeys(
        ("ridge_upsampling", "kernel_ridge_detail", "pod_rbf", "pod_gaussian", "pod_network"), "interpolation"
    )
)
"""Models that are measured by the job of another's family, if that is measured: it has prepared their contacts, read
their compliance, or takes as few seconds as they do."""

SAVED_AGAINST = "fem_p2"
"""The model of whoever prepares nothing, at its last setting: the finest level, converged from rest."""
FAMILY_OF = {name: where.rpartition(".")[2] for name, (where, _) in MODELS.items() if where in _VARIANTS}
"""The family of each model that is one of many variants: a diagram shows the family's best. Others stand alone."""
RESERVED = ("truth", "zero")
"""Names that the table gives to the truth's own error and to the answer that nothing moves, so that models have
others."""


def model(name: str, own: Mapping[str, str]) -> Model:
    """Load one of MODELS, or of the user's ``own`` by its file; InputError if ``name`` is neither."""
    if name not in own and name not in MODELS:
        raise InputError(f"there is no model {unknown([name], own)}")
    from palpate.models.load_model import load_model

    return load_model(name, **_recipe(name, own))


def absent() -> list[str]:
    """List the models whose engine is not installed."""
    return [name for name, package in ENGINES.items() if find_spec(package) is None]


def families(names: list[str], own: Mapping[str, str]) -> dict[str, dict[str, dict[str, Any]]]:
    """Group ``names`` by the module they live in, or BESIDE, as what one of them has prepared may serve the others.

    Each of the user's ``own`` is a family by itself. Within a family: by name, ``place`` and ``keywords`` of
    ``load_model``, which is all that a job needs to measure it.
    """
    groups: dict[str, dict[str, dict[str, Any]]] = {}
    for name in names:
        near = BESIDE[name] if BESIDE.get(name) in names else name
        family = name if name in own else MODELS[near][0].rpartition(".")[2]
        groups.setdefault(family, {})[name] = _recipe(name, own)
    return groups


def unknown(names: list[str], own: Mapping[str, object]) -> str:
    """Describe what is wrong with the ``names`` of models, or nothing; ``own`` are those that the user brings along."""
    modules = {place.rpartition(".")[2] for place, _ in MODELS.values()}
    for name in own:
        if name in (*MODELS, *modules, *RESERVED):
            return f"{name}, which palpate uses itself; call your own model something else"
    for name in names:
        if name in absent():
            return f"{name}, whose engine is not installed; {INSTALL}"
    return describe_unknown(names, [*MODELS, *own])


def _recipe(name: str, own: Mapping[str, str]) -> dict[str, Any]:
    if name in own:
        return {"place": str(own[name]), "keywords": {}}
    place, what = MODELS[name]
    return {"place": place, "keywords": what}
