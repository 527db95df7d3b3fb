"""Scenes with contact: nothing overlaps, nothing tunnels, and the mechanics are right."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from palpate.bodies.particles import merge_particles
from palpate.effects import linear_elements
from palpate.effects import settings as blocks
from palpate.errors import NotConverged
from palpate.scenes.effect_registry import integrator
from palpate.scenes.run_scene import compose
from palpate.scenes.settings import Scene

FLOOR = blocks.Floor(name="ground", height_m=0.0)
WEIGHT = blocks.Gravity(acceleration_m_s2=[0.0, 0.0, -9.81])
LOSS = blocks.Rayleigh(mass_1_s=1.0, stiffness_s=0.02)
SHAPES = blocks.ShapeMatching(mode="linear", alpha=0.6, beta=0.3, clusters=blocks.Clusters(kind="one"))
SPRINGS = blocks.Springs(structural_n_m=10.0, shear_n_m=5.0, bending_n_m=1.0)
IMPLICIT = {"integrator": "backward_euler", "step_s": 0.01}
EXPLICIT = {"integrator": "symplectic_euler"}
MATCHED = {"integrator": "goal_position", "step_s": 0.01, "shape_matching": SHAPES}
DAMPED_SPRINGS = {"springs": blocks.Springs(), "kelvin": blocks.Kelvin(ratio=0.1)}
SOLID = {
    "corotational, implicit": IMPLICIT | {"rayleigh": LOSS},
    "corotational, explicit": EXPLICIT | {"step_s": 0.001, "rayleigh": LOSS.but(stiffness_s=0.001)},
    "springs, implicit": IMPLICIT | DAMPED_SPRINGS,
    "springs, explicit": EXPLICIT | {"step_s": 0.001} | DAMPED_SPRINGS,
    "shapes": MATCHED | {"velocity_damping": blocks.VelocityDamping(rate_1_s=3.0)},
}
THIN = {
    "triangles, implicit": IMPLICIT,
    "triangles, explicit": EXPLICIT | {"step_s": 0.0005},
    "springs, implicit": IMPLICIT | {"springs": SPRINGS},
    "springs, explicit": EXPLICIT | {"step_s": 0.0005, "springs": SPRINGS},
    "shapes": MATCHED,
}
MU = 0.3


def slow_where_explicit(ways):
    return [pytest.param(way, marks=pytest.mark.slow) if "explicit" in way else way for way in ways]


def ball(center_m, times_s, shifts_m, radius_m=0.01):
    return blocks.Ball(name="ball", center_m=center_m, radius_m=radius_m, times_s=times_s, shifts_m=shifts_m)


@pytest.mark.parametrize("way", slow_where_explicit(SOLID))
def test_two_cubes_and_an_instrument_never_overlap(play, cube, trespass, way):
    """They fall on a floor beside each other, and a ball is driven into one of them and dragged along."""
    path = [0.0, 0.1, 0.15, 0.25], [[0, 0, 0], [0, 0, -0.12], [0.05, 0, -0.12], [0.05, 0, 0]]
    contact = blocks.Contact(instruments=[FLOOR, ball([0.05, 0.05, 0.2], *path, 0.03)], friction=MU)
    shifts, steps = [[0.0, 0.0, 0.005], [0.13, 0.01, 0.005]], round(0.25 / SOLID[way]["step_s"])
    ran = play([cube(2)] * 2, shifts, steps=steps, gravity=WEIGHT, contact=contact, **SOLID[way])
    assert np.isfinite(ran.motion.positions).all()
    room, faults = trespass(ran.motion)
    assert room > 0.0 and not faults
    assert ran.motion.observed["ball_force_z_n"].max() > 0.1


@pytest.mark.parametrize("way", slow_where_explicit(THIN))
def test_a_fast_ball_never_gets_through_a_thin_sheet(play, cloth, trespass, way):
    """10 m/s, so that in 10 ms it goes ten times its radius."""
    sheet = cloth(4)
    rim = np.flatnonzero((np.isclose(sheet.nodes[:, :2], 0.0) | np.isclose(sheet.nodes[:, :2], 0.1)).any(axis=1))
    contact = blocks.Contact(instruments=[ball([0.052, 0.047, 0.06], [0.0, 0.02], [[0, 0, 0], [0, 0, -0.2]])])
    steps = round(0.03 / THIN[way]["step_s"])
    ran = play([replace(sheet, held=rim)], steps=steps, held=True, contact=contact, **THIN[way])
    room, faults = trespass(ran.motion, solid=False)
    assert room > 0.0 and not faults
    assert ran.motion.positions[-1][:, 2].min() < -0.15  # the ball's bottom is at -0.15


def test_forces_on_obstacles_are_the_sums_of_the_contacts(play, cube):
    contact = blocks.Contact(instruments=[FLOOR])
    ran = play([cube(1)], [[0.0, 0.0, 0.001]], steps=30, gravity=WEIGHT, contact=contact, rayleigh=LOSS)
    table, seen = ran.motion.contacts, ran.motion.observed.set_index("time_s")
    assert set(table["first"]) == {"cube"} and set(table["second"]) == {"ground"}
    assert (table["gap_m"] > 0.0).all()
    for time, rows in table.groupby("time_s"):
        total = -(rows["force_n"].to_numpy() @ rows[["normal_x", "normal_y", "normal_z"]].to_numpy())
        forces = [seen.loc[time, f"ground_force_{axis}_n"] for axis in "xyz"]
        assert forces == pytest.approx(total, rel=1e-9, abs=1e-9)


@pytest.mark.slow
def test_a_pile_comes_to_rest_and_bears_its_weight(play, cube, trespass):
    parts, shifts = [cube(1)] * 3, [[0.0, 0.0, 0.02], [0.006, 0.008, 0.15], [-0.003, 0.004, 0.28]]
    contact = blocks.Contact(instruments=[FLOOR], friction=0.5)
    damping = blocks.Rayleigh(mass_1_s=3.0, stiffness_s=0.03)
    ran = play(parts, shifts, steps=700, gravity=WEIGHT, contact=contact, rayleigh=damping)
    energy, weight = ran.motion.energy, 9.81 * 3.0
    drop = energy["gravity_j"].iloc[0] - energy["gravity_j"].iloc[-1]
    quiet = energy[energy["time_s"] > 5.0]
    assert drop > 0.5 and quiet["kinetic_j"].max() < 1e-8 * drop
    force = ran.motion.observed.set_index("time_s").loc[5.0:, "ground_force_z_n"]
    assert np.abs(force + weight).max() < 1e-3 * weight
    assert np.diff(energy["total_j"]).max() < 1e-9 * drop
    late = replace(ran.motion, positions=ran.motion.positions[::10])
    room, faults = trespass(late)
    assert room > 0.0 and not faults


@pytest.mark.parametrize("degrees", [15.0, 26.0, 35.0])
def test_coulombs_cone(play, cube, degrees):
    """On a tilted plane a block of friction 0.5, whose angle is 26.57°, sticks below that angle and slides above."""
    mu, slip, tilt = 0.5, 1e-3, np.radians(degrees)
    pull = blocks.Gravity(acceleration_m_s2=[9.81 * np.sin(tilt), 0.0, -9.81 * np.cos(tilt)])
    contact = blocks.Contact(friction=mu, slip_m_s=slip, instruments=[FLOOR])
    block = replace(cube(1), material=replace(cube(1).material, young_pa=5e4))
    acting = {"gravity": pull, "contact": contact, "rayleigh": LOSS.but(mass_1_s=0.0)}
    ran = play([block], [[0.0, 0.0, 2e-4]], steps=100, **acting)
    along = ran.motion.positions[:, :, 0] @ block.masses / block.masses.sum()
    speed = np.diff(along) / 0.01
    if np.tan(tilt) < mu:
        assert speed[-20:].max() < slip  # it creeps, but more slowly than the bound
        # f₁(v/slip) = 2 q − q² is the friction at a fraction q of the slip speed
        q = 1.0 - np.sqrt(1.0 - np.tan(tilt) / mu)
        assert speed[-1] == pytest.approx(q * slip, rel=0.05)
    else:
        expected = 9.81 * (np.sin(tilt) - mu * np.cos(tilt))
        assert (speed[-1] - speed[49]) / 0.5 == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("way", SOLID)
@pytest.mark.parametrize("speed", [1.0, pytest.param(10.0, marks=pytest.mark.slow)])
def test_bodies_that_collide_keep_momentum_and_gain_no_energy(cube, way, speed):
    acting = {name: block for name, block in SOLID[way].items() if name not in ("rayleigh", "velocity_damping")}
    particles = merge_particles([cube(2)] * 2, [[0.0, 0.0, 0.0], [0.02, 0.03, 0.15]], "meeting")
    scene = Scene(body="meeting", held=False, duration_s=1.0, contact=blocks.Contact(friction=MU), **acting)
    system, step = compose(scene, particles), scene.step_s
    stepper = integrator(scene.integrator).make(system, scene)
    x, masses = particles.nodes, particles.masses[:, None]
    v = np.zeros_like(x)
    v[:, 2] = np.where(np.arange(len(x)) < len(x) // 2, speed, -speed)
    least, start = np.inf, 0.5 * float((masses * v * v).sum())
    for i in range(min(round(0.06 / speed / step) + 2, 60)):
        system.at((i + 1) * step)
        x, v = stepper.step(x, v, step)
        system.relax(x, step)
        least = min(least, len(system.effects["contact"].contacts(x)) or np.inf)
        assert np.abs((masses * v).sum(axis=0)).max() < 1e-12 * masses.sum() * speed
        # an explicit scheme's energy oscillates about the true one
        assert 0.5 * float((masses * v * v).sum()) + system.energy(x) < (1.0 + 1e-9) * start
    assert np.isfinite(least)  # they have touched


def test_the_reaction_of_a_cone_agrees_with_that_of_a_solved_step(play, cube, tmp_path):
    """Where a surface has just been moved the barrier may push with 1e14 N: residuals are not relative to that."""
    import pyvista

    cone = pyvista.Cone(center=(0, 0, 0.0), direction=(0, 0, -1), height=0.04, radius=0.02, resolution=8)
    cone.triangulate().save(tmp_path / "cone.stl")
    block = cube(3)
    block = replace(block, held=np.flatnonzero(block.nodes[:, 2] == 0.0))
    path = {"times_s": [0.0, 0.08], "shifts_m": [[0.05, 0.05, 0.125], [0.05, 0.05, 0.105]]}
    contact = blocks.Contact(instruments=[blocks.Triangles(name="cone", file=str(tmp_path / "cone.stl"), **path)])
    ran = play([block], steps=40, held=True, contact=contact, rayleigh=LOSS)
    felt = ran.motion.observed["cone_force_z_n"].to_numpy()
    pressed, still = felt[3:8], felt[-5:]
    assert (np.diff(pressed) > 0.0).all() and pressed[0] > 0.1
    # at rest the elastic forces alone carry it
    forces = np.zeros_like(block.nodes)
    linear_elements.make(block, None).add_force(ran.motion.positions[-1], forces, forces)
    assert still[-1] == pytest.approx(np.delete(forces, block.held, axis=0)[:, 2].sum(), rel=1e-2)
    assert np.ptp(still) < 1e-2 * still[-1]


@pytest.mark.parametrize("name", ["backward_euler", "symplectic_euler"])
def test_a_step_too_long_for_a_path_around_held_nodes_is_cut(play, cube, name):
    """From one side to the other over the top: the straight path would cross the block, of which one corner is free."""
    block = replace(cube(1), held=np.arange(7))
    path = [0.0, 0.3, 0.7, 1.0], [[0, 0, 0], [0, 0, 0.1], [0.2, 0, 0.1], [0.2, 0, 0]]
    acting = {"held": True, "contact": blocks.Contact(instruments=[ball([-0.05, 0.05, 0.06], *path)])}
    ran = play([block], step_s=1.0, steps=1, integrator=name, allow_unstable=True, **acting)
    assert np.isfinite(ran.motion.positions).all()
    assert ran.motion.obstacles[0].positions[-1][0] == pytest.approx([0.15, 0.05, 0.06])


def test_what_is_driven_into_held_nodes_ends_in_one_sentence(play, cube):
    block = replace(cube(1), held=np.arange(8))
    driven = ball([0.05, 0.05, 0.12], [0.0, 0.1], [[0, 0, 0], [0, 0, -0.1]]).but(name=None)
    with pytest.raises(NotConverged, match=r"scenes.played, at 0 s: .*sphere_0 is driven into held nodes") as error:
        play([block], held=True, contact=blocks.Contact(instruments=[driven]))
    assert ". " not in str(error.value).replace("scenes.", "")


HERTZ = runpy.run_path(str(Path(__file__).parents[1] / "benchmarks/hertz.py"))


@pytest.mark.slow
def test_the_error_halves_with_the_mesh():
    coarse, fine = (HERTZ["pressed"](cells, 40.0, 2.0, 0.01)[-1] - 1.0 for cells in (1, 2))
    assert 0.0 < fine < 0.55 * coarse < 0.3


def test_a_wide_gap_presses_early_by_as_much_as_it_is_wide():
    """The gap changes the force as much as the same additional depth does."""
    narrow, wide = (HERTZ["pressed"](1, 30.0, 2.5, gap)[-1] for gap in (0.01, 0.2))
    assert 1.15**1.5 < wide / narrow < 1.2**1.5
