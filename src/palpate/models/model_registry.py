"""Register the models by the names that tables give them; no solver is imported before one is prepared."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from palpate.benchmark.model import Model
from palpate.errors import InputError, describe_unknown
from palpate.files import check_file
from palpate.models import kinds
from palpate.own_file import MODEL_FUNCTIONS, MODEL_GUIDE, check_source

VARIANTS = (kinds.PaperEnrichment, kinds.Springs)
"""Classes whose models are variants of one method: twelve blends, four networks of springs."""
MODELS: dict[str, Model] = {
    model.name: model
    for model in (
        kinds.FEM(order=1),
        kinds.FEM(order=2),
        kinds.FastFEM(),
        kinds.LocalFEM(),
        kinds.ContactModes(),
        kinds.PODGalerkin(),
        kinds.LinearFEM(),
        kinds.LinearResidual(),
        kinds.WarpedCompliance(),
        kinds.DetailCorrection(),
        kinds.Interpolation(),
        kinds.Ridge(kernel=False),
        kinds.Ridge(kernel=True),
        kinds.PODRBF(),
        kinds.PODOfLoads(learner="gaussian"),
        kinds.PODOfLoads(learner="network"),
        *(kinds.Springs(nodal=nodal, volume=volume) for nodal in (False, True) for volume in (False, True)),
        kinds.ShapeMatching(),
        kinds.XPBD(),
        kinds.VertexBlockDescent(),
        kinds.ProjectiveDynamics(),
        *(
            kinds.PaperEnrichment(features=features, weights=weights)
            for features in get_args(kinds.FEATURES)
            for weights in get_args(kinds.WEIGHTS)
        ),
    )
}
"""The models by name, in the order of tables; what identifies one is set, and all else is its default."""

BESIDE = dict.fromkeys(("linear_residual", "warped_compliance", "detail_correction"), "linear_fem") | dict.fromkeys(
    ("ridge_upsampling", "kernel_ridge_detail", "pod_rbf", "pod_gaussian", "pod_network"), "interpolation"
)
"""Models that are measured by the job of another's family, if that is measured: it has prepared their contacts, read
their compliance, or takes as few seconds as they do."""

SAVED_AGAINST = "fem_p2"
"""The model of whoever prepares nothing, at its last setting: the finest level, converged from rest."""


def family_of(name: str) -> str:
    """Return the name of the module that prepares a model, by which its files are called."""
    return MODELS[name].place.rpartition(".")[2]


FAMILY_OF = {name: family_of(name) for name, model in MODELS.items() if isinstance(model, VARIANTS)}
"""The family of each model that is one of many variants: a diagram shows the family's best. Others stand alone."""
RESERVED = ("truth", "zero")
"""Names that the table gives to the truth's own error and to the answer that nothing moves, so that models have
others."""
MOTION_MODELS = ("fem_coarse", "fem_fine", "moving_modes", "path_modes", "region_modes")
"""Models of motions alone."""


def model(name: str, own: Mapping[str, str | Path]) -> Model:
    """Return one of MODELS, or of the user's ``own`` by its file; InputError if ``name`` is neither."""
    if name in own:
        from palpate.models.own_model import load_own

        return load_own(name, Path(own[name]))
    if name not in MODELS:
        raise InputError(f"there is no model {unknown([name], own)}")
    return MODELS[name]


def families(names: list[str], own: Mapping[str, str]) -> dict[str, dict[str, dict[str, Any]]]:
    """Group ``names`` by the module they live in, or that of the model in BESIDE whose preparation serves them.

    Each of the user's ``own`` is a family by itself. Within a family: by name, ``place`` and ``fields`` of
    ``tradeoff.jobs.load_model``, which is all that a job needs to measure it.
    """
    groups: dict[str, dict[str, dict[str, Any]]] = {}
    for name in names:
        leader = BESIDE[name] if BESIDE.get(name) in names else name
        family = name if name in own else family_of(leader)
        groups.setdefault(family, {})[name] = _recipe(name, own)
    return groups


def unknown(names: list[str], own: Mapping[str, object]) -> str:
    """Describe what is wrong with the ``names`` of models, or nothing; ``own`` are those that the user brings along."""
    taken = {*MODELS, *map(family_of, MODELS), *MOTION_MODELS, *RESERVED}
    for name in own:
        if name in taken:
            return f"{name}, which palpate uses itself; call your own model something else"
    return describe_unknown(names, [*MODELS, *own])


def check_own(file: Path, own: Mapping[str, str]) -> None:
    """Raise InputError for names of the user's ``own`` models that are taken, and for files without such a class.

    file : of the settings, to whose folder the files are relative
    """
    if problem := unknown([], own):
        raise InputError(f"{file}: own_models names {problem}")
    for name, path in own.items():
        check_file(f"{file}: own_models.{name}", path, (file.parent / path).is_file())
        check_source(f"{file}: own_models.{name}", file.parent / path, MODEL_FUNCTIONS, MODEL_GUIDE)


def _recipe(name: str, own: Mapping[str, str]) -> dict[str, Any]:
    if name in own:
        return {"place": str(own[name]), "fields": {}}
    model = MODELS[name]
    chosen = {key: getattr(model, key) for key in sorted(model.model_fields_set)}
    return {"place": f"{kinds.__name__}:{type(model).__name__}", "fields": chosen}
