"""XPBD, projective dynamics and vertex block descent in motion: what they converge to, and what they survive."""

from itertools import pairwise

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import particles_of
from palpate.bodies.simple_shapes import box, sheet
from palpate.effects import settings as blocks
from palpate.errors import InputError, NotConverged
from palpate.scenes import effect_registry
from palpate.scenes.run_scene import compose, run
from palpate.scenes.settings import Scene

MANY = {
    "xpbd": blocks.Xpbd(iterations=400),
    "projective_dynamics": blocks.ProjectiveDynamics(iterations=60, memory=5),
    "vertex_block_descent": blocks.VertexBlockDescent(sweeps=200, radius=0.95),
}
"""So many iterations that a step converges."""
SOME = MANY | {
    "projective_dynamics": blocks.ProjectiveDynamics(iterations=20, memory=5),
    "vertex_block_descent": blocks.VertexBlockDescent(sweeps=20, radius=0.95),
}
FEW = {
    "xpbd": blocks.Xpbd(iterations=1),
    "projective_dynamics": blocks.ProjectiveDynamics(iterations=3),
    "vertex_block_descent": blocks.VertexBlockDescent(sweeps=3),
}
ONE = FEW | {
    "projective_dynamics": blocks.ProjectiveDynamics(iterations=1),
    "vertex_block_descent": blocks.VertexBlockDescent(sweeps=1),
}
methods = pytest.mark.parametrize("method", MANY)
WEIGHT = blocks.Gravity(acceleration_m_s2=[0, 0, -9.81])


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


def scene(integrator, steps, own=None, damping=(0.0, 0.0), duration_s=0.1, **more) -> Scene:
    """A bar that sags; ``own`` : the integrator's settings; ``damping`` is Rayleigh's."""
    rayleigh = blocks.Rayleigh(**dict(zip(("mass_1_s", "stiffness_s"), damping, strict=True))) if any(damping) else None
    own = own or MANY.get(integrator)
    given = {"gravity": WEIGHT, "rayleigh": rayleigh} | ({integrator: own} if own else {}) | more
    times = {"step_s": duration_s / steps, "duration_s": duration_s, "frames": 5}
    return Scene(name="bar", body="bar", integrator=integrator, tolerance=1e-10, **times, **given)


def apart(one, other) -> float:
    """The largest distance of two motions over the largest displacement of the second."""
    return float(np.abs(one.positions - other.positions).max() / np.abs(other.positions - other.rest).max())


@pytest.mark.parametrize("method", ["projective_dynamics", "vertex_block_descent"])
@pytest.mark.parametrize("damping", [(0.0, 0.0), (3.0, 0.0)])
def test_with_many_iterations_a_step_is_backward_eulers(bar, method, damping):
    """Of the same law, undamped and damped by mass, while the bar sags by half of its length."""
    expected = run(scene("backward_euler", 20, damping=damping), bar).motion
    assert apart(run(scene(method, 20, damping=damping), bar).motion, expected) < 1e-9


@pytest.mark.slow
def test_xpbd_ends_beside_backward_eulers_step_by_what_vanishes_with_the_step(bar):
    """Corrections along constraints' directions that turn between iterations do not add up to the last direction's."""
    off = []
    for steps in (20, 40, 80):
        expected = run(scene("backward_euler", steps), bar).motion
        off.append(apart(run(scene("xpbd", steps), bar).motion, expected))
    assert off[0] < 0.05 and all(np.log2(a / b) > 1.0 for a, b in pairwise(off))


@methods
def test_damping_by_stiffness_is_rayleighs_for_small_strain(bar, method):
    """It takes off a fifth of the motion; XPBD's, along each element's strain alone, is off by a tenth of that."""
    off, taken = [], []
    for share in (1.0, 0.05):
        weight = blocks.Gravity(acceleration_m_s2=[0, 0, -9.81 * share])
        plain, damped, found = (
            run(scene(name, 20, damping=(0.0, beta), gravity=weight), bar).motion
            for name, beta in (("backward_euler", 0.0), ("backward_euler", 0.02), (method, 0.02))
        )
        off.append(apart(found, damped))
        taken.append(apart(plain, damped))
    assert min(taken) > 0.2
    most = {"projective_dynamics": (1e-9, 1e-9), "vertex_block_descent": (0.06, 0.002), "xpbd": (0.1, 0.04)}[method]
    assert off[0] < most[0] and off[1] < most[1]


@methods
def test_errors_of_one_iteration_fall_with_the_step_in_first_order(bar, method):
    """Against second-order steps that are short."""
    expected = run(scene("bdf2", 1600), bar).motion
    off = [apart(run(scene(method, steps, own=ONE[method]), bar).motion, expected) for steps in (400, 800, 1600)]
    assert all(0.7 < np.log2(a / b) < 1.6 for a, b in pairwise(off)) and off[-1] < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("method", ["projective_dynamics", "vertex_block_descent"])
def test_a_step_that_has_converged_gains_no_energy(bar, method):
    for steps in (10, 80):  # of 40 and 5 ms
        moved = run(scene(method, steps, duration_s=0.4), bar).motion
        assert moved.energy["gain_j"].iloc[-1] < 1e-9 and moved.energy["kinetic_j"].max() > 1e-3


@methods
def test_energy_that_steps_of_one_iteration_gain_vanishes_with_the_step(bar, method):
    """A weight is not borne at once: elements stretch before their neighbours know. XPBD's do so most."""
    found = {n: run(scene(method, n, duration_s=0.4, own=ONE[method]), bar).motion.energy for n in (10, 80, 400)}
    gains = {n: float(energy["gain_j"].iloc[-1]) for n, energy in found.items()}
    assert gains[400] < 5e-3 * found[400]["kinetic_j"].max() and gains[400] < 0.05 * gains[80]
    assert (gains[10] > 1.0) == (method == "xpbd")


DAMPED = (5.0, 0.01)


@pytest.fixture(scope="module")
def sagged(bar):
    return run(scene("backward_euler", 200, damping=DAMPED, duration_s=2.0), bar).motion


@pytest.mark.slow
@methods
@pytest.mark.parametrize("start", ["inverted", "point"])
def test_a_bar_comes_back_from_any_start_and_stays_finite_at_steps_of_40_ms(bar, sagged, method, start):
    """To its equilibrium; XPBD's single iterations bear less weight, so that it hangs lower."""
    long = run(scene(method, 40, damping=(1.0, 0.01), duration_s=1.6, own=FEW[method], start=start), bar).motion
    assert np.abs(long.positions - long.rest).max() < 0.5
    short = run(scene(method, 2000, damping=DAMPED, duration_s=2.0, own=FEW[method], start=start), bar).motion
    off = np.abs(short.positions[-1] - sagged.positions[-1]).max() / np.abs(sagged.positions[-1] - sagged.rest).max()
    assert off < (0.3 if method == "xpbd" else 0.02)


@methods
def test_what_is_not_finite_never_leaves(bar, method):
    stepped = scene(method, 10)
    stepper = effect_registry.integrator(method).make(compose(stepped, bar), stepped)
    x, v = bar.nodes.copy(), np.zeros_like(bar.nodes)
    v[-1] = np.nan
    with pytest.raises(NotConverged, match=method):
        stepper.step(x, v, 0.01)


@pytest.mark.parametrize(
    ("method", "most"), [("projective_dynamics", 1e-9), ("vertex_block_descent", 1e-6), ("xpbd", 0.1)]
)
def test_a_sheet_moves_as_by_backward_euler(cloth, method, most):
    """Stretched, bent and swinging down, by the law of its triangles."""
    own = blocks.VertexBlockDescent(sweeps=2000, radius=0.99) if method == "vertex_block_descent" else None
    expected = run(scene("backward_euler", 20, bending=blocks.Bending()), cloth).motion
    assert np.abs(expected.positions - expected.rest).max() > 0.02
    assert apart(run(scene(method, 20, own, bending=blocks.Bending()), cloth).motion, expected) < most


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "steps", "most"),
    [("xpbd", (100, 400), 0.02), ("projective_dynamics", (25, 100), 0.01), ("vertex_block_descent", (25, 100), 0.01)],
)
def test_errors_of_a_press_by_an_instrument_fall_with_the_step(bar, method, steps, most):
    """A ball pushed into the bar: contact is projected after each step, and its last force acts throughout the next."""
    path = {"times_s": [0.0, 0.1], "shifts_m": [[0, 0, 0], [0, 0, -0.02]]}
    ball = blocks.Ball(center_m=[0.08, 0.015, 0.0455], radius_m=0.015, **path)
    contact = blocks.Contact(instruments=[ball], friction=0.3, gap_m=5e-4)
    more = {"gravity": None, "contact": contact, "damping": (1.0, 0.005)}
    expected = run(scene("backward_euler", 400, **more), bar).motion
    own = ONE[method] if method == "xpbd" else SOME[method]
    off = [apart(run(scene(method, n, own=own, **more), bar).motion, expected) for n in steps]
    assert np.abs(expected.positions - expected.rest).max() > 0.015
    assert off[1] < 0.5 * off[0] and off[1] < most


def test_what_they_have_no_part_for_is_refused(bar):
    with pytest.raises(InputError, match="springs"):
        run(scene("xpbd", 10, springs=blocks.Springs()), bar)
    with pytest.raises(InputError, match="prony"):
        run(scene("vertex_block_descent", 10, prony=blocks.Prony(shares=[0.5], times_s=[0.1])), bar)
