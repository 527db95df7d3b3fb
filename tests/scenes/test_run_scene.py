"""Composing and running scenes."""

import re
from pathlib import Path

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import particles_of
from palpate.bodies.simple_shapes import cylinder
from palpate.errors import InputError, NotConverged
from palpate.scenes.run_scene import compose, decisions, effect_names, initial_positions, run
from palpate.scenes.settings import Scene

GUIDE = Path(__file__).parents[2] / "docs/add-an-effect.md"
GRAVITY = {"gravity": {"acceleration_m_s2": [0.5, 0, 0]}, "rayleigh": {"mass_1_s": 1.0, "stiffness_s": 0.01}}
SCENE = Scene(name="sag", body="bar", step_s=0.05, duration_s=0.5, frames=5, **GRAVITY)
SAGGING = SCENE.but(rayleigh=None)


@pytest.fixture(scope="module")
def bar():
    mesh = cylinder(0.2, 0.03)
    return nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] < 1e-6), Material(3000.0, 0.3, 1000.0))


@pytest.fixture(scope="module")
def particles(bar):
    return particles_of(bar, 0, surface=False)


def test_masses_are_the_bodys(bar, particles):
    mass = 1000.0 * bar.coarse.volumes.sum()
    assert particles.masses.sum() == pytest.approx(mass, rel=1e-12)
    skin = particles_of(bar, 0, surface=True)
    assert skin.masses.sum() == pytest.approx(mass, rel=1e-12)
    np.testing.assert_array_equal(skin.nodes, bar.coarse.nodes[bar.coarse.surface])
    np.testing.assert_array_equal(skin.nodes[skin.triangles], bar.coarse.nodes[bar.coarse.triangles])
    np.testing.assert_array_equal(skin.nodes[skin.held][:, 2], 0.0)
    with pytest.raises(InputError, match="level is 3"):
        particles_of(bar, 3, surface=False)


def test_a_run_is_reproducible_to_the_bit_and_costs_are_recorded(particles):
    first, second = run(SCENE, particles), run(SCENE, particles)
    assert set(first.effect_seconds) == {"corotational", "gravity", "held", "rayleigh"}
    assert sum(first.effect_seconds.values()) <= first.seconds
    assert first.effect_kb["gravity"] == pytest.approx(particles.nodes.nbytes / 1024, rel=0.1)
    assert np.array_equal(second.motion.positions, first.motion.positions)
    assert second.motion.energy.equals(first.motion.energy)


def test_what_is_not_named_is_not_there(particles):
    bare = SAGGING.but(gravity=None)
    assert list(compose(bare, particles).effects) == ["corotational", "held"]
    table = decisions(bare, particles).set_index("effect")
    assert not table.loc["gravity", "called"]
    assert table.loc["held", "called"] and "anchored" in table.loc["held", "reason"]
    whole = run(SCENE, particles).motion
    without = run(SCENE, particles, without="gravity").motion
    assert np.abs(whole.positions - particles.nodes).max() > 1e-3
    assert np.abs(without.positions - particles.nodes).max() < 1e-9


def test_an_unstable_step_is_refused_with_its_limit_unless_asked_for(particles):
    hasty = SAGGING.but(integrator="symplectic_euler")
    with pytest.raises(InputError, match=r"step_s is 0.05 s, and symplectic_euler takes steps of up to 0.00\d+ s"):
        run(hasty, particles)
    with pytest.raises(NotConverged, match="diverged"):
        run(hasty.but(allow_unstable=True, duration_s=100.0), particles)


@pytest.mark.parametrize("integrator", ["symplectic_euler", "backward_euler"])
def test_a_step_in_substeps_ends_where_as_many_steps_do(particles, integrator):
    """Frames and their number are those of whole steps."""
    fine = SAGGING.but(integrator=integrator, step_s=5e-4, duration_s=0.02)
    whole = run(fine.but(step_s=4e-3, substeps=8, frames=100), particles)
    parts = run(fine.but(frames=100), particles)
    assert whole.steps == 5 and parts.steps == 40
    np.testing.assert_allclose(whole.motion.times, 4e-3 * np.arange(6))
    np.testing.assert_array_equal(whole.motion.positions, parts.motion.positions[::8])
    assert whole.motion.energy["outer_work_j"].iloc[-1] == parts.motion.energy["outer_work_j"].iloc[-1]


def test_auto_takes_as_many_substeps_as_are_stable(particles):
    light = {"acceleration_m_s2": [0.05, 0, 0]}
    hasty = SAGGING.but(integrator="symplectic_euler", duration_s=5.0, gravity=light)
    moved = np.abs(run(hasty.but(substeps="auto"), particles).motion.positions - particles.nodes).max()
    assert 1e-3 < moved < 0.1
    with pytest.raises(InputError, match=r"step_s is 0.05 s in 2 substeps, and .* say substeps: auto"):
        run(hasty.but(substeps=2), particles)
    implicit = run(SCENE.but(substeps="auto"), particles).motion
    np.testing.assert_array_equal(implicit.positions, run(SCENE, particles).motion.positions)


RIGID = {"mode": "rigid", "alpha": 0.5, "beta": 0.0, "clusters": {"kind": "one"}}
STIFF = {"stiffness_n_m": 2e4, "damping_ratio": 0.1}


@pytest.mark.parametrize(
    ("integrator", "elastic", "more"),
    [
        ("goal_position", {"shape_matching": RIGID}, {"body_springs": STIFF}),
        ("goal_position", {"shape_matching": RIGID}, {"rayleigh": {"mass_1_s": 5e3, "stiffness_s": 0.0}}),
        ("symplectic_euler", {"springs": {}}, {"body_springs": STIFF}),
    ],
)
def test_explicit_steps_are_limited_by_what_is_not_elastic(particles, integrator, elastic, more):
    """Beyond the stated limit the step is refused; below it a body gains nothing."""
    stepped = {"body": "bar", "held": False, "integrator": integrator, "step_s": 0.01, "duration_s": 0.3, "frames": 5}
    loose = Scene(gravity={"acceleration_m_s2": [0, 0, -9.81]}, **stepped, **elastic, **more)
    with pytest.raises(InputError, match="takes steps of up to") as caught:
        run(loose, particles)
    limit = float(re.search(r"up to (\S+) s", str(caught.value))[1])
    moved = run(loose.but(step_s=0.99 * limit), particles).motion.positions - particles.nodes
    assert np.abs(moved).max() < 0.5 * 9.81 * 0.3**2 + 0.02


def test_an_own_effect_acts(particles, tmp_path):
    wind = tmp_path / "wind.py"
    wind.write_text(re.search(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.S)[1])
    own = {"own": {"wind": str(wind)}, "own_settings": {"wind": {"pressure_pa": 5.4}}}
    scene = SCENE.but(gravity=None, duration_s=0.2, **own)
    assert effect_names(scene, particles) == ["corotational", "held", "rayleigh", "wind"]
    blown = run(scene, particles).motion
    assert (blown.positions[-1] - particles.nodes)[:, 0].max() > 1e-4
    wind.write_text(wind.read_text().replace("outer = True", ""))
    with pytest.raises(InputError, match="wind has a force"):
        run(scene, particles)


@pytest.mark.parametrize("kind", ["rest", "inverted", "random", "plane", "line", "point"])
def test_starts(particles, kind):
    free = np.ones(len(particles.nodes), dtype=bool)
    free[particles.held] = False
    x = initial_positions(particles, free, kind, seed=1)
    np.testing.assert_array_equal(x[~free], particles.nodes[~free])
    rank = {"plane": 2, "line": 1, "point": 0}.get(kind, 3)
    spread = np.linalg.svd(x[free] - x[free].mean(axis=0), compute_uv=False)
    assert (spread > 1e-9).sum() == rank


def test_up_is_where_weight_comes_from_or_else_a_floors_axis_or_z(particles):
    floor = {"instruments": [{"kind": "floor", "axis": "y", "height_m": -1.0}]}
    loose = SAGGING.but(duration_s=0.05, held=False, gravity=None)
    scenes = SCENE.but(duration_s=0.05, contact=floor), loose.but(contact=floor), loose
    assert [run(scene, particles).motion.up for scene in scenes] == [0, 1, 2]
