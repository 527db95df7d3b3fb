"""A touched body in modes of strokes moves as quadratic elements do, or says that it may not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.simple_shapes import box
from palpate.collision.contact import instrument_contact
from palpate.effects.instrument import gaps_of
from palpate.effects.settings import Ball, Capsule, Contact, Rayleigh, Touching
from palpate.errors import InputError, NotConverged
from palpate.models import local_answers, stroke_motion, strokes
from palpate.models.stroke_motion import Learnt
from palpate.scenes.run_scene import compose, run
from palpate.scenes.settings import Scene
from palpate.solvers.touched_motion import STIFFER

DURATION_S, STEP_S = 0.24, 0.01
SHIFTS = [[0, 0, 0], [0, 0, -0.008], [0, 0, -0.008], [0.015, 0, -0.006]]
BALL = Ball(name="finger", center_m=[0.03, 0.03, 0.0421], radius_m=0.012)
FINGER = BALL.but(times_s=[0.0, 0.1, 0.14, 0.24], shifts_m=SHIFTS)
CONTACT = Contact(friction=0.3, instruments=[FINGER])
RAYLEIGH = Rayleigh(mass_1_s=1.0, stiffness_s=0.01)


def scene(contact: Contact = CONTACT, modes: Touching | None = None, **stepping) -> Scene:
    given = {"integrator": "touching", "step_s": STEP_S, "duration_s": DURATION_S, "frames": 12} | stepping
    return Scene(name="pad", body="pad", contact=contact, rayleigh=RAYLEIGH, touching=modes, **given)


def moved(contact: Contact, by: list[float]) -> Contact:
    tool = contact.instruments[0]
    return contact.but(instruments=[tool.but(center_m=(np.array(tool.center_m) + by).tolist())])


@pytest.fixture(scope="module")
def pad() -> Particles:
    mesh = box([0.06, 0.06, 0.03], [4, 4, 2])
    held = np.flatnonzero(mesh.nodes[:, 2] == 0.0)
    return particles_of(nest("pad", mesh, 0, held, Material(5000.0, 0.3, 1000.0)), 0, surface=False)


@pytest.fixture(scope="module")
def shown(pad) -> np.ndarray:
    return strokes.shown(pad.body, strokes.neighbours(CONTACT), RAYLEIGH, DURATION_S)


def few(pad: Particles, shown: np.ndarray, contact: Contact = CONTACT, **asked) -> Learnt:
    """Modes learnt from ``shown``."""
    modes = Touching(**asked)
    return Learnt(**dict(modes), learnt=stroke_motion.prepare(compose(scene(contact), pad), modes, shown))


def elements_of(pad: Particles, contact: Contact, steps: int, softer: float = STIFFER) -> tuple[np.ndarray, np.ndarray]:
    """What quadratic elements do with contact as stiff as modes have it: corners (steps, n, 3), forces (steps, 3)."""
    points = strokes.points_of(pad.body, [contact])
    points = replace(points, penalty=points.penalty / softer)
    motion = strokes.elements_under(pad.body, contact, RAYLEIGH, points)
    reached = list(motion.touched_steps(DURATION_S / steps, steps, 1e-3))
    return np.array([each.x[: len(pad.nodes)] for each in reached]), np.array([each.forces[0] for each in reached])


def off(found: np.ndarray, truth: np.ndarray, rest: np.ndarray) -> float:
    """RMSE of positions (f, n, 3) over the peak of displacements."""
    peak = np.linalg.norm(truth - rest, axis=2).max()
    return float(np.sqrt(np.mean(np.sum((found - truth) ** 2, axis=2))) / peak)


def force_of(done) -> np.ndarray:
    """The mean force of the finger on the body in each step."""
    return -done.motion.observed[[f"finger_mean_force_{axis}_n" for axis in "xyz"]].to_numpy()


def test_modes_of_strokes_move_as_quadratic_elements_in_steps_of_the_same_length(pad, shown):
    truth, forces = elements_of(pad, CONTACT, 12)
    done = run(scene(modes=few(pad, shown, modes=20, thinning=0.02), step_s=DURATION_S / 12), pad)
    wrong = np.sqrt(np.mean(np.sum((force_of(done) - forces) ** 2, axis=1)))
    assert off(done.motion.positions[1:], truth, pad.nodes) < 0.01 and wrong < 0.05 * np.abs(forces).max()


@pytest.mark.slow
def test_the_doubt_is_large_where_the_error_is(pad, shown):
    """On the path, beside it, and on the other side of the pad, which no stroke has shown."""
    asked = few(pad, shown, modes=40)
    beside = [[0, 0, 0], [0, 0.004, 0], [-0.018, 0.018, 0]]
    passing = [moved(CONTACT, by) for by in beside]
    wide = stroke_motion.prepare(compose(scene(), pad), asked, shown, passing)
    blind = replace(wide, local=None)
    found = []
    for contact in passing:
        done = run(scene(contact, asked.but(learnt=blind)), pad)
        truth, _ = elements_of(pad, contact, 24, softer=1.0)
        found.append((off(done.motion.positions[1:], truth[1::2], pad.nodes), done.doubts_m.max()))
    errors, doubts = np.transpose(found)
    assert errors[2] > 3.0 * errors[:2].max()
    assert doubts[2] > 3.0 * doubts[:2].max()
    # there the answers of the surface take most of the error away, and of the force's
    known = run(scene(passing[2], asked.but(learnt=wide)), pad)
    assert off(known.motion.positions[1:], truth[1::2], pad.nodes) < 0.3 * errors[2]
    truly = np.linalg.norm(elements_of(pad, passing[2], 24, softer=1.0)[1], axis=1).max()
    strong = [np.linalg.norm(force_of(each), axis=1).max() / truly for each in (known, done)]
    assert abs(strong[0] - 1.0) < 0.3 * abs(strong[1] - 1.0)
    # where points are not in reach the finger goes into the body, and it knows
    done = run(scene(moved(CONTACT, [-0.03, 0.03, 0]), asked), pad)
    assert np.isinf(done.doubts_m.max())


def test_modes_and_what_they_lack_answer_as_the_linear_body(pad, shown):
    """Forces on nodes of the surface, against the stiffness matrix; and what is inverted is what it was."""
    wide = stroke_motion.prepare(compose(scene(), pad), few(pad, shown, modes=10), shown, [CONTACT])
    local, elements = wide.local, wide.elements
    rng, nodes = np.random.default_rng(2), np.array([3, 8, 20])
    forces, load = rng.normal(size=(3, 3)), np.zeros(elements.rest.shape)
    load[local.nodes[nodes]] = forces
    truth = elements.solve(load[:, :, None], 1e-10)[: len(pad.nodes), :, 0]
    dent = local_answers.Dent(nodes, forces, np.eye(3))
    modes = wide.modes[: len(pad.nodes)] @ np.tensordot(load, wide.modes, 2)
    lacked = local.of_corners(dent) / local_answers.SOFTER
    assert modes + lacked == pytest.approx(truth, abs=2e-3 * np.abs(truth).max())
    assert np.abs(lacked).max() > 0.1 * np.abs(truth).max()
    assert local.stiffness(nodes) @ local.field(dent, nodes).ravel() == pytest.approx(forces.ravel(), abs=1e-4)
    turn = Rotation.from_rotvec([0.3, -0.5, 0.2]).as_matrix()
    assert local_answers.turn_of(local.rest, local.rest @ turn.T + 0.1) == pytest.approx(turn)
    whole = np.kron(np.eye(3), turn)
    stiff = local.stiffness(nodes)
    assert local_answers.turned(stiff, turn) == pytest.approx(whole @ stiff @ whole.T)


def test_the_finger_works_on_the_body_and_pushes_along_its_normals_without_friction(pad, shown):
    contact = CONTACT.but(friction=0.0)
    asked = scene(contact, few(pad, shown, contact))
    system = compose(asked, pad)
    motion = stroke_motion.make(system, asked)
    pushed = 0
    for number in range(24):
        system.at((number + 1) * STEP_S)
        motion.advance(STEP_S)
        forces, near, q = motion._forces, motion._near, motion._now.q
        points = motion._rest[near] + motion.body.rows[near] @ q
        assert forces.sum(axis=0) == pytest.approx(-motion.contact.reactions[0], abs=1e-12)
        pushed += bool(forces.any())
        # all forces on a ball without friction go through its centre
        pose = motion.contact.obstacles[0].pose(system.time)
        centre = pose.tip + BALL.radius_m * pose.axes[2]
        assert np.abs(np.cross(points - centre, forces).sum(axis=0)).max() <= 1e-9 * max(np.abs(forces).max(), 1e-9)
    assert pushed > 12
    assert motion.contact.work_j > 0.0


@pytest.mark.parametrize(
    "tool",
    [
        Ball(center_m=[0, 0, 0], radius_m=0.012),
        Capsule(from_m=[-0.01, 0, 0], to_m=[0.01, 0, 0], radius_m=0.012),
    ],
)
def test_forces_and_stiffness_of_contact_are_derivatives(pad, tool):
    """By differences; the stiffness leaves out what curvature and sliding take off, so that it is no smaller."""
    rng = np.random.default_rng(1)
    contact = instrument_contact.instruments_of(pad.body, Contact(friction=0.5, instruments=[tool]))
    points = rng.uniform(-1.0, 1.0, (40, 3)) * [0.02, 0.012, 0.012]
    tools, stiff = contact.at(0.0), rng.uniform(50.0, 100.0, 40)
    gaps, normals = gaps_of(points, tools)
    before = points - 1e-4 * rng.normal(size=(40, 3)), np.zeros((1, 3))
    rubbing = instrument_contact.rubbing_of(points, stiff, tools, 0.5, *before, 1e-4)

    def force_at(x: np.ndarray) -> np.ndarray:
        return instrument_contact.pushes(x, stiff, tools, rubbing)[0][0]

    def energy(x: np.ndarray) -> float:
        return instrument_contact.pushes(x, stiff, tools, rubbing)[1].sum()

    force, h = force_at(points), 1e-8
    blocks = instrument_contact.stiffness(points, stiff, tools, rubbing, np.arange(40))
    inside = np.flatnonzero(gaps[0] < 0.0)
    assert 5 < len(inside) < 35 and not force[gaps[0] > 0.0].any() and not blocks[gaps[0] > 0.0].any()
    for q in inside:
        slopes, bends = np.empty(3), np.empty((3, 3))
        for i in range(3):
            up, down = points.copy(), points.copy()
            up[q, i], down[q, i] = points[q, i] + h, points[q, i] - h
            slopes[i] = (energy(up) - energy(down)) / (2.0 * h)
            bends[i] = (force_at(down)[q] - force_at(up)[q]) / (2.0 * h)
        assert force[q] == pytest.approx(-slopes, rel=1e-5, abs=1e-6)
        more = np.linalg.eigvalsh(blocks[q] - 0.5 * (bends + bends.T))
        assert more.min() > -1e-4 * np.abs(bends).max()
    still = rubbing._replace(limits=np.zeros_like(gaps))
    alone = instrument_contact.stiffness(points, stiff, tools, still, inside)
    assert alone == pytest.approx(stiff[inside, None, None] * normals[0, inside, :, None] * normals[0, inside, None, :])


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
        run(scene(CONTACT.but(**changed)), pad)


def test_other_effects_and_other_bodies_are_refused(pad, shown):
    with pytest.raises(InputError, match="the scene has gravity"):
        run(scene().but(gravity={"acceleration_m_s2": [0, 0, -9.81]}), pad)
    with pytest.raises(InputError, match="it is for a body that instruments touch"):
        run(scene().but(contact=None), pad)
    asked = few(pad, shown)
    stiffer = replace(pad, body=replace(pad.body, material=replace(pad.material, young_pa=6000.0)))
    with pytest.raises(InputError, match="modes are those of another body"):
        run(scene(modes=asked), stiffer)
    with pytest.raises(InputError, match="motions of 74 nodes"):
        few(pad, shown[:, :74])


def test_a_finger_that_goes_through_the_body_is_raised_and_one_nearly_through_doubted(pad, shown):
    """What is held below gives way to nothing; where the corners of elements turn, nothing of it is believed."""

    def pressed(depth_m: float):
        deep = {"times_s": [0.0, 0.2], "shifts_m": [[0, 0, 0], [0, 0, -depth_m]]}
        contact = CONTACT.but(instruments=[BALL.but(**deep)])
        return run(scene(contact, few(pad, shown, contact, modes=40)), pad)

    for depth_m in (0.032, 0.05):
        with pytest.raises(NotConverged, match="driven into held nodes"):
            pressed(depth_m)
    assert np.isinf(pressed(0.0299).doubts_m[-1])


def test_a_ball_that_was_inside_between_frames_is_doubted_at_the_next(pad, shown):
    """Led through the pad from side to side, which no modes of presses follow, it is outside again where it ends."""
    through = {"times_s": [0.0, 0.24], "shifts_m": [[0, 0, 0], [0.085, 0, 0]]}
    contact = CONTACT.but(instruments=[BALL.but(center_m=[-0.0125, 0.03, 0.022], **through)])
    asked = scene(contact, few(pad, shown, contact), step_s=0.005)
    for frames in (1, 12):
        assert np.isinf(run(asked.but(frames=frames), pad).doubts_m.max())


def test_energies_are_those_of_the_integrator_and_balance(pad, shown):
    """Without damping and friction the work of a slow press is what the body and contact keep of it."""
    contact = Contact(instruments=[BALL.but(times_s=[0, 0.2], shifts_m=SHIFTS[:2])])
    asked = scene(contact, few(pad, shown, contact, thinning=0.01), step_s=0.005)
    done = run(asked.but(rayleigh=Rayleigh(mass_1_s=0.0, stiffness_s=0.0)), pad).motion
    energy = done.energy
    assert np.isfinite(energy.to_numpy()).all()
    end = energy.iloc[-1]
    assert end["total_j"] == pytest.approx(end["kinetic_j"] + end["corotational_j"] + end["contact_j"])
    assert 0.0 < end["contact_j"] < 0.5 * end["corotational_j"]
    assert end["total_j"] == pytest.approx(end["outer_work_j"], rel=0.02) and end["gain_j"] < 2e-3 * end["total_j"]
    # penalties are springs: energy and forces of the points that touch say the same depth, and add up to the finger's
    last = done.contacts[done.contacts["time_s"] == end["time_s"]]
    assert (last["gap_m"] < 0.0).all()
    assert end["contact_j"] == pytest.approx(-0.5 * (last["gap_m"] * last["force_n"]).sum())
    upward = (last["force_n"] * last["normal_z"]).sum()
    assert upward == pytest.approx(-done.observed["finger_force_z_n"].iloc[-1], rel=1e-6)


def test_what_overlaps_or_is_missed_where_it_begins_is_refused(pad, shown):
    asked = few(pad, shown)
    for tool in (
        moved(CONTACT, [0, 0, -0.004]),  # in part inside
        Contact(instruments=[FINGER.but(center_m=[0.03, 0.03, 0.015], radius_m=0.004)]),  # wholly
        Contact(instruments=[FINGER.but(times_s=[-0.1, 0.0, 0.14, 0.24])]),  # it began earlier
    ):
        with pytest.raises(InputError, match=r"scenes\.pad\.integrator is touching: .* where the scene begins"):
            run(scene(tool, asked), pad)
    with pytest.raises(
        InputError, match=r"no instrument comes within 1\.2 times its radius of pad; lead its path there"
    ):
        run(scene(moved(CONTACT, [0.0, 0.0, 0.1])), pad)


def test_a_step_in_which_the_finger_would_pass_through_the_pad_unseen_is_refused(pad, shown):
    """It is above the pad where the step begins and below it where it ends, and the pad would not move."""
    asked = few(pad, shown)
    through = CONTACT.but(instruments=[BALL.but(times_s=[0.0, 0.04], shifts_m=[[0, 0, 0], [0, 0, -0.06]])])
    with pytest.raises(InputError, match=r"step_s is 0\.04 s, and touching takes steps of up to 0\.008 s"):
        run(scene(through, asked, step_s=0.04), pad)
