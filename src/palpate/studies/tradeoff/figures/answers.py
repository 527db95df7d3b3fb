"""Draw answers of engines that ran elsewhere beside palpate's models, hollow, as their times are another machine's."""

from matplotlib.figure import Figure

from palpate.benchmark.engine_scores import score_table
from palpate.exchange.picture import draw_score
from palpate.report import style
from palpate.studies.tradeoff.figures.scene_rows import answers as answering


@style.figure("answers", tables=("accuracy_vs_time", "answers"))
def draw_answers(accuracy_vs_time, answers, *, scene) -> Figure:
    rows = accuracy_vs_time[accuracy_vs_time["scene"] == scene]
    own = answering(rows[rows["split"] == rows["split"].min()])
    engines = answers[answers["scene"] == scene]
    floor = {name: float(engines[f"truth_{name}"].iloc[0]) for name in ("rmse_of_peak", "patch_rms_of_peak")}
    known = engines.drop(columns=[f"truth_{name}" for name in floor])
    return draw_score(score_table(known, floor, own), floor)
