"""Error of an organ's springs and of their rivals, at fitted contacts and at others, and what their motion costs."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.report.model_looks import DASHES, FITS, FORCES, look
from palpate.report.words import spaced

SHORT = {
    "van_gelder": "Van Gelder",
    "lloyd": "Lloyd",
    "uniform": "one E",
    "genetic": "genetic",
    "cma_es": "CMA-ES",
    "gradient": "gradient",
    "coarse_fem": "coarse FEM",
    "shape_matching": "shapes",
}
"""Labels for axes."""
APART = 1.16
"""Springs, which all take the same time, are drawn so many times as far to the right as one another."""


@style.figure("organ_springs", tables=("organ_springs",))
def draw_organ_springs(organ_springs) -> Figure:
    """Draw each model's errors at fitted and tested contacts, and those at tested contacts over time; a row a body.

    A dot is a contact and a bar their mean, medians over the seeds
    """
    names = tables.bodies(organ_springs)
    # replace the seeds of each search by their median
    run = ["body", "model", "volume_force", "step_s", "contact", "used_in_fit"]
    organ_springs = organ_springs.groupby(run, sort=False)[["rmse_of_peak", "ms_a_second"]].median().reset_index()
    figure, axes = style.panels(len(names), 2, (9.5, 3.9 * len(names)), width_ratios=[1.25, 1])
    for (left, right), body in zip(axes, names, strict=True):
        rows = tables.where(organ_springs, body=body)
        _errors(left, rows)
        _over_time(right, rows)
        left.set_title(f"{spaced(body)}: at the fitted contacts (filled) and at others")
        right.set_title(f"{spaced(body)}: at contacts that no fit saw")
    looks = [look(model) for model in dict.fromkeys(organ_springs["model"]) if model != "zero"]
    handles = [Line2D([], [], ls="", marker=shown.marker, color=shown.colour, label=shown.label) for shown in looks]
    forces = sorted(set(organ_springs["volume_force"].astype(bool)))
    if len(forces) > 1:
        handles += [Line2D([], [], color=style.INK, ls=DASHES[force], label=FORCES[force]) for force in forces]
    figure.legend(handles=handles, loc="outside upper center", ncols=5)
    return figure


def _errors(axis, rows) -> None:
    """Draw errors at fitted and tested contacts for each model, in its time step that is best at tested contacts."""
    shown = []
    for (model, force), of_model in rows[rows["model"] != "zero"].groupby(["model", "volume_force"], sort=False):
        best = of_model[~of_model["used_in_fit"]].groupby("step_s")["rmse_of_peak"].mean().idxmin()
        shown.append((model, bool(force), of_model[of_model["step_s"] == best]))
    for place, (model, force, of_model) in enumerate(shown):
        for used, shift, fill in ((True, -0.18, look(model).colour), (False, 0.18, "none")):
            error, x = 100 * tables.where(of_model, used_in_fit=used)["rmse_of_peak"], place + shift
            axis.plot([x] * len(error), error, "o", mfc=fill, mec=look(model).colour, ms=4)
            axis.plot([x - 0.15, x + 0.15], [error.mean()] * 2, color=style.INK, ls=DASHES[force])
    zero = 100 * tables.where(rows, model="zero")["rmse_of_peak"].mean()
    axis.annotate(f"no motion: {zero:.0f} %", (1.0, 1.0), (-2, -8), "axes fraction", "offset points", ha="right")
    labels = [SHORT[model] + (" + V" if force and len(shown) > 8 else "") for model, force, _ in shown]
    axis.set_xticks(range(len(shown)), labels, rotation=30, ha="right")
    axis.set(ylabel="RMSE [% of peak]", ylim=(0, None))


def _over_time(axis, rows) -> None:
    """Draw the mean error at tested contacts over the computing time of a second of motion; for springs see APART."""
    tested = rows[~rows["used_in_fit"] & (rows["model"] != "zero")]
    spring_models = dict(enumerate(dict.fromkeys(model for model in tested["model"] if model in FITS)))
    shifts = {model: number - (len(spring_models) - 1) / 2 for number, model in spring_models.items()}
    for (model, force), of_model in tested.groupby(["model", "volume_force"], sort=False):
        steps = of_model.groupby("step_s")
        mean = steps[["rmse_of_peak"]].mean().assign(ms=steps["ms_a_second"].median()).sort_values("ms")
        if model in shifts:
            all_springs = tested[tested["model"].isin(shifts) & (tested["volume_force"] == force)]
            mean["ms"] = np.median(all_springs["ms_a_second"]) * APART ** shifts[model]
        mark = look(model)
        looks = {"marker": mark.marker, "color": mark.colour, "ls": DASHES[force], "ms": 9, "mec": "white", "mew": 0.6}
        axis.plot(mean["ms"], 100 * mean["rmse_of_peak"], **looks)
    axis.axvline(1000.0, color=style.FAINT, lw=1)
    axis.annotate("real time", (1000.0, 0.0), (-3, 4), ("data", "axes fraction"), "offset points", ha="right")
    axis.set(xscale="log", xlabel="computing for a second of motion [ms]", ylabel="RMSE [% of peak]", ylim=(0, None))
    style.plain_log(axis.xaxis)
