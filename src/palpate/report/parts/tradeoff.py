"""What accuracy costs in the report: a diagram and advice a scene, then all scenes together, then what pays."""

from html import escape

import pandas as pd

from palpate.figures import tables
from palpate.figures.model_looks import label, look
from palpate.figures.tradeoff.work_precision import front_rows
from palpate.report import markup
from palpate.report.advice_words import limit, sentence
from palpate.report.material import Report

TITLE = "What accuracy costs in time"


def sections(report: Report) -> list[tuple[str, str, str]]:
    """A section a scene, then the advice for all of them, then preparation and the whole tables."""
    settings, advice = report.tables["accuracy_vs_time"], report.tables["advice"]
    pressed = advice[advice["scene"].isin(settings["scene"])]
    found = [(f"tradeoff_{scene}", scene.replace("_", " "), _scene(report, scene)) for scene in tables.scenes(settings)]
    both = report.figure("advice") + _overview(pressed) + report.folded("advice")
    paid = report.figure("break_even") + report.folded("accuracy_vs_time")
    return [*found, ("advice_section", "Advice", both), ("break_even_section", "When preparing pays", paid)]


def _scene(report: Report, scene: str) -> str:
    """The diagram, the advice in sentences, and what is on the front."""
    settings = tables.where(report.tables["accuracy_vs_time"], scene=scene)
    advice = tables.where(report.tables["advice"], scene=scene)
    front = front_rows(settings)
    rows = pd.DataFrame(
        {
            "model": [look(model).label for model in front["model"]],
            "setting": front["knob"],
            "RMSE [% of peak]": 100 * front["rmse_of_peak"],
            "p95 of the nodes [% of peak]": 100 * front["p95_of_peak"],
            "online, median [ms]": 1e3 * front["online_median_s"],
            "online, p95 [ms]": 1e3 * front["online_p95_s"],
            "prepared in [s]": front["offline_s"],
            "memory [MB]": front["memory_mb"],
            "paid back after answers": front["break_even_queries"],
        }
    )
    text = markup.table(rows, "The front that lasts from run to run, fastest first")
    return (
        report.figure(f"work_precision_{scene}", "work_precision", scene=scene.replace("_", " ")) + items(advice) + text
    )


def items(advice: pd.DataFrame) -> str:
    """The advice in sentences."""
    return f"<ul>{''.join(f'<li>{escape(sentence(row))}</li>' for _, row in advice.iterrows())}</ul>"


def _overview(advice) -> str:
    """A row a scene, a column a limit: what is advised."""
    advice = advice.assign(
        asked=[limit(row) for _, row in advice.iterrows()],
        taken=[row.model if row.model == "none" else label(row.model, row.knob) for row in advice.itertuples()],
    )
    wide = advice.pivot(index="scene", columns="asked", values="taken")
    wide = wide.reindex(index=tables.scenes(advice), columns=advice["asked"].unique()).reset_index()
    return markup.table(wide, "What to take for each limit")
