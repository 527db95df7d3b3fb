"""Draw how far another law or Poisson's ratio moves a press's answer over depth, beside the mesh's error."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from palpate.report import style, tables
from palpate.report.model_looks import law_look
from palpate.report.words import spaced
from palpate.studies.law.compare_laws import OWN, POISSON, REGIONS

POISSONS = ("#cc79a7", "#7a3b63", "#b8578f", "#e3b1cd")
"""Colours of the other Poisson's ratios, in the order of the table."""
UNIFORM = ("without its regions", "#e6b400")
MESHES = {
    "linear_rmse_of_peak": ("mesh: linear elements on the finest level", "#111111", (0, (5, 2))),
    "quadratic_rmse_of_peak": ("mesh: quadratic elements with the same nodes", "#111111", (0, (3, 1.5, 1, 1.5))),
    "finest_rmse_of_peak": ("mesh: quadratic elements on the finest level", "#111111", (0, (1, 1.5))),
    "own_rmse_of_peak": ("the truth's own error", "#bbbbbb", "-"),
}
"""Errors of the body as it is described, which every change stands beside: name, colour and dashes."""


@style.figure("law", tables=("law",))
def draw_law(law) -> Figure:
    """Draw a column for each body: above, what each change is worth, and the mesh; below, the change of its volume.

    A line is one contact, dotted and hollow where it has no truth that is believed. Crosses at the top are presses
    without an equilibrium.
    """
    names = tables.bodies(law)
    figure, axes = style.panels(2, len(names), (max(4.6 * len(names), 6.4), 6.4), sharex="col", height_ratios=[5, 3])
    poissons = sorted(set(tables.where(law, changed=POISSON)["poisson"]))

    def shade_of(changed: str, name: str, poisson: float) -> str:
        if changed == POISSON:
            return POISSONS[poissons.index(poisson) % len(POISSONS)]
        return UNIFORM[1] if changed == REGIONS else law_look(name)[1]

    handles: dict[str, Line2D] = {}
    for body, (errors, volume) in zip(names, axes.T, strict=True):
        rows = tables.where(law, body=body)
        for (changed, name, poisson), variant in rows.groupby(["changed", "law", "poisson"], sort=False):
            shade = shade_of(changed, name, poisson)
            for _, curve in variant.groupby("contact"):
                _curve(errors, volume, curve.sort_values("depth_of_size"), changed, shade)
            if changed != OWN:
                handles[label(changed, name, poisson)] = Line2D([], [], marker="o", ms=3.5, color=shade)
        if (rows["why"].fillna("") != "").any():  # presses without an answer, at the top
            for row in rows[~np.isfinite(rows["peak_of_size"])].itertuples():
                looks = {"color": shade_of(row.changed, row.law, row.poisson), "ms": 6, "zorder": 4}
                errors.plot(100 * row.depth_of_size, 0.97, "x", transform=errors.get_xaxis_transform(), **looks)
        errors.set(yscale="log", xscale="log", title=spaced(body))
        volume.set(xlabel="depth of the press [% of the body's size]")
        style.plain_log(errors.xaxis, errors.yaxis)
        errors.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes[0, 0].set_ylabel("RMSE [% of peak]")
    axes[1, 0].set_ylabel("change of volume [%]")
    if not law.loc[law["change_rmse_of_peak"].notna(), "believed"].astype(bool).all():
        hollow = Line2D([], [], marker="o", ms=3.5, mfc="white", color=style.INK, ls=":")
        handles["without a truth that is believed"] = hollow
    handles |= {"the body as it is described": Line2D([], [], color=style.INK)}
    handles |= {text: Line2D([], [], color=ink, ls=dashes) for text, ink, dashes in MESHES.values()}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=2)
    return figure


def _curve(errors, volume, curve, changed: str, shade: str) -> None:
    """Draw the rows of one contact over depth [% of the body's size], into the axes ``errors`` and ``volume``.

    errors : how far a change moves the answer, or, where nothing is ``changed`` (OWN), the errors of the mesh [% of the
        peak]; a change without a truth that is believed is dotted and hollow
    volume : the change of volume [%]
    """
    depth = 100 * curve["depth_of_size"]
    if changed == OWN:
        for column, (_, ink, dashes) in MESHES.items():
            errors.plot(depth, 100 * curve[column], color=ink, ls=dashes, lw=1.2, zorder=1)
        shade = style.INK
    else:
        believed = curve.loc[curve["change_rmse_of_peak"].notna(), "believed"].astype(bool).all()
        looks = {"mfc": shade, "mec": "white", "mew": 0.4} if believed else {"mfc": "white", "mec": shade, "ls": ":"}
        looks |= {"marker": "o", "ms": 3.5, "zorder": 3, "color": shade}
        errors.plot(depth, 100 * curve["change_rmse_of_peak"], **looks)
    volume.plot(depth, 100 * curve["volume_change"], "-", lw=1.2, zorder=2, color=shade)


def label(changed: str, law: str, poisson: float) -> str:
    """Name a change of a body: "neo-Hookean", "ν = 0.45"; of the body as it is described its law and ν."""
    if changed == OWN:
        return f"{law_look(law)[0]}, ν = {poisson:g}"
    return {POISSON: f"ν = {poisson:g}", REGIONS: UNIFORM[0]}.get(changed, law_look(law)[0])
