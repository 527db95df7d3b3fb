"""Modes move as the limit of quadratic elements does: exactly with all of them, and nearly with the few of a place."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.poked_bar import poked
from scipy.linalg import eigh

from palpate.benchmark.motion_truth import motion_truth
from palpate.bodies.body import nest
from palpate.bodies.material import NAMED, Material
from palpate.effects.settings import Load, Loads, Rayleigh
from palpate.errors import InputError, NotConverged
from palpate.models import reduced_body, reduced_motion
from palpate.models.reduced import basis, cubature
from palpate.models.reduced.basis import bending_loads, vibrations
from palpate.models.reduced.cubature import points_and_means
from palpate.models.reduced.energy import ReducedEnergy
from palpate.models.reduced_body import BodyAtRest, Modes, ReducedBody, limit_modes
from palpate.models.reduced_motion import CubatureEnergy, ReducedMotion, misses, move, prepare
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.dynamic.estimates import estimate_in_modes

UNDAMPED = Rayleigh(mass_1_s=0.0, stiffness_s=0.0)
FALLING = Loads(gravity={"acceleration_m_s2": [0.0, 0.0, -3.0]})
OTHER = {"at_m": [0.025, 0.04, 0.02], "force_n": [0.0, -0.2, 0.0], "normal": [0.0, 1.0, 0.0]}
MISSED = 0.02


@pytest.fixture(scope="module")
def pressed(box):
    return poked(box)


@pytest.fixture(scope="module")
def truth(pressed):
    acts = pressed.body, pressed.placed_loads(), pressed.rayleigh, pressed.duration_s
    return motion_truth(*acts, pressed.frames, 4 * pressed.frames)


@pytest.fixture(scope="module")
def rest(pressed):
    return BodyAtRest(pressed.body, 10)


@pytest.fixture(scope="module")
def reduced(pressed, rest):
    return prepare(rest, pressed.placed_loads(), pressed.rayleigh, 3, MISSED)


def cube(box, law: str = "corotational", poisson: float = 0.3, held: bool = True):
    mesh = box([1, 1, 1], [0.1, 0.1, 0.1])
    anchors = np.flatnonzero(mesh.nodes[:, 2] == 0.0) if held else np.empty(0, dtype=int)
    return nest("cube", mesh, 0, anchors, Material(5000.0, poisson, 1000.0, law))


def whole(rest: BodyAtRest) -> ReducedBody:
    """All unknowns of the elements as modes, and all their points as cells."""
    elements, motion = rest.elements, rest.motion
    free = np.repeat(~motion.held, 3)
    n = len(free)
    stiffness = elements.multiply(np.eye(n).reshape(-1, 3, n)).reshape(n, n)[np.ix_(free, free)]
    masses, vectors = eigh(np.kron(motion.masses.toarray(), np.eye(3))[np.ix_(free, free)], stiffness)
    flat = np.zeros((n, len(masses)))
    flat[free] = vectors
    shape = flat.reshape(-1, 3, len(masses))
    points = points_and_means(elements, shape, np.ones(len(elements.couples), dtype=bool))
    model = ReducedEnergy(points, np.zeros((len(masses), 1)), elements.law)
    return ReducedBody(rest, Modes(shape, shape, shape, masses), model, 0.0, 0.0)


def wrong(moved: np.ndarray, truth) -> float:
    """RMSE over the peak."""
    off = np.sqrt(np.mean(np.sum((moved - truth.displacement) ** 2, axis=2)))
    return float(off / np.linalg.norm(truth.displacement, axis=2).max())


def asked(body: ReducedBody, compared, steps: int) -> tuple:
    """A motion, and what it says of itself, over the peak."""
    motion = ReducedMotion(body, compared.placed_loads(), compared.rayleigh)
    found = move(motion, compared.duration_s, compared.frames, steps)
    return found, estimate_in_modes(compared, motion, found).estimate_of_peak


def test_vibrations_are_those_of_the_dense_problem(box):
    motion = BodyAtRest(cube(box), 3).motion
    free, matrix = np.repeat(~motion.held, 3), motion.linear_stiffness(motion.rest).toarray()
    dense, masses = matrix[np.ix_(free, free)], np.repeat(motion.lumped, 3)[free]
    squares = np.linalg.eigvalsh(dense / np.sqrt(np.outer(masses, masses)))

    def solve(force):
        moved = np.zeros(free.size)
        moved[free] = np.linalg.solve(dense, force.ravel()[free])
        return moved.reshape(-1, 3)

    modes, frequencies = vibrations(solve, motion.lumped, ~motion.held, 5)
    assert frequencies**2 == pytest.approx(squares[:5], rel=1e-8)
    flat = modes.reshape(5, -1)
    assert flat @ (np.repeat(motion.lumped, 3)[:, None] * flat.T) == pytest.approx(np.eye(5), abs=1e-8)
    with pytest.raises(InputError, match="free coordinates"):
        vibrations(solve, motion.lumped, ~motion.held, int((~motion.held).sum()) * 3)


def test_bends_are_what_a_static_answer_lacks_to_second_order(pressed, rest):
    load = rest.spread(reduced_motion.disc(pressed.placed_loads().pushes[0]))[:, :, 2]
    linear = rest.elements.solve(load[:, :, None], 1e-10)
    second = rest.elements.solve(bending_loads(rest.elements, linear), 1e-8)[:, :, 0]
    size = basis.BEND_STEP * rest.elements.size / np.linalg.norm(linear, axis=1).max()
    equilibrium = Equilibrium(reduced_body.with_midpoints(pressed.body, 1), 1, order=2)
    there, back = (equilibrium.solve(s * size * load, 1e-11).x - rest.elements.rest for s in (1.0, -1.0))
    assert np.linalg.norm(second - (there + back)) < 0.02 * np.linalg.norm(second)


def test_a_linear_answer_in_modes_is_the_limit_of_the_levels(pressed, rest):
    load = rest.spread(reduced_motion.disc(pressed.placed_loads().pushes[0]))
    modes = limit_modes(rest, [load], 3)
    answers, changes = rest.answers(load[:, :, 2:])
    q = np.tensordot(modes.limit, load[:, :, 2], ((0, 1), (0, 1)))
    limit = answers + rest.gain * changes
    off = modes.limit @ q - limit[:, :, 0]
    assert np.linalg.norm(off) < 0.03 * np.linalg.norm(changes) and 1.5 < 1.0 + 1.0 / rest.gain < 8.0


@pytest.mark.parametrize("weak", [1e-9, 1e-13])
def test_stiffness_is_positive_and_that_of_the_slopes_however_weak_the_modes_that_are_kept(
    weak, pressed, rest, monkeypatch
):
    monkeypatch.setattr(basis, "DEPENDENT", weak)
    load = rest.spread(reduced_motion.disc(pressed.placed_loads().pushes[0]))
    modes = limit_modes(rest, [load], 3)
    flat = modes.slopes.reshape(-1, len(modes.masses))
    stiffness = flat.T @ rest.elements.multiply(modes.slopes).reshape(flat.shape)
    assert np.abs(np.linalg.eigvalsh(stiffness) - 1.0).max() < 0.02
    assert (modes.masses > 0.0).all()


@pytest.mark.parametrize("law", NAMED)
def test_all_points_as_cells_have_the_energy_the_forces_and_the_clamped_hessian_of_the_elements(law, box):
    rest = BodyAtRest(cube(box, law), 3)
    body, motion = whole(rest), rest.motion
    r, flat = len(body.modes.masses), body.modes.own.reshape(-1, len(body.modes.masses))
    q = np.random.default_rng(0).normal(size=(r, 1)) * np.sqrt(body.modes.masses)[:, None]
    q *= 0.05 * motion.mesh.size / np.abs(flat @ q).max()
    x, points = motion.rest + (flat @ q).reshape(-1, 3), CubatureEnergy(body.model)
    motion.load = np.zeros_like(x)
    assert points.energy(q) == pytest.approx(motion.energy(x), rel=1e-8)
    force = flat.T @ motion.force(x).ravel()
    assert points.force(q)[:, 0] == pytest.approx(force, abs=1e-6 * np.abs(force).max())
    tangent = motion._tangent(x, True)
    few = flat[:, -5:]
    dense = flat.T @ np.array([tangent(each.reshape(-1, 3)).ravel() for each in few.T]).T
    assert points.clamped(q)[:, -5:] == pytest.approx(dense, abs=1e-6 * np.abs(dense).max())
    assert points.least_det(q) == pytest.approx(motion.least_det(x))


def test_all_modes_move_as_the_elements_do(box):
    rest, falling = BodyAtRest(cube(box), 3), Loads(gravity={"acceleration_m_s2": [3.0, 0.0, -5.0]})
    body, rayleigh = whole(rest), Rayleigh(mass_1_s=2.0, stiffness_s=0.01)
    reduced = ReducedMotion(body, falling, rayleigh)
    elements = type(rest.motion)(reduced_body.with_midpoints(rest.body, 1), 1, falling, rayleigh)
    few, all_of = (list(each.steps(0.02, 6, 1e-8)) for each in (reduced, elements))
    moved = np.array([body.modes.own @ each.x[:, 0] for each in few])
    expected = np.array([each.x - elements.rest for each in all_of])
    assert np.abs(moved - expected).max() < 1e-6 * np.abs(expected).max()
    assert sum(each.lost_j for each in few) == pytest.approx(sum(each.lost_j for each in all_of), rel=1e-6)
    assert few[-1].work_j == pytest.approx(all_of[-1].work_j, rel=1e-6)


def test_a_load_that_modes_were_not_told_of_is_missed_as_it_moves_the_body(box, monkeypatch):
    """Elements feel 5 % more of a push that grows all the time: what is missed is what that adds to the motion."""
    monkeypatch.setattr(reduced_motion, "MISSED_RESIDUAL", 1e-8)
    monkeypatch.setattr(reduced_motion, "TOLERANCE", 1e-8)
    body, rayleigh = whole(BodyAtRest(cube(box), 3)), Rayleigh(mass_1_s=5.0, stiffness_s=0.02)
    course = {"press_s": 0.4, "hold_s": 1.0, "release_s": 0.0}
    push = Load(at_m=[0.05, 0.05, 0.1], normal=[0, 0, 1], radius_m=0.04, force_n=[0.3, 0.0, -0.5], **course)
    more = push.but(force_n=[1.05 * newtons for newtons in push.force_n])
    motion, other = (ReducedMotion(body, Loads(push={"loads": [each]}), rayleigh) for each in (push, more))
    found, expected = (move(each, 0.4, 8, 8) for each in (motion, other))
    motion.nodal = other.nodal
    added = np.sqrt(np.mean(np.sum((expected.moved - found.moved) ** 2, axis=2)))
    assert misses(motion, found) == pytest.approx(added, rel=0.03)


def test_few_modes_are_near_the_truth_and_say_so(pressed, truth, reduced):
    found, told = asked(reduced, pressed, 4 * pressed.frames)
    error = wrong(found.moved, truth)
    assert error < 0.005 and 0.3 * error < told < 0.02
    assert len(reduced.model.points.volumes) < 200 and (reduced.model.points.volumes > 0.0).all()
    coarse, rough = asked(reduced, pressed, pressed.frames)
    assert 3.0 * error < wrong(coarse.moved, truth) < 3.0 * rough, "steps of 40 ms"


@pytest.mark.slow
def test_modes_of_another_place_are_doubted(pressed, truth, reduced):
    other = pressed.placed_loads().pushes[0].but(**OTHER)
    there = prepare(BodyAtRest(pressed.body, 1), Loads(push={"loads": [other]}), pressed.rayleigh, 1, MISSED)
    found, told = asked(there, pressed, 4 * pressed.frames)
    own, told_own = asked(reduced, pressed, 4 * pressed.frames)
    error = wrong(found.moved, truth)
    assert error > 2.0 * wrong(own.moved, truth) and told > 0.3 * error and told > 2.0 * told_own


@pytest.mark.parametrize(("missed", "weak"), [(0.02, 1e-5), pytest.param(0.5, 1e-12, marks=pytest.mark.slow)])
def test_loose_cells_and_weak_modes_are_told_or_right(missed, weak, pressed, truth, rest, monkeypatch):
    monkeypatch.setattr(basis, "DEPENDENT", weak)
    try:
        body = prepare(rest, pressed.placed_loads(), pressed.rayleigh, 3, missed)
        found, told = asked(body, pressed, 4 * pressed.frames)
    except NotConverged:
        return
    assert wrong(found.moved, truth) < max(0.01, 3.0 * told)
    assert body.held_out <= missed


def test_what_is_damped_and_kept_is_the_work_of_the_loads(pressed, reduced):
    balances = []
    for steps in (8, 16):
        motion = ReducedMotion(reduced, pressed.placed_loads(), pressed.rayleigh)
        balances.append(move(motion, pressed.duration_s, pressed.frames, steps * pressed.frames).balance)
    assert balances[1] < 0.5 * balances[0] < 5e-3
    free = ReducedMotion(reduced, pressed.placed_loads(), UNDAMPED)
    reached = list(free.steps(0.005, 200, 1e-6))
    gone = [free.total_energy(each.x, each.v) for each in reached[60:]]  # when the push is over
    assert np.ptp(gone) < 0.01 * np.mean(gone)


@pytest.mark.slow
def test_weight_has_modes_of_its_own(pressed):
    heavy = replace(pressed, loads=FALLING)
    truth = motion_truth(heavy.body, heavy.loads, heavy.rayleigh, heavy.duration_s, heavy.frames, 4 * heavy.frames)
    body = prepare(BodyAtRest(heavy.body, 10), heavy.loads, heavy.rayleigh, 3, MISSED)
    found, told = asked(body, heavy, 8 * heavy.frames)
    assert wrong(found.moved, truth) < 0.005 and told < 0.02


def test_what_modes_cannot_do_is_refused(box, pressed, rest, monkeypatch):
    with pytest.raises(InputError, match="nothing is held"):
        BodyAtRest(cube(box, held=False), 3)
    with pytest.raises(NotConverged, match="mean dilatation"):
        BodyAtRest(cube(box, poisson=0.49), 3)
    for other in (cube(box), replace(pressed.body, material=Material(30000.0, 0.3, 1000.0))):
        with pytest.raises(InputError, match="another body"):
            rest.check(other)
    rest.check(pressed.body)
    five = np.arange(5), np.ones(5)
    monkeypatch.setattr(cubature, "candidate_points", lambda *given: points_and_means(*given[:3], 8).take(*five))
    with pytest.raises(NotConverged, match="misplace"):
        prepare(rest, FALLING, pressed.rayleigh, 3, 0.01)
