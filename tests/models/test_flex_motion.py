"""Flex bodies of MuJoCo in motion, if installed, against palpate's elements of their law on the same mesh."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.poked_bar import poked

from palpate.benchmark.accuracy import errors
from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.simple_shapes import box as block
from palpate.effects.settings import Contact, Loads, Rayleigh
from palpate.errors import NotConverged
from palpate.models import flex_motion
from palpate.models.flex_motion import FlexMotion, move
from palpate.models.mujoco_flex import LAW
from palpate.studies.dynamic import accuracy
from palpate.studies.dynamic.compared_scene import ComparedScene
from palpate.studies.dynamic.reference import reference

UNDAMPED = Rayleigh(mass_1_s=0.0, stiffness_s=0.0)
DAMPED = Rayleigh(mass_1_s=1.0, stiffness_s=0.01)
OTHERS: dict[str, dict] = {"fem_coarse": {}, "fem_fine": {}, "moving_modes": {}}
"""Models that a scene names no settings of."""
ONE = {"level": 0, "steps_per_frame": 1}
FALL = Loads(gravity={"acceleration_m_s2": [0.0, 4.0, -4.0]})
BALL = {"kind": "sphere", "center_m": [0.03, 0.03, 0.0425], "radius_m": 0.012, "times_s": [0.0, 0.1, 0.2]}
PRESS = Contact(instruments=[BALL | {"shifts_m": [[0, 0, 0], [0, 0, -0.008], [0, 0, -0.008]]}])
STROKE = Contact(instruments=[BALL | {"shifts_m": [[0, 0, 0], [0, 0, -0.006], [0.012, 0, -0.006]]}])


def elements(compared: ComparedScene, level: int, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements (f, n, 3) [m] and forces of palpate's elements of MuJoCo's law, extrapolated in the step."""
    own = replace(compared, body=replace(compared.body, material=replace(compared.body.material, law=LAW)))
    found = [own.move(own.fem(count), level)[1].motion for count in (steps, 2 * steps)]
    share = 2.0**own.order - 1.0
    moved, felt = ([each.positions[1:] - each.rest for each in found], [each.instrument_forces() for each in found])
    return tuple(short + (short - long) / share for long, short in (moved, felt))


def flex(compared: ComparedScene, level: int, steps: int) -> flex_motion.MovedFlex:
    h = compared.duration_s / steps
    return move(FlexMotion(compared, level, compared.placed_loads(), compared.rayleigh, h), compared.frames, steps)


def off(found: np.ndarray, right: np.ndarray) -> float:
    return errors(found.reshape(-1, 3), right.reshape(-1, 3)).rmse_of_peak


@pytest.fixture(scope="module")
def pad() -> ComparedScene:
    mesh = block([0.06, 0.06, 0.03], [6, 6, 3])
    body = nest("pad", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] == 0.0), Material(5000.0, 0.3, 1000.0))
    return ComparedScene("pad", body, Loads(contact=PRESS), DAMPED, 0.2, 5)


@pytest.mark.parametrize(
    ("changed", "level"),
    [
        ({"loads": FALL, "rayleigh": UNDAMPED}, 0),
        ({"loads": FALL, "rayleigh": UNDAMPED}, 1),
        ({"rayleigh": UNDAMPED.but(mass_1_s=5.0)}, 0),
    ],
)
def test_its_motion_tends_to_that_of_elements_of_its_law(box, changed, level):
    """Far from rest, by half a length of the bar; its steps are of first order, and two of them show the limit."""
    pytest.importorskip("mujoco")
    made = replace(poked(box), **changed)
    right = elements(made, level, 40 * made.frames)[0]
    assert np.linalg.norm(right, axis=2).max() > 0.012
    longer, shorter = (flex(made, level, count * made.frames).moved for count in (40, 80))
    assert 0.4 < off(shorter, right) / off(longer, right) < 0.6
    assert off(2.0 * shorter - longer, right) < 0.0015


def test_its_damping_is_rayleighs_where_strains_are_small(box):
    pytest.importorskip("mujoco")
    apart = []
    for factor in (1.0, 0.1):
        made = replace(poked(box), rayleigh=DAMPED).scale_loads(factor)
        right = elements(made, 0, 40 * made.frames)[0]
        longer, shorter = (flex(made, 0, count * made.frames).moved for count in (40, 80))
        apart.append(off(2.0 * shorter - longer, right))
    assert apart[0] < 0.006 and apart[1] < 0.0005


def test_what_is_held_stays_and_masses_are_those_of_the_level(box):
    pytest.importorskip("mujoco")
    made = poked(box)
    motion = FlexMotion(made, 1, made.placed_loads(), made.rayleigh, 0.01)
    moved = move(motion, 1, 4).moved[0]
    held = made.body.anchors[1]
    assert np.abs(moved[held]).max() < 1e-15 and np.abs(moved).max() > 1e-4
    masses = made.particles(1).masses
    assert motion._flex.model.body_mass.sum() == pytest.approx(masses.sum() - masses[held].sum(), rel=1e-12)


def test_contact_presses_as_a_barrier_does(pad):
    """At rest on a ball; force and place, against palpate's contact, which touches at other points."""
    pytest.importorskip("mujoco")
    right, felt = elements(pad, 0, 8 * pad.frames)
    found = [flex(pad, 0, count * pad.frames) for count in (2, 8, 32)]
    assert (np.diff([off(each.moved, right) for each in found]) < 0.0).all()
    assert off(found[-1].moved, right) < 0.004 and off(found[-1].forces, felt) < 0.015
    assert found[-1].forces[-1, 0, 2] == pytest.approx(felt[-1, 0, 2], rel=0.02) and felt[-1, 0, 2] < -0.5


def test_friction_drags_along_the_stroke(pad):
    pytest.importorskip("mujoco")
    drag = {}
    for friction in (0.0, 0.3):
        made = replace(pad, loads=Loads(contact=STROKE.but(friction=friction)))
        right, felt = elements(made, 0, 8 * made.frames)
        found = flex(made, 0, 16 * made.frames)
        assert off(found.moved, right) < 0.015 and off(found.forces, felt) < 0.03
        drag[friction] = found.forces[-2:, 0, 0], felt[-2:, 0, 0]
    rise, right = (drag[0.3][i] - drag[0.0][i] for i in (0, 1))
    assert (right > 0.1).all() and rise == pytest.approx(right, rel=0.1)


def test_rows_stand_beside_those_of_other_models(box):
    pytest.importorskip("mujoco")
    made = poked(box, duration_s=0.2, frames=5)
    truth = reference(made, None, 0.02, 6)
    runs = [{"level": level, "steps_per_frame": count} for level, count in ((0, 1), (0, 8), (1, 8), (7, 1))]
    table = accuracy.measure(made, None, truth, OTHERS | {"mujoco": {"runs": runs}}, ["mujoco"])[0]
    rows = table[table["model"] == "mujoco"]
    assert list(rows["level"]) == [0, 0, 1] and (rows["failures"] == 0).all()
    assert (np.diff(rows["rmse_of_peak"]) < 0.0).all() and rows["rmse_of_peak"].iloc[-1] < 0.03
    assert (rows["real_time_factor"] > 0.0).all()


def test_a_body_that_flies_apart_is_a_failure_of_its_row(box, monkeypatch):
    pytest.importorskip("mujoco")
    made = poked(box, duration_s=0.2, frames=5)
    truth = reference(made, None, 0.02, 6)
    monkeypatch.setattr(flex_motion.FlexMotion, "step", lambda *_: (_ for _ in ()).throw(NotConverged("apart", [])))
    table = accuracy.measure(made, None, truth, OTHERS | {"mujoco": {"runs": [ONE]}}, ["mujoco"])[0]
    assert table[table["model"] == "mujoco"]["failures"].tolist() == [1]


def test_beyond_what_it_knows_there_is_no_row(box):
    made, grid = poked(box, duration_s=0.2, frames=5), OTHERS | {"mujoco": {"runs": []}}

    def models(scene):
        return accuracy._models(scene, None, None, grid, {})

    assert "mujoco" in models(made)
    floor = Loads(contact={"instruments": [{"kind": "floor", "height_m": -1.0}]})
    clay = Loads(plasticity={"yield_strain": 0.1, "max_strain": 0.5})
    unknown = [{"held": False}, {"shifts_m": [[0, 0, 1]]}, {"loads": floor}, {"loads": clay}]
    for changed in unknown:
        assert "mujoco" not in models(replace(made, **changed))
