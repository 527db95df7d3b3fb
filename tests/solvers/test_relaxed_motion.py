"""XPBD, projective dynamics and vertex block descent in motion: what they converge to, and what they survive."""

from itertools import pairwise

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import particles_of
from palpate.bodies.simple_shapes import box, sheet
from palpate.errors import InputError, NotConverged
from palpate.scenes import effect_registry
from palpate.scenes.run_scene import compose, run
from palpate.scenes.scene import Scene

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
ONE = {name: {**own, **dict.fromkeys({"iterations", "sweeps"} & own.keys(), 1)} for name, own in FEW.items()}
SOME = {name: {**own, **dict.fromkeys({"iterations", "sweeps"} & own.keys(), 20)} for name, own in MANY.items()}
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
        effects, settings = (
            [*effects, "rayleigh"],
            settings | {"rayleigh": dict(zip(("mass_1_s", "stiffness_s"), damping, strict=True))},
        )
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
        weight = {"acceleration_m_s2": [0, 0, -9.81 * share]}
        plain, damped = (run(scene("backward_euler", 20, weight, (0.0, beta)), bar).motion for beta in (0.0, 0.02))
        off.append(apart(run(scene(method, 20, weight, (0.0, 0.02)), bar).motion, damped))
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


@pytest.mark.slow
@methods
@pytest.mark.parametrize("start", ["inverted", "random", "point"])
def test_a_bar_comes_back_from_any_start_and_stays_finite_at_steps_of_40_ms(bar, method, start):
    """To its equilibrium; XPBD's single iterations bear less weight, so that it hangs lower."""
    long = run(scene(method, 40, damping=(1.0, 0.01), duration_s=1.6, own=FEW[method], start=start), bar).motion
    assert np.abs(long.positions - long.rest).max() < 0.5
    damping = (5.0, 0.01)
    short = run(scene(method, 2000, damping=damping, duration_s=2.0, own=FEW[method], start=start), bar).motion
    sagged = run(scene("backward_euler", 200, damping=damping, duration_s=2.0), bar).motion
    off = np.abs(short.positions[-1] - sagged.positions[-1]).max() / np.abs(sagged.positions[-1] - sagged.rest).max()
    assert off < (0.3 if method == "xpbd" else 0.02)


@methods
def test_what_is_not_finite_never_leaves(bar, method):
    system = compose(scene(method, 10), bar)
    stepper = effect_registry.integrator(method).make(system, scene(method, 10).integration)
    x, v = bar.nodes.copy(), np.zeros_like(bar.nodes)
    v[-1] = np.nan
    with pytest.raises(NotConverged, match=method):
        stepper.step(x, v, 0.01)


@pytest.mark.parametrize(
    ("method", "most"), [("projective_dynamics", 1e-9), ("vertex_block_descent", 1e-6), ("xpbd", 0.1)]
)
def test_a_sheet_moves_as_by_backward_euler(cloth, method, most):
    """Stretched, bent and swinging down, by the law of its triangles."""
    effects = ["triangles", "bending", "gravity", "held"]
    own = {"own": {"sweeps": 2000, "radius": 0.99}} if method == "vertex_block_descent" else {}
    expected = run(scene("backward_euler", 20, effects=effects), cloth).motion
    assert np.abs(expected.positions - expected.rest).max() > 0.02
    assert apart(run(scene(method, 20, effects=effects, **own), cloth).motion, expected) < most


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "steps", "most"),
    [("xpbd", (100, 400), 0.02), ("projective_dynamics", (25, 100), 0.01), ("vertex_block_descent", (25, 100), 0.01)],
)
def test_errors_of_a_press_by_an_instrument_fall_with_the_step(bar, method, steps, most):
    """A ball pushed into the bar: contact is projected after each step, and its last force acts throughout the next."""
    ball = {"kind": "sphere", "center_m": [0.08, 0.015, 0.0455], "radius_m": 0.015}
    ball |= {"times_s": [0.0, 0.1], "shifts_m": [[0, 0, 0], [0, 0, -0.02]]}
    more = {"effects": ["corotational", "held", "contact", "rayleigh"], "damping": (1.0, 0.005)}
    more["settings"] = {"contact": {"instruments": [ball], "friction": 0.3, "gap_m": 5e-4}}
    expected = run(scene("backward_euler", 400, **more), bar).motion
    own = ONE[method] if method == "xpbd" else SOME[method]
    off = [apart(run(scene(method, n, own=own, **more), bar).motion, expected) for n in steps]
    assert np.abs(expected.positions - expected.rest).max() > 0.015
    assert off[1] < 0.5 * off[0] and off[1] < most


def test_what_they_have_no_part_for_is_refused(bar):
    with pytest.raises(InputError, match="springs"):
        run(scene("xpbd", 10, effects=["springs", "gravity", "held"]), bar)
    with pytest.raises(InputError, match="prony"):
        run(
            scene(
                "vertex_block_descent",
                10,
                effects=["corotational", "prony", "held"],
                settings={"prony": {"shares": [0.5], "times_s": [0.1]}},
            ),
            bar,
        )
