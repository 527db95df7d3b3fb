"""Load cases: as many as asked, where the body can be pressed, as deep as asked."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.benchmark import presses
from palpate.benchmark.presses import LOAD_COLUMNS, choose_loads, force_of
from palpate.benchmark.static_responses import press
from palpate.errors import InputError
from palpate.solvers.compliance import compute_compliance

MAGNITUDES = [0.5, 1.0]


@pytest.fixture(scope="module")
def choose(slab, slab_compliance):
    def loads(count=8, peak=0.05, magnitudes=MAGNITUDES, seed=1, radius=0.0):
        return choose_loads(slab, slab_compliance, magnitudes, peak, radius, count, seed)

    return loads


def test_as_many_as_asked_and_contact_by_contact(choose):
    loads = choose()
    assert list(loads.columns) == LOAD_COLUMNS
    assert loads["sample"].tolist() == list(range(8))
    contacts = loads["contact"].to_numpy().reshape(-1, len(MAGNITUDES))
    assert (contacts == contacts[:, :1]).all() and len(np.unique(contacts)) == 4
    assert set(choose(radius=0.02)["radius_m"]) == {0.02}


def test_the_seed_decides(choose):
    assert choose(seed=1).equals(choose(seed=1))
    assert choose(seed=1)["contact"].tolist() != choose(seed=2)["contact"].tolist()


def test_contacts_can_be_pressed_and_are_pressed_inward(slab, slab_compliance, choose):
    beside = {n for element in slab.coarse.tetrahedra if np.isin(element, slab.anchors[0]).any() for n in element}
    able = [n for n in slab_compliance.contacts if n not in beside]
    loads = choose(count=len(able), magnitudes=[1.0])
    assert sorted(loads["contact"]) == able
    for _, load in loads.iterrows():
        force, normal = force_of(load), slab.fine.normals[int(load["contact"])]
        assert force @ normal == pytest.approx(-np.linalg.norm(force), rel=1e-12)


@pytest.mark.parametrize("peak", [0.02, 0.15])
def test_peaks_are_as_deep_as_asked(slab, slab_compliance, choose, peak):
    """On the coarse mesh, corrected by how much softer the fine one is for small loads; and on the fine, nearly."""
    loads = choose(peak=peak)
    wanted = peak * slab.fine.size * np.tile(MAGNITUDES, 4)
    reached = [np.linalg.norm(press(slab, k, loads, 1e-6).displacement, axis=2).max(axis=1) for k in (0, 1)]
    softer = []
    for _, load in loads.iterrows():
        row = slab_compliance.row(int(load["contact"]))
        linear = [np.tensordot(force_of(load), c[row], 1) for c in (slab_compliance.fine, slab_compliance.coarse)]
        fine, coarse = (np.linalg.norm(u, axis=1).max() for u in linear)
        softer.append(fine / coarse)
    assert np.min(softer) > 1.0
    assert np.abs(reached[0] * softer / wanted - 1.0).max() < 0.025
    assert np.abs(reached[1] / wanted - 1.0).max() < (0.1 if peak < 0.1 else 0.35)


def test_samples_lie_among_the_contacts_that_are_prepared(slab):
    compliance = compute_compliance(slab, 0.0, contacts=6)
    loads = choose_loads(slab, compliance, MAGNITUDES, 0.05, 0.0, 12, 1)
    assert sorted(loads["contact"].unique()) == compliance.contacts.tolist()
    with pytest.raises(InputError, match=r"^bodies\.slab: 7 contacts are asked for and 6 can be pressed; .* contacts"):
        choose_loads(slab, compliance, MAGNITUDES, 0.05, 0.0, 14, 1)


def test_counts_that_cannot_be_are_refused(choose):
    with pytest.raises(InputError, match=r"^bodies\.slab: train \+ test is 7, which 2 magnitudes do not divide; .*\.$"):
        choose(count=7)
    with pytest.raises(InputError, match=r"^bodies\.slab: 500 contacts are asked for and \d+ can be pressed; .*\.$"):
        choose(count=1000)


class Stiffening:
    """A body that moves by what it is pressed with, but at most by 0.61 m."""

    mesh = SimpleNamespace(nodes=np.zeros((1, 3)))

    def solve(self, forces, tolerance):
        return SimpleNamespace(x=np.minimum(forces, 0.61))


def test_a_peak_that_is_not_reached_is_warned_of_with_its_share(choose, monkeypatch):
    unit = np.array([[1.0, 0.0, 0.0]])
    assert presses._force_for(Stiffening(), unit, 0.5, 0.2) == (0.5, 1.0)
    assert presses._force_for(Stiffening(), unit, 1.0, 1.0)[1] == 0.61
    shares = iter([1.0, 0.61, 0.99, 0.75])
    monkeypatch.setattr(presses, "_force_for", lambda *_: (1.0, next(shares)))
    with pytest.warns(UserWarning, match=r"^bodies\.slab: 2 of 4 loads do not .*, but by 61 % to 75 % of it"):
        choose(count=4)


def test_forces_that_are_found_are_not_warned_of(choose):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        choose(peak=0.15)
