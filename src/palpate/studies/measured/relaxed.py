"""Relaxation of tissue while a press is held: branches with intervals, and how they predict presses left out."""

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import pearsonr

from palpate.errors import InputError
from palpate.identification import relaxation
from palpate.identification.hereditary import Branches, Kernel
from palpate.identification.presses import Press, PressRecords
from palpate.identification.relaxation import Draws, Hold, draw_branches, fit_branches, fit_fading
from palpate.studies.measured.settings import Presses
from palpate.table_declaration import Table

RELAXATION = Table(
    "relaxation",
    "Branches that presses relax by while their depth is held, fitted to all of an entry, with intervals of 90 %.",
    """
    entry branches branch: an entry, how many branches are fitted, and which of them, the fastest first
    chosen: whether the report takes that many
    share share_low share_high: part of the instantaneous modulus that relaxes, which the fastest branch extrapolates
    time_s time_low_s time_high_s: time constant [s]
    drawn: what was drawn anew for the intervals: specimens, presses, or errors with their correlation in time
    misfit: RMS error of the held forces over the largest force of each press; median over the presses
    """,
    always=False,
)
RELAXATION_CURVES = Table(
    "relaxation_curves",
    "Modulus over time of the chosen branches, and the force of each press while its depth is held.",
    """
    entry press specimen: a press; none for the modulus, over that half a second after a sudden strain
    time_s: since the depth is held, or since the sudden strain [s]
    measured predicted: force over the largest; predicted from the loading, by branches of the other specimens
    low high: interval of 90 % of the modulus
    """,
    always=False,
)
RELAXATION_ERRORS = Table(
    "relaxation_errors",
    "Error of the held force of each press, predicted from its loading, by what was left out of the fit.",
    """
    entry left_out group: an entry; what was left out (specimen, session, depth: the deeper half), and which
    press: its name
    model: n branches; power of time; no relaxation; mean curve of the presses that are fitted; siblings: mean curve of
        the others of the same specimen and session, the floor; own: n branches fitted to the press itself
    error: RMS over the time that depth is held, over the largest force
    end: error of the last force, over the largest force; positive where the prediction is too large
    """,
    always=False,
)
RELAXATION_PRESSES = Table(
    "relaxation_presses",
    "Each press that was held: what is left of its force, its own branches, and how many it needs.",
    """
    entry press specimen session: a press
    depth_m thickness_m loading_s held_s: depth that is held, thickness of the tissue [m], time to it and at it [s]
    left: force at the end over the largest
    late_over_early: modulus at the end of the hold over that half a second after a sudden strain, of its own branches
    branches: how many have the least information criterion of Bayes
    """,
    always=False,
)
RELAXATION_TRENDS = Table(
    "relaxation_trends",
    "Whether the shape of relaxation depends on how far and how fast one presses, which quasi-linear theory excludes.",
    """
    entry over presses: an entry, what late_over_early is a line of, and the number of presses
    slope slope_low slope_high: change of late_over_early from the 10th to the 90th percentile; 90 % by drawing presses
    correlation p_value: Pearson's, without a correction for several tests
    """,
    always=False,
)
TABLES = (RELAXATION, RELAXATION_CURVES, RELAXATION_ERRORS, RELAXATION_PRESSES, RELAXATION_TRENDS)

EARLY_S = 0.5
"""Time after a sudden strain [s] at which the modulus still follows from a loading that takes seconds."""
SPECIMEN, SESSION, DEPTH, NOTHING = "specimen", "session", "depth", "nothing"
HELD, POWER, MEAN, SIBLINGS, OWN = "no relaxation", "power of time", "mean curve", "siblings", "own"
DRAWN_TRENDS, TIMES, SHOWN = 1000, 60, 24
"""Number of resamples for slopes, of times of the modulus, and of times of each press in the tables."""


class Group(NamedTuple):
    """A part of the presses that is left out of a fit: its kind, its name, and the mask ``out`` of its presses."""

    kind: str
    name: str
    out: np.ndarray


def identify_relaxation(
    entry: str, records: PressRecords, settings: Presses, seed: int, progress: Callable = iter
) -> tuple[dict[str, pd.DataFrame], Branches]:
    """Fit branches of relaxation to the presses that were held; return TABLES by name, and the branches chosen.

    settings : ``branches``, the numbers that are tried, ``held_out`` and ``draws``
    progress : wraps the list of groups of presses that are left out in turn
    Raises InputError if no press was held, and warns of those that were not.
    """
    holds = _holds(records)
    counts, rng = settings.branches, np.random.default_rng(seed)
    whole = {count: fit_branches(holds, count) for count in counts}
    weights = {count: relaxation.weight_of(kernel, holds) for count, kernel in whole.items()}
    own = [{count: fit_branches([hold], count, weight=1.0) for count in counts} for hold in holds]
    apart = [(group, _without(holds, group, whole, weights)) for group in progress(_groups(holds, settings.held_out))]
    judged = pd.DataFrame(
        [row for group, kernels in apart for row in _left_out(holds, group, kernels, weights)]
        + [row for hold, fits in zip(holds, own, strict=True) for row in _own(hold, fits)],
        columns=RELAXATION_ERRORS.columns[1:],
    )
    best = [
        min(counts, key=lambda count: relaxation.information(hold, fits[count]))
        for hold, fits in zip(holds, own, strict=True)
    ]
    chosen = _choose(judged, counts) or int(np.median(best))
    draws = draw_branches(holds, whole[chosen], settings.draws, rng)
    span = float(np.median([hold.held_s[-1] for hold in holds]))
    presses = pd.DataFrame(
        {
            "press": [hold.press.name for hold in holds],
            "specimen": [hold.press.specimen for hold in holds],
            "session": [hold.press.session for hold in holds],
            "depth_m": [hold.press.depth_m[-1] for hold in holds],
            "thickness_m": [hold.press.thickness_m for hold in holds],
            "loading_s": [hold.loading_s for hold in holds],
            "held_s": [hold.held_s[-1] for hold in holds],
            "left": [hold.held_force[-1] for hold in holds],
            "late_over_early": [_late_over_early(fits[max(counts)], span) for fits in own],
            "branches": best,
        }
    )
    found = {
        RELAXATION.name: pd.DataFrame(
            [row for count in counts for row in _rows(whole[count], holds, count == chosen, draws)],
            columns=RELAXATION.columns[1:],
        ),
        RELAXATION_CURVES.name: pd.DataFrame(
            [*_modulus(whole[chosen], draws, span), *_curves(holds, chosen, whole[chosen], apart)],
            columns=RELAXATION_CURVES.columns[1:],
        ),
        RELAXATION_ERRORS.name: judged,
        RELAXATION_PRESSES.name: presses,
        RELAXATION_TRENDS.name: pd.DataFrame(list(_trends(presses, rng)), columns=RELAXATION_TRENDS.columns[1:]),
    }
    return {table.name: found[table.name].assign(entry=entry)[table.columns] for table in TABLES}, whole[chosen]


def _holds(records: PressRecords) -> list[Hold]:
    """Return the presses that were held; raises InputError if there is none, and warns of the others."""
    found, refused = relaxation.holds_of(records)
    if not found:
        raise InputError(f"{records.source} has no press that relaxation follows from: {refused[0]}")
    if refused:
        share = f"{len(refused)} of {len(records.presses)} presses"
        warnings.warn(f"{records.source}: {share} say nothing of relaxation; {refused[0]}", stacklevel=3)
    return found


def _groups(holds: Sequence[Hold], kinds: Sequence[str]) -> list[Group]:
    """Return the groups of presses that are left out in turn; a kind with one group only has none."""
    groups = []
    for kind in kinds:
        if kind == DEPTH:
            depths = np.array([_strain(hold.press) for hold in holds])
            deep = depths > np.median(depths)
            groups += [Group(kind, "deeper half", deep)] if 0 < deep.sum() < len(deep) else []
        elif kind in (SPECIMEN, SESSION):
            names = np.array([getattr(hold.press, kind) for hold in holds])
            each = list(dict.fromkeys(names.tolist()))
            groups += [Group(kind, name, names == name) for name in each] if len(each) > 1 else []
    return groups


def _strain(press: Press) -> float:
    """Return the held depth over the thickness, or the depth [m] if no thickness is known."""
    return float(press.depth_m[-1] / (press.thickness_m or 1.0))


def _without(
    holds: Sequence[Hold], group: Group, whole: Mapping[int, Branches], weights: Mapping[int, float]
) -> dict[int, Branches]:
    """Return the branches that are fitted without a group, by their number; whole : those fitted to all presses."""
    seen = [hold for hold, out in zip(holds, group.out, strict=True) if not out]
    return {count: fit_branches(seen, count, kernel.series, weights[count]) for count, kernel in whole.items()}


def _left_out(
    holds: Sequence[Hold], group: Group, fits: Mapping[int, Branches], weights: Mapping[int, float]
) -> Iterator[tuple]:
    """Yield a row of RELAXATION_ERRORS for each model and press of a group; fits : branches fitted ``_without`` it."""
    seen = [hold for hold, out in zip(holds, group.out, strict=True) if not out]
    unseen = [hold for hold, out in zip(holds, group.out, strict=True) if out]
    kernels: dict[str, Kernel] = {_words(count): kernel for count, kernel in fits.items()}
    kernels[POWER] = fit_fading(seen, weights[max(weights)])
    for name, kernel in kernels.items():
        for hold in unseen:
            yield _error(group, hold, name, hold.error(kernel))
    for hold in unseen:
        start = hold.force[hold.held]
        yield _error(group, hold, HELD, start - hold.held_force)
        siblings = [one for one in holds if one is not hold and _related(one.press, hold.press)]
        for name, others in ((MEAN, seen), (SIBLINGS, siblings)):
            if others:
                yield _error(group, hold, name, start * _mean_curve(others, hold.held_s) - hold.held_force)


def _related(one: Press, other: Press) -> bool:
    return (one.specimen, one.session) == (other.specimen, other.session)


def _mean_curve(holds: Sequence[Hold], time_s: np.ndarray) -> np.ndarray:
    """Return the mean over presses of the force at ``time_s`` (k,) [s] relative to that when the hold begins."""
    curves = []
    for hold in holds:
        times, forces = np.append(0.0, hold.held_s), hold.force[hold.held :]
        curves.append(np.interp(time_s, times, forces / forces[0]))
    return np.mean(curves, axis=0)


def _own(hold: Hold, fits: Mapping[int, Branches]) -> Iterator[tuple]:
    """Yield the rows of RELAXATION_ERRORS of branches that are fitted to the press itself."""
    group = Group(NOTHING, "", np.zeros(0))
    for count, kernel in fits.items():
        yield _error(group, hold, f"{OWN}: {_words(count)}", hold.residuals(kernel, 1.0)[hold.held + 1 :])


def _error(group: Group, hold: Hold, model: str, error: np.ndarray) -> tuple:
    return group.kind, group.name, hold.press.name, model, float(np.sqrt(np.mean(error**2))), float(error[-1])


def _words(count: int) -> str:
    return f"{count} branch" + ("es" if count > 1 else "")


def _choose(judged: pd.DataFrame, counts: Sequence[int]) -> int | None:
    """Return the fewest branches whose errors are within one standard error of the best's (Breiman et al. 1984).

    None where neither specimens nor sessions were left out.
    """
    for kind in (SPECIMEN, SESSION):
        rows = judged[judged["left_out"].eq(kind) & judged["model"].isin([_words(count) for count in counts])]
        if len(rows):
            errors_of = rows.pivot_table(index="press", columns="model", values="error")
            best = errors_of[errors_of.mean().idxmin()]
            for count in sorted(counts):
                more = errors_of[_words(count)] - best
                if more.mean() <= more.std() / np.sqrt(len(more)) or len(more) < 2:
                    return count
    return None


def _rows(kernel: Branches, holds: Sequence[Hold], chosen: bool, draws: Draws) -> Iterator[tuple]:
    """Yield a row of RELAXATION for each branch of ``kernel``, with intervals from ``draws`` if it is ``chosen``."""
    series = kernel.series
    misfit = float(np.median([np.sqrt(np.mean(hold.error(kernel) ** 2)) for hold in holds]))
    count = len(series.shares)
    empty = np.full((2, count), np.nan)
    shares = draws.interval(lambda one: np.array(one.series.shares)) if chosen else empty
    times = draws.interval(lambda one: np.array(one.series.times_s)) if chosen else empty
    for i in range(count):
        values = series.shares[i], *shares[:, i], series.times_s[i], *times[:, i]
        yield count, i + 1, chosen, *values, draws.drawn if chosen else "", misfit


def _late_over_early(kernel: Branches, span: float) -> float:
    """Return the modulus at ``span`` [s] after a sudden strain over that at EARLY_S."""
    early, late = kernel.modulus(np.array([EARLY_S, span]))
    return float(late / early)


def _modulus(kernel: Branches, draws: Draws, span: float) -> Iterator[tuple]:
    """Yield the rows of RELAXATION_CURVES of the modulus over time, relative to that at EARLY_S."""
    times = np.geomspace(0.05, 3.0 * span, TIMES)

    def relative(one: Branches) -> np.ndarray:
        return one.modulus(times) / one.modulus(np.array(EARLY_S))

    ends = draws.interval(relative)
    for time, value, low, high in zip(times, relative(kernel), *ends, strict=True):
        yield "", "", time, np.nan, value, low, high


def _curves(
    holds: Sequence[Hold], chosen: int, whole: Branches, apart: Sequence[tuple[Group, Mapping[int, Branches]]]
) -> Iterator[tuple]:
    """Yield the rows of RELAXATION_CURVES of each held press, predicted by branches of the other specimens."""
    kernels = [whole] * len(holds)
    for group, fits in apart:
        if group.kind == SPECIMEN:
            kernels = [fits[chosen] if out else old for old, out in zip(kernels, group.out, strict=True)]
    for hold, kernel in zip(holds, kernels, strict=True):
        predicted = hold.fit(kernel)[hold.held + 1 :]
        times = hold.held_s
        wanted = np.geomspace(times[0], times[-1], SHOWN)
        for k in np.unique(np.abs(times[:, None] - wanted).argmin(axis=0)):
            name, specimen = hold.press.name, hold.press.specimen
            yield name, specimen, times[k], hold.held_force[k], predicted[k], np.nan, np.nan


def _trends(presses: pd.DataFrame, rng: np.random.Generator) -> Iterator[tuple]:
    """Yield a row of RELAXATION_TRENDS for each quantity that late_over_early should not depend on."""
    known = presses.assign(strain=presses["depth_m"] / presses["thickness_m"].astype(float))
    for over in ("depth_m", "strain", "thickness_m", "loading_s"):
        rows = known[[over, "late_over_early"]].astype(float).dropna()
        x, y = rows.to_numpy().T
        if len(rows) < 8 or not np.ptp(x) > 0.0:
            continue
        span = float(np.subtract(*np.quantile(x, [0.9, 0.1])))
        picks = rng.integers(len(x), size=(DRAWN_TRENDS, len(x)))
        slopes = [span * np.polyfit(x[pick], y[pick], 1)[0] for pick in picks if np.ptp(x[pick]) > 0.0]
        correlation = pearsonr(x, y)
        ends = np.quantile(slopes, [0.05, 0.95])
        values = span * np.polyfit(x, y, 1)[0], *ends, correlation.statistic, correlation.pvalue
        yield over, len(x), *map(float, values)
