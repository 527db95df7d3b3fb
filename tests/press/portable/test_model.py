"""What a portable model answers: small loads, continuity, energies, doubts, and two discs at once."""

import numpy as np
import pytest
from press.portable.conftest import press_near

from palpate.press.portable.runtimes.palpate_model import (
    APART,
    MOST_MISSED,
    RESIDUAL_TOLERANCE,
    _energies,
    settle,
    undeformed,
)


def test_energy_and_gradient_are_those_of_the_corotational_law(made_up, model):
    """Against rotations found by singular value decompositions, and finite differences of the energy."""
    contact, rng = model.contacts[0], np.random.default_rng(1)
    for size in (1e-3, 0.3, 0.8):
        q = size * rng.normal(size=6)
        (energy, gradient, least) = _energies([contact], [q])[0]
        f = (contact.slopes @ q).reshape(9, -1).T.reshape(-1, 3, 3) + np.eye(3)
        expected = 0.5 * q @ contact.rest @ q
        for one, volume, mu, lam in zip(f, contact.volumes, contact.mu, contact.lam, strict=True):
            stretches = np.linalg.svd(one, compute_uv=False)
            stretches[2] *= np.sign(np.linalg.det(one))
            expected += volume * (mu * ((stretches - 1.0) ** 2).sum() + 0.5 * lam * (stretches.sum() - 3.0) ** 2)
        assert energy == pytest.approx(expected, rel=1e-9, abs=1e-12)
        assert least == pytest.approx(np.linalg.det(f).min(), rel=1e-9)
        for k in range(6):
            step = 1e-6 * np.eye(6)[k]
            ahead, back = _energies([contact, contact], [q + step, q - step])
            slope = (ahead[0] - back[0]) / 2e-6
            assert gradient[k] == pytest.approx(slope, rel=1e-5, abs=1e-7)


def test_coordinates_are_those_of_the_reduced_contact(made_up, model):
    for contact, reduced in zip(model.contacts, made_up.contacts, strict=True):
        force = np.array([0.05, -0.02, -0.3])
        load = contact.loads @ force
        (found,) = settle([contact], [load], [undeformed(contact)], RESIDUAL_TOLERANCE)
        expected = reduced.settle(force, 1e-8)
        assert np.linalg.norm(load - found.pull) <= RESIDUAL_TOLERANCE * np.linalg.norm(load)
        assert found.least == pytest.approx(expected.least_det, rel=1e-3)
        assert found.q == pytest.approx(expected.q, abs=2e-4 * np.abs(expected.q).max())


def test_small_presses_are_answered_in_proportion(model):
    press = {"triangle": 3, "weights": [0.2, 0.5, 0.3], "force": [1e-5, 2e-5, -1e-4]}
    once = model.respond([press]).displacement
    half = model.respond([press | {"force": [5e-6, 1e-5, -5e-5]}]).displacement
    assert np.abs(once - 2.0 * half).max() < 2e-3 * np.abs(once).max()


def test_a_sliding_finger_meets_no_jump(model):
    """Halving the steps along a line over a triangle's edge halves the largest change between two answers."""
    press = {"force": [0.02, 0.01, -0.2]}
    shared = next(
        (a, b)
        for a in range(len(model.triangles))
        for b in range(len(model.triangles))
        if a != b
        and len(np.intersect1d(model.triangles[a], model.triangles[b])) == 2
        and abs(model._facing[a] @ model._facing[b]) > 0.99
    )

    def changes(count):
        answers = []
        for triangle, way in zip(shared, (1, -1), strict=True):
            ends = model.triangles[triangle]
            alone = ~np.isin(ends, model.triangles[shared[1] if way == 1 else shared[0]])
            for part in np.linspace(0.0, 1.0, count)[::way]:
                weights = np.where(alone, 1.0 - part, 0.5 * part)
                answers.append(model.respond([press | {"triangle": triangle, "weights": weights}]).displacement)
        return max(np.abs(one - two).max() for one, two in zip(answers[1:], answers, strict=False))

    assert changes(17) < 0.65 * changes(9)


def test_a_disc_is_moved_as_far_as_it_is_pushed(model):
    press = {"triangle": 5, "weights": [0.3, 0.3, 0.4]}
    forced = model.respond([press | {"force": [0.01, 0.02, -0.1]}])
    place = model._place(press)
    linear, bent, _ = model._parts_of([place], forced.forces, [rest for _, rest in forced.rest[0]])
    moved = place.disc @ (linear + bent[0].more)
    found = model.respond([press | {"moved": moved}])
    assert found.forces == pytest.approx(forced.forces, rel=1e-4)


def test_too_hard_a_press_is_doubted_in_words(model):
    node = int(np.argmin(np.linalg.norm(model.nodes - model.contacts[0].place, axis=1)))
    press = model.press_at(node, -0.001 * model.contacts[0].normal)
    gentle = model.respond([press])
    hard = model.respond([press | {"force": (-80.0 * model.contacts[0].normal).tolist()}])
    assert gentle.doubt == "" and hard.doubt != ""
    assert np.isfinite(hard.displacement).all() and 0.0 < gentle.error < hard.error <= 1.0


def test_what_is_no_press_is_refused_in_words(model):
    press = model.press_at(0, np.array([0.0, 0.0, -1e-3]))
    both = press | {"moved": [0.0, 0.0, -1e-3]}
    for presses, why in ((17 * [press], "more than 16"), ([both], "and not both"), ([None], "list of dictionaries")):
        with pytest.raises(ValueError, match=why):
            model.respond(presses)
    for wrong in ({"triangle": 10**6}, {"weights": [2, 0, 0]}, {"weights": [1, 0]}, {"force": [0, 0, np.nan]}):
        with pytest.raises(ValueError, match="press"):
            model.respond([press | wrong])


@pytest.mark.slow
def test_an_answer_that_starts_from_an_earlier_one_is_the_same(cold, warm):
    """As close as runtimes are to each other."""
    compared = 0
    for one, other in zip(cold, warm, strict=True):
        if one.doubt:
            continue
        compared += 1
        peak = np.linalg.norm(one.displacement, axis=1).max()
        assert np.abs(other.displacement - one.displacement).max() <= 1e-5 * peak
        assert other.forces == pytest.approx(one.forces, abs=1e-5 * np.abs(one.forces).max())
        assert other.error == pytest.approx(one.error, rel=1e-4) and other.doubt == ""
    assert compared >= 20


@pytest.fixture(scope="module")
def top(exported):
    """A point in the middle of the slab's top, and a depth of 1 % of its size."""
    low, high = exported.nodes.min(axis=0), exported.nodes.max(axis=0)
    return np.array([*(0.5 * (low + high))[:2], high[2]]), 0.01 * float((high - low).max())


def is_answer(answer):
    """Whether nothing is doubted but the distance to the few contacts of this file."""
    return answer.doubt == "" or answer.doubt.startswith(APART)


def reached(model, presses, answer):
    """How far the discs of presses were moved [m], (k, 3)."""
    places = [model._place(press) for press in presses]
    linear, bent, _ = model._parts_of(places, answer.forces, [rest for each in answer.rest for _, rest in each])
    return np.array([place.disc @ (linear + sum(each.more for each in bent)) for place in places])


@pytest.mark.slow
def test_two_discs_at_one_place_share_the_force_of_one(exported, top):
    press = press_near(exported, *top)
    one, two = exported.respond([press]), exported.respond([press, press])
    assert is_answer(one) and is_answer(two)
    assert two.forces[0] == pytest.approx(two.forces[1], rel=1e-6)
    total = two.forces.sum(axis=0)
    assert np.linalg.norm(total - one.forces[0]) < 0.05 * np.linalg.norm(one.forces)
    assert reached(exported, [press, press], two) == pytest.approx(np.array([press["moved"]] * 2), abs=1e-5 * top[1])


@pytest.mark.slow
@pytest.mark.parametrize("radii", [0.25, 0.5, 1.0, 2.0])
def test_discs_that_are_near_are_moved_as_far_as_they_are_pushed(exported, top, radii):
    point, depth = top
    beside = point + radii * exported.radius_m * np.array([1.0, 0.0, 0.0])
    presses = [press_near(exported, each, depth) for each in (point, beside)]
    answer = exported.respond(presses)  # nearer than a radius they share the force, and miss a little of their way
    missed = np.linalg.norm(reached(exported, presses, answer) - [press["moved"] for press in presses])
    peak = np.linalg.norm(answer.displacement, axis=1).max()
    assert is_answer(answer) and missed <= MOST_MISSED * np.sqrt(2.0) * depth
    assert answer.error >= missed / peak
    assert (answer.forces[:, 2] < 0.0).all() if radii < 1.0 else missed < 1e-5 * depth
