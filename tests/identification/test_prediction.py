"""Presses left out are judged by models that did not see them, beside rivals and floors."""

import numpy as np
import pytest
from fixtures.pressed_layer import Layer, draw_presses

from palpate.identification.fit import Data, MixedModel, Options, best_fit
from palpate.identification.prediction import fitted_points, predict, summary

OPTIONS = Options(resamples=0)


def predicted(ways, **more):
    records = draw_presses(Layer(0.004), {"poisson": 0.45}, np.random.default_rng(3), **more)
    model = MixedModel.of(Data.of(records), Layer(0.004), OPTIONS)
    table = predict({"law": model}, {"law": best_fit(model)[0]}, OPTIONS, ways)
    return table, summary(table).set_index(["by", "model"])["median"]


def test_without_noise_deeper_presses_are_predicted_by_the_law_and_not_by_a_line():
    _, error = predicted(("depth",), noise=1e-4, places=10)
    assert error["depth", "law"] < 0.01
    assert error["depth", "line"] > 0.1 and error["depth", "line_of_place"] > 0.1
    assert error["depth", "power_law_of_place"] < 0.05  # Hertz is a power law


def test_places_left_out_are_as_wrong_as_places_differ():
    table, error = predicted(("place",), places=40, place_scatter=0.3)
    # the median of |z| of a normal value is 0.67 of its deviation
    assert error["place", "law"] == pytest.approx(0.67 * 0.3, rel=0.5)
    assert error["place", "neighbour"] == pytest.approx(0.67 * 0.3 * np.sqrt(2), rel=0.6)
    assert len(table[table["model"] == "law"]) == 40  # each once


def test_the_floor_of_repeats_is_their_noise():
    _, error = predicted(("place",), places=15, repeats=2, place_scatter=0.3, offset_m=(0.0, 1e-9), noise=0.05)
    assert error["place", "repeat"] == pytest.approx(0.05 * np.sqrt(2), rel=0.3)


def test_what_is_left_out_is_whole_places_deep_points_or_sessions():
    records = draw_presses(Layer(0.004), {}, np.random.default_rng(0), places=7, repeats=2)
    data = Data.of(records)
    place = data.place_of_press[data.press_of_point]
    parts = fitted_points(data, "place", 0)
    assert np.array([~part for part in parts]).sum(axis=0).tolist() == [1] * len(place)
    for part in parts:
        assert not set(place[part]) & set(place[~part])
    (shallow,) = fitted_points(data, "depth", 0)
    assert shallow.sum() == 14 * 5
    assert fitted_points(data, "session", 0) == [] and fitted_points(data, "specimen", 0) == []
