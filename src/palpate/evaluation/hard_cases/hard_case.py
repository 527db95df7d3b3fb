"""A hard case, and the judgement of a model's outcome in it."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from palpate.errors import InputError, NotConverged

OUTCOMES = ("stable", "refused", "not_converged", "wrong", "nan")
"""All outcomes: ``wrong`` and ``nan`` are never acceptable, ``refused`` and ``not_converged`` only where declared."""


@dataclass(frozen=True, eq=False)
class Case:
    """One situation in which numerics may fail, with the result that was expected beforehand.

    family : enrichment, fem, dynamics or contact; source : author of the idea; scene : the situation; expected : the
        behaviour of a good model; all in words
    measure : meaning of the number that each of ``models`` returns when called; it must not exceed ``bound``
    declared : acceptable outcomes by model; ``stable`` for models that are not named
    """

    name: str
    family: str
    source: str
    scene: str
    expected: str
    measure: str
    bound: float
    models: dict[str, Callable[[], float]]
    declared: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def of(
        cls, *words: Any, run: Callable[[str], float], models: Iterable[str], declared: dict | None = None
    ) -> "Case":
        """Make a case whose models share one function, which receives the model's name."""
        make: Callable[..., Case] = cls  # the type check cannot count ``words``
        return make(*words, {model: partial(run, model) for model in models}, declared or {})

    def acceptable(self, model: str) -> tuple[str, ...]:
        """Return the outcomes declared for a model."""
        return self.declared.get(model, ("stable",))


def finite(*arrays: np.ndarray) -> None:
    """Raise FloatingPointError, which is judged ``nan``, if a value is not finite."""
    for array in arrays:
        if not np.isfinite(array).all():
            raise FloatingPointError("a value that was returned is not finite")


def judge(case: Case, model: str) -> dict:
    """Return the row of one model in one case: the outcome, and whether it was declared.

    Every exception except InputError and NotConverged is judged ``wrong``, since a crash does not count as a refusal;
    FloatingPointError is judged ``nan``. ``message`` : the text of the exception
    """
    value, message = math.nan, ""
    try:
        value = float(case.models[model]())
    except InputError as error:
        outcome, message = "refused", str(error)
    except NotConverged as error:
        outcome, message = "not_converged", str(error)
    except FloatingPointError as error:
        outcome, message = "nan", str(error)
    except Exception as error:
        outcome, message = "wrong", f"{type(error).__name__}: {error}"
    else:
        outcome = "nan" if not math.isfinite(value) else "stable" if value <= case.bound else "wrong"
    return {
        "family": case.family,
        "case": case.name,
        "source": case.source,
        "scene": case.scene,
        "model": model,
        "outcome": outcome,
        "measure": case.measure,
        "value": value,
        "bound": case.bound,
        "declared": " or ".join(case.acceptable(model)),
        "passed": outcome in case.acceptable(model),
        "message": message,
    }
