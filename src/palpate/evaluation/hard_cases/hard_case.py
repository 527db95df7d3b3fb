"""What a hard case is, and how the outcome of a model in it is judged."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from palpate.errors import InputError, NotConverged

OUTCOMES = ("stable", "refused", "not_converged", "wrong", "nan")
"""Of which ``wrong`` and ``nan`` are never acceptable, ``refused`` and ``not_converged`` where a case says so."""


@dataclass(frozen=True, eq=False)
class Case:
    """One situation in which numerics may fail, with what was expected of it beforehand.

    family : kernel, fem, dynamics or contact; source : who thought of it; scene : what happens; expected : what a good
        model does; all in words
    measure : what the number is that each of ``models`` returns when called; it must not exceed ``bound``
    declared : outcomes that are acceptable for a model; ``stable`` for those that are not named
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
    def of(cls, *words, run: Callable[[str], float], models: Iterable[str], declared: dict | None = None) -> "Case":
        """A case whose models all have one function, which is told the model's name."""
        return cls(*words, {model: partial(run, model) for model in models}, declared or {})

    def acceptable(self, model: str) -> tuple[str, ...]:
        """The outcomes declared for a model."""
        return self.declared.get(model, ("stable",))


def finite(*arrays: np.ndarray) -> None:
    """Raise FloatingPointError, which is judged ``nan``, if a value is not finite."""
    for array in arrays:
        if not np.isfinite(array).all():
            raise FloatingPointError("a value that was returned is not finite")


def judge(case: Case, model: str) -> dict:
    """The row of one model in one case: what came out, and whether that was declared.

    Any error but the two in which palpate says no is ``wrong``: a crash is no refusal. ``message`` is what was said.
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
