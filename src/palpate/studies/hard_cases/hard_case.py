"""A hard case, and the judgement of a model's outcome in it and of the bound that it was judged by."""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from palpate.errors import InputError, NotConverged

OUTCOMES = ("stable", "refused", "not_converged", "wrong", "nan")
"""All outcomes: ``nan`` is never acceptable, ``refused`` and ``not_converged`` only where declared.

``wrong`` may be declared for a model whose fault is known, as that of elements that lock; it counts as wrong.
"""
WRONG = ("frozen", "zero", "tenth")
"""Wrong answers that the bound of a case must fail, as in ``Answer``."""
NEARLY = "twentieth"
"""The wrong answer that bounds fail, too, except those of models that are ``blunt``."""
SHARES = {"tenth": 0.1, NEARLY: 0.05}
"""Shares of the way from an answer's origin by which two wrong answers go too far, or not far enough."""
UNMEASURABLE = 1e9
"""Number at which the error of a wrong answer is cut, and that of one that cannot be measured at all."""


@dataclass(frozen=True, eq=False)
class Answer:
    """The answer of a model in a case, and the measure of its error, which can be taken of any other answer, too.

    found : the answer, an array of any shape; frozen : that of a solver which returns what it was given; zero : that of
        no displacement, by default the same; both of a shape that fits ``found``
    error : computes the number that the case bounds
    origin : from which SHARES more and less are reckoned, by default ``frozen``
    """

    found: np.ndarray
    frozen: np.ndarray
    error: Callable[[np.ndarray], float]
    zero: np.ndarray | None = None
    origin: np.ndarray | None = None

    def wrong(self) -> dict[str, float]:
        """Return the errors of the answers WRONG and NEARLY: of a share too much and too little, the smaller error."""
        way = self.found - (self.frozen if self.origin is None else self.origin)
        made = {"frozen": [self.frozen], "zero": [self.frozen if self.zero is None else self.zero]}
        made |= {name: [self.found - share * way, self.found + share * way] for name, share in SHARES.items()}
        shape = self.found.shape
        return {name: min(self._error(np.broadcast_to(one, shape)) for one in some) for name, some in made.items()}

    def _error(self, answer: np.ndarray) -> float:
        """Return the error of a wrong answer, UNMEASURABLE if it cannot be measured."""
        try:
            with np.errstate(all="ignore"):
                value = float(self.error(answer))
        except (ArithmeticError, InputError, NotConverged):
            return UNMEASURABLE
        return min(value, UNMEASURABLE) if math.isfinite(value) else UNMEASURABLE


@dataclass(frozen=True, eq=False)
class Case:
    """One situation in which numerics may fail, with the result that was expected beforehand.

    scene : the situation; expected : the behaviour of a good model; source : author of the idea; all in words
    measure : meaning of the error of the answer that ``run`` returns for each of ``models``; it must not exceed
        ``bound``, and the errors of WRONG answers must
    declared : acceptable outcomes by model; ``stable`` for models that are not named
    bounds : tighter bounds by model
    blunt : models whose own error lets no bound fail NEARLY
    """

    name: str
    scene: str
    expected: str
    measure: str
    bound: float
    run: Callable[[str], Answer]
    models: Collection[str]
    declared: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    source: str = "palpate"
    bounds: Mapping[str, float] = field(default_factory=dict)
    blunt: Collection[str] = ()

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
    FloatingPointError is judged ``nan``. ``message`` : the text of the exception; ``frozen``, ``zero``, ``tenth`` and
    ``twentieth`` : the errors of these answers, empty without one; ``sharp`` : whether those of WRONG are beyond the
    bound, empty unless stable
    """
    value, message, wrong = math.nan, "", dict.fromkeys((*WRONG, NEARLY), math.nan)
    bound = case.bounds.get(model, case.bound)
    try:
        answer = case.run(model)
        finite(answer.found)
        value = float(answer.error(answer.found))
        wrong = answer.wrong()
    except InputError as error:
        outcome, message = "refused", str(error)
    except NotConverged as error:
        outcome, message = "not_converged", str(error)
    except FloatingPointError as error:
        outcome, message = "nan", str(error)
    except Exception as error:
        outcome, message = "wrong", f"{type(error).__name__}: {error}"
    else:
        outcome = "nan" if not math.isfinite(value) else "stable" if value <= bound else "wrong"
    sharp = all(wrong[name] > bound for name in WRONG) if outcome == "stable" else None
    return {
        "case": case.name,
        "source": case.source,
        "scene": case.scene,
        "model": model,
        "outcome": outcome,
        "measure": case.measure,
        "value": value,
        "bound": bound,
        **wrong,
        "sharp": sharp,
        "declared": " or ".join(case.acceptable(model)),
        "passed": outcome in case.acceptable(model) and sharp is not False,
        "message": message,
    }
