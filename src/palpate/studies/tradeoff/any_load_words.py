"""Put advice for a kind of load into words, for the terminal and the report."""

import numpy as np

from palpate.report.model_looks import label
from palpate.report.number_format import percent, seconds
from palpate.studies.tradeoff.advice import NONE
from palpate.studies.tradeoff.advice_any_load import AnyLoadAdvice, doubts


def lines(advice: AnyLoadAdvice) -> str:
    """Return lines for the terminal."""
    head = f"{advice.scene}, {advice.kind}"
    if advice.model == NONE:
        return f"{head}: none\n  because   {advice.why}".replace("\u00a0", " ")
    who = advice.model if advice.setting == "default" else f"{advice.model} {advice.setting}"
    force = f"; of the force {percent(advice.force_error)}" if np.isfinite(advice.force_error) else ""
    found = [
        f"{head}: {who}",
        f"  error     {percent(advice.error_of_peak)} of the peak displacement, {percent(advice.most)} at most{force}; "
        "against the fine operator, whose own error comes on top",
        f"  bound     {_bounded(advice)}",
        *([f"  doubts    {_unanswered(advice)}"] if advice.doubted else []),
        f"  time      {seconds(advice.online_p95_s)} at the 95th percentile",
        f"  before    {seconds(advice.offline_s)} of preparation"
        + (f", {seconds(advice.preparation_s)} for a new press" if advice.preparation_s > 0 else ""),
        f"  because   {advice.why}",
    ]
    return "\n".join(found).replace("\u00a0", " ")


def _bounded(advice: AnyLoadAdvice) -> str:
    """Return below what a single answer's error stays, and how surely."""
    where = "of those that it answers, " if advice.doubted else ""
    return (
        f"{where}{percent(advice.sure)} of such loads at another place are answered with an error of less than "
        f"{percent(advice.most)}, the largest that was found"
    )


def _unanswered(advice: AnyLoadAdvice) -> str:
    share = percent(advice.doubted / advice.samples)
    return f"{advice.doubted} of {advice.samples} loads ({share}): it says that it does not know, and gives no answer"


def brief(advice: AnyLoadAdvice) -> str:
    """Return model, mean and largest error, and time for a cell of a table."""
    if advice.model == NONE:
        return "none"
    error = f"{percent(advice.error_of_peak)}, at most {percent(advice.most)}"
    said = f"{label(advice.model, advice.setting)}: {error}, in {seconds(advice.online_p95_s)}"
    return f"{said}, {doubts(advice)}" if advice.doubted else said
