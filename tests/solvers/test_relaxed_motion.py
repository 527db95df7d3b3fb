"""XPBD, projective dynamics and vertex block descent in motion: what they converge to, and what they survive."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import particles_of
from palpate.bodies.simple_shapes import box, sheet
from palpate.effects.triangles import Triangles
from palpate.errors import InputError, NotConverged
from palpate.scenes.run_scene import run
from palpate.scenes.scene import Scene
from palpate.solvers.moved_parts import FlatElements, springs_of
from palpate.solvers.projective_dynamics import laplacian
from palpate.solvers.xpbd import Constraints

MANY = {
    "xpbd": {"iterations": 400},
    "projective_dynamics": {"iterations": 60, "memory": 5},
    "vertex_block_descent": {"sweeps": 200, "radius": 0.95},
}
"""So many iterations that a step converges."""
FEW = {
    "xpbd": {"iterations": 1},
    "projective_dynamics": {"iterations": 3, "memory": 0},
    "vertex_block_descent": {"sweeps": 3, "radius": 0.0},
}
methods = pytest.mark.parametrize("method", MANY)
WEIGHT = {"acceleration_m_s2": [0, 0, -9.81]}


@pytest.fixture(scope="module")
def bar():
    mesh = box([0.1, 0.03, 0.03], [5, 2, 2])
    return particles_of(
        nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(20000.0, 0.3, 1000.0)), 0, surface=False
    )


@pytest.fixture(scope="module")
def cloth():
    mesh = sheet([0.1, 0.1], [4, 4], 0.002)
    held = np.flatnonzero(mesh.nodes[:, 0] < 1e-9)
    return particles_of(nest("cloth", mesh, 0, held, Material(50000.0, 0.3, 1000.0)), 0, surface=False)


def scene(integrator, steps, weight=WEIGHT, damping=(0.0, 0.0), duration_s=0.1, **more) -> Scene:
    """A bar that sags; ``damping`` is Rayleigh's."""
    effects, settings = ["corotational", "gravity", "held"], {"gravity": weight}
    if any(damping):
        effects, settings = [*effects, "rayleigh"], settings | {
            "rayleigh": dict(zip(("mass_1_s", "stiffness_s"), damping, strict=True))
        }
    settings |= {integrator: more.pop("own", MANY.get(integrator, {}))} | more.pop("settings", {})
    return Scene(
        "bar",
        more.pop("effects", effects),
        integrator,
        step_s=duration_s / steps,
        duration_s=duration_s,
        frames=5,
        settings=settings,
        tolerance=1e-10,
        **more,
    )


def apart(one, other) -> float:
    """The largest distance of two motions over the largest displacement of the second."""
    return float(np.abs(one.positions - other.positions).max() / np.abs(other.positions - other.rest).max())


@methods
@pytest.mark.parametrize("damping", [(0.0, 0.0), (3.0, 0.0)])
def test_with_many_iterations_a_step_is_backward_eulers(bar, method, damping):
    """Of the same law, undamped and damped by mass, at steps in which the bar sags by a fifth of its length."""
    expected = run(scene("backward_euler", 20, damping=damping), bar).motion
    assert apart(run(scene(method, 20, damping=damping), bar).motion, expected) < 1e-4


@methods
def test_damping_by_stiffness_is_rayleighs_for_small_strain(bar, method):
    """With a twentieth of the weight what is left is a twentieth, but for XPBD, which damps along the strain alone."""
    off, undamped = [], []
    for share in (1.0, 0.05):
        weight = {"acceleration_m_s2": [0, 0, -9.81 * share]}
        plain, damped = (run(scene("backward_euler", 20, weight, (0.0, beta)), bar).motion for beta in (0.0, 0.02))
        off.append(apart(run(scene(method, 20, weight, (0.0, 0.02)), bar).motion, damped))
        undamped.append(apart(plain, damped))
    if method == "projective_dynamics":
        assert max(off) < 1e-6
    else:
        assert off[1] < 0.1 * off[0] and off[0] < 0.1 * undamped[0]


@methods
def test_errors_fall_with_the_step_of_one_iteration_in_first_order(bar, method):
    """Against second-order steps far shorter."""
    expected = run(scene("bdf2", 1600), bar).motion
    one = {"xpbd": {"iterations": 1}, "vertex_block_descent": {"sweeps": 1, "radius": 0.0}}
    own = one.get(method, {"iterations": 1, "memory": 0})
    off = [apart(run(scene(method, steps, own=own), bar).motion, expected) for steps in (400, 800, 1600)]
    assert all(0.8 < np.log2(a / b) < 2.5 for a, b in pairwise(off)) and off[-1] < 0.05
