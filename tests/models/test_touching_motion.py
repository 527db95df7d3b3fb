"""A touched body in modes of strokes moves as its elements do, or says that it may not."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.simple_shapes import box
from palpate.collision.contact import barrier, instrument_contact
from palpate.errors import InputError, NotConverged
from palpate.models import strokes, touching_motion
from palpate.models.stroke_modes import StrokeModes
from palpate.scenes.run_scene import compose, run
from palpate.scenes.scene import Scene
from palpate.solvers.backward_euler import BackwardEuler

DURATION_S, STEP_S = 0.24, 0.01
BALL = {"kind": "sphere", "name": "finger", "center_m": [0.03, 0.03, 0.0421], "radius_m": 0.012}
PATH = {"times_s": [0.0, 0.1, 0.14, 0.24], "shifts_m": [[0, 0, 0], [0, 0, -0.008], [0, 0, -0.008], [0.015, 0, -0.006]]}
CONTACT = {"friction": 0.3, "instruments": [BALL | PATH]}
RAYLEIGH = {"mass_1_s": 1.0, "stiffness_s": 0.01}


def scene(contact: dict = CONTACT, integrator: str = "touching", step_s: float = STEP_S, **modes) -> Scene:
    settings = {"contact": contact, "rayleigh": RAYLEIGH} | ({"touching": modes} if modes else {})
    effects = ["corotational", "held", "contact", "rayleigh"]
    return Scene("pad", effects, integrator, step_s, DURATION_S, frames=12, settings=settings)


def moved(contact: dict, by: list[float]) -> dict:
    tool = contact["instruments"][0]
    return contact | {"instruments": [tool | {"center_m": (np.array(tool["center_m"]) + by).tolist()}]}


@pytest.fixture(scope="module")
def pad() -> Particles:
    mesh = box([0.06, 0.06, 0.03], [4, 4, 2])
    held = np.flatnonzero(mesh.nodes[:, 2] == 0.0)
    return particles_of(nest("pad", mesh, 0, held, Material(5000.0, 0.3, 1000.0)), 0, surface=False)


@pytest.fixture(scope="module")
def shown(pad) -> np.ndarray:
    return strokes.shown(compose(scene(), pad), strokes.neighbours(CONTACT), DURATION_S)


def whole(pad: Particles, contact: dict = CONTACT) -> StrokeModes:
    """All coordinates of the free nodes and all elements."""
    system = compose(scene(contact), pad)
    free = np.repeat(system.free, 3)
    matrix = system.stiffness(pad.nodes, True)
    dense = matrix.toarray()[np.ix_(free, free)]
    masses = np.repeat(pad.masses, 3)[free]
    values, vectors = np.linalg.eigh(dense / np.sqrt(np.outer(masses, masses)))
    modes = np.zeros((len(free), len(values)))
    modes[free] = vectors / np.sqrt(masses)[:, None] / np.sqrt(values)
    elements = len(system.elastic.volumes)
    kept = np.arange(elements), np.ones(elements), np.zeros((len(values), len(values)))
    return StrokeModes(modes, 1.0 / values, *kept, np.unique(pad.triangles))


def few(pad: Particles, shown: np.ndarray, contact: dict = CONTACT, **asked) -> dict:
    """The block ``touching`` with modes learnt from ``shown``."""
    settings = scene(contact).integration["touching"] | asked
    body = touching_motion.prepare(compose(scene(contact), pad), settings, shown)
    return settings | {"learnt": body}


def of_elements(pad: Particles, contact: dict = CONTACT, step_s: float = STEP_S):
    return run(scene(contact, "backward_euler", step_s), pad)


def off(found: np.ndarray, truth: np.ndarray) -> float:
    """RMSE of positions (f, n, 3) over the peak of displacements."""
    peak = np.linalg.norm(truth - truth[0], axis=2).max()
    return float(np.sqrt(np.mean(np.sum((found - truth) ** 2, axis=2))) / peak)


def force_of(done) -> np.ndarray:
    return done.motion.observed[[f"finger_force_{axis}_n" for axis in "xyz"]].to_numpy()


@pytest.mark.parametrize("coefficient", [0.0, 0.3])
def test_with_all_modes_a_step_is_that_of_the_elements(pad, coefficient, monkeypatch):
    """The first steps that touch, with friction lagged once as elements have it."""
    contact = CONTACT | {"friction": coefficient}
    monkeypatch.setattr(touching_motion, "PASSES", 1)
    monkeypatch.setattr(instrument_contact.InstrumentContact, "bends", lambda *_: True)  # backward Euler throughout
    modes = scene(contact).integration["touching"] | {"learnt": whole(pad, contact), "tolerance": 1e-8}
    done = run(scene(contact, **modes), pad)
    truth = of_elements(pad, contact)
    # damping is taken as the change of the elastic force, and by the elements as that of K at the step's beginning
    assert off(done.motion.positions, truth.motion.positions) < 0.01
    strong = np.abs(force_of(truth)).max()
    assert strong > 0.05 and np.abs(force_of(done) - force_of(truth)).max() < 0.05 * strong
    assert (done.doubts_m < 1e-5 * 0.008).all()  # nothing is left outside of all modes
    undamped = {"rayleigh": {"mass_1_s": 1.0, "stiffness_s": 0.0}}
    pair = [
        replace(each, settings=each.settings | undamped)
        for each in (scene(contact, **modes), scene(contact, "backward_euler"))
    ]
    done, truth = (run(each, pad) for each in pair)
    assert off(done.motion.positions, truth.motion.positions) < 2e-5
    assert force_of(done) == pytest.approx(force_of(truth), abs=2e-4 * np.abs(force_of(truth)).max())


def test_few_modes_and_elements_are_near_the_limit_of_the_same_mesh(pad, shown):
    coarser, finer = (of_elements(pad, step_s=h) for h in (0.0025, 0.00125))
    limit = 2.0 * finer.motion.positions - coarser.motion.positions
    asked = few(pad, shown, modes=40)
    assert asked["learnt"].count < 0.5 * 3 * len(pad.nodes) and len(asked["learnt"].elements) < 0.9 * len(
        pad.tetrahedra
    )
    done = run(scene(step_s=0.005, **asked), pad)
    assert off(done.motion.positions, limit) < 0.01
    every = len(force_of(finer)) // len(force_of(done))
    wrong = force_of(done) - force_of(finer)[every - 1 :: every]
    strong = np.linalg.norm(force_of(finer), axis=1).max()
    assert np.sqrt(np.mean(np.sum(wrong**2, axis=1))) < 0.07 * strong


def test_the_doubt_is_large_where_the_error_is(pad, shown):
    """On the path, beside it, and on the other side of the pad, which no stroke has shown."""
    asked = few(pad, shown, modes=40)
    everywhere = replace(asked["learnt"], reach=np.unique(pad.triangles))
    found = []
    for by in ([0, 0, 0], [0, 0.004, 0], [-0.018, 0.018, 0]):
        contact = moved(CONTACT, by)
        done = run(scene(contact, **asked | {"learnt": everywhere}), pad)
        found.append(
            (off(done.motion.positions, of_elements(pad, contact, 0.005).motion.positions), done.doubts_m.max())
        )
    errors, doubts = np.transpose(found)
    assert errors[2] > 3.0 * errors[:2].max()
    assert doubts[2] > 3.0 * doubts[:2].max()
    # where nodes are not in reach the finger goes into the body, and it knows
    narrow = everywhere.reach[pad.nodes[everywhere.reach, 0] > 0.02]
    done = run(scene(moved(CONTACT, [-0.018, 0.018, 0]), **asked | {"learnt": replace(everywhere, reach=narrow)}), pad)
    assert np.isinf(done.doubts_m.max())


def test_the_body_is_pushed_as_hard_as_the_finger_and_without_friction_along_its_normal(pad, shown):
    contact = CONTACT | {"friction": 0.0}
    system = compose(scene(contact), pad)
    motion = touching_motion.make(system, {"touching": few(pad, shown, contact)})
    pushed = 0
    for number in range(24):
        system.at((number + 1) * STEP_S)
        motion.advance(STEP_S)
        forces, points = motion._work[3], motion._work[2]
        on_nodes, on_finger = forces[:-1], forces[-1]
        assert on_nodes.sum(axis=0) == pytest.approx(-on_finger, abs=1e-12 + 1e-10 * np.abs(on_finger).max())
        pushed += bool(on_finger.any())
        # all forces on a ball without friction go through its centre
        turning = np.cross(points[:-1] - points[-1], on_nodes).sum(axis=0)
        assert np.abs(turning).max() <= 1e-9 * max(np.abs(on_nodes).max(), 1e-9)
    assert pushed > 12
    assert motion.contact.work_j > 0.0


def test_instruments_push_as_the_contact_that_trees_find(pad):
    system = compose(scene(), pad)
    contact, x = system.effects["contact"], pad.nodes * [1.0, 1.0, 0.999]
    lent = contact.instruments_on(np.unique(pad.triangles))
    for part in (0.9, 0.5, 0.1):  # of the gap
        contact._points[-1, 2] = x[:, 2].max() + BALL["radius_m"] + part * contact.gap_m
        points, force = np.vstack([x[lent.nodes], contact._points[-1]]), np.zeros((lent.count, 3))
        energy = instrument_contact.press(lent.stencils, lent._unrubbed, points, force)
        assert force[-1, 2] > 0.0 and energy == pytest.approx(contact.energy(x), rel=1e-12)
        assert force[:-1] == pytest.approx(contact.forces(x)[lent.nodes], rel=1e-10, abs=1e-15)
        assert instrument_contact.least_gap(lent.stencils, points) == pytest.approx(part, abs=1e-6)


def test_a_soft_barrier_goes_on_as_its_parabola():
    soft, h = 0.05, 1e-6
    for s in (0.2, 0.049, -0.5):
        slope, bend = barrier.barrier(s, soft)[1:]
        above, below = (barrier.barrier(s + side * h, soft) for side in (1, -1))
        assert slope == pytest.approx((above[0] - below[0]) / (2 * h), rel=1e-4)
        assert bend == pytest.approx((above[1] - below[1]) / (2 * h), rel=1e-3)
    assert barrier.barrier(0.2, soft) == barrier.barrier(0.2)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"self_contact": True}, "touch each other or themselves"),
        ({"instruments": [BALL]}, "no instrument moves"),
        ({"instruments": []}, "no instruments"),
    ],
)
def test_what_it_has_no_modes_for_is_refused(pad, changed, said):
    with pytest.raises(InputError, match=said):
        run(scene(CONTACT | changed), pad)


def test_other_effects_and_other_bodies_are_refused(pad, shown):
    heavy = replace(scene(), effects=[*scene().effects, "gravity"])
    heavy = replace(heavy, settings=heavy.settings | {"gravity": {"acceleration_m_s2": [0, 0, -9.81]}})
    with pytest.raises(InputError, match="the scene has gravity"):
        run(heavy, pad)
    with pytest.raises(InputError, match="it is for a body that instruments touch"):
        run(replace(scene(), effects=["corotational", "held", "rayleigh"]), pad)
    asked = few(pad, shown)
    stiffer = replace(pad, material=replace(pad.material, young_pa=6000.0))
    with pytest.raises(InputError, match="modes are not those of pad"):
        run(scene(**asked), stiffer)
    with pytest.raises(InputError, match="motions of 74 nodes"):
        few(pad, shown[:, :74])


def test_a_finger_that_goes_through_the_body_is_doubted_or_raised(pad, shown):
    asked = few(pad, shown, modes=40)
    deep = {"times_s": [0.0, 0.2], "shifts_m": [[0, 0, 0], [0, 0, -0.05]]}
    try:
        done = run(scene(CONTACT | {"instruments": [BALL | deep]}, **asked), pad)
    except NotConverged:
        return
    usual = run(scene(**asked), pad).doubts_m.max()
    assert done.doubts_m.max() > 10.0 * usual


def test_a_body_that_is_held_down_is_followed_until_its_scene_ends(pad):
    """As it goes on to move when the finger has stopped: modes of the way down alone are several times as wrong."""
    press = {"times_s": [0.0, 0.04], "shifts_m": [[0, 0, 0], [0, 0, -0.008]]}
    contact = CONTACT | {"instruments": [BALL | press]}
    coarser, finer = (of_elements(pad, contact, h).motion.positions for h in (0.0025, 0.00125))
    limit, asked = 2.0 * finer - coarser, scene(contact).integration["touching"] | {"modes": 20, "vibrations": 0}
    wrong = []
    for until in (0.04, DURATION_S):
        learnt = touching_motion.prepare(compose(scene(contact), pad), asked, until_s=until)
        done = run(scene(contact, step_s=0.0025, **asked, learnt=learnt), pad)
        wrong.append(off(done.motion.positions, limit))
    assert off(run(scene(contact, step_s=0.0025, **asked), pad).motion.positions, limit) == wrong[1]
    assert wrong[1] < 0.01 and wrong[0] > 1.5 * wrong[1]


def test_a_step_in_which_the_finger_would_pass_through_the_pad_unseen_is_refused(pad, shown):
    """It is above the pad where the step begins and below it where it ends, and the pad would not move."""
    asked = few(pad, shown)
    through = CONTACT | {"instruments": [BALL | {"times_s": [0.0, 0.04], "shifts_m": [[0, 0, 0], [0, 0, -0.06]]}]}
    with pytest.raises(InputError, match=r"step_s is 0\.04 s, and touching takes steps of up to 0\.008 s"):
        run(scene(through, step_s=0.04, **asked), pad)
    low = run(scene(through, step_s=0.005, **asked), pad).motion.positions[-1][:, 2].min()
    assert low < -0.02  # before the finger, which ends at −0.018


def test_random_strokes_press_into_the_surface_and_stay_in_the_region(pad):
    found = strokes.roaming(pad, CONTACT, 0.025, 6, seed=2)
    assert found == strokes.roaming(pad, CONTACT, 0.025, 6, seed=2) != strokes.roaming(pad, CONTACT, 0.025, 6, seed=3)
    middle = np.array([0.03, 0.03]) + np.array(PATH["shifts_m"]).mean(axis=0)[:2]
    for contact in found:
        tool = contact["instruments"][0]
        places = np.array(tool["center_m"]) + np.array(tool["shifts_m"])
        assert np.abs(places[:, :2] - middle).max() <= 0.025 + 1e-12
        depths = 0.03 + tool["radius_m"] - places[:, 2]
        assert depths[0] < 0.0 and depths[-1] < 0.0
        assert depths[1] == pytest.approx(depths[3]) and strokes.DEPTHS_M[0] <= depths[1] <= strokes.DEPTHS_M[1]


def test_strokes_that_elements_do_not_find_are_left_out_and_most_must_be_found(pad, monkeypatch):
    system, real = compose(scene(), pad), BackwardEuler.step
    failing = {0}

    def step(self, x, v, h):
        if self._system.effects["contact"].settings["number"] in failing:
            raise NotConverged("lost", [])
        return real(self, x, v, h)

    monkeypatch.setattr(BackwardEuler, "step", step)
    numbered = [CONTACT | {"number": k} for k in range(3)]
    assert strokes.shown(system, numbered, 0.04).shape == (2 * strokes.LEAST_STEPS, *pad.nodes.shape)
    failing.add(1)
    with pytest.raises(NotConverged, match="2 of 3 strokes are not found: lost"):
        strokes.shown(system, numbered, 0.04)
