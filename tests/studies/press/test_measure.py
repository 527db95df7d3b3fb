"""What is said of the page's models follows from their answers to presses whose truth is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.benchmark.measuring import WARM_UP
from palpate.studies.press.measure import CALLS, Known, measure

TRUTH = np.zeros((4, 3))
TRUTH[0] = [0.0, 0.0, -0.01]


class Model:
    """Answers a share of the truth, and says that it is 1 % wrong."""

    def __init__(self, share, doubt=""):
        self.share, self.doubt, self.calls = share, doubt, 0

    def respond(self, presses):
        self.calls += 1
        return SimpleNamespace(displacement=self.share * TRUTH, forces=np.zeros((1, 3)), error=0.01, doubt=self.doubt)


@pytest.fixture
def known():
    place = {"triangle": 0, "weights": [1.0, 0.0, 0.0]}
    return [Known(7, place, np.array([0.0, 0.0, -0.3]), TRUTH * size, 0.001) for size in (1.0, 1.25)]


def test_errors_are_shares_of_the_true_peak(known):
    model = Model(0.9, "too far")
    row = measure("liver", {"contact_modes": (12, model)}, known, [], {"contact_modes": 1.5}).iloc[0]
    # the RMSE of four nodes of which one is wrong by a tenth, and by 0.35 of 1.25
    wrong = sorted([0.1 / 2, 0.35 / 1.25 / 2])
    assert list(row[["rmse_of_peak", "rmse_of_peak_most"]]) == pytest.approx([np.mean(wrong), wrong[1]])
    assert row["error_of_peak"] == pytest.approx(0.01) and row["doubted"] == 2 and row["samples"] == 2
    assert model.calls == 2 + WARM_UP + CALLS


def test_without_truths_only_the_time_is_said():
    press = {"triangle": 0, "weights": [1.0, 0.0, 0.0], "moved": [0.0, 0.0, -0.01]}
    table = measure("liver", {"contact_modes": (12, Model(1.0))}, [], [press], {"contact_modes": 1.5})
    assert np.isnan(table["rmse_of_peak"].iloc[0]) and table["samples"].iloc[0] == 0
