"""Open a finished run, by its settings and its results, so that its models can be prepared again and answer presses."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from palpate.benchmark.accuracy import read_case
from palpate.benchmark.model import Case, Model
from palpate.benchmark.settings import FitOptions
from palpate.errors import InputError
from palpate.files import read_table
from palpate.models.model_registry import model
from palpate.run.settings import complete, read_settings


@dataclass(frozen=True)
class FinishedRun:
    """Settings as a file has them, with the defaults of all others, and the folder that ``make`` has filled."""

    config: Path
    results: Path

    @cached_property
    def settings(self) -> Any:
        """All settings; InputError naming the file and what is wrong."""
        return complete(read_settings(self.config), self.config)

    @cached_property
    def table(self) -> pd.DataFrame:
        """The rows of accuracy_vs_time.csv; InputError if there is no such table."""
        columns = ["scene", "body", "regime", "model", "setting", "split", "online_p95_s", "validation_rmse_of_peak"]
        return read_table(self.results / "tables/accuracy_vs_time.csv", columns)

    @property
    def scenes(self) -> list[str]:
        """The names of what was pressed, such as liver_large."""
        return list(dict.fromkeys(self.table["scene"]))

    def rows(self, scene: str) -> pd.DataFrame:
        """Return the rows of a scene in its first split; InputError for one that was not measured."""
        if scene not in self.scenes:
            raise InputError(f"--scene {scene} is not in {self.results}; choose from {', '.join(self.scenes)}.")
        rows = self.table[self.table["scene"] == scene]
        return rows[rows["split"] == rows["split"].min()]

    def folder(self, scene: str) -> Path:
        """Return where the data of a scene are."""
        first = self.rows(scene).iloc[0]
        return self.results / "data" / first["body"] / first["regime"]

    def case(self, scene: str) -> Case:
        """Read what models of a scene are prepared from, in its first split; InputError for a damaged file."""
        folder, study = self.folder(scene), self.settings.tradeoff
        regime = (self.settings.regimes or {}).get(folder.name)
        if study is None or regime is None:
            raise InputError(f"{self.config} asks for no {scene}; give the settings that {self.results} is made of.")
        radius_m = regime.radius_on(folder.parent.name)
        compliance = folder.parent / f"compliance_{radius_m}m.h5"
        options = FitOptions(**dict(study.regression), seed=self.settings.seed)
        files: dict[str, Path] = {"body": folder.parent / "body.h5"}
        files |= {"database": folder / "database.h5", "samples": folder / "samples.csv"}
        files |= {"compliance": compliance} if compliance.is_file() else {}
        split = int(self.rows(scene)["split"].iloc[0])
        tolerance = self.settings.solver.tolerance
        return read_case(files, folder.name, split, radius_m, options, tolerance)

    def models(self, name: str, case: Case) -> Sequence[Model]:
        """Return a model with all the settings that the run has measured; InputError for one that it has not."""
        own_models = {key: str(self.config.parent / path) for key, path in self.settings.own_models.items()}
        measured = list(dict.fromkeys(self.table["model"]))
        if name not in measured:
            raise InputError(f"--model {name} was not measured in {self.results}; choose from {', '.join(measured)}.")
        return model(name, own_models).tried(case, self.settings.tradeoff.settings)
