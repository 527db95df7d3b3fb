"""Draw the figures of a study from its tables."""

from collections.abc import Mapping
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from palpate.files import read_yaml
from palpate.report import style, tables


def draw(figures: Mapping[str, Mapping[str, Any]]) -> None:
    """Write results/figures/<name>.png and .svg of each.

    figures : by name, the ``place`` of what draws it ("palpate.studies.NAME.figures:draw_NAME"), the names of the
        ``tables`` that it gets, the ``scene`` if there is one for each, and the file ``published`` if it shows that
    """
    for name, figure in figures.items():
        scene = figure["scene"]
        # of one scene there may be nothing to draw
        read = [tables.read(f"results/tables/{table}.csv", rows=not scene) for table in figure["tables"]]
        options = {"scene": scene} if scene else {}
        if figure["published"]:
            options["published"] = read_yaml(figure["published"])
        style.save(resolve_name(figure["place"])(*read, **options), Path("results/figures") / name)
