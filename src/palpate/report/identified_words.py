"""Put what presses determine, and what they leave open, into sentences: for the terminal and for the report."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
import pandas as pd

from palpate.identification.identify import MODULUS, OFFSET, YOUNG, Identified, Line
from palpate.identification.intervals import Interval
from palpate.identification.prediction import LINE, NEIGHBOUR, OF_PLACE, POWER_LAW, REPEAT, summary
from palpate.identification.relaxation import Relaxation
from palpate.identification.sessions import Comparison
from palpate.report.words import capital, listed, pascals, percent, seconds, spaced, two_digits

WORDS = {"poisson": "ν", "stiffening": "the law's stiffening", "thickness_m": "the thickness", "sticking": "friction"}
"""What sentences call a parameter."""
AT_END = 1e-3
"""Distance of the best value to the end of a range, as a share of it, that is none."""
MATTERS = 0.02
"""Change of E, as a share, with a parameter that is unknown, that is worth a word."""
RESAMPLED_WIDER = 1.5
"""Factor by which the bootstrap's interval is wider than the profile's where the model of scatter is doubted."""
LEFT_OUT = {
    "place": "places left out", "depth": "the deeper half of each press", "session": "a session left out",
    "specimen": "a specimen left out",
}  # fmt: skip


def quantity(name: str, value: float) -> str:
    """Write a parameter with its unit."""
    return f"{two_digits(1e3 * value)} mm" if name.endswith("_m") else f"{float(f'{value:.2g}'):g}"


def sentences(identified: Identified, predictions: pd.DataFrame) -> list[str]:
    """Return what presses determine and do not, a sentence each.

    predictions : the table of ``prediction.predict`` for the same presses
    """
    lines = [
        *_modulus(identified),
        *_parameters(identified),
        *_law(identified),
        *_scatter(identified),
        *_resampled(identified),
    ]
    return [*lines, *predicted(predictions, identified.law)]


def compared(comparisons: Sequence[Comparison]) -> Iterator[str]:
    """Yield a sentence for each two sessions of a specimen: whether forces agree at places that both pressed."""
    for comparison in comparisons:
        of_specimen = f" of {comparison.specimen}" if comparison.specimen else ""
        ratio = (
            f"forces of {comparison.second or 'the second'} are {two_digits(comparison.ratio)} times those of "
            f"{comparison.first or 'the first'} in the median of {comparison.places} places that both pressed"
        )
        agreement, consequence = "agree", ""
        if comparison.contradicts:
            agreement, consequence = (
                "contradict each other",
                ", so that no one modulus holds for both, and each session is fitted alone",
            )
        elif comparison.may_contradict:
            agreement = "may contradict each other"
            consequence = ", which are too few or too different to tell; one modulus is fitted to both"
        yield f"Sessions{of_specimen} {agreement}: {ratio}{consequence}."


def relaxes(relaxation: Relaxation | None) -> list[str]:
    """Return what held presses say of relaxation, a sentence or none."""
    if relaxation is None:
        return ["No press is held, so that relaxation is not known; E is that of the rate of the presses."]
    series = relaxation.kernel.series
    shares = listed([f"{percent(s)} in {seconds(t)}" for s, t in zip(series.shares, series.times_s, strict=True)])
    count = len(series.shares)
    return [
        f"Relaxation needs {count} branch{'es' * (count > 1)} (of the instant force {shares}), by {relaxation.holds} "
        f"held presses; E is that after relaxation, and {relaxation.faster:.2f} times as large "
        f"{seconds(relaxation.loading_s)} after a sudden press: in so much time they were loaded."
    ]


def uncertain(identified: Identified, line: Line | None) -> Iterator[str]:
    """Yield warnings of what the intervals leave out; line : what ``identify.line_of`` says."""
    if (offset := identified.intervals.get(OFFSET)) is not None:
        low, high = identified.model.offset_m
        margin = 0.02 * (high - low)
        if offset.known and not low + margin < offset.best < high - margin:
            yield (
                f"warning: first touch is at the end of its range, {two_digits(1e3 * offset.best)} mm: it may "
                "be beyond, or forces have a zero that is not subtracted; give rows before contact, or --offset."
            )
    if not identified.laws[0].follows:
        bend = "steeper" if identified.laws[0].excess.best > 0.0 else "flatter"
        yield (
            f"warning: the curve is {bend} than any law here, so that E may be farther off than its interval says: see "
            "whether the sensor's zero and slope are subtracted, and whether the tissue is as deep and flat as assumed."
        )
    if line is not None:
        zero, slope = two_digits(1e3 * line.zero_n), two_digits(line.slope_n_m)
        remedy = ": give rows before contact, with negative depth_m, or subtract the sensor's line"
        remedy = "" if identified.records.force_error > 0.0 else remedy
        yield (
            f"warning: with {zero} mN and {slope} mN/mm subtracted, which a sensor that is not zeroed, tissue that "
            f"sticks or another law may add, forces fit better (by {line.better:.0f} in −2 log likelihood) and "
            f"E is {pascals(line.young_pa)}; the interval below does not hold it{remedy}."
        )


def assumed(ball_m: float, deep: bool) -> str:
    """Say what E leaves out without a body; ball_m : radius of the instrument [m]; deep : no thickness is known."""
    radius = 3.0 * ball_m
    bump, dent = np.sqrt(1.0 + ball_m / radius), np.sqrt(1.0 - ball_m / radius)
    slab = "No --thickness and no --body are given: the tissue is assumed deep; on a slab E is less. " if deep else ""
    return (
        f"{slab}The surface is assumed flat, which these intervals leave out: where it is round with a radius R, E is "
        f"√(1 + {1e3 * ball_m:g} mm/R) times as large ({bump:.2f} at R = {1e3 * radius:g} mm; in a hollow {dent:.2f})."
    )


def _modulus(identified: Identified) -> Iterator[str]:
    young = identified.young_pa
    places = (
        f"in the median of {identified.model.data.places} places"
        if identified.model.data.places > 1
        else "at the one place"
    )
    yield f"E is {_in_pascals(young)}, 90 % by profile likelihood, {places}."
    modulus = identified.intervals.get(MODULUS)
    if modulus is not None and modulus.high / modulus.low < young.high / young.low:
        yield f"E/(1 − ν²), which these presses determine better, is {_in_pascals(modulus)}."


def _parameters(identified: Identified) -> Iterator[str]:
    for name, interval in identified.parameters.items():
        profile, words, write = identified.profiles[name], WORDS.get(name, spaced(name)), partial(quantity, name)
        low, best, high = map(write, interval[:3])
        range_begin, range_end = write(profile.values[0]), write(profile.values[-1])
        if not interval.known and name == "sticking":
            line = "Friction cannot be told from these presses (from sliding to sticking all fits)"
        elif not interval.known:
            line = f"{_first(words)} cannot be told from these presses (any from {low} to {high} fits)"
        elif interval.open_low and not interval.open_high:
            line = f"{_first(words)} is at most {high} (its range begins at {range_begin})"
        elif interval.open_high and not interval.open_low:
            line = f"{_first(words)} is at least {low} (its range ends at {range_end})"
        else:
            line = f"{_first(words)} is {best} ({low} to {high})"
        fits = profile.minus2 <= identified.rise
        young, ends = profile.young_pa[fits], profile.values[fits]
        if len(young) > 1 and abs(np.log(young[-1] / young[0])) > MATTERS:
            line += f"; E is {pascals(young[0])} with {write(ends[0])} and {pascals(young[-1])} with {write(ends[-1])}"
        yield line + "."
        below, above = interval.best - interval.low, interval.high - interval.best
        if interval.known and interval.open_low != interval.open_high and min(below, above) < AT_END * (below + above):
            end = f"below {range_begin}" if below < above else f"above {range_end}"
            yield f"The presses fit best at the end of this range: {words} may be {end}, or the law another."


def _law(identified: Identified) -> Iterator[str]:
    best, *rivals = identified.laws
    excess = f"{abs(best.excess.best):.2f} ({_ends(best.excess)})"
    if not best.follows:
        bend = "steeper" if best.excess.best > 0 else "flatter"
        than = f"than any law here, of which {spaced(best.law)} comes nearest" if rivals else f"than {spaced(best.law)}"
        side = "above" if bend == "steeper" else "below"
        yield f"The curve is {bend} {than}: the exponent of depth is {excess} {side} its."
        return
    indistinguishable = [spaced(name) for name in identified.same_law[1:]]
    worse = [spaced(score.law) for score in rivals if score.law not in identified.same_law]
    line = f"The law {spaced(best.law)} follows the curve (exponent within {_ends(best.excess)} of it)"
    if indistinguishable:
        line += f"; {listed(indistinguishable)} cannot be told from it"
    if worse:
        line += f"; {listed(worse)} fits worse"
    yield line + "."


def _scatter(identified: Identified) -> Iterator[str]:
    scatter = identified.scatter
    if identified.model.data.places > 1:
        exponent = f"{scatter['shape_scatter']:.2f} in exponent"
        line = f"Places differ by {percent(scatter['place_scatter'])} in force and {exponent}"
        if np.isfinite(scatter["repeat_scatter"]):
            line += f", presses of one place by {percent(scatter['repeat_scatter'])}"
        noise = f"{percent(scatter['noise_share'])} and {two_digits(1e3 * scatter['noise_n'])} mN"
        yield f"{line}; noise is {noise} (deviations)."
    if (offset := identified.intervals.get(OFFSET)) is not None:
        low, best, high = (two_digits(1e3 * value) for value in offset[:3])
        deviation_mm = two_digits(1e3 * scatter["offset_scatter_m"])
        line = f"First touch is at {best} mm ({low} to {high}) of the stated depth, ± {deviation_mm} mm between presses"
        yield f"{line}{'; that cannot be told from these presses' if not offset.known else ''}."
    if scatter["relative_error"] > 0.0:
        yield f"The model's own error of {percent(scatter['relative_error'])} in force is part of these intervals."


def _resampled(identified: Identified) -> Iterator[str]:
    name = MODULUS if MODULUS in identified.intervals else YOUNG
    if name not in identified.resampled:
        return
    by_profile, by_bootstrap = identified.intervals[name], identified.resampled[name]
    what = "E/(1 − ν²)" if name == MODULUS else "E"
    line = f"Places drawn with replacement give {what} from {pascals(by_bootstrap.low)} to {pascals(by_bootstrap.high)}"
    if np.log(by_bootstrap.high / by_bootstrap.low) > RESAMPLED_WIDER * np.log(by_profile.high / by_profile.low):
        yield f"{line}, wider than by likelihood: places differ otherwise than the model says, so take this interval."
    else:
        yield f"{line}; that varies places alone, so the profile, which also moves what is unknown, is reported."


def predicted(predictions: pd.DataFrame, law: str) -> Iterator[str]:
    """Yield a sentence for each kind of left-out data of ``predictions``: how well the law and rivals predict them."""
    table = summary(predictions)
    for left_out in dict.fromkeys(predictions["by"]):
        errors = table[table["by"] == left_out].set_index("model")["median"]
        if law not in errors:
            continue
        floor = [f"{word} differ by {percent(errors[name])}" for name, word in
                 ((REPEAT, "repeats"), (NEIGHBOUR, "nearest neighbours")) if name in errors]  # fmt: skip
        line = f"Prediction of {LEFT_OUT[left_out]}: {percent(errors[law])} in force"
        line += f", where {' and '.join(floor)}" if floor else ""
        rivals = {"a power law": [POWER_LAW, POWER_LAW + OF_PLACE], "a line": [LINE, LINE + OF_PLACE]}
        errors_of_kinds = [
            f"{word} has {percent(min(errors[name] for name in names if name in errors))}"
            for word, names in rivals.items()
            if any(name in errors for name in names)
        ]
        yield f"{line}; {listed(errors_of_kinds)}."


def _first(words: str) -> str:
    """Begin a sentence with ``words``, capitalised unless they are a symbol."""
    return words if words == WORDS["poisson"] else capital(words)


def _in_pascals(interval: Interval) -> str:
    """Write a modulus and its interval, with as many digits as tell the ends from the middle."""
    for digits in (2, 3, 4):
        low, best, high = (pascals(value, digits) for value in interval[:3])
        if len({low, best, high}) == 3:
            break
    return f"{best} ({low} to {high})"


def _ends(interval: Interval) -> str:
    return f"{interval.low:+.2f} to {interval.high:+.2f}"
