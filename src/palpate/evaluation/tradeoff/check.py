"""Check of the settings of the trade-off between accuracy and time."""

from pathlib import Path

from palpate.config import check_samples
from palpate.errors import InputError
from palpate.files import check_file
from palpate.models import model_registry
from palpate.own_file import MODEL_FUNCTIONS, check_source


def check(config: dict, file: Path) -> None:
    """Raise InputError for unknown or missing models, or nothing to sample."""
    place, names, own = f"{file}: tradeoff", config["tradeoff"]["models"], config["tradeoff"]["own_models"]
    if wrong := model_registry.unknown(names or [], own):
        raise InputError(f"{place} names {wrong}")
    if names is not None and model_registry.SAVED_AGAINST not in names:
        raise InputError(
            f"{place}.models lacks {model_registry.SAVED_AGAINST}, which is what the others save time against; add it."
        )
    for name, path in own.items():
        check_file(f"{place}.own_models.{name}", path, (file.parent / path).is_file())
        check_source(f"{place}.own_models.{name}", file.parent / path, MODEL_FUNCTIONS, "see docs/add-a-model.md")
    check_samples(file, "tradeoff", config)
