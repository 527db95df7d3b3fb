"""Carry out ``palpate score``: a table on the screen, score.csv and a picture."""

import sys
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.engine_scores import OWN, score_table
from palpate.benchmark.motion_truth import MotionTruth
from palpate.benchmark.ranking import BOUNDS, lasting
from palpate.errors import InputError
from palpate.exchange import motions, presses, touches
from palpate.exchange.answers import Wanted, read_answers
from palpate.exchange.folder import Arrays, Questions, read
from palpate.exchange.score import Scored, floor_of, kept_truth, truth_beside
from palpate.exchange.score_motions import score_motions
from palpate.exchange.score_presses import score_presses
from palpate.exchange.score_touches import score_touches
from palpate.files import read_table, write_whole
from palpate.report.words import percent, seconds, two_digits
from palpate.run.job import steps
from palpate.stores import stored

KINDS: dict[str, tuple[Any, Callable[..., Scored], Callable[[Questions], Mapping[str, Wanted]]]] = {
    presses.KIND: (presses, score_presses, lambda _: {}),
    touches.KIND: (touches, score_touches, lambda _: touches.NUMBERS),
    motions.KIND: (motions, score_motions, motions.wanted),
}
"""What finds the truth of each kind of questions, what scores answers to them, and which numbers these have."""


def score(answers: Path, folder: Path, results: Path | None, out: Path | None, own_law: bool) -> str:
    """Score a file of answers to the questions in ``folder``, and return what is printed.

    results : folder that make has filled, whose models stand beside it, or None
    out : folder for score.csv and score.png; None is that of ``answers``
    own_law : whether the truth of another law than the body's is found, which takes minutes
    InputError for answers, questions or results that cannot be used.
    """
    questions = read(folder)
    if questions.kind not in KINDS:
        raise InputError(
            f"{folder} has questions of kind {questions.kind}, which this palpate does not know; ask anew."
        )

    # before a truth is found, which takes minutes
    read_answers(answers, questions, KINDS[questions.kind][2](questions))
    beside = None if results is None else _beside(results, questions)

    def kept(law: str) -> Arrays:
        return truth_beside(questions, folder, law, lambda name: _find(questions, folder, name))

    truth = kept(questions.info["law"]) if questions.truth is None else questions.truth
    scored = KINDS[questions.kind][1](answers, questions, truth, kept if own_law else None)
    floor = floor_of(truth)
    table = score_table(scored.settings, floor, beside)
    place = (answers.parent if out is None else out).resolve()
    from palpate.exchange.picture import draw_score
    from palpate.report.style import save

    figure = draw_score(table, floor)
    with write_whole(place / "score.csv") as part:
        table.to_csv(part, index=False)
    save(figure, place / "score")
    head = f"{scored.answers.engine} {scored.answers.version} on {scored.answers.hardware}, {questions.info['scene']}"
    own = "is not known" if np.isnan(floor["rmse_of_peak"]) else f"{percent(floor['rmse_of_peak'])} of the peak"
    lines = [f"{head}, law {scored.answers.law}", f"the truth's own error: {own}", *_printed(table)]
    lines += [f"note: {warning}" for warning in scored.warnings]
    return "\n".join([*lines, f"written: {place / 'score.csv'}, score.png, score.svg"])


def _find(questions: Questions, folder: Path, law: str) -> Arrays:
    """Find the truth of ``law``, and say where it is kept and how far it is."""
    place = kept_truth(folder, law)
    print(f"finding the truth of {questions.counted} with the law {law}, kept as {place}", file=sys.stderr, flush=True)
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of questions without a truth, which the score notes
        tell = partial(print, file=sys.stderr, flush=True)
        return KINDS[questions.kind][0].find_truth(questions, law, steps(tell, "truth, solution"))


def _beside(results: Path, questions: Questions) -> pd.DataFrame:
    """Return the rows of palpate's own models on the very same questions; InputError where results are of others."""
    return BESIDE[questions.kind](results, questions)


def _beside_presses(results: Path, questions: Questions) -> pd.DataFrame:
    info, loads = questions.info, questions.arrays["loads"]
    columns = ["scene", "model", "setting", "split", "rmse_of_peak", "online_median_s", "commit"]
    table = read_table(results / "tables/accuracy_vs_time.csv", columns)
    rows = table[table["scene"] == info["scene"]]
    if not len(rows):
        raise InputError(f"{results} has no models of {info['scene']}; leave --results out, or make that scene.")
    place = results / "data" / info["body"] / info["regime"] / "loads.csv"
    forces = ["force_x_n", "force_y_n", "force_z_n"]
    known = read_table(place, ["sample", "contact", *forces]).set_index("sample").reindex(loads["sample"])
    same = np.array_equal(known["contact"], loads["node"]) and np.allclose(known[forces], loads["force_n"], rtol=1e-6)
    if not same:
        raise InputError(f"{place} has other presses than these questions; leave --results out, or ask anew.")
    rows = rows[(rows["split"] == rows["split"].min()) & ~rows["model"].isin(BOUNDS)]
    return rows[rows["engine"].isna()] if "engine" in rows else rows


def _beside_touches(results: Path, questions: Questions) -> pd.DataFrame:
    info, loads = questions.info, questions.arrays["loads"]
    columns = ["scene", "model", "setting", "rmse_of_peak", "force_error", "online_median_s"]
    table = read_table(results / "tables/touch.csv", columns)
    rows = table[(table["scene"] == info["scene"]) & ~table["model"].isin(BOUNDS)]
    if not len(rows):
        raise InputError(f"{results} has no models of {info['scene']}; leave --results out, or make that scene.")
    tool = info["scene"].removeprefix(f"{info['body']}_")
    place = results / "data" / info["body"] / "touch" / tool / "touches.csv"
    known = read_table(place, ["sample", "node", "depth_m"]).set_index("sample").reindex(loads["sample"])
    if not (np.array_equal(known["node"], loads["node"]) and np.allclose(known["depth_m"], loads["depth_m"])):
        raise InputError(f"{place} has other touches than these questions; leave --results out, or ask anew.")
    return rows.assign(commit="")


def _beside_motions(results: Path, questions: Questions) -> pd.DataFrame:
    scene, columns = questions.info["scene"], ["scene", "model", "setting", "failures", "rmse_of_peak"]
    table = read_table(results / "tables/dynamic_accuracy.csv", [*columns, "force_rms_of_peak", "real_time_factor"])
    rows = table[table["scene"] == scene]
    if not len(rows):
        raise InputError(f"{results} has no models of {scene}; leave --results out, or make that scene.")
    place = results / "data/dynamic" / scene / "truth.h5"
    known = stored(MotionTruth, place).displacement if place.is_file() else np.empty(0)
    asked = None if questions.truth is None else questions.truth["displacement_m"][0]
    if asked is None or known.shape != asked.shape or not np.allclose(known, asked, rtol=1e-6, atol=0.0):
        raise InputError(f"{place} is of another motion than these questions; leave --results out, or ask anew.")
    seconds = rows["real_time_factor"] * questions.info["duration_s"]
    return rows.assign(online_median_s=seconds, samples=1, commit="")


BESIDE = {presses.KIND: _beside_presses, touches.KIND: _beside_touches, motions.KIND: _beside_motions}
"""What finds models beside answers to each kind of questions."""
SHOWN = (
    "setting",
    "error",
    "worst point",
    "in the dent",
    "median",
    "p95",
    "s per s",
    "failed",
    "through its mesh",
    "own law",
    "force",
)


def _printed(table: pd.DataFrame) -> list[str]:
    """Return the lines of a table for reading: the engine's settings, and those of palpate that are worth taking."""
    own, others = table[table["engine"] != OWN], table[table["engine"] == OWN]
    if len(others):
        sound = others[others["failures"] == 0]
        others = sound[lasting(sound["online_median_s"].to_numpy(), sound["rmse_of_peak"].to_numpy())]
    rows = [SHOWN]
    for _, row in pd.concat([own, others.sort_values("online_median_s")]).iterrows():
        name = row["setting"] if row["engine"] != OWN else f"palpate's {row['model']}, {row['setting']}"
        rows.append((
            name + (" (converged)" if row["engine"] != OWN and row["converged"] is True else ""),
            _percent(row["rmse_of_peak"]), _percent(row["max_of_peak"]), _percent(row["patch_rms_of_peak"]),
            *_times(row), f"{row['failures']:.0f}/{row['samples']:.0f}",
            _percent(row["mesh_rmse_of_peak"]), _percent(row["own_law_rmse_of_peak"]),
            _percent(np.fmax(row["force_error_median"], row["force_rms_of_peak"])),
        ))  # fmt: skip
    used = [c for c in range(len(SHOWN)) if c < 2 or any(row[c] for row in rows[1:])]
    wide = [max(len(row[c]) for row in rows) for c in used]
    return ["  ".join(row[c].ljust(w) for c, w in zip(used, wide, strict=True)).rstrip() for row in rows]


def _percent(value: float) -> str:
    return percent(float(value)) if np.isfinite(float(value)) else ""


def _times(row: pd.Series) -> tuple[str, str, str]:
    """Return the median and the 95th percentile, or, of motions, seconds for a second."""
    if np.isfinite(row["real_time_factor"]):
        return "", "", two_digits(row["real_time_factor"])
    return _time(row["online_median_s"]), _time(row["online_p95_s"]), ""


def _time(value: float) -> str:
    return seconds(float(value)) if np.isfinite(float(value)) else ""
