"""Draw errors after a cut against the time from the blade's move to the first answer, and how far the lips open."""

import pandas as pd
from matplotlib.figure import Figure

from palpate.benchmark.ranking import TRUTH
from palpate.report import style, tables
from palpate.report.model_looks import look
from palpate.report.words import spaced
from palpate.report.work_precision import frames, handles, legend, panels, points

PANELS = {
    "surface_error": "surface: RMS error [% of peak]",
    "opening_error": "opening: largest error [% of the largest]",
    "force_error": "hooks: largest error of a force [%]",
}
"""The errors that are drawn, a panel each."""
WAYS = {
    "removal": ("elements removed", "X"),
    "deleted": ("springs deleted", "v"),
    "split_faces": ("split along faces", "s"),
    "virtual_nodes": ("virtual nodes", "o"),
    "conform": ("mesh made anew", "*"),
    "enriched": ("jumps added to the whole", "h"),
}
"""How a level is cut, in words, with a marker each."""
FRAMES_MS = (16.7, 100.0)
"""Times of an answer: of 60 pictures a second, of an immediate reaction."""
TOLD = {
    "update=true": ("compliance updated", "P"),
    "update=false": ("compliance factorised", "D"),
    "order=1": ("in linear elements", "h"),
    "order=2": ("in quadratic elements", "p"),
}


def way_of(row: pd.Series) -> tuple[str, str]:
    """Return how a setting follows a cut, in words, and its marker."""
    named = next((shown for text, shown in TOLD.items() if row["setting"].endswith(text)), None)
    return named or WAYS[row["way"]]


@style.figure("cut_precision", tables=("cut",))
def draw_cut_precision(cut, *, scene: str) -> Figure:
    """Draw the errors of all models in one ``scene``: colours are models, and markers ways.

    Lines join the settings of one model and way that no other of these beats; what failed is named below.
    """
    rows = tables.where(cut, scene=scene)
    ways = pd.DataFrame([way_of(row) for _, row in rows.iterrows()], columns=["meaning", "marker"], index=rows.index)
    drawn_points = [points(rows, "first_median_s", column, marker=ways["marker"]) for column in PANELS]
    figure = Figure(figsize=(10.2, 5.2), layout="constrained")
    figure.suptitle(f"{spaced(scene)}: error against time", x=0.01, ha="left", fontsize=10, fontweight="bold")
    parts = figure.subplot_mosaic([list(PANELS), ["legend"] * len(PANELS)], height_ratios=[4.6, 0.8])
    axes = [parts[column] for column in PANELS]
    for axis, name in zip(axes, PANELS.values(), strict=True):
        axis.set_xlabel("from the blade's move to the first answer [ms]")
        axis.set_title(name, pad=18)
    panels(axes, drawn_points, (rows[f"own_{column}"].iloc[0] for column in PANELS), frames(FRAMES_MS))
    shown = handles(pd.concat(drawn_points, ignore_index=True), dict(zip(ways["marker"], ways["meaning"], strict=True)))
    failed = rows[rows["failure"].fillna("") != ""]
    names = [f"{look(row.model).label} ({row.setting})" for row in failed.itertuples()]
    legend(parts["legend"], shown, f"no answer: {', '.join(names)}" if names else "", ncols=6, width=160)
    return figure


@style.figure("cut_opening", tables=("cut_opening",))
def draw_cut_opening(cut_opening, *, scene: str) -> Figure:
    """Draw how far the lips open along the cut, a panel for each level; filled: the truth.

    Models of one way often open them alike: each that follows is drawn thinner, so that those below are seen.
    """
    rows = tables.where(cut_opening, scene=scene)
    truth, models = tables.where(rows, model=TRUTH), rows[rows["model"] != TRUTH]
    levels = sorted(models["level"].astype(int).unique())
    figure, (axes,) = style.panels(1, max(1, len(levels)), (10.2, 3.9), sharey=True)
    for axis, level in zip(axes, levels, strict=False):
        axis.fill_between(1e3 * truth["along_m"], 1e3 * truth["opening_m"], color="#d9d9d9", label="the truth")
        of_level = models[models["level"].astype(int) == level]
        distinct = of_level.drop_duplicates(["model", "way", "along_m"], keep="last")
        groups = list(distinct.groupby(["model", "way"], sort=False))
        for number, ((model, how_cut), places) in enumerate(groups):
            shown, (words, marker) = look(str(model)), WAYS[str(how_cut)]
            places = places.sort_values("along_m")
            above = sum(other == how_cut for (_, other), _ in groups[number + 1 :])
            drawn = {"color": shown.colour, "marker": marker, "ms": 4 + above, "lw": 1 + 0.9 * above, "mew": 0}
            axis.plot(1e3 * places["along_m"], 1e3 * places["opening_m"], label=f"{shown.label}, {words}", **drawn)
        axis.set(title=f"{spaced(scene)}, level {level}", xlabel="along the cut [mm]")
    axes[0].set_ylabel("opening of the lips [mm]")
    by_label = {label: handle for axis in axes for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(by_label.values(), by_label.keys(), loc="outside lower left", ncols=4, fontsize=7.5)
    return figure
