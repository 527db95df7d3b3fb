"""The numbers that the captions and the headline about models in motion name, worked out from their table."""

import pandas as pd

from palpate.figures import tables
from palpate.figures.model_looks import look
from palpate.figures.number_format import percent


def numbers(all_tables: dict[str, pd.DataFrame]) -> dict[str, str]:
    """Every placeholder of these captions, as text."""
    table = all_tables["dynamic_accuracy"]
    told = [_least_wrong(scene, tables.where(table, scene=scene)) for scene in tables.scenes(table)]
    return {"headline_dynamic": f"Least wrong of what runs faster than life: {'; '.join(told)}."}


def _least_wrong(scene: str, rows: pd.DataFrame) -> str:
    """The model with the least error among those that need less than a second for a second of motion."""
    name = scene.replace("_", " ")
    fast = rows[(rows["failures"] == 0) & (rows["slower_than_life"] < 1)]
    if fast.empty:
        return f"{name} none"
    best = fast.loc[fast["rmse_of_peak"].idxmin()]
    return f"{name} {look(best['model']).label} ({percent(best['rmse_of_peak'])} of the peak off)"
