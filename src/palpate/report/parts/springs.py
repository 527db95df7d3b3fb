"""Paper 2 in the report: how well each way fits springs, how errors grow, and what springs can do at all."""

from palpate.figures.number_format import percent, seconds
from palpate.figures.springs.spring_looks import FORCES, look
from palpate.report import markup
from palpate.report.material import Report

TITLE = "Spring parameters"


def sections(report: Report) -> list[tuple[str, str, str]]:
    """A figure each, and the tables that belong to it."""
    fits = report.figure("spring_fit") + _medians(report.tables["spring_fit"])
    return [
        ("spring_search", "Finding spring parameters", fits + report.folded("spring_fit", "spring_history")),
        ("spring_presses", "Errors over time", report.figure("spring_errors")),
        (
            "spring_trust",
            "How far springs can be trusted",
            report.figure("spring_floor") + report.folded("spring_floor"),
        ),
    ]


def _medians(fits) -> str:
    """Median of the seeds and, where there are several, their range: a row a way, a column a press."""
    rows = []
    for (force, method), runs in fits.groupby(["volume_force", "method"], sort=False):
        row = {"forces": FORCES[force], "way": look(method).label, "seeds": runs["seed"].nunique()}
        fitted = runs[runs["used_in_fit"]].groupby("seed")
        row |= {"generations": int(fitted["generations"].first().max())}
        row |= {"time": seconds(fitted["seconds"].first().median())}
        row |= {"fitness_m": spread(runs[runs["press"] == fits["press"].iloc[0]]["fitness"], "{:.3g}".format)}
        for press, found in runs.groupby("press", sort=False):
            used = " (fitted)" if found["used_in_fit"].all() else ""
            row[f"{press}_press"] = spread(found["rmse_of_peak"], percent) + used
        rows.append(row)
    caption = "Fitness of the top press and RMSE of the peak displacement: median [least, largest] of the seeds"
    return markup.table(type(fits)(rows), caption)


def spread(values, words) -> str:
    """The median, and the range if there are several."""
    median, least, largest = (words(value) for value in (values.median(), values.min(), values.max()))
    return median if len(values) == 1 else f"{median} [{least}, {largest}]"
