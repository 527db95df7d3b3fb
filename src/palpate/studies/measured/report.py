"""Report on models beside measured bodies: what each predicts, and what it cannot."""

from collections.abc import Iterator

import pandas as pd

from palpate.report import markup, tables
from palpate.report.material import Report, Section
from palpate.report.model_looks import look
from palpate.report.number_format import percent
from palpate.report.words import capital, spaced
from palpate.studies.measured.figures import GIVEN, named
from palpate.studies.measured.tables import TABLES

__all__ = ["TABLES", "TITLE", "failures", "numbers", "sections"]

TITLE = "Models beside a measured body"
WORDS = {"sink_m": "the place", "frequency_hz": "the frequency"}
"""The quantities that a headline names."""


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text."""
    table = report.tables["measured"]
    names = list(dict.fromkeys(table["experiment"]))
    return {"headline": " ".join(_headline(name, tables.where(table, experiment=name)) for name in names)}


def _headline(name: str, rows: pd.DataFrame) -> str:
    """Describe how well the finest quadratic elements predict the cases that they were not fitted to."""
    model = rows[
        rows["model"].eq("fem_p2") & rows["setting"].str.fullmatch(r"level=\d+") & rows["calibrated"].ne(GIVEN)
    ]
    coarser = model[model["nodes"].lt(model["nodes"].max())]
    model = model[model["nodes"].eq(model["nodes"].max())]
    fitted = model["calibrated"].iloc[0] if len(model) else ""
    found = []
    for case in dict.fromkeys(model.loc[model["case"].ne(fitted), "case"]):
        parts = [
            f"{words} of {spaced(case)} within {percent(abs(row.error))}{_also(coarser, case, quantity)}"
            for quantity, words in WORDS.items()
            for row in tables.where(model, case=case, quantity=quantity, marker="all")
            .dropna(subset=["error"])
            .itertuples()
        ]
        found += [" and ".join(parts)] if parts else []
    if not found:
        return f"{capital(spaced(name))}: nothing was measured that a fitted model could be tested on."
    others = rows[rows["case"].ne(fitted) & rows["marker"].eq("all") & rows["error"].notna()]
    crept = _ending(others, "creep", "frequency_hz")
    within = f"within {percent(crept['error'].abs().max())}" if len(crept) else ""
    more = f"; with the modulus before the creep, frequencies {within}" if within else ""
    told = "; ".join(found) + more
    return f"{capital(spaced(name))}: fitted to {spaced(fitted)} alone, quadratic elements predict {told}."


def _also(rows: pd.DataFrame, case: str, quantity: str) -> str:
    """Describe the same error on the next coarser mesh, if there is one."""
    rows = tables.where(rows, case=case, quantity=quantity, marker="all").dropna(subset=["error"])
    if rows.empty:
        return ""
    row = rows.loc[rows["nodes"].idxmax()]
    return f" ({percent(abs(row['error']))} on {row['nodes']} nodes)"


def sections(report: Report) -> list[Section]:
    """Return a section for each experiment: the figure, the answer in words, and predictions that were not tested."""
    table, found = report.tables["measured"], []
    for name in dict.fromkeys(table["experiment"]):
        rows = tables.where(table, experiment=name)
        shown = report.figure(f"measured_{name}", "measured", **answer(rows)) + _untested(rows)
        found.append((f"measured_{name}_section", capital(spaced(name)), shown))
    last = found[-1]
    return [*found[:-1], (last[0], last[1], last[2] + report.folded("measured"))]


def answer(rows: pd.DataFrame) -> dict[str, str]:
    """Return the answer of one experiment in words: locking, creep, and damping by an integrator and by Rayleigh."""
    every = rows[rows["marker"].eq("all") & rows["error"].notna()]
    free = tables.where(every, calibrated=GIVEN, quantity="sink_m")
    plain = free[free["setting"].str.fullmatch(r"level=\d+")]
    first = plain[plain["case"].eq(plain["case"].iloc[0])] if len(plain) else plain
    apart = every.drop_duplicates(["case", "quantity"]).dropna(subset=["repeat"])
    return {
        "given": _list(first, lambda row: f"{_signed(row.error)} ({named(row)})"),
        "predicted": _list(
            _tested(every), lambda row: f"{_signed(row.error)} in {spaced(row.case)} ({look(row.model).label})"
        ),
        "alike": _alike(every),
        "crept": _list(
            _ending(every, "creep", "frequency_hz"), lambda row: f"{_signed(row.error)} in {spaced(row.case)}"
        ),
        "branched": _list(
            every[every["setting"].str.contains(" prony ") & every["quantity"].eq("creep_m")],
            lambda row: f"{_signed(row.error)} in {spaced(row.case)}",
        ),
        "stepped": _list(_with(every, "step_s="), _ratio),
        "damped": _list(_with(every, "damping=", fitted=False), _ratio),
        "repeats": _list(
            apart[apart["quantity"].isin(["sink_m", "frequency_hz", "damping_ratio"])],
            lambda row: (
                f"{percent(row.repeat / abs(row.measured))} in the {_quantity(row.quantity)} of {spaced(row.case)}"
            ),
        ),
    }


def _tested(rows: pd.DataFrame) -> pd.DataFrame:
    """Select where markers come to rest in cases that the modulus was not fitted to, a row a model: its finest."""
    rows = rows[rows["quantity"].eq("sink_m") & rows["calibrated"].ne(GIVEN) & rows["case"].ne(rows["calibrated"])]
    rows = rows[rows["setting"].str.fullmatch(r"level=\d+")]
    return rows.sort_values("nodes", kind="stable").drop_duplicates(["case", "model"], keep="last")


def _alike(rows: pd.DataFrame) -> str:
    """Describe how far quadratic elements of one mesh with other laws and Poisson's ratios are wrong in such cases."""
    rows = rows[rows["quantity"].eq("sink_m") & rows["calibrated"].ne(GIVEN) & rows["case"].ne(rows["calibrated"])]
    rows = rows[rows["model"].eq("fem_p2") & rows["setting"].str.fullmatch(r"level=0( (law|poisson)=\S+)?")]
    found = [
        f"from {_signed(part['error'].min())} to {_signed(part['error'].max())} in {spaced(case)}"
        for case, part in rows.groupby("case", sort=False)
        if len(part) > 1
    ]
    laws, ratios = rows["law"].nunique(), rows["poisson"].nunique()
    told = f"quadratic elements of one mesh under {laws} laws and {ratios} Poisson's ratios {'; '.join(found)}"
    return told if found else "other laws were not tried"


def _ending(rows: pd.DataFrame, word: str, quantity: str) -> pd.DataFrame:
    return rows[rows["setting"].str.endswith(f" {word}") & rows["quantity"].eq(quantity)]


def _with(rows: pd.DataFrame, word: str, fitted: bool | None = None) -> pd.DataFrame:
    rows = rows[rows["setting"].str.contains(word, regex=False) & rows["quantity"].eq("damping_ratio")]
    return rows if fitted is None else rows[rows["fitted"].eq(fitted)]


def _ratio(row) -> str:
    return f"{row.predicted:.3f} for {row.measured:.3f} ({spaced(row.case)}, {named(row).rpartition(', ')[2]})"


def _list(rows: pd.DataFrame, phrase) -> str:
    return "; ".join(phrase(row) for row in rows.itertuples()) or "not computed"


def _signed(error: float) -> str:
    return f"{percent(abs(error))} {'more' if error > 0 else 'less'}"


def _quantity(name: str) -> str:
    return {"sink_m": "place", "frequency_hz": "frequency", "damping_ratio": "damping ratio"}[name]


def _untested(rows: pd.DataFrame) -> str:
    """Show the predictions of cases that nobody measured."""
    free = rows[rows["measured"].isna() & rows["predicted"].notna() & rows["marker"].eq("all")]
    if free.empty:
        return ""
    shown = free.assign(model=[named(row) for row in free.itertuples()])
    shown = shown[["case", "model", "calibrated", "quantity", "predicted"]]
    return markup.fold("Predictions of cases without files", markup.table(shown, "What nobody measured"), opened=True)


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the models that gave no answer: what, where, how."""
    table = report.tables["measured"]
    silent = table[table["message"].notna() & table["message"].ne("")].drop_duplicates(
        ["experiment", "case", "model", "setting"]
    )
    for row in silent.itertuples():
        yield named(row), f"{spaced(row.experiment)}, {spaced(row.case)}", row.message
