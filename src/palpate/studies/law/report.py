"""Report what the choice of the law changes, beside the error of the mesh."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from palpate.report import markup, tables
from palpate.report.law_looks import label, law_label
from palpate.report.material import Report, Section
from palpate.report.number_format import each, percent
from palpate.report.words import capital, listed, spaced
from palpate.studies.law.compare_laws import LAW, OWN, POISSON, REGIONS, VARIANT, from_depths
from palpate.studies.law.tables import TABLES

__all__ = ["TABLES", "TITLE", "failures", "numbers", "sections"]

TITLE = "The law of the tissue"
MESHES = {
    "own": "the truth",
    "finest": "quadratic elements on the finest mesh",
    "quadratic": "quadratic elements with the nodes of linear ones",
    "linear": "linear elements on the finest mesh",
}
"""The meshes whose errors are known, best first."""


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text."""
    table = report.tables["law"]
    bodies = tables.bodies(table)
    depths = from_depths(table)
    said = [_sentence(tables.where(table, body=body), tables.where(depths, body=body)) for body in bodies]
    return {
        "headline": " ".join(filter(None, said)) or "No press has an answer under two laws.",
        "law_contacts": each(bodies, lambda body: str(tables.where(table, body=body)["contact"].nunique())),
        "law_depths": each(bodies, lambda body: _range(tables.where(table, body=body, changed=OWN)["depth_of_size"])),
        "law_own": _range(tables.where(table, changed=OWN)["own_rmse_of_peak"]),
        "law_doubted": _doubted(table),
        "law_lost": _lost(table),
        "law_locking": each(bodies, lambda body: _locking(tables.where(table, body=body))),
    }


def _sentence(table: pd.DataFrame, depths: pd.DataFrame) -> str:
    """Describe for one body what another law, another Poisson's ratio and leaving out its regions change."""
    said = " ".join(filter(None, [_laws(table, depths), _poissons(table), _regions(table)]))
    return f"{capital(spaced(str(table['body'].iloc[0])))}: {said}" if said else ""


def _laws(table: pd.DataFrame, depths: pd.DataFrame) -> str:
    """Describe what another law changes at most, over the surface and at the patch, and from which depth on."""
    laws = tables.where(table, changed=LAW).dropna(subset=["change_rmse_of_peak"])
    if laws.empty:
        return ""
    most = laws.groupby("law", sort=False)["change_rmse_of_peak"].max()
    ends = [f"{percent(most[law])} ({law_label(str(law))})" for law in dict.fromkeys([most.idxmin(), most.idxmax()])]
    of_laws, deepest = tables.where(depths, changed=LAW), percent(laws["depth_of_size"].max())
    matters = [f"{MESHES[mesh]} {_from(tables.where(of_laws, mesh=mesh))}" for mesh in ("own", "finest", "linear")]
    dent = laws.loc[laws["change_patch_rms_of_peak"].idxmax()]
    return (
        f"up to a depth of {deepest}, another law changes the answer by up to {' to '.join(ends)} of the peak. "
        f"That is more than the error of {'; of '.join(matters)}. At the patch it changes up to "
        f"{percent(dent['change_patch_rms_of_peak'])} ({law_label(str(dent['law']))}), where linear elements are wrong "
        f"by {percent(dent['linear_patch_rms_of_peak'])}."
    )


def _poissons(table: pd.DataFrame) -> str:
    """Describe what other Poisson's ratios change, at all contacts and depths, and how well that is known."""
    own = float(tables.where(table, changed=OWN)["poisson"].iloc[0])
    worth = [
        f"ν = {poisson:g} in the place of {own:g} changes it by {_range(part['change_rmse_of_peak'])}{_known(part)}"
        for poisson, part in tables.where(table, changed=POISSON).groupby("poisson")
        if part["change_rmse_of_peak"].notna().any()
    ]
    return f"{listed(worth)}, at any depth." if worth else ""


def _regions(table: pd.DataFrame) -> str:
    """Describe what leaving out the regions changes, above them and elsewhere, over the surface and at the patch."""
    left = tables.where(table, changed=REGIONS).dropna(subset=["change_rmse_of_peak"])
    if left.empty:
        return ""
    most = left.loc[left["change_rmse_of_peak"].idxmax()]
    return (
        f"leaving its regions out changes the answer by up to {percent(most['change_rmse_of_peak'])} of the peak, "
        f"and by up to {percent(left['change_patch_rms_of_peak'].max())} at the patch; "
        f"linear elements on the finest mesh are wrong by {percent(most['linear_rmse_of_peak'])} and "
        f"{percent(most['linear_patch_rms_of_peak'])}."
    )


def _known(rows: pd.DataFrame) -> str:
    """Describe how large the truth's own error is where that is not believed."""
    doubted = rows[~rows["believed"].astype(bool)]["own_rmse_of_peak"].dropna()
    return f" (known to {percent(doubted.max())})" if len(doubted) else ""


def _doubted(table: pd.DataFrame) -> str:
    """List the changes whose truth is not believed, with its own error."""
    rows = table[~table["believed"].astype(bool) & table["own_rmse_of_peak"].notna()]
    found = [
        f"{label(*names)} ({_range(part['own_rmse_of_peak'])})" for names, part in rows.groupby(VARIANT[1:], sort=False)
    ]
    return listed(found) if found else "none"


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


def _deepest(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the deepest press of each contact."""
    return table[table["depth_of_size"] == table.groupby("contact")["depth_of_size"].transform("max")]


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
    shown = shown.dropna(subset=["linear_rmse_of_peak"])
    return listed(
        [
            f"{percent(part['linear_rmse_of_peak'].mean())} at ν = {poisson:g}{_known(part)}"
            for poisson, part in shown.groupby("poisson")
        ]
    )


def sections(report: Report) -> list[Section]:
    """Return the figure, what each change is worth in a table, and what it took."""
    table = report.tables["law"]
    shown = report.figure("law") + summary(table) + report.folded("law")
    return [("law_section", "What the law changes, and what the mesh does", shown)]


def summary(table: pd.DataFrame) -> str:
    """Tabulate each body and change: the deepest presses, from which depth on they matter, and what they took."""
    rows, depths = [], from_depths(table).set_index(VARIANT)
    for names, part in table.groupby(VARIANT, sort=False):
        deepest = _deepest(part)
        row = {"body": spaced(names[0]), "changed to": label(*names[1:]) + (" (as it is)" if names[1] == OWN else "")}
        row |= {"depth [% of size]": 100 * deepest["depth_of_size"].mean()}
        row |= {"change [% of peak]": 100 * deepest["change_rmse_of_peak"].mean()}
        row |= {"at the patch [% of peak]": 100 * deepest["change_patch_rms_of_peak"].mean()}
        own = depths.loc[[names]] if names in depths.index else depths.iloc[:0]
        for mesh, name in MESHES.items():
            row |= {f"error of {name} [% of peak]": 100 * deepest[f"{mesh}_rmse_of_peak"].mean()}
            row |= {f"more than that of {name}": _from(tables.where(own, mesh=mesh)) if len(own) else ""}
        row |= {
            "change of volume [%]": 100 * deepest["volume_change"].mean(),
            "least det F": deepest["least_det"].min(),
        }
        row |= {"iterations": part["iterations"].mean(), "cycles": part["cycles"].mean()}
        rows.append(row | {"presses without an answer": int(part["peak_of_size"].isna().sum())})
    return markup.table(pd.DataFrame(rows), "Each change at the deepest press of each contact, mean over the contacts")


def beside(table: pd.DataFrame) -> str:
    """Write in a line for each body what another description of it changes: it stands beside the errors of models."""
    lines = []
    for body in tables.bodies(table):
        deepest = _deepest(tables.where(table, body=body)).dropna(subset=["change_rmse_of_peak"])
        parts = deepest[deepest["changed"] != OWN].groupby(VARIANT[1:], sort=False)
        if len(parts):
            changes = listed(
                [
                    f"{percent(part['change_rmse_of_peak'].mean())} by {_by(*names)}{_known(part)}"
                    for names, part in parts
                ]
            )
            lines.append(f"{spaced(body)}, {percent(deepest['depth_of_size'].mean())} deep: {changes}")
    said = f"What another description of the body changes, beside these errors of models: {'; '.join(lines)}."
    return f"<p>{markup.escaped(said)}</p>" if lines else ""


def _by(changed: str, law: str, poisson: float) -> str:
    return "leaving out its regions" if changed == REGIONS else label(changed, law, poisson)


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the presses that have no answer under a law: what, where, how."""
    lost = report.tables["law"][report.tables["law"]["peak_of_size"].isna()]
    for row in lost.itertuples():
        what = label(row.changed, row.law, row.poisson)
        yield what, spaced(row.body), f"no answer at a depth of {percent(row.depth_of_size)}: {row.why}"
