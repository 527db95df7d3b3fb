"""What presses determine is found again, and what they leave open is said."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.pressed_layer import Layer, draw_presses
from scipy.stats import chi2

from palpate.effects.instrument import Instrument
from palpate.errors import InputError, NotConverged
from palpate.identification import fit
from palpate.identification.fit import POINTS, Data, MixedModel, Options, best_fit, fitted, loading, scaling_near
from palpate.identification.forward import Parameter
from palpate.identification.identify import identify, line_of
from palpate.identification.intervals import Profiler, bootstrap, threshold
from palpate.identification.presses import Press, PressRecords

NU = Parameter("poisson", 0.3, 0.49)
THICKNESS = Parameter("thickness_m", 0.006, 0.04)
STIFFENING = Parameter("stiffening", 0.0, 3.0)
QUICK = Options(resamples=0)


def fit_of(layer, values, seed=0, **more):
    records = draw_presses(Layer(layer.radius_m), values, np.random.default_rng(seed), **more)
    model = MixedModel.of(Data.of(records), layer, QUICK)
    return model, *best_fit(model)


@pytest.mark.slow
def test_poisson_is_unknown_and_the_modulus_that_it_acts_through_is_not():
    model, best, least = fit_of(Layer(0.004), {"poisson": 0.45}, place_scatter=0.05)
    profiler = Profiler(model, best, least)
    nu, profile = profiler.parameter("poisson")
    assert not nu.known and nu.open_low and nu.open_high
    assert (nu.low, nu.high) == (0.3, 0.49)
    assert np.abs(profile.minus2).max() < 0.1  # E makes up for ν entirely
    young, modulus = profiler.young_pa()[0], profiler.modulus_pa()[0]
    assert young.low < 2000.0 < young.high
    assert modulus.low < 2000.0 / (1 - 0.45**2) < modulus.high
    # E may be anything that ν makes of the modulus
    assert young.high / young.low > 1.1 * modulus.high / modulus.low


def test_intervals_hold_the_truth_about_as_often_as_they_say():
    inside = []
    for seed in range(8):
        model, best, least = fit_of(Layer(0.008), {"poisson": 0.4}, seed, places=12)
        modulus, _ = Profiler(model, best, least).modulus_pa()
        inside.append(modulus.low <= 2000.0 / (1 - 0.4**2) <= modulus.high)
    assert sum(inside) >= 6


def test_scatter_noise_and_first_touch_are_found():
    model, best, _ = fit_of(Layer(0.008), {"poisson": 0.4}, places=60, place_scatter=0.3)
    assert np.exp(best["log_noise"]) == pytest.approx(0.02, rel=0.15)
    assert best["place"] == pytest.approx(0.3, rel=0.3)
    assert model.values(best)["offset_m"] == pytest.approx(-1e-4, abs=5e-5)


def test_places_that_differ_by_a_hundred_times_are_fitted():
    """As those of a pig's liver do: a likelihood that expects a fifth is too steep for a search to leave."""
    model, best, least = fit_of(Layer(0.008), {"poisson": 0.4}, places=60, place_scatter=1.5, noise=0.005)
    assert best["place"] == pytest.approx(1.5, rel=0.3)
    assert np.exp(best["log_noise"]) == pytest.approx(0.005, rel=0.3)
    start = model.start()
    assert start["place"] == pytest.approx(1.5, rel=0.3)
    assert (
        least
        < model.minus2(start)
        < 0.2 * model.minus2(start | {"place": 0.2, "shape": 0.1, "log_noise": np.log(0.05)})
    )


def test_presses_that_no_law_describes_have_no_modulus():
    records, rng = draw_presses(Layer(0.004), {}, np.random.default_rng(0), places=6), np.random.default_rng(1)
    torn = tuple(replace(p, force_n=np.exp(2.5 * rng.standard_normal(len(p.force_n)))) for p in records.presses)
    with pytest.raises(NotConverged):
        identify(replace(records, presses=torn), {"linear": Layer(0.004)}, QUICK)


@pytest.mark.slow
def test_a_layer_of_another_thickness_is_not_followed():
    thin = {"poisson": 0.45, "thickness_m": 0.006}
    known = Layer(0.004, known={"thickness_m": 0.04})
    records = draw_presses(Layer(0.004), thin, np.random.default_rng(0), places=10, offset_m=(0.0, 5e-5))
    found = identify(records, {"thick": known}, Options(offset_m=(-1e-4, 1e-4), resamples=0))
    assert found.laws[0].excess.low > 0.0 and not found.laws[0].follows
    free = identify(records, {"free": Layer(0.004, (NU, THICKNESS))}, Options(offset_m=(-1e-4, 1e-4), resamples=0))
    assert free.parameters["thickness_m"].low <= 0.006 <= free.parameters["thickness_m"].high < 0.02
    assert free.laws[0].follows


@pytest.mark.slow
def test_the_law_that_stiffens_is_found_and_its_stiffening():
    values = {"poisson": 0.45, "stiffening": 1.0}
    laws = {"linear": Layer(0.004), "stiffens": Layer(0.004, (NU, STIFFENING))}
    records = draw_presses(Layer(0.004), values, np.random.default_rng(0), places=8)
    found = identify(records, laws, QUICK)
    assert found.law == "stiffens"
    assert found.laws[1].law == "linear" and found.laws[1].above > 10.0
    assert found.laws[0].follows and not found.laws[1].follows
    assert found.parameters["stiffening"].low < 1.0 < found.parameters["stiffening"].high
    # and where tissue does not stiffen, the law cannot be told from the one that may
    records = draw_presses(Layer(0.004), {"poisson": 0.45}, np.random.default_rng(0), places=8)
    assert set(identify(records, laws, QUICK).same_law) == set(laws)


def test_the_own_error_of_a_model_widens_the_interval_as_squares_add():
    records = draw_presses(Layer(0.004), {"poisson": 0.45}, np.random.default_rng(0), places=80, place_scatter=0.0)
    found = []
    for error in (0.0, 0.1):
        model = MixedModel.of(Data.of(records), Layer(0.004, relative_error=error), QUICK)
        best, least = best_fit(model)
        found.append(Profiler(model, best, least).modulus_pa()[0])
    assert np.log(found[1].high / found[1].best) > 0.1 * np.sqrt(threshold(0.9, 80))
    assert np.log(found[1].high / found[1].best) < 0.25
    assert np.log(found[0].high / found[0].best) < 0.05


def test_an_error_that_differs_from_place_to_place_averages_out_over_them():
    records = draw_presses(Layer(0.004), {"poisson": 0.45}, np.random.default_rng(0), places=80, place_scatter=0.0)
    model = MixedModel.of(Data.of(records), Layer(0.004, relative_error=0.1, local=True), QUICK)
    best, least = best_fit(model)
    found = Profiler(model, best, least).modulus_pa()[0]
    half = 0.1 * np.sqrt(threshold(0.9, 80) / 80)
    assert best["place"] == pytest.approx(0.1)  # more than noise says, which knows no more than these presses
    assert np.log(found.high / found.low) == pytest.approx(2.0 * half, rel=0.3)


def test_the_bootstrap_over_places_is_as_wide_as_places_differ():
    model, best, _ = fit_of(Layer(0.008), {"poisson": 0.45}, places=30, place_scatter=0.2)
    drawn = bootstrap(model, best, Options(resamples=40))["modulus_pa"]
    expected = 2 * 1.645 * 0.2 / np.sqrt(30)
    assert 0.6 * expected < np.log(drawn.high / drawn.low) < 1.5 * expected


def test_thresholds_are_those_of_one_degree_of_freedom_for_many_places():
    assert threshold(0.9, 100_000) == pytest.approx(chi2.ppf(0.9, 1), rel=1e-3)
    # 5 normal values: t of 4 degrees, 2.132
    assert threshold(0.9, 5) == pytest.approx(5 * np.log(1 + 2.132**2 / 4), rel=1e-3)


def test_round_coordinates_end_where_others_do():
    """With a modulus far from the best, so that parameters reach the ends of their ranges."""
    model, best, least = fit_of(Layer(0.004, (NU, THICKNESS)), {"poisson": 0.45, "thickness_m": 0.01})
    young = np.log(model.values(best)["young_pa"])
    scaling = scaling_near(model, best, young=True)
    for away in (-0.3, 0.05, 0.2):
        expected = fitted(model, best, young=young + away)[1]
        unknown, value = fitted(model, best, young=young + away, scaling=scaling)
        assert value == pytest.approx(expected, abs=0.05) and value > least - 0.01
        assert np.log(model.values(unknown)["young_pa"]) == pytest.approx(young + away)
        assert all(low <= unknown[name] <= high for name in model.parameters for low, high in [model.bounds(name)])


def test_a_press_is_fitted_while_it_goes_deeper():
    depth = np.concatenate([np.linspace(0, 1e-3, 50), np.linspace(1e-3, 0.0, 50)[1:]])
    press = Press("a", "", "", "", None, None, None, depth, np.arange(99.0))
    deep, force = loading(press)
    assert len(deep) == POINTS and (np.diff(deep) > 0).all() and deep[-1] == 1e-3
    assert (force < 50).all()


def touched(seed, zero=0.0, slope=0.0, pull=0.0, rows=31):
    """Hertz presses of 4 kPa from depth 0 on, with noise at small forces [N], a zero, a slope [N/m] and a pull [N]."""
    rng, depth, presses = np.random.default_rng(seed), np.linspace(0.0, 3e-3, rows), []
    clean = 4.0 / 3.0 * 4000.0 / (1.0 - 0.45**2) * np.sqrt(0.004) * depth**1.5
    for name in "abcdef":
        force = np.exp(0.02 * rng.normal()) * clean - pull * (depth > 0.0) + zero + slope * depth
        force += 2e-4 * rng.normal(size=rows)
        presses.append(Press(name, name, "", "", None, None, None, depth, force))
    return PressRecords(Instrument("sphere", 0.004), tuple(presses), "presses.csv")


def test_a_noisy_row_at_first_touch_leaves_e_in_its_interval_and_no_start_finds_a_better_fit():
    found = identify(touched(1), {"hertz": Layer(0.004, (), 0.003)}, QUICK)
    assert found.young_pa.low < 4000.0 < found.young_pa.high < 1.1 * found.young_pa.low
    model, best, rng = found.models["hertz"], found.best["hertz"], np.random.default_rng(1)
    for _ in range(3):
        drawn = best | {"log_noise": np.log(rng.uniform(0.005, 0.3)), "offset": rng.uniform(-1.0, 1.0)}
        drawn["log_floor"] = np.log(model.data.typical_n) - rng.uniform(0.0, 8.0)
        assert fitted(model, drawn)[1] > model.minus2(best) - 1.0
    assert line_of(found) is None


@pytest.mark.parametrize(
    "sensor", [{"slope": 5.0}, pytest.param({"slope": -5.0, "zero": 0.005, "pull": 0.004}, marks=pytest.mark.slow)]
)
def test_a_line_of_the_sensor_or_a_pull_is_doubted_where_no_rows_are_before_contact(sensor):
    found = identify(touched(1, **sensor), {"hertz": Layer(0.004, (), 0.003)}, QUICK)
    line = line_of(found)
    ends = abs(found.intervals["offset_m"].best - found.models["hertz"].offset_at(-1.0)) < 2e-5
    assert line is not None or ends or found.young_pa.low < 4000.0 < found.young_pa.high
    if line is not None:
        assert line.young_pa == pytest.approx(4000.0, rel=0.1)


def test_searches_that_do_not_agree_are_no_fit(monkeypatch):
    values = iter(range(100, 0, -2))
    monkeypatch.setattr(fit, "fitted", lambda model, start, *more: (dict(start), float(next(values))))
    model = MixedModel.of(Data.of(touched(1)), Layer(0.004, ()), QUICK)
    with pytest.raises(NotConverged, match="has not converged"):
        best_fit(model, sure=True)


def test_presses_of_no_force_are_refused():
    records = draw_presses(Layer(0.004), {"poisson": 0.45}, np.random.default_rng(0), young_pa=0.0)
    with pytest.raises(InputError, match="no forces"):
        best_fit(MixedModel.of(Data.of(records), Layer(0.004), QUICK))
