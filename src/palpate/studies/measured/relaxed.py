"""Relaxation of tissue while a press is held: branches with intervals, and how they predict presses left out."""

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import pearsonr

from palpate.errors import InputError
from palpate.identification import relaxation
from palpate.identification.hereditary import Branches, Kernel
from palpate.identification.presses import PressRecords
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
    """A part of the presses that is left out of a fit, ``unseen``: its kind and its name."""

    kind: str
    name: str
    seen: list[Hold]
    unseen: list[Hold]


def identify_relaxation(
    entry: str, records: PressRecords, settings: Presses, seed: int, progress: Callable = iter
) -> tuple[dict[str, pd.DataFrame], Branches]:
    """Fit branches of relaxation to the presses that were held; return TABLES by name, and the branches chosen.

    settings : ``branches``, the numbers that are tried, ``held_out`` and ``draws``
    progress : wraps the list of groups of presses that are left out in turn
    Raises InputError if no press was held, and warns of those that were not.
    """
    holds, refused = relaxation.holds_of(records)
    if not holds:
        raise InputError(f"{records.source} has no press that relaxation follows from: {refused[0]}")
    if refused:
        share = f"{len(refused)} of {len(records.presses)} presses"
        warnings.warn(f"{records.source}: {share} say nothing of relaxation; {refused[0]}", stacklevel=2)
    counts, rng = settings.branches, np.random.default_rng(seed)
    fits_of_all = {count: fit_branches(holds, count) for count in counts}
    weights = {count: relaxation.weight_of(kernel, holds) for count, kernel in fits_of_all.items()}
    own_fits = [{count: fit_branches([hold], count, weight=1.0) for count in counts} for hold in holds]
    left_out = [
        (group, {count: fit_branches(group.seen, count, fits_of_all[count].series, weights[count]) for count in counts})
        for group in progress(_groups(holds, settings.held_out))
    ]
    errors = [row for group, fits in left_out for row in _left_out(holds, group, fits, weights[max(counts)])]
    for hold, fits in zip(holds, own_fits, strict=True):
        for count, kernel in fits.items():
            error = hold.residuals(kernel, 1.0)[hold.held + 1 :]
            errors.append(_error(NOTHING, "", hold, f"{OWN}: {_words(count)}", error))
    error_table = pd.DataFrame(errors, columns=RELAXATION_ERRORS.columns[1:])
    best_counts = [
        min(counts, key=lambda count: relaxation.information(hold, fits[count]))
        for hold, fits in zip(holds, own_fits, strict=True)
    ]
    chosen = _choose(error_table, counts) or int(np.median(best_counts))
    draws = draw_branches(holds, fits_of_all[chosen], settings.draws, rng)
    hold_s = float(np.median([hold.held_s[-1] for hold in holds]))
    rows = []
    for hold, fits, count in zip(holds, own_fits, best_counts, strict=True):
        early, late = fits[max(counts)].modulus(np.array([EARLY_S, hold_s]))
        about = hold.press.name, hold.press.specimen, hold.press.session, hold.press.depth_m[-1], hold.press.thickness_m
        rows.append((*about, hold.loading_s, hold.held_s[-1], hold.held_force[-1], float(late / early), count))
    presses = pd.DataFrame(rows, columns=RELAXATION_PRESSES.columns[1:])
    by_table: tuple[Iterable, ...] = (
        [row for count in counts for row in _rows(fits_of_all[count], holds, count == chosen, draws)],
        [*_modulus(fits_of_all[chosen], draws, hold_s), *_curves(holds, chosen, fits_of_all[chosen], left_out)],
        errors,
        rows,
        _trends(presses, rng),
    )
    tables = {
        table.name: table.frame([entry, *row] for row in rows) for table, rows in zip(TABLES, by_table, strict=True)
    }
    return tables, fits_of_all[chosen]


def _groups(holds: Sequence[Hold], kinds: Sequence[str]) -> list[Group]:
    """Return the groups of presses that are left out in turn; a kind with one group only has none."""
    groups = []
    for kind in kinds:
        if kind == DEPTH:
            strains = np.array([hold.press.depth_m[-1] / (hold.press.thickness_m or 1.0) for hold in holds])
            names = np.where(strains > np.median(strains), "deeper half", "").tolist()
        elif kind in (SPECIMEN, SESSION):
            names = [getattr(hold.press, kind) for hold in holds]
        else:
            continue
        groups_of_kind = dict.fromkeys(names) if len(set(names)) > 1 else ()
        for name in (each for each in groups_of_kind if each or kind != DEPTH):
            seen = [hold for group_name, hold in zip(names, holds, strict=True) if group_name != name]
            unseen = [hold for group_name, hold in zip(names, holds, strict=True) if group_name == name]
            groups.append(Group(kind, name, seen, unseen))
    return groups


def _left_out(holds: Sequence[Hold], group: Group, fits: Mapping[int, Branches], weight: float) -> Iterator[tuple]:
    """Yield a row of RELAXATION_ERRORS for each model and press of a group; fits : branches fitted without it.

    weight : of the samples at the held depth in the fit of a power of time
    """
    kernels: dict[str, Kernel] = {_words(count): kernel for count, kernel in fits.items()}
    kernels[POWER] = fit_fading(group.seen, weight)
    for name, kernel in kernels.items():
        for hold in group.unseen:
            yield _error(group.kind, group.name, hold, name, hold.error(kernel))
    for hold in group.unseen:
        start_force, session_key = hold.force[hold.held], (hold.press.specimen, hold.press.session)
        yield _error(group.kind, group.name, hold, HELD, start_force - hold.held_force)
        siblings = [
            other for other in holds if other is not hold and (other.press.specimen, other.press.session) == session_key
        ]
        for name, others in ((MEAN, group.seen), (SIBLINGS, siblings)):
            if others:
                error = start_force * _mean_curve(others, hold.held_s) - hold.held_force
                yield _error(group.kind, group.name, hold, name, error)


def _mean_curve(holds: Sequence[Hold], time_s: np.ndarray) -> np.ndarray:
    """Return the mean over presses of the force at ``time_s`` (k,) [s] relative to that when the hold begins."""
    curves = []
    for hold in holds:
        times, forces = np.append(0.0, hold.held_s), hold.force[hold.held :]
        curves.append(np.interp(time_s, times, forces / forces[0]))
    return np.mean(curves, axis=0)


def _error(kind: str, group: str, hold: Hold, model: str, error: np.ndarray) -> tuple:
    return kind, group, hold.press.name, model, float(np.sqrt(np.mean(error**2))), float(error[-1])


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
            best_errors = errors_of[errors_of.mean().idxmin()]
            for count in sorted(counts):
                excess = errors_of[_words(count)] - best_errors
                if excess.mean() <= excess.std() / np.sqrt(len(excess)) or len(excess) < 2:
                    return count
    return None


def _rows(kernel: Branches, holds: Sequence[Hold], chosen: bool, draws: Draws) -> Iterator[tuple]:
    """Yield a row of RELAXATION for each branch of ``kernel``, with intervals from ``draws`` if it is ``chosen``."""
    series = kernel.series
    misfit = float(np.median([np.sqrt(np.mean(hold.error(kernel) ** 2)) for hold in holds]))
    count = len(series.shares)
    empty = np.full((2, count), np.nan)
    shares = draws.interval(lambda drawn: np.array(drawn.series.shares)) if chosen else empty
    times = draws.interval(lambda drawn: np.array(drawn.series.times_s)) if chosen else empty
    for i in range(count):
        values = series.shares[i], *shares[:, i], series.times_s[i], *times[:, i]
        yield count, i + 1, chosen, *values, draws.drawn if chosen else "", misfit


def _modulus(kernel: Branches, draws: Draws, span: float) -> Iterator[tuple]:
    """Yield the rows of RELAXATION_CURVES of the modulus over time, relative to that at EARLY_S."""
    times = np.geomspace(0.05, 3.0 * span, TIMES)

    def relative(branches: Branches) -> np.ndarray:
        return branches.modulus(times) / branches.modulus(np.array(EARLY_S))

    interval = draws.interval(relative)
    for time, value, low, high in zip(times, relative(kernel), *interval, strict=True):
        yield "", "", time, np.nan, value, low, high


def _curves(
    holds: Sequence[Hold], chosen: int, of_all: Branches, left_out: Sequence[tuple[Group, Mapping[int, Branches]]]
) -> Iterator[tuple]:
    """Yield the rows of RELAXATION_CURVES of each held press, predicted by branches of the other specimens."""
    without_specimen = {
        hold.press.name: fits[chosen] for group, fits in left_out if group.kind == SPECIMEN for hold in group.unseen
    }
    for hold in holds:
        kernel = without_specimen.get(hold.press.name, of_all)
        predicted = hold.fit(kernel)[hold.held + 1 :]
        times = hold.held_s
        shown_times = np.geomspace(times[0], times[-1], SHOWN)
        for k in np.unique(np.abs(times[:, None] - shown_times).argmin(axis=0)):
            name, specimen = hold.press.name, hold.press.specimen
            yield name, specimen, times[k], hold.held_force[k], predicted[k], np.nan, np.nan


def _trends(presses: pd.DataFrame, rng: np.random.Generator) -> Iterator[tuple]:
    """Yield a row of RELAXATION_TRENDS for each quantity that late_over_early should not depend on."""
    with_strain = presses.assign(strain=presses["depth_m"] / presses["thickness_m"].astype(float))
    for quantity in ("depth_m", "strain", "thickness_m", "loading_s"):
        rows = with_strain[[quantity, "late_over_early"]].astype(float).dropna()
        x, y = rows.to_numpy().T
        if len(rows) < 8 or not np.ptp(x) > 0.0:
            continue
        span = float(np.subtract(*np.quantile(x, [0.9, 0.1])))
        picks = rng.integers(len(x), size=(DRAWN_TRENDS, len(x)))
        slopes = [span * np.polyfit(x[pick], y[pick], 1)[0] for pick in picks if np.ptp(x[pick]) > 0.0]
        correlation = pearsonr(x, y)
        interval = np.quantile(slopes, [0.05, 0.95])
        values = span * np.polyfit(x, y, 1)[0], *interval, correlation.statistic, correlation.pvalue
        yield quantity, len(x), *map(float, values)
