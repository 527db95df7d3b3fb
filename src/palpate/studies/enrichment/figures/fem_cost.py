"""Cost of a fine simulation: Newton iterations and seconds over the size of the deformation."""

from matplotlib.figure import Figure

from palpate.report import style, tables

TABLES = ("fem_cost", "sample_peaks")
_REGIMES = (("#0072b2", "o"), ("#d55e00", "^"), ("#009e73", "s"), ("#7d7d7d", "D"))


@style.styled
def draw(fem_cost, sample_peaks) -> Figure:
    """Draw seconds and Newton iterations over the peak displacement [mm], one column for each body.

    fem_cost, sample_peaks : the tables of these names, joined on body, regime and sample
    """
    joined = fem_cost.merge(sample_peaks, on=["body", "regime", "sample"], validate="one_to_one")
    names = tables.bodies(joined)
    figure = Figure(figsize=(4.2 * len(names) + 0.4, 5), layout="constrained")
    grid = figure.subplots(2, len(names), sharex=True, sharey="row", squeeze=False)
    for column, body in zip(grid.T, names, strict=True):
        here = tables.where(joined, body=body)
        for (regime, rows), (colour, marker) in zip(here.groupby("regime", sort=False), _REGIMES, strict=False):
            label = f"{regime} loads: median {rows['seconds'].median():.2g} s, most {rows['seconds'].max():.2g} s"
            for axis, value in zip(column, ("seconds", "newton_iterations"), strict=True):
                axis.plot(
                    1e3 * rows["peak_m"],
                    rows[value],
                    marker,
                    color=colour,
                    ms=4,
                    mec="white",
                    mew=0.4,
                    label=label,
                )
        column[0].set(xscale="log", yscale="log")
        column[0].set_title(body, pad=32)
        column[0].legend(loc="lower left", bbox_to_anchor=(-0.03, 0.99))
        column[1].set(xlabel="peak displacement [mm]", ylim=(0, None))
    style.plain_log(grid[0, 0].xaxis)
    style.plain_log(grid[0, 0].yaxis)
    grid[0, 0].set_ylabel("time of a fine simulation [s]")
    grid[1, 0].set_ylabel("Newton iterations")
    return figure
