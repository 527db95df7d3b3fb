"""Put advice for a kind of load into words, for the terminal and the report."""

import numpy as np

from palpate.evaluation.tradeoff.advice import NONE
from palpate.evaluation.tradeoff.advice_any_load import AnyLoadAdvice
from palpate.figures.model_looks import label
from palpate.figures.number_format import percent, seconds


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
        f"  time      {seconds(advice.online_p95_s)} at the 95th percentile",
        f"  before    {seconds(advice.offline_s)} of preparation"
        + (f", {seconds(advice.preparation_s)} for a new press" if advice.preparation_s > 0 else ""),
        f"  because   {advice.why}",
    ]
    return "\n".join(found).replace("\u00a0", " ")


def brief(advice: AnyLoadAdvice) -> str:
    """Return model, error and time for a cell of a table."""
    if advice.model == NONE:
        return "none"
    return f"{label(advice.model, advice.setting)}: {percent(advice.error_of_peak)} in {seconds(advice.online_p95_s)}"
