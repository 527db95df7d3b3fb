"""Tables of spring parameters: each method is evaluated correctly, and none is below the floor."""

from pathlib import Path

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.models.springs import cube_experiment as experiment
from palpate.models.springs.searches import SEEDED
from palpate.models.springs.spring_motion import simulate
from palpate.run.settings import read_settings
from palpate.studies.springs import spring_fit
from palpate.studies.springs.settings import Settings

SMOKE = Settings(**read_settings(Path(__file__).parents[2] / "smoke/config.yaml")["springs"])
YOUNG_PA = 900.0


@pytest.fixture(scope="module")
def found():
    return experiment.experiment(SMOKE, 0.3)


@pytest.fixture(scope="module")
def own(found):
    """Motions that springs of one modulus make: a fit that finds them is right everywhere."""
    young = np.full(120, YOUNG_PA)
    return {name: simulate(found.model, young, press, found.settings) for name, press in found.presses.items()}


@pytest.fixture(scope="module")
def references(found):
    return experiment.simulate_references(found, 1)


def made(found, references, method, volume_force, seeds=(1,)):
    return spring_fit.tables(found, method, volume_force, references, SMOKE.searches, seeds, lambda *told: None)


def test_one_modulus_is_found_where_one_was_used(found, own):
    tables = made(found, own, "uniform", False)
    fit = tables["spring_fit"]
    assert list(fit["press"]) == ["top", "left", "front"] and list(fit["used_in_fit"]) == [True, False, False]
    assert fit["rmse_of_peak"].max() < 1e-3
    assert (len(tables["spring_history"]), len(tables["spring_errors"])) == (1, 3 * found.settings.steps)


def test_errors_are_those_of_the_motions(found, references):
    """Van Gelder's springs, compared by hand."""
    tables = made(found, references, "van_gelder", False)
    young = np.full(120, SMOKE.material.young_pa)
    for row in tables["spring_fit"].itertuples():
        positions, velocities = references[row.press]
        x, v = simulate(found.model, young, found.presses[row.press], found.settings)
        assert row.rmse_m == pytest.approx(np.sqrt(np.mean(np.linalg.norm(x - positions, axis=2) ** 2)))
        assert row.max_z_m == pytest.approx(np.abs(x - positions)[:, :, 2].max())
        error = np.linalg.norm(x - positions, axis=2).sum() + 0.0025 * np.linalg.norm(v - velocities, axis=2).sum()
        assert row.fitness == pytest.approx(-error)
        steps = tables["spring_errors"].query("press == @row.press")
        assert list(steps["step"]) == list(range(1, found.settings.steps + 1))
        error, zero = x - positions, found.settings.keys.of(found.model.nodes) - positions
        farthest = np.linalg.norm(zero, axis=2).max(axis=0).argmax()
        assert steps[["error_x_m", "error_y_m", "error_z_m"]].to_numpy() == pytest.approx(error[:, farthest])
        assert steps["most_m"].max() == pytest.approx(max(row.max_x_m, row.max_y_m, row.max_z_m))
        assert steps["zero_m"].to_numpy() == pytest.approx(np.abs(zero).max(axis=(1, 2)))


def test_the_gradient_beats_what_needs_no_search_and_more_presses_make_it_better(found, references):
    methods = ("uniform", "lloyd", "gradient", "gradient_all")
    fits = {method: made(found, references, method, False)["spring_fit"] for method in methods}
    top = {method: fit["fitness"][0] for method, fit in fits.items()}
    assert top["gradient"] > max(top["uniform"], top["lloyd"])
    assert fits["gradient_all"]["used_in_fit"].all()
    assert fits["gradient_all"]["fitness"].sum() > fits["gradient"]["fitness"].sum()


def test_searches_have_a_history_a_seed(found, references):
    for method in SEEDED:
        tables = made(found, references, method, True, (1, 2))
        history, fit = tables["spring_history"], tables["spring_fit"]
        assert sorted(history["seed"].unique()) == [1, 2]
        for seed, run in history.groupby("seed"):
            assert (run["fitness"].diff().dropna() >= 0).all()
            end = fit[(fit["seed"] == seed) & (fit["press"] == "top")].iloc[0]
            assert end["fitness"] == pytest.approx(run["fitness"].iloc[-1])
            assert end["generations"] == run["generation"].iloc[-1] and end["seconds"] == run["seconds"].iloc[-1]
        assert fit["volume_n_m"].min() > 0.0


@pytest.mark.slow
def test_the_floor_is_below_what_one_press_teaches(found, references):
    stiffest = experiment.experiment(SMOKE, spring_fit.INCOMPRESSIBLE).volume_n_m()
    floor = spring_fit.measure(found, references, stiffest, 40)
    assert list(floor["volume_force"]) == 3 * [False] + 3 * [True]
    assert floor["volume_n_m"].between(0.0, stiffest).all()
    alone, tied = floor.groupby("volume_force")["fitness"].sum()
    assert tied > alone * (1 + 1e-3)
    one = made(found, references, "gradient", False)["spring_fit"]
    assert floor.query("not volume_force")["fitness"].sum() > one["fitness"].sum()


def test_a_step_that_is_too_long_is_refused():
    with pytest.raises(InputError, match=r"springs\.step_s is 0\.01 s, and springs of 3000 Pa are stable up to"):
        experiment.experiment(SMOKE.but(step_s=0.01), 0.3)
