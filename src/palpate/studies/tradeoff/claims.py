"""Judge the idea that paper 3 reports of Bao and others (2006): a fine model only where force acts."""

from collections.abc import Iterator, Mapping

import pandas as pd

from palpate.benchmark.ranking import fields_of
from palpate.number_text import percent_in_table as percent
from palpate.report.claims import Claim, claims, verdict
from palpate.report.words import two_digits


@claims("accuracy_vs_time")
def local(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield a claim for each order of elements, of the first split; none without whole meshes as fine as local ones."""
    table = tables["accuracy_vs_time"]
    table = table[table["split"] == table["split"].min()]
    names = ["fem_local", "fem_p1", "fem_p2"]
    elements = table[table["model"].isin(names)].reset_index(drop=True)
    settings = elements.join(fields_of(elements, "level", "depth", "order", "start", "iterations", "target"))
    if settings["depth"].isna().all():
        return
    # all stop in the same way, one iteration from the frame before, and none is corrected to the limit
    settings = settings[(settings["start"] == "frame") & (settings["iterations"] == 1) & settings["target"].isna()]
    for order, rows in settings[settings["model"] == "fem_local"].groupby("order"):
        whole_meshes = settings[settings["model"] == f"fem_p{order:g}"].set_index(["scene", "level"])
        compared = rows[rows["depth"].isin(whole_meshes.index.get_level_values("level"))]
        if len(compared):
            deepest = compared[compared["depth"] == compared["depth"].max()]
            yield _claim(order, deepest, whole_meshes[["patch_rms_of_peak", "online_median_s"]])


def _claim(order: float, rows: pd.DataFrame, whole: pd.DataFrame) -> Claim:
    """Compare meshes that are fine at the contact alone (``rows``, one a scene) with wholly coarse and fine ones.

    whole : error at the patch and time, by scene and level
    """
    error, time = "patch_rms_of_peak", "online_median_s"
    local = rows.drop_duplicates("scene", keep="last").set_index("scene")
    depth = local["depth"].iloc[0]
    coarse, fine = whole.xs(0, level="level"), whole.xs(depth, level="level")
    scenes = local.index.intersection(coarse.index).intersection(fine.index)
    coarse, local, fine = (table.loc[scenes, [error, time]] for table in (coarse, local, fine))
    holds = bool((local[error] < coarse[error]).all() and (local[time] < fine[time]).all())
    results = []
    for scene in scenes:
        three_rows = (table.loc[scene] for table in (coarse, local, fine))
        told = ", ".join(f"{percent(each[error])} in {two_digits(1e3 * each[time])} ms" for each in three_rows)
        results.append(f"{scene.replace('_', ' ')}: {told}")
    claim = "a fine model only where force acts is more precise there than a coarse one, and faster than a fine one"
    premise = f"elements of order {order:g}, level {depth:g} near the contact; errors at the patch: coarse, local, fine"
    return Claim(
        3, "1, of Bao and others", claim, premise, "no figure", "; ".join(results) or "not measured", verdict(holds)
    )
