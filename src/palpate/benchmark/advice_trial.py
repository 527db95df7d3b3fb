"""Try advice: on the same machine another day, and at contacts that had no part in it."""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.advice import ADVICE, NONE, Question, advise
from palpate.benchmark.held_out import SETTING
from palpate.benchmark.ranking import EQUAL, KINDS
from palpate.benchmark.split import deal

NOISE = (0.7, 1.4)
"""Factors between which the times of a setting change from run to run."""
RUNS = 10
SEED = 2
"""Of the noise and of the folds, which are others than those of a run."""
TIMES = ["online_median_s", "online_p95_s", "online_max_s"]


class Again(NamedTuple):
    """How many rows of advice were asked for again, named the same model, or that or one whose bound is as good."""

    rows: int
    same: int
    as_good: int


def advised_again(settings: pd.DataFrame, errors: pd.DataFrame, limits: dict[str, Any]) -> Again:
    """Advise RUNS times for one scene with all times of each setting multiplied by a factor of NOISE.

    settings, errors, limits : as ``advise`` takes them
    """
    random, first = np.random.default_rng(SEED), advise(settings, errors, **limits)
    rows = same = as_good = 0
    for _ in range(RUNS):
        noisy, factor = settings.copy(), random.uniform(*NOISE, len(settings))
        noisy[TIMES] = settings[TIMES].mul(factor, axis=0)
        for before, now in zip(first.itertuples(), advise(noisy, errors, **limits).itertuples(), strict=True):
            alike = before.model == now.model
            rows, same = rows + 1, same + alike
            as_good += alike or now.bound_of_peak <= EQUAL * before.bound_of_peak
    return Again(rows, same, as_good)


class Broken(NamedTuple):
    """What advised limits of error came to at contacts held out.

    rows, broken : how many limits had an advised model, and how many of these its mean error passed
    answers, above : how many single answers they gave, and how many of these passed it
    over : how many rows have a bound above their limit
    """

    rows: int
    broken: int
    answers: int
    above: int
    over: int


def tried_elsewhere(settings: pd.DataFrame, errors: pd.DataFrame, max_errors: list[float]) -> Broken:
    """Advise for one scene without a fold of the contacts, and try that on the fold; over all folds.

    Errors include the truth's own; presses that a model refuses to answer are none.
    settings, errors, max_errors : as ``advise`` takes them
    """
    contacts = np.unique(errors["contact"])
    fold = pd.Series(deal(contacts, SEED), index=contacts)
    counts = np.zeros(5, dtype=int)
    for kind in KINDS:
        held = Question(settings, errors, kind).held
        own = pd.Series(held.own, index=held.sample)
        for number in fold.unique():
            hidden = fold[fold == number].index
            question = Question(settings, errors[~errors["contact"].isin(hidden)], kind)
            there = errors[errors["contact"].isin(hidden)].drop_duplicates([*SETTING, "sample"]).set_index(SETTING)
            for row in ADVICE.frame([question.under(limit) for limit in max_errors]).itertuples():
                if row.model == NONE or (row.model, row.setting) not in there.index:
                    continue
                presses = there.loc[[(row.model, row.setting)]].dropna(subset=KINDS[kind])
                answers = presses[KINDS[kind]].to_numpy() + own.reindex(presses["sample"]).to_numpy()
                if len(answers):
                    above = answers > row.max_error
                    over = row.bound_of_peak > row.max_error
                    counts += [1, answers.mean() > row.max_error, len(answers), above.sum(), over]
    return Broken(*counts.tolist())
