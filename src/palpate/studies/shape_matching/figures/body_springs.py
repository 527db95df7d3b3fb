"""Extent of a poke on a surface model, and its recovery, with and without virtual body springs (paper 3)."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style

TABLES = ("body_springs",)
_SHADES = ("#c5e29f", "#8cc63f", "#3f6b12")  # the hue of body springs in style.EFFECTS, darker the stiffer


@style.styled
def draw(body_springs) -> Figure:
    """Draw the displacement at the end of the hold over the distance from the poke, and the largest one over time.

    body_springs : the table of this name
    """
    figure = Figure(figsize=(9.5, 3.9), layout="constrained")
    local, back = figure.subplots(1, 2)
    handles, shades = [], iter(_SHADES)
    for (case, stiffness), rows in body_springs.groupby(["case", "body_springs_n_m"], sort=False):
        colour, dashes, label = _look(case, stiffness, shades)
        held = rows[rows["phase"] == "hold"]
        held = held[held["time_s"] == held["time_s"].max()]
        peak = held["max_displacement_m"].max()
        local.plot(1e3 * held["distance_m"], 1e3 * held["mean_displacement_m"], "o", ls=dashes, ms=4, color=colour)
        over = rows.groupby("time_s")["max_displacement_m"].max() / peak
        back.plot(over.index, 100 * over, ls=dashes, color=colour)
        share = held["moved"].sum() / held["nodes"].sum()
        label = f"{label}\n{100 * share:.0f} % of nodes moved, {1e3 * peak:.1f} mm"
        handles.append(Line2D([], [], color=colour, ls=dashes, marker="o", ms=4, label=label))
    released = body_springs.loc[body_springs["phase"] == "hold", "time_s"].max()
    back.axvline(released, color=style.FAINT, ls=":", lw=1)
    back.annotate("release", (released, 0.01), (-3, 2), xycoords=("data", "axes fraction"),
                  textcoords="offset points", rotation=90, ha="right", va="bottom", fontsize=7)  # fmt: skip
    local.set(xlabel="rest distance from the poke [mm]", ylabel="mean displacement [mm]", title="during the hold")
    back.set(xlabel="time [s]", ylabel="largest displacement [% of that during the hold]", title="over time")
    back.set(yscale="log", ylim=(1e-2, 300))
    style.plain_log(back.yaxis)
    title = "moved: by more than 10 % of the largest"
    figure.legend(handles=handles, loc="outside right upper", labelspacing=0.9, title=title)
    return figure


def _look(case: str, stiffness: float, shades) -> tuple[str, str, str]:
    """Return colour, line style and label of a case."""
    if case == "body_springs":
        return next(shades), "-", f"body springs, {stiffness:g} N/m per node"
    return {
        "none": (style.INK, "-", "surface springs only"),
        "dampers_only": (style.FAINT, "--", "dampers only, without body springs"),
    }[case]
