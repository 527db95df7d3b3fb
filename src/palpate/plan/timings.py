"""Estimate seconds from amounts of work: by timings that palpate brings along, corrected by this machine's own."""

import json
import math
import os
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from palpate.files import read_yaml, write_whole
from palpate.plan.work import Amounts

SHIPPED = Path(__file__).with_name("timings.yaml")
KEPT = 8
"""Jobs of each kind whose times are kept: the last ones."""
UNKNOWN_S = 5.0
"""Estimate of a job about which nothing is known, such as the first of a model of the user's own."""
SHORT_S = 0.5
"""Time below which the ratio of two says little."""
OVERALL = 0.5
"""Weight of all jobs beside those of a kind: one of these that takes as long has 10, one ten times as long 0.4."""


class Timings:
    """Times of kinds of jobs: ``shipped`` rates and, by kind, [estimated with these, taken] of the last jobs here."""

    def __init__(self, shipped: dict[str, Amounts], here: dict[str, list[list[float]]]):
        self._shipped, self.here = shipped, here

    def seconds(self, kind: str, amounts: Amounts) -> float:
        """Estimate how long a job of this kind takes [s], on a core or, if it uses several, on all of them together."""
        return self.shipped_seconds(kind, amounts) * self._correction(kind, self.shipped_seconds(kind, amounts))

    def shipped_seconds(self, kind: str, amounts: Amounts) -> float:
        """Estimate the same [s] as on the machine whose timings palpate brings along."""
        if kind not in self._shipped:
            return UNKNOWN_S
        rates = self._shipped[kind]
        return rates["base"] + sum(rates.get(name, 0.0) * amount for name, amount in amounts.items())

    def _correction(self, kind: str, seconds: float) -> float:
        """Return how many times as long jobs take here: of its kind, those most like it most, and of all."""
        rows = [row for known, kept in self.here.items() if known in self._shipped for row in kept]
        overall = _ratio(sum(taken for _, taken in rows), sum(estimated for estimated, _ in rows))
        same = self.here.get(kind, [])
        weights = [1.0 / (0.1 + abs(math.log(_ratio(seconds, estimated)))) for estimated, _ in same]
        logs = [math.log(_ratio(taken, estimated)) for estimated, taken in same]
        total = OVERALL * math.log(overall) + sum(w * x for w, x in zip(weights, logs, strict=True))
        return math.exp(total / (OVERALL + sum(weights)))


def _ratio(a: float, b: float) -> float:
    return (a + SHORT_S) / (b + SHORT_S)


def read_timings() -> Timings:
    """Read the shipped timings and this machine's; those of other shipped timings no longer count."""
    return Timings(read_yaml(SHIPPED), _read_here())


def remember(taken: dict[str, list[list[float]]]) -> None:
    """Add what jobs took here, by kind [shipped estimate, seconds taken]; where nothing can be written, forget it.

    Of two runs that end at once one may replace what the other has added; the file is whole in any case.
    """
    here = _read_here()
    for kind, rows in taken.items():
        here[kind] = [*here.get(kind, []), *rows][-KEPT:]
    with suppress(OSError), write_whole(_file()) as temporary:
        temporary.write_text(json.dumps({"shipped": _digest(), "kinds": here}), encoding="utf-8")


def _read_here() -> dict[str, list[list[float]]]:
    with suppress(OSError, ValueError, TypeError, KeyError, AttributeError):
        kept = json.loads(_file().read_text(encoding="utf-8"))
        if kept["shipped"] == _digest():
            return {str(kind): [[float(a), float(b)] for a, b in rows] for kind, rows in kept["kinds"].items()}
    return {}


def _file() -> Path:
    """Return the file of this machine's timings, outside of any results folder, so that ``make clean`` keeps it."""
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(cache) / "palpate/timings.json"


def _digest() -> str:
    return sha256(SHIPPED.read_bytes()).hexdigest()[:12]
