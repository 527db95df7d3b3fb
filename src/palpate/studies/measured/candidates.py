"""The models that can predict an experiment, from the settings of the study."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from palpate.bodies.body import Body
from palpate.studies.measured.specimen import FemSpecimen, Specimen, SpringSpecimen


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model of ``body`` with a setting: ``make`` builds its specimen.

    asked_more : whether it also says what follows from creep, and from kinds of damping
    """

    model: str
    setting: str
    body: Body
    make: Callable[[], Specimen]
    asked_more: bool = False


def candidates(body: Body, settings: Mapping[str, Mapping[str, Any]]) -> Iterator[Candidate]:
    """Yield linear and quadratic elements on their levels, these with other ν and laws on the coarsest, and springs.

    settings : ``measured.models`` of the config; levels that are null are all that the body has
    """
    for order, model in ((1, "fem_p1"), (2, "fem_p2")):
        last = len(body.levels) - order
        levels = settings[model]["levels"]
        for number, level in enumerate(range(last + 1) if levels is None else levels):
            made = partial(FemSpecimen, body, level, order)
            yield Candidate(model, f"level={level}", body, made, asked_more=order == 2 and number == 0)
    quadratic = settings["fem_p2"]
    if len(body.levels) > 1:
        for poisson in quadratic["poissons"]:
            other = replace(body, material=replace(body.material, poisson=poisson))
            yield Candidate("fem_p2", f"level=0 poisson={poisson:g}", other, partial(FemSpecimen, other, 0, 2))
        for law in quadratic["laws"]:
            other = replace(body, material=replace(body.material, law=law))
            yield Candidate("fem_p2", f"level=0 law={law}", other, partial(FemSpecimen, other, 0, 2))
    for level in settings["springs"]["levels"]:
        yield Candidate("springs", f"level={level}", body, partial(SpringSpecimen, body, level))
