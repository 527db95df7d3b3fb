"""Times of building, refitting and querying up to a million triangles."""

import numpy as np
from matplotlib.figure import Figure

from palpate.report import style
from palpate.studies.collision.compare_trees import STAGES, exponents
from palpate.studies.collision.figures.collision_looks import depths_of, look, ranked

TABLES = ("collision_scaling",)
_TITLES = {"build_ms": "build", "refit_ms": "refit", "query_ms": "query"}


@style.styled
def draw(collision_scaling) -> Figure:
    """Draw one panel for each stage, one curve with its exponent for each structure; dotted: proportional to n.

    collision_scaling : the table of this name
    """
    table = ranked(collision_scaling)
    among, powers = depths_of(table), exponents(table).set_index(["structure", "depths"])
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    for axis, stage in zip(figure.subplots(1, len(STAGES), sharey=True), STAGES, strict=True):
        for (structure, depths), rows in table.dropna(subset=stage).groupby(["structure", "depths"], sort=False):
            shown, power = look(structure, depths, among), powers.loc[(structure, depths), stage]
            grows = f": n$^{{{power:.2f}}}$" if np.isfinite(power) else ""
            size = 8 if shown.marker == "*" else 4
            axis.loglog(
                rows["triangles"],
                rows[stage],
                marker=shown.marker,
                ms=size,
                lw=1,
                color=shown.colour,
                label=f"{shown.label}{grows}",
            )
        ends = np.array([table["triangles"].min(), table["triangles"].max()])
        axis.loglog(ends, 1e-4 * ends, color=style.FAINT, lw=0.8, ls=":", label="100 ns per triangle")
        axis.set(title=_TITLES[stage], xlabel="triangles, n")
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), fontsize=7.5, ncols=2)
        style.plain_log(axis.xaxis)
        style.plain_log(axis.yaxis)
    figure.axes[0].set_ylabel("time for two bodies on one core [ms]")
    return figure
