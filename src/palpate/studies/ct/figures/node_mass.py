"""Total mass of an organ's mesh against that of its voxels, and mean density, over mesh resolutions (paper 2)."""

from matplotlib.figure import Figure

from palpate.report import style, tables

TABLES = ("node_mass",)
_COLOURS = ("#009e73", "#d55e00", "#0072b2", "#cc79a7", "#e69f00")
_ENOUGH, _BOUND, _PAPERS = 6000, 1.0, 3.5  # elements; deviations [%]


@style.styled
def draw(node_mass) -> Figure:
    """Draw the deviation of the total mass, with and without the correction at the organ's rim, and the mean density.

    node_mass : the table of this name
    """
    figure = Figure(figsize=(9.5, 3.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    for i, body in enumerate(tables.bodies(node_mass)):
        rows = tables.where(node_mass, body=body).sort_values("elements")
        colour = _COLOURS[i % len(_COLOURS)]
        left.plot(rows["elements"], 100 * rows["raw_deviation"], color=colour, ls="--", marker="o", ms=3, alpha=0.7)
        left.plot(rows["elements"], 100 * rows["deviation_from_voxels"], color=colour, marker="o", ms=4, label=body)
        right.plot(rows["elements"], rows["mean_density_kg_m3"], color=colour, marker="o", ms=4, label=body)
    _bounds(left, node_mass["elements"])
    left.plot([], [], color=style.INK, label="densities of the organ only")
    left.plot([], [], color=style.INK, ls="--", alpha=0.7, label="densities of all voxels (paper 2)")
    left.set(title="deviation of the total mass from the voxels", ylabel="deviation [%]")
    left.legend(loc="lower right")
    right.set(title="mean density", ylabel="total mass / volume [kg/m³]")
    low, high = right.get_ylim()
    right.set_ylim(min(low, high - 40), max(high, low + 40))
    right.legend(loc="lower right")
    for axis in (left, right):
        axis.set_xscale("log")
        axis.set_xlabel("elements")
        style.plain_log(axis.xaxis)
    return figure


def _bounds(axis, elements) -> None:
    """Draw the range that paper 2 reports, and the bound for meshes with enough elements."""
    axis.axhspan(-_PAPERS, _PAPERS, color="#f3f3f3", zorder=0)
    axis.annotate(
        f"±{_PAPERS:g} %: paper 2's meshes", (elements.min(), _PAPERS), (0, -10), textcoords="offset points", fontsize=8
    )
    if elements.max() > _ENOUGH:
        axis.fill_between([_ENOUGH, elements.max()], -_BOUND, _BOUND, color="#dcdcdc", lw=0, zorder=0.5)
        axis.annotate(
            f"±{_BOUND:g} % from {_ENOUGH} elements", (elements.max(), _BOUND), (0, 3), textcoords="offset points",
            fontsize=8, ha="right",
        )  # fmt: skip
