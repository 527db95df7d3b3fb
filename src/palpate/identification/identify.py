"""Identify tissue from presses: the law that fits best, and its modulus and parameters with intervals."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from palpate.errors import NotConverged
from palpate.identification.fit import BOUNDS, Data, MixedModel, Options, best_fit, fitted
from palpate.identification.forward import Forward
from palpate.identification.intervals import Interval, Profile, Profiler, bootstrap
from palpate.identification.presses import PressRecords
from palpate.identification.progress import UNFOLLOWED, Progress

YOUNG, MODULUS, OFFSET = "young_pa", "modulus_pa", "offset_m"
TOUCH_OF_DEPTH, ZEROS = 0.05, (0.0, 0.1, -0.05)
"""Share of the largest depth where first touch decides; zeros over the typical force that a search begins with."""
BETTER = 9.21
"""Gain in −2 log likelihood by two terms that one of a hundred presses without them has (χ²)."""
UNEXPLAINED = BOUNDS["log_noise"][1] - 1e-3
"""Log of the noise, as a share of force, of presses that a law does not describe: a search ends there, or is lost."""


class LawScore(NamedTuple):
    """How well a law follows the presses.

    above : information criterion, −2 log likelihood plus 2 for each parameter, above the best law's (Akaike 1974)
    excess : by how much the presses' exponent of depth is above the law's, with its interval
    """

    law: str
    above: float
    excess: Interval

    @property
    def follows(self) -> bool:
        """Whether the law has the exponent of the presses."""
        return self.excess.low <= 0.0 <= self.excess.high


class Curve(NamedTuple):
    """Points of a press that were fitted, (k,): depths, forces, and predictions with the effects of place and touch."""

    name: str
    depth_m: np.ndarray
    force_n: np.ndarray
    predicted_n: np.ndarray


@dataclass(frozen=True, eq=False)
class Identified:
    """What presses determine, of one session or of several that agree.

    laws : all, the best first, which is reported: that of the smallest ``LawScore.above``
    intervals : by name: young_pa of the median place; modulus_pa, E/(1 − ν²), where ν is free; the ``parameters``; and
        offset_m, the mean of first touch over the presses, unless it is known
    profiles : of all of these
    resampled : intervals by the bootstrap over places, without the forward model's own error
    scatter : standard deviations by name. offset_scatter_m is over presses; place_scatter of log force, and
        shape_scatter of the exponent of depth, over places; repeat_scatter of log force over presses of a place, NaN
        without repeats; noise_share and noise_n of forces about the curves, at large and at small ones; relative_error
        is the forward model's own, table_error that of its interpolation
    rise : by how much −2 log likelihood rises at the ends of an interval
    models, best : by law, the statistical model and its unknowns
    """

    records: PressRecords
    laws: tuple[LawScore, ...]
    intervals: dict[str, Interval]
    profiles: dict[str, Profile]
    resampled: dict[str, Interval]
    scatter: dict[str, float]
    rise: float
    models: dict[str, MixedModel]
    best: dict[str, dict[str, float]]

    @property
    def law(self) -> str:
        """The law that is reported."""
        return self.laws[0].law

    @property
    def model(self) -> MixedModel:
        """The statistical model with that law."""
        return self.models[self.law]

    @property
    def young_pa(self) -> Interval:
        """Young's modulus of the median place."""
        return self.intervals[YOUNG]

    @property
    def parameters(self) -> dict[str, Interval]:
        """The free parameters of the law's forward model."""
        return {name: self.intervals[name] for name in self.model.parameters}

    @property
    def fitted(self) -> dict[str, float]:
        """Values of the greatest likelihood, of the parameters, young_pa and offset_m."""
        return self.model.values(self.best[self.law])

    @cached_property
    def curves(self) -> tuple[Curve, ...]:
        """Measured and predicted forces of each press, in the order of ``records``."""
        data, layout, predicted = self.model.data, self.model.data.layout, self.model.forces(self.best[self.law])
        curves = []
        for press, k in zip(data.records.presses, np.argsort(data.order), strict=True):
            points = layout.points(k)
            curves.append(Curve(press.name, layout.depth_m[points], layout.force_n[points], predicted[points]))
        return tuple(curves)

    @property
    def same_law(self) -> list[str]:
        """The reported law, and those that fit the presses as well."""
        return [score.law for score in self.laws if score.above <= self.rise]


def identify(
    records: PressRecords, forwards: Mapping[str, Forward], options: Options, progress: Progress = UNFOLLOWED
) -> Identified:
    """Fit every forward model, named by its law, to presses of sessions that agree; report the law that fits best.

    Warns of a law whose fit fails or leaves the presses unexplained, and leaves it out. Raises InputError for presses
    that cannot be fitted, NotConverged for a likelihood without a value, and where no law is left.
    """
    data, models, fits = Data.of(records), {}, {}
    for law in progress.follow("forces of laws", list(forwards)):
        models[law] = MixedModel.of(data, forwards[law], options)
    for law in progress.follow("fit of laws", list(models)):
        try:
            fits[law] = best_fit(models[law], sure=True)
            if fits[law][0]["log_noise"] > UNEXPLAINED:
                raise NotConverged("it leaves as much of these presses as they have", [])
        except NotConverged as failure:
            if len(models) == 1:
                raise NotConverged(f"{law}: {failure}", failure.history) from failure
            warnings.warn(f"{records.source}: {law}: {failure}; left out.", stacklevel=2)
            del models[law]
            fits.pop(law, None)
    criterion = {law: fits[law][1] + 2.0 * len(model.parameters) for law, model in models.items()}
    order = sorted(criterion, key=lambda law: criterion[law])
    model, (best, least) = models[order[0]], fits[order[0]]
    profiler = Profiler(model, best, least)
    jobs: dict[str, Callable[[], Any]] = {YOUNG: profiler.young_pa}
    if "poisson" in model.parameters:
        jobs[MODULUS] = profiler.modulus_pa
    jobs |= {name: partial(profiler.parameter, name) for name in model.parameters}
    if "offset" in model.names:
        jobs[OFFSET] = profiler.offset_m
    jobs |= {law: partial(_excess, models[law], fits[law][0]) for law in order}
    results = dict(
        zip(jobs, progress.each("what the presses leave open", lambda job: job(), list(jobs.values())), strict=True)
    )
    answers = {name: answer for name, answer in results.items() if name not in models}
    scatter = {
        "offset_scatter_m": 0.5 * (model.offset_m[1] - model.offset_m[0]) * best.get("offset_scatter", 0.0),
        "place_scatter": best["place"], "shape_scatter": best["shape"], "repeat_scatter": best.get("repeat", np.nan),
        "noise_share": float(np.exp(best["log_noise"])),
        "noise_n": float(np.exp(best["log_noise"] + best["log_floor"])),
        "relative_error": model.table.forward.relative_error, "table_error": model.table.error,
    }  # fmt: skip
    return Identified(
        records,
        tuple(LawScore(law, criterion[law] - criterion[order[0]], results[law]) for law in order),
        {name: interval for name, (interval, _) in answers.items()},
        {name: profile for name, (_, profile) in answers.items()},
        bootstrap(model, best, options, progress) if data.places > 1 else {},
        scatter,
        profiler.rise,
        models,
        {law: unknown for law, (unknown, _) in fits.items()},
    )


class Line(NamedTuple):
    """A zero [N] and a slope [N/m] of the force, with which presses fit better, and the modulus [Pa] with them.

    better : by how much −2 log likelihood is below that without them
    """

    zero_n: float
    slope_n_m: float
    young_pa: float
    better: float


def line_of(identified: Identified) -> Line | None:
    """Return a zero and a slope of the sensor that may have changed E, by adhesion or drift; None if E would stay.

    Both are fitted as terms of the forces beyond TOUCH_OF_DEPTH of the largest depth; the slope is known where there
    are rows before contact. Adhesion pulls by a nearly constant force from first touch on (Derjaguin, Muller and
    Toporov 1975). E stays where the fit is not better by BETTER, or E is within its interval.
    """
    model = identified.model
    deep = replace(model, data=model.data.masked(model.data.layout.depth_m > TOUCH_OF_DEPTH * model.data.largest_m))
    _, without = fitted(deep, identified.best[identified.law])
    lined = replace(deep, lined=True)
    starts = [identified.best[identified.law] | {"zero": zero, "slope": 0.0} for zero in ZEROS]
    held = {"slope": 0.0} if identified.records.force_error > 0.0 else {}
    unknown, with_both = min((fitted(lined, start, held) for start in starts), key=lambda fit: fit[1])
    young, (low, _, high, *_) = lined.values(unknown)["young_pa"], identified.young_pa
    if without - with_both < BETTER or low <= young <= high:
        return None
    typical, deepest = model.data.typical_n, model.data.largest_m
    return Line(typical * unknown["zero"], typical * unknown["slope"] / deepest, young, without - with_both)


def _excess(model: MixedModel, best: dict[str, float]) -> Interval:
    """Return the interval of the exponent of depth that presses have above a law's, fitted with all unknowns."""
    free = replace(model, free_excess=True)
    unknown, least = fitted(free, {"excess": 0.0} | best)
    return Profiler(free, unknown, least).excess()
