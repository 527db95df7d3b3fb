"""Contact-ordered against unordered features in every premise: errors, and their ratios with intervals."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables

TABLES = ("premises", "premise_bodies")
PAPERS = "nonnegative_a"
READINGS = {
    PAPERS: ("non-negative (a), the paper", "s"),
    "nonnegative_b": ("non-negative (b)", "D"),
    "literal": ("(a), equation 4 word for word", "v"),
    "linear": ("linear regressor of § 3.2", "P"),
}
"""Label and marker of each way to weigh samples that is compared."""
SHOWN = (0.08, 30.0)
"""Ratios that are shown; what is larger is marked at the end of the scale."""


@style.styled
def draw(premises, premise_bodies, *, held_out: str = "contacts") -> Figure:
    """Draw a row for each premise, the most local first: errors on the left, ratios to unordered features on the right.

    premises, premise_bodies : the tables of these names
    Whiskers hold 90 % of draws of splits and contacts. Left of the line ordered features pay; ratios beyond SHOWN are
    arrows at its end.
    """
    about = premise_bodies.sort_values("moved_share", kind="stable")
    shown = tables.where(premises, held_out=held_out)
    whole = shown[shown["train"] == shown.groupby("premise")["train"].transform("max")]
    figure = Figure(figsize=(10, 0.62 * len(about) + 1.7), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    right.set(xscale="log", xlim=SHOWN, xlabel="error / error of unordered features with the same weights")
    for y, row in enumerate(about.itertuples()):
        _errors(left, y, tables.where(whole, premise=row.premise))
        _ratios(right, y, tables.where(whole, premise=row.premise))
    labels = [
        f"{row.premise.replace('_', ' ')}{'*' if row.responses == 'nonlinear' else ''}\n"
        f"{100 * row.moved_share:.0f} % of the surface moves"
        for row in about.itertuples()
    ]
    left.set_yticks(range(len(about)), labels)
    left.invert_yaxis()
    left.set(xscale="log", xlabel="RMSE [% of peak], mean of the test samples")
    right.axvline(1.0, color=style.INK, lw=1, zorder=1)
    for axis in (left, right):
        style.plain_log(axis.xaxis)
        axis.grid(axis="y", visible=False)
    figure.legend(handles=_legend(), loc="outside lower center", ncols=3)
    return figure


def _errors(axis, y, rows) -> None:
    """Draw the errors of the paper's weights, and of the answers that need no samples."""
    for name, marker, colour in (
        ("zero", "|", style.FAINT),
        ("interpolation", "X", style.look("interpolation").colour),
    ):
        error = 100 * tables.where(rows, features=name)["rmse_of_peak"].iloc[0]
        axis.plot(error, y - 0.36, marker, color=colour, ms=11 if marker == "|" else 6, mew=2 if marker == "|" else 0.5)
    for i, features in enumerate(style.FEATURES):
        row = tables.where(rows, features=features, weights=PAPERS).iloc[0]
        _whisker(
            axis, y + 0.22 * (i - 1), [100 * row[c] for c in ("rmse_of_peak", "error_low", "error_high")], features
        )


def _ratios(axis, y, rows) -> None:
    """Draw the ratios of both kinds of ordered features, one mark for each way to weigh."""
    for i, weights in enumerate(READINGS):
        for features, up in (("ordered", -0.04), ("framed", 0.04)):
            row = tables.where(rows, features=features, weights=weights).iloc[0]
            values, marker = [row[c] for c in ("ratio", "ratio_low", "ratio_high")], READINGS[weights][1]
            if values[0] > 0.9 * SHOWN[1]:
                values, marker = [0.9 * SHOWN[1]] * 3, ">"
            _whisker(axis, y + 0.19 * (i - 1.5) + up, values, features, marker)


def _whisker(axis, y, values, features, marker="s") -> None:
    """Draw one mark at the first of ``values``, and a line from the second to the third."""
    colour = style.look(f"{features}_{PAPERS}").colour
    axis.plot(values[1:], [y, y], color=colour, lw=1.2, zorder=2)
    axis.plot(values[0], y, marker, color=colour, mec="white", mew=0.5, ms=5.5, zorder=3)


def _legend() -> list[Line2D]:
    """Return the handles: colours for features, markers for weights."""
    colours = [
        Line2D([], [], color=style.look(f"{features}_{PAPERS}").colour, label=name)
        for features, (name, _) in style.FEATURES.items()
    ]
    markers = [Line2D([], [], ls="", marker=m, color="#777777", label=name) for name, m in READINGS.values()]
    return [
        *colours,
        Line2D([], [], ls="", marker="|", ms=11, mew=2, color=style.FAINT, label="the zero answer"),
        Line2D([], [], ls="", marker="X", color=style.look("interpolation").colour, label="linear interpolation"),
        *markers,
    ]
