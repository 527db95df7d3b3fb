"""Presses: as deep as asked, no harder than the cap, and never through an element."""

import warnings

import numpy as np
import pytest

from palpate.benchmark import presses
from palpate.benchmark.presses import (
    FORCES,
    PRESS_COLUMNS,
    SOUND,
    choose_presses,
    samples_in,
)
from palpate.benchmark.static_responses import press
from palpate.bodies.contacts import kept_contacts, sampled_contacts
from palpate.errors import InputError, NotConverged

PRESSES = [{"magnitude": 1.0, "tilt_degrees": 0}, {"magnitude": 0.6, "tilt_degrees": 45}]
RADIUS = 0.01


def choose(body, regime, count=3, presses=PRESSES, radius=RADIUS, seed=1):
    return choose_presses(body, count, presses, regime, radius, seed)


@pytest.fixture(scope="module")
def small(beam):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return choose(beam, {"peak_of_size": 0.04})


def pressures(table, body, radius=RADIUS):
    newtons = np.linalg.norm(table[FORCES], axis=1)
    return 2 * newtons / (np.pi * radius**2) / body.material.young_pa


def test_every_press_at_every_contact(beam, small):
    assert list(small.columns) == PRESS_COLUMNS
    assert small["sample"].tolist() == list(range(6))
    assert small["contact"].tolist() == np.repeat(sampled_contacts(beam, 3, 1), 2).tolist()
    assert small["magnitude"].tolist() == [1.0, 0.6] * 3 and small["tilt_degrees"].tolist() == [0, 45] * 3
    assert set(small["radius_m"]) == {RADIUS} and set(small["capped"]) == {"no"}


def test_forces_are_tilted_as_asked_and_the_seed_turns_them(beam, small):
    for sample, tilt in zip(samples_in(small), small["tilt_degrees"], strict=True):
        contact, force = sample.load.single()
        for order in (1, 2):
            assert sample.nodal(beam, 0, order).sum(axis=0) == pytest.approx(force, rel=1e-12)
        cosine = -force @ beam.fine.normals[contact] / np.linalg.norm(force)
        assert cosine == pytest.approx(np.cos(np.radians(tilt)), abs=1e-12)
    assert choose(beam, {"peak_of_size": 0.04}).equals(small)
    other = choose(beam, {"peak_of_size": 0.04, "pressure_of_young": 1.0}, seed=2)
    spread = kept_contacts(beam, 2)  # the third contact is drawn, by another seed elsewhere
    both = [table[np.isin(table["contact"], spread)] for table in (small, other)]
    ways = [table[["force_x_n", "force_y_n", "force_z_n"]].to_numpy() for table in both]
    first, second = (way / np.linalg.norm(way, axis=1, keepdims=True) for way in ways)
    assert (np.abs(first - second).max(axis=1) > 0.01).tolist() == [False, True] * 2


def test_the_body_moves_as_deep_as_asked(beam, small):
    """By another way than the search: each load by itself, to a tight tolerance, as the table says and as asked."""
    found = press(beam, 0, small, 1e-8, order=2)
    peaks = np.linalg.norm(found.displacement, axis=2).max(axis=1) / beam.fine.size
    assert (small["peak_of_size"] / (0.04 * small["magnitude"])).to_numpy() == pytest.approx(np.ones(6), abs=0.05)
    # the peak may be at a midpoint, which is not a node of level 0
    assert peaks == pytest.approx(small["peak_of_size"].to_numpy(), rel=0.05)
    assert found.least_det == pytest.approx(small["least_det"].to_numpy(), rel=1e-3)
    assert small["pressure_of_young"].to_numpy() == pytest.approx(pressures(small, beam), rel=1e-12)


def test_without_a_peak_the_pressure_is_the_magnitudes(beam):
    table = choose(beam, {"pressure_of_young": 0.02}, count=2)
    assert pressures(table, beam) == pytest.approx([0.02, 0.012] * 2, rel=1e-12)
    assert set(table["capped"]) == {"no"}


def test_a_slender_body_is_not_bent_beyond_its_size(beam):
    """Across its axis, far from the clamp, the pressure would bend it by half of its length and more."""
    with pytest.warns(UserWarning, match=r"^bodies\.beam: .. of 16 presses are lowered, .* than 0\.15 of its size"):
        table = choose(beam, {"pressure_of_young": 0.25}, count=8)
    far = table["contact"] == 197
    assert table["capped"][far].tolist() == ["peak", "peak"]
    assert (table["peak_of_size"] / table["magnitude"])[far].to_numpy() == pytest.approx([0.15, 0.15], rel=0.05)
    assert pressures(table, beam).max() <= 0.25 * (1 + 1e-12)


def test_the_pressure_is_capped_and_that_is_said(beam):
    with pytest.warns(
        UserWarning, match=r"^bodies\.beam: 2 of 4 presses are lowered, .* a peak pressure of 0\.25 of Young"
    ):
        table = choose(beam, {"peak_of_size": 0.03}, count=2, radius=0.004)
    capped = table["capped"] == "pressure"
    assert capped.sum() == 2 and pressures(table, beam, 0.004).max() <= 0.25 * (1 + 1e-12)
    assert (table["peak_of_size"] < 0.03 * table["magnitude"] * 0.95)[capped].all()


def test_no_element_is_turned_inside_out(beam):
    """At the pressure asked it would be, as the press itself shows."""
    hard = {"pressure_of_young": 2.0}
    with pytest.warns(UserWarning, match=r"^bodies\.beam: . of 2 presses are lowered, as they would (turn|press) an"):
        table = choose(beam, hard, count=2, presses=PRESSES[:1])
    lowered = table["capped"].isin(["inverted", "squeezed"])
    assert lowered.any() and (table["least_det"] >= SOUND).all()
    harder = table[lowered].copy()
    harder[["force_x_n", "force_y_n", "force_z_n"]] *= 2.4
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert press(beam, 0, harder, 1e-6, order=2).least_det.max() < SOUND


class Snapping:
    """A search in a body that moves in proportion to the force, from 1 N on by half as much again, or not at all."""

    def __init__(self, monkeypatch, beyond):
        self.tried = []
        monkeypatch.setattr(presses.PressSearch, "_press", lambda _, load, newtons, low: self(newtons, beyond))

    def __call__(self, newtons, beyond):
        self.tried.append(newtons)
        still = np.zeros((1, 3))
        if newtons >= 1.0 and not beyond:
            return presses.Trial(newtons, still, np.inf, -np.inf, "unstable")
        return presses.Trial(newtons, still, newtons * (beyond if newtons >= 1.0 else 1.0), 0.9)


@pytest.mark.parametrize("beyond", [1.5, None])
def test_a_press_ends_below_a_limit_of_stability(beam, monkeypatch, beyond):
    law = Snapping(monkeypatch, beyond)
    search = presses.PressSearch(beam, {"peak_of_size": 1.2 / beam.fine.size, "pressure_of_young": 1e6}, RADIUS)
    search._linear = lambda unit: np.array([[1.0, 0.0, 0.0]])
    contact = int(kept_contacts(beam, 1)[0])
    found, why = search.find(contact, -beam.fine.normals[contact], 1.0)
    assert why == "unstable" and 0.5 < found.newtons <= 0.6
    assert len(law.tried) <= presses.TRIES


class Fragile:
    """A search on a body that breaks at 0.4 N, where gentler presses in other directions would find 0.9 N."""

    def find(self, contact, direction, magnitude, bound=np.inf, why=""):
        newtons, cause = (0.4, "squeezed") if magnitude == 1.0 else (0.9, "peak")
        newtons, cause = min((newtons, cause), (bound, why))
        return presses.Trial(newtons, direction, newtons, 0.7), cause


def test_a_gentler_press_has_no_more_than_its_share_of_one_that_had_to_be_lowered():
    magnitudes = [0.6, 1.0, 0.8, 1.0]
    found = presses._in_order(Fragile(), 3, [np.zeros(3)] * 4, magnitudes)
    assert [press.newtons for press, _ in found] == pytest.approx([0.24, 0.4, 0.32, 0.4])
    assert [why for _, why in found] == ["squeezed"] * 4
    sound = presses._in_order(Fragile(), 3, [np.zeros(3)] * 2, [0.8, 0.6])  # "peak" lowers that press alone
    assert [press.newtons for press, _ in sound] == [0.9, 0.9]


@pytest.mark.parametrize("regime", [{"peak_of_size": 0.5}, {}])
def test_a_bound_ends_a_press_with_its_reason(beam, monkeypatch, regime):
    law = Snapping(monkeypatch, None)
    search = presses.PressSearch(beam, regime | {"pressure_of_young": 1e6}, RADIUS)
    search._linear = lambda unit: np.array([[1.0, 0.0, 0.0]])
    contact = int(kept_contacts(beam, 1)[0])
    wanted = 0.8 * search._peak
    found, why = search.find(contact, -beam.fine.normals[contact], 0.8, 0.5 * wanted, "squeezed")
    assert (found.newtons, why) == (0.5 * wanted, "squeezed") and max(law.tried) <= 0.5 * wanted


def test_where_every_press_fails_it_is_said(beam, monkeypatch):
    monkeypatch.setattr(
        presses.PressSearch, "_press", lambda _, load, newtons, low: presses.Trial(newtons, load, 1, -1, "inverted")
    )
    with pytest.raises(NotConverged, match=r"^beam, contact \d+: no press was found .* radius_m\.$"):
        choose(beam, {"peak_of_size": 0.02}, count=1)


def test_what_cannot_be_is_refused(beam):
    with pytest.raises(InputError, match=r"^bodies\.beam: radius_m is 0, and a press needs a disc; .*\.$"):
        choose(beam, {"peak_of_size": 0.02}, radius=0.0)
    inch = r"^bodies\.beam: radius_m is 12, and the body's longest side is 0\.. m; .* half .* 0\.012 for millimetres "
    with pytest.raises(InputError, match=inch):
        choose(beam, {"peak_of_size": 0.02}, radius=12)
    with pytest.raises(InputError, match=r"^bodies\.beam: 500 contacts are asked for and \d+ can be pressed; .*\.$"):
        choose(beam, {"peak_of_size": 0.02}, count=500)
