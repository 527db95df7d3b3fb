"""Report what the choice of the law changes, beside the error of the mesh."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from palpate.report import tables
from palpate.report.model_looks import law_look
from palpate.report.report import Report
from palpate.report.words import listed, percent, spaced
from palpate.studies.law.compare_laws import LAW, OWN, POISSON, REGIONS, VARIANT, from_depths
from palpate.studies.law.figures import label

TITLE = "The law of the tissue"
MESHES = {
    "own": "the truth",
    "finest": "quadratic elements on the finest mesh",
    "quadratic": "quadratic elements with the nodes of linear ones",
    "linear": "linear elements on the finest mesh",
}
"""The meshes whose errors are known, best first."""


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    table = report.tables["law"]
    depths = from_depths(table)
    return {
        "bodies": [
            _of_body(tables.where(table, body=body), tables.where(depths, body=body)) for body in tables.bodies(table)
        ],
        "own": _range(tables.where(table, changed=OWN)["own_rmse_of_peak"]),
        "doubted": _doubted(table),
        "lost": _lost(table),
        "summary": summary(table),
    }


def _of_body(table: pd.DataFrame, depths: pd.DataFrame) -> dict[str, Any]:
    """Return what another law, another Poisson's ratio and leaving out the regions change in one body."""
    return {
        "name": spaced(str(table["body"].iloc[0])),
        "contacts": table["contact"].nunique(),
        "depths": _range(tables.where(table, changed=OWN)["depth_of_size"]),
        "locking": _locking(table),
        "laws": _laws(table, depths),
        "poissons": _poissons(table),
        "regions": _regions(table),
    }


def _laws(table: pd.DataFrame, depths: pd.DataFrame) -> dict[str, Any] | None:
    """Return what another law changes at most, over the surface and at the patch, and from which depth on."""
    laws = tables.where(table, changed=LAW).dropna(subset=["change_rmse_of_peak"])
    if laws.empty:
        return None
    most = laws.groupby("law", sort=False)["change_rmse_of_peak"].max()
    of_laws = tables.where(depths, changed=LAW)
    dent = laws.loc[laws["change_patch_rms_of_peak"].idxmax()]
    return {
        "deepest": laws["depth_of_size"].max(),
        "ends": [(law_look(str(law))[0], most[law]) for law in dict.fromkeys([most.idxmin(), most.idxmax()])],
        "matters": [(MESHES[mesh], _from(tables.where(of_laws, mesh=mesh))) for mesh in ("own", "finest", "linear")],
        "patch": dent["change_patch_rms_of_peak"],
        "patch_law": law_look(str(dent["law"]))[0],
        "patch_linear": dent["linear_patch_rms_of_peak"],
    }


def _poissons(table: pd.DataFrame) -> list[dict[str, str]]:
    """Return what other Poisson's ratios change, at all contacts and depths, and how well that is known."""
    return [
        {"changed": f"{poisson:g}", "change": _range(part["change_rmse_of_peak"]), "known": _known(part)}
        for poisson, part in tables.where(table, changed=POISSON).groupby("poisson")
        if part["change_rmse_of_peak"].notna().any()
    ]


def _regions(table: pd.DataFrame) -> dict[str, float] | None:
    """Return what leaving out the regions changes, and the errors of linear elements."""
    left = tables.where(table, changed=REGIONS).dropna(subset=["change_rmse_of_peak"])
    if left.empty:
        return None
    most = left.loc[left["change_rmse_of_peak"].idxmax()]
    return {
        "change": most["change_rmse_of_peak"],
        "patch": left["change_patch_rms_of_peak"].max(),
        "linear": most["linear_rmse_of_peak"],
        "patch_linear": most["linear_patch_rms_of_peak"],
    }


def _known(rows: pd.DataFrame) -> str:
    """Describe how large the truth's own error is where that is not believed."""
    doubted = rows[~rows["believed"].astype(bool)]["own_rmse_of_peak"].dropna()
    return f" (known to {percent(doubted.max())})" if len(doubted) else ""


def _doubted(table: pd.DataFrame) -> str:
    """List the changes whose truth is not believed, with its own error."""
    rows = table[~table["believed"].astype(bool) & table["own_rmse_of_peak"].notna()]
    groups = rows.groupby(VARIANT[1:], sort=False)["own_rmse_of_peak"]
    return listed([f"{label(*names)} ({_range(own)})" for names, own in groups]) or "none"


def _from(depths: pd.DataFrame) -> str:
    """Describe from which depth on changes matter more than one mesh, from the earliest to the latest of them."""
    ends = [depths["from_depth"].min(), depths["from_depth"].max()] if len(depths) else [np.inf]
    first, *latest = dict.fromkeys(map(_depth, ends))
    if not latest:
        return first
    return f"{first} at the earliest" + (f" and {latest[0]} at the latest" if np.isfinite(ends[1]) else "")


def _depth(share: float) -> str:
    """Describe one depth from which on a change matters more."""
    if not np.isfinite(share):
        return "at no depth"
    return f"from {percent(share)} on" if share > 0.0 else "from the first depth on"


def _range(values: pd.Series) -> str:
    """Return the least and the most of shares, in per cent."""
    known = values.dropna()
    ends = [percent(value) for value in (known.min(), known.max())] if len(known) else ["unknown"]
    return " to ".join(dict.fromkeys(ends))


def _lost(table: pd.DataFrame) -> str:
    """Count the presses that have no answer under a law."""
    lost = table[table["peak_of_size"].isna()]
    if lost.empty:
        return "every press has an equilibrium under every law"
    counts = lost.groupby(VARIANT, sort=False).size()
    return listed([f"{count} of the {spaced(body)} under {label(*rest)}" for (body, *rest), count in counts.items()])


def _locking(table: pd.DataFrame) -> str:
    """List what linear elements lack on the finest mesh, by Poisson's ratio."""
    shown = pd.concat([tables.where(table, changed=changed) for changed in (OWN, POISSON)])
    groups = shown.dropna(subset=["linear_rmse_of_peak"]).groupby("poisson")
    return listed([f"{percent(part['linear_rmse_of_peak'].mean())} at ν = {nu:g}{_known(part)}" for nu, part in groups])


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Tabulate each body and change: the deepest presses, from which depth on they matter, and what they took."""
    rows, depths = [], from_depths(table).set_index(VARIANT)
    for names, part in table.groupby(VARIANT, sort=False):
        deepest = part[part["depth_of_size"] == part.groupby("contact")["depth_of_size"].transform("max")]
        row = {"body": spaced(names[0]), "changed to": label(*names[1:]) + (" (as it is)" if names[1] == OWN else "")}
        row |= {"depth [% of size]": 100 * deepest["depth_of_size"].mean()}
        row |= {"change [% of peak]": 100 * deepest["change_rmse_of_peak"].mean()}
        row |= {"at the patch [% of peak]": 100 * deepest["change_patch_rms_of_peak"].mean()}
        own = depths.loc[[names]] if names in depths.index else depths.iloc[:0]
        for mesh, name in MESHES.items():
            row |= {f"error of {name} [% of peak]": 100 * deepest[f"{mesh}_rmse_of_peak"].mean()}
            row |= {f"more than that of {name}": _from(tables.where(own, mesh=mesh)) if len(own) else ""}
        row |= {"change of volume [%]": 100 * deepest["volume_change"].mean()}
        row |= {"least det F": deepest["least_det"].min()}
        row |= {"iterations": part["iterations"].mean(), "cycles": part["cycles"].mean()}
        rows.append(row | {"presses without an answer": int(part["peak_of_size"].isna().sum())})
    return pd.DataFrame(rows)


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the presses that have no answer under a law: what, where, how."""
    lost = report.tables["law"][report.tables["law"]["peak_of_size"].isna()]
    for row in lost.itertuples():
        what = label(row.changed, row.law, row.poisson)
        yield what, spaced(row.body), f"no answer at a depth of {percent(row.depth_of_size)}: {row.why}"
