"""Paper 2's chain for a block that weighs what a CT would say: fitted springs, their rivals, and what masses change."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material, Tissue
from palpate.bodies.simple_shapes import box
from palpate.errors import InputError
from palpate.models.springs.spring_motion import simulate
from palpate.run.settings import defaults
from palpate.studies.organ_springs import organ_fit
from palpate.studies.organ_springs.organ import frequencies_hz, mass_motion, organ, references
from palpate.studies.organ_springs.settings import check

SMALL = {
    "fitted": 1,
    "tested": 2,
    "frames": 4,
    "reference_steps": 1,
    "key_points": 6,
    "fem_frames": [2],
    "shape_steps": [5],
    "shape_evaluations": 20,
    "searches": {"seeds": 2, "population": 6, "generations": 8, "cma_es_evaluations": 48, "gradient_evaluations": 12},
}


@pytest.fixture(scope="module")
def block():
    """A block of 0.1 m in two levels, twice as dense at its top as at its bottom."""
    mesh = box([0.1, 0.1, 0.1], [2, 2, 2])
    body = nest("block", mesh, 1, np.flatnonzero(mesh.nodes[:, 2] == 0.0), Material(3000.0, 0.25, 1000.0))
    return replace(body, densities=[1000.0 + 1e4 * level.nodes[:, 2] for level in body.levels])


@pytest.fixture(scope="module")
def found(block):
    return organ(block, defaults("organ_springs", **SMALL))


@pytest.fixture(scope="module")
def measured(found):
    motions = references(found)
    return motions, *organ_fit.measure(found, motions, 1, lambda method: lambda *told: None)


def test_it_moves_with_the_masses_of_the_ct(found):
    """1500 kg/m³ in the middle, exactly, as density is linear; the same forces on both levels."""
    for level in (0, 1):
        masses = found.particles(level).masses
        assert masses.sum() == pytest.approx(1.5)
        assert found.press(0, level).pattern(len(masses)).sum(axis=0) == pytest.approx(found.forces[0])
    assert np.array_equal(found.model.masses, found.particles(0).masses)
    assert found.settings.fitted == 1 and len(set(found.contacts.tolist())) == 3


def test_a_press_moves_the_body_as_far_as_asked(found, measured):
    motions, errors, _ = measured
    assert errors["peak_m"].between(0.5 * 0.05 * 0.1, 3.0 * 0.05 * 0.1).all()
    rest = found.keys.of(found.body.coarse.nodes)
    assert np.linalg.norm(motions[0][0] - rest, axis=2).max() == pytest.approx(errors["peak_m"].iloc[0])


def test_errors_are_those_of_the_motions(found, measured):
    motions, errors, _ = measured
    row = errors[(errors["model"] == "van_gelder") & ~errors["used_in_fit"]].iloc[0]
    settings = found.spring_settings(False)
    x = simulate(found.model, np.full(len(found.model.masses), 3000.0), found.press(1, 0), settings)[0]
    assert x.shape == motions[1][0].shape and settings.steps == 4 * settings.every
    assert row["rmse_m"] == pytest.approx(np.sqrt(((x - motions[1][0]) ** 2).sum(axis=2).mean()))


def test_searches_improve_where_they_are_fitted(measured):
    """The gradient and CMA-ES begin at Van Gelder's moduli; there are few generations here."""
    _, errors, history = measured
    assert list(errors["model"].unique()) == list(organ_fit.METHODS)
    ends = history.groupby("model")["fitness"].max()
    assert ends["gradient"] > ends["van_gelder"]
    assert (ends > history.groupby("model")["fitness"].first())[["genetic", "gradient"]].all()
    assert (errors["rmse_of_peak"] < 0.8).all()
    for _, run in history.groupby(["model", "seed"]):
        assert (run["fitness"].diff().dropna() >= 0.0).all()


def test_rivals_are_judged_on_the_same_presses(found, measured):
    motions, springs, _ = measured
    table = organ_fit.rivals(found, motions)
    means = table.groupby("model")["rmse_of_peak"].mean()
    assert means["coarse_fem"] < 0.5 * means["zero"] and means["shape_matching"] < means["zero"]
    rest = found.keys.of(found.body.coarse.nodes)
    nothing = np.sqrt(((motions[0][0][-1] - rest) ** 2).sum(axis=1).mean())
    assert table[table["model"] == "zero"]["rmse_m"].iloc[0] == pytest.approx(nothing)
    assert set(table["contact"]) == set(springs["contact"])


def test_heavier_nodes_swing_slower(found):
    """The frequencies of a body of even density go as 1/√density; the slowest mode moves its heavy top most."""
    own, uniform, mean = mass_motion(found).itertuples()
    assert own.total_kg == pytest.approx(1.5) and uniform.total_kg == pytest.approx(1.0)
    assert mean.total_kg == pytest.approx(own.total_kg)
    assert uniform.frequency_hz / mean.frequency_hz == pytest.approx(np.sqrt(1.5))
    assert own.frequency_hz < 0.95 * mean.frequency_hz
    assert (own.change_of_motion, own.change_of_frequency) == (0.0, 0.0)
    assert 0.0 < mean.change_of_motion < uniform.change_of_motion
    particles = found.particles(0)
    again = frequencies_hz(replace(particles, masses=4.0 * particles.masses))
    assert 2.0 * again == pytest.approx(frequencies_hz(particles))


def test_a_stiff_region_makes_its_springs_stiff(block):
    region = (block.coarse.nodes[block.coarse.tetrahedra].mean(axis=1)[:, 2] > 0.05).astype(int)
    soft = block.material
    layered = replace(block, regions=Tissue((soft, replace(soft, young_pa=30000.0)), region))
    settings = defaults("organ_springs", **SMALL)
    ratio = organ(layered, settings).model.weights / organ(block, settings).model.weights
    assert ratio.min() == pytest.approx(1.0) and ratio.max() == pytest.approx(10.0)


def test_too_many_contacts_and_no_anchors_get_one_sentence(block):
    settings = defaults("organ_springs")
    with pytest.raises(InputError, match=r"508 contacts are asked for and \d+ of block can be pressed"):
        organ(block, settings.but(tested=505))
    with pytest.raises(InputError, match="block is not held by anchors"):
        organ(replace(block, anchors=[np.empty(0, dtype=int)] * 2), settings)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"bodies": ["livre"]}, "names livre, which is no solid body; did you mean liver"),
        ({"bodies": None}, "no body is of kind ct"),
        ({"rise_s": 5.0}, "rise_s is 5 s, and motions end after duration_s, 0.4 s"),
        ({"fem_frames": [3]}, "fem_frames has 3, which does not divide frames, 20"),
    ],
)
def test_settings_that_do_not_fit_are_said(change, said):
    settings = defaults("organ_springs", **{"bodies": ["liver"]} | change)
    config = SimpleNamespace(bodies={"liver": SimpleNamespace(kind="liver")}, organ_springs=settings)
    with pytest.raises(InputError, match=said):
        check(config, Path("config.yaml"))
