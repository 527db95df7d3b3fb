"""Carry out ``palpate score``: a table on the screen, score.csv and a picture."""

import io
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.benchmark.engine_scores import OWN, score_table
from palpate.benchmark.ranking import BOUNDS, lasting
from palpate.errors import InputError
from palpate.exchange.answers import read_answers
from palpate.exchange.folder import DAMAGE, Arrays, Questions, packed, read
from palpate.exchange.judging import KINDS, module_of, score_answers
from palpate.files import read_table, write_whole
from palpate.report.words import percent, seconds, two_digits
from palpate.run.job import steps


def score(answers: Path, folder: Path, results: Path | None, out: Path | None, own_law: bool) -> str:
    """Score a file of answers to the questions in ``folder``, write the scores, and return what is printed.

    results : folder that make has filled, whose models stand beside it, or None
    out : folder for score.csv and score.png; None is that of ``answers``
    own_law : whether the truth of another law than the body's is found, which takes minutes
    InputError for answers, questions or results that cannot be used.
    """
    questions = read(folder)
    if questions.truth is None:  # finding one takes minutes
        read_answers(answers, questions, module_of(questions).wanted(questions))
    beside = None if results is None else _beside(results, questions)

    truth_with = partial(truth_beside, questions, folder)
    truth = truth_with(questions.info["law"]) if questions.truth is None else questions.truth
    scored = score_answers(answers, questions, truth, truth_with if own_law else None)
    floor = floor_of(truth)
    table = score_table(scored.settings, floor, beside)
    place = (answers.parent if out is None else out).resolve()
    from palpate.exchange.picture import draw_score
    from palpate.report.style import save

    figure = draw_score(table, floor)
    with write_whole(place / "score.csv") as temporary:
        table.to_csv(temporary, index=False)
    save(figure, place / "score")
    title = f"{scored.answers.engine} {scored.answers.version} on {scored.answers.hardware}, {questions.info['scene']}"
    own_error = "is not known" if np.isnan(floor["rmse_of_peak"]) else f"{percent(floor['rmse_of_peak'])} of the peak"
    lines = [f"{title}, law {scored.answers.law}", f"the truth's own error: {own_error}", *_printed(table)]
    lines += [f"note: {warning}" for warning in scored.warnings]
    return "\n".join([*lines, f"written: {place / 'score.csv'}, score.png, score.svg"])


def _beside(results: Path, questions: Questions) -> pd.DataFrame:
    """Return the rows of palpate's own models for these questions; InputError for results of other questions."""
    module, scene = module_of(questions), questions.info["scene"]
    columns = ["scene", "model", "setting", "rmse_of_peak", *module.COLUMNS]
    table = read_table(results / f"tables/{module.TABLE}.csv", columns)
    rows = table[(table["scene"] == scene) & ~table["model"].isin(BOUNDS)]
    if not len(rows):
        raise InputError(f"{results} has no models of {scene}; leave --results out, or make that scene.")
    place, is_same = module.asked_in(results, questions)
    if not is_same:
        kind = KINDS[questions.kind]
        raise InputError(f"{place} has other {kind} than these questions; leave --results out, or ask anew.")
    return module.beside(rows, questions)


def truth_beside(questions: Questions, folder: Path, law: str) -> Arrays:
    """Read the truth of ``law`` beside the folder of questions; find and write it where it is missing or damaged."""
    path = folder.resolve().parent / f"{folder.resolve().name}.truth_{law}.npz"
    with suppress(*DAMAGE), np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
        if str(arrays.pop("digest", "")) == questions.digest:
            return arrays
    tell = partial(print, file=sys.stderr, flush=True)
    tell(f"finding the truth of {questions.counted} with the law {law}, kept as {path}")
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of questions without a truth, which the score notes
        arrays = dict(module_of(questions).find_truth(questions, law, steps(tell, "truth, solution")))
    with write_whole(path) as temporary:
        temporary.write_bytes(packed(arrays | {"digest": np.array(questions.digest)}))
    return arrays


def floor_of(truth: Arrays) -> dict[str, float]:
    """Return the mean own errors of a truth where it is believed, by name; NaN where it never is."""
    names = ("rmse_of_peak", "patch_rms_of_peak", "force_rms_of_peak")
    own = {name: truth[f"own_{name}"] for name in names if f"own_{name}" in truth}
    is_believed = np.isfinite([own[name] for name in names[:2]]).all(axis=0)
    return {name: float(values[is_believed].mean()) if is_believed.any() else np.nan for name, values in own.items()}


SHOWN = (
    *("setting", "error", "worst point", "in the dent", "median", "p95", "s per s", "failed"),
    *("through its mesh", "own law", "force"),
)


def _printed(table: pd.DataFrame) -> list[str]:
    """Return the table as lines of text: the engine's settings, and palpate's of which no faster one is better."""
    engine_rows, own_rows = table[table["engine"] != OWN], table[table["engine"] == OWN]
    if len(own_rows):
        sound = own_rows[own_rows["failures"] == 0]
        own_rows = sound[lasting(sound["online_median_s"].to_numpy(), sound["rmse_of_peak"].to_numpy())]
    rows = [SHOWN]
    for _, row in pd.concat([engine_rows, own_rows.sort_values("online_median_s")]).iterrows():
        name = row["setting"] if row["engine"] != OWN else f"palpate's {row['model']}, {row['setting']}"
        is_motion = np.isfinite(row["real_time_factor"])  # of motions, seconds for a second say more
        force = np.fmax(row["force_error_median"], row["force_rms_of_peak"])
        rows.append((
            name + (" (converged)" if row["engine"] != OWN and row["converged"] is True else ""),
            _cell(row["rmse_of_peak"]), _cell(row["max_of_peak"]), _cell(row["patch_rms_of_peak"]),
            *(("", "") if is_motion else (_cell(row[f"online_{each}_s"], seconds) for each in ("median", "p95"))),
            _cell(row["real_time_factor"], two_digits), f"{row['failures']:.0f}/{row['samples']:.0f}",
            _cell(row["mesh_rmse_of_peak"]), _cell(row["own_law_rmse_of_peak"]), _cell(force),
        ))  # fmt: skip
    filled = [c for c in range(len(SHOWN)) if c < 2 or any(row[c] for row in rows[1:])]
    widths = [max(len(row[c]) for row in rows) for c in filled]
    return ["  ".join(row[c].ljust(w) for c, w in zip(filled, widths, strict=True)).rstrip() for row in rows]


def _cell(value: float, write: Callable[[float], str] = percent) -> str:
    return write(float(value)) if np.isfinite(float(value)) else ""
