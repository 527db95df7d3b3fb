"""Modes move as the mesh does: exactly with all of them, and nearly with the few of a place that is pushed."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.body import Body, nest
from palpate.bodies.material import LAWS, Material
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.simple_shapes import box
from palpate.errors import InputError, NotConverged
from palpate.models.reduced_body import ReducedBody, bends, vibrations
from palpate.models.reduced_motion import CarriedBfgs
from palpate.scenes.run_scene import compose, run
from palpate.scenes.scene import Scene
from palpate.solvers.equilibrium import Equilibrium

TIP = {"at_m": [0.1, 0.02, 0.04], "radius_m": 0.03}
PUSH = TIP | {"force_n": [0, 0.05, -0.2], "start_s": 0.0, "press_s": 0.1, "hold_s": 0.1, "release_s": 0.1}
RAYLEIGH = {"mass_1_s": 5.0, "stiffness_s": 0.005}
SCENE = Scene(
    "poke",
    ["corotational", "held", "push", "rayleigh"],
    "reduced",
    step_s=0.01,
    duration_s=0.4,
    frames=20,
    settings={"push": {"loads": [PUSH]}, "rayleigh": RAYLEIGH, "reduced": {"coarsened": 1}},
)


def bar(law: str = "corotational", counts=(4, 2, 2), refinements: int = 1) -> Body:
    mesh = box([0.1, 0.04, 0.04], list(counts))
    held = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    return nest("bar", mesh, refinements, held, Material(20000.0, 0.3, 1000.0, law))


@pytest.fixture(scope="module")
def body() -> Body:
    return bar()


@pytest.fixture(scope="module")
def particles(body) -> Particles:
    return particles_of(body, 1, surface=False)


@pytest.fixture(scope="module")
def truth(particles) -> np.ndarray:
    return of_mesh(SCENE, particles, 0.00125)


def changed(scene: Scene, reduced: dict | None = None, **rest) -> Scene:
    settings = {k: v for k, v in scene.settings.items() if k != "reduced" or rest.get("integrator", "") != "bdf2"}
    settings |= {} if reduced is None else {"reduced": scene.settings["reduced"] | reduced}
    return replace(scene, settings=settings, **rest)


def of_mesh(scene: Scene, particles: Particles, step_s: float) -> np.ndarray:
    """The positions that all nodes of the mesh have by BDF2."""
    return run(changed(scene, integrator="bdf2", step_s=step_s), particles).motion.positions


def of_modes(scene: Scene, particles: Particles) -> np.ndarray:
    return run(scene, particles).motion.positions


def made(scene: Scene, particles: Particles) -> tuple:
    system = compose(scene, particles)
    return system, ReducedBody.of(system, scene.integration["reduced"])


def wrong(found: np.ndarray, truth: np.ndarray) -> float:
    """RMSE over the peak."""
    moved = np.linalg.norm(truth - truth[0], axis=2)
    return float(np.sqrt(np.mean(np.sum((found - truth) ** 2, axis=2))) / moved.max())


def test_vibrations_are_those_of_the_dense_problem(particles):
    system, _ = made(SCENE, particles)
    matrix = system.stiffness(particles.nodes, True)
    system.hold(matrix)
    free = np.repeat(system.free, 3)
    dense, masses = matrix.toarray()[np.ix_(free, free)], np.repeat(particles.masses, 3)[free]
    squares = np.linalg.eigvalsh(dense / np.sqrt(np.outer(masses, masses)))

    def solve(force):
        moved = np.zeros(free.size)
        moved[free] = np.linalg.solve(dense, force.ravel()[free])
        return moved.reshape(-1, 3)

    modes, frequencies = vibrations(solve, particles.masses, system.free, 5)
    assert frequencies**2 == pytest.approx(squares[:5], rel=1e-8)
    flat = modes.reshape(5, -1)
    assert flat @ (np.repeat(particles.masses, 3)[:, None] * flat.T) == pytest.approx(np.eye(5), abs=1e-8)
    assert (flat @ matrix @ flat.T) == pytest.approx(np.diag(squares[:5]), rel=1e-6, abs=1e-6 * squares[0])
    with pytest.raises(InputError, match="free coordinates"):
        vibrations(solve, particles.masses, system.free, int(free.sum()))


def test_bends_are_what_a_static_answer_lacks_to_second_order(body, particles):
    system, _ = made(SCENE, particles)
    system.at(0.15)
    load = system.outer_force(particles.nodes, np.zeros_like(particles.nodes))
    equilibrium = Equilibrium(body, 1)
    linear = equilibrium.linear_solver()(load)
    second = bends(system.elastic, particles.nodes, equilibrium.linear_solver(), linear[None], particles.size)[0]
    share, peak = 0.05, np.linalg.norm(linear, axis=1).max()
    there, back = (equilibrium.solve(s * load, 1e-11).x - particles.nodes for s in (share, -share))
    found = (there + back) / share**2 / peak**2
    assert np.linalg.norm(second - found) < 0.02 * np.linalg.norm(found)


@pytest.mark.parametrize("law", LAWS)
def test_elements_as_cells_have_the_energy_and_the_forces_of_the_mesh(law):
    particles = particles_of(bar(law), 1, surface=False)
    scene = replace(changed(SCENE, {"coarsened": 0}), effects=[law, *SCENE.effects[1:]])
    system, reduced = made(scene, particles)
    q = 0.03 * np.random.default_rng(0).normal(size=reduced.count) * np.sqrt(system.elastic.energy(particles.nodes) + 1)
    q *= 0.2 * particles.size / np.abs(reduced.expand(q)).max()
    x = particles.nodes + reduced.expand(q)
    energy, gradient = reduced.cells.evaluate(q)
    assert energy == pytest.approx(system.energy(x), rel=1e-10)
    assert gradient == pytest.approx(
        -reduced.project(system.potential_force(x)), rel=1e-8, abs=1e-10 * np.abs(gradient).max()
    )
    assert reduced.cells.least_det(q) == pytest.approx(system.elastic.least_det(x))


@pytest.mark.parametrize("law", LAWS)
def test_coarser_cells_have_the_exact_stiffness_at_rest_and_few_modes_do(law):
    particles = particles_of(bar(law), 1, surface=False)
    system, reduced = made(replace(SCENE, effects=[law, *SCENE.effects[1:]]), particles)
    columns = [reduced.cells.evaluate(1e-7 * unit)[1] / 1e-7 for unit in np.eye(reduced.count)]
    assert np.array(columns) == pytest.approx(np.eye(reduced.count), abs=1e-4)
    assert np.abs(reduced.cells.modulus).max() > 0.05  # which the cells alone lack
    assert 19 < reduced.count <= 10 + 3 + 21
    assert not reduced.modes.reshape(-1, 3, reduced.count)[~system.free].any()


def test_all_modes_move_as_the_mesh_does():
    particles = particles_of(bar(counts=(2, 1, 1), refinements=0), 0, surface=False)
    settings = SCENE.settings | {"rayleigh": {"mass_1_s": 5.0, "stiffness_s": 0.0}}
    scene = replace(SCENE, settings=settings | {"reduced": {"coarsened": 0, "vibrations": 23}}, tolerance=1e-9)
    assert made(scene, particles)[1].count == 24
    found = of_modes(scene, particles)
    mesh = of_mesh(scene, particles, scene.step_s)
    assert np.abs(found - mesh).max() < 1e-5 * np.abs(mesh - mesh[0]).max() < 1e-2


def test_few_modes_follow_a_push_and_its_release_at_their_place_and_near_it_at_another(particles, truth):
    positions, other = of_modes(SCENE, particles), [{"at_m": [0.06, 0.02, 0.04], "radius_m": 0.03}]
    scenes = (changed(SCENE, {"places": places}) for places in (other, []))
    elsewhere, nowhere = (wrong(of_modes(scene, particles), truth) for scene in scenes)
    here = wrong(positions, truth)
    assert here < 0.015 and here < elsewhere < 0.05 < nowhere
    assert np.array_equal(positions, of_modes(SCENE, particles))
    held = np.flatnonzero(particles.nodes[:, 0] == 0.0)
    assert np.array_equal(positions[-1][held], particles.nodes[held])


def test_the_linear_part_that_cells_lack_is_what_makes_them_right(particles, truth, monkeypatch):
    monkeypatch.setattr("palpate.models.reduced_body.Cells.stiffness", property(lambda self: np.eye(34)))
    assert wrong(of_modes(SCENE, particles), truth) > 0.03


def test_a_weight_has_modes_of_its_own(particles):
    scene = replace(SCENE, effects=["corotational", "held", "gravity", "rayleigh"])
    settings = {k: v for k, v in SCENE.settings.items() if k != "push"}
    scene = replace(scene, settings=settings | {"gravity": {"acceleration_m_s2": [0, 0, -5.0]}}, step_s=0.005)
    mesh = of_mesh(scene, particles, 0.00125)
    assert wrong(of_modes(scene, particles), mesh) < 0.01


def test_damping_turns_with_the_body_and_is_that_of_the_mesh(particles):
    settings = SCENE.settings | {"rayleigh": {"mass_1_s": 0.0, "stiffness_s": 0.05}}
    scene = replace(SCENE, settings=settings)
    mesh = of_mesh(scene, particles, 0.00125)
    assert wrong(of_modes(scene, particles), mesh) < 0.015


def test_what_modes_cannot_do_is_refused(particles):
    refused = {
        r"integrator is reduced: .* the scene has contact": {"effects": [*SCENE.effects, "contact"]},
        "a body that is held": {"effects": ["corotational", "push", "rayleigh"], "held": False},
        "start: rest": {"start": "inverted"},
        "needs finite elements": {"effects": ["springs", "held", "push"]},
    }
    for told, changes in refused.items():
        with pytest.raises(InputError, match=told):
            run(replace(SCENE, **changes), particles)
    with pytest.raises(InputError, match="no multiple of 64"):
        run(changed(SCENE, {"coarsened": 2}), particles_of(bar(counts=(1, 1, 1)), 1, surface=False))


def test_what_flattens_cells_is_not_answered(particles):
    heavy = SCENE.settings | {"push": {"loads": [PUSH | {"force_n": [0, 0.5, -2.0]}]}}
    with pytest.raises(NotConverged, match="of its volume"):
        run(replace(changed(SCENE, {"coarsened": 0}), settings=heavy | {"reduced": {"coarsened": 0}}), particles)


HESSIAN = np.array([[3.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 1.0]])


class Bowl:
    """½ qᵀHq − pull·q, which counts its calls."""

    def __init__(self, pull):
        self.pull, self.calls = np.array(pull), 0

    def __call__(self, q):
        self.calls += 1
        return float(0.5 * q @ HESSIAN @ q - self.pull @ q), HESSIAN @ q - self.pull


def rosenbrock(q):
    a, b = q
    value = 100.0 * (b - a * a) ** 2 + (1.0 - a) ** 2
    return value, np.array([-400.0 * a * (b - a * a) - 2.0 * (1.0 - a), 200.0 * (b - a * a)])


def test_the_next_minimum_is_found_in_fewer_steps():
    search, first, second = CarriedBfgs(np.ones(3)), Bowl([1.0, -2.0, 3.0]), Bowl([-3.0, 1.0, 2.0])
    for bowl in (first, second):
        q, left = search.minimise(bowl, np.zeros(3), 1e-6, 0.0, 50)
        assert left <= 1e-6 and np.abs(HESSIAN @ q - bowl.pull).max() <= 1e-6
    assert second.calls <= 5 < 8 < first.calls


def test_a_bent_valley_is_followed_downhill_and_what_is_left_is_told():
    """As where iterations end; and nothing where rounding ends the search."""
    (q, left), (_, early) = (
        CarriedBfgs(np.full(2, 0.01)).minimise(rosenbrock, np.array([-1.2, 1.0]), 1e-8, 0.0, n) for n in (100, 3)
    )
    assert left <= 1e-8 and np.abs(q - 1.0).max() < 1e-7 and early > 1e-3
    bowl = Bowl([1.0, -2.0, 3.0])

    def coarse(q):
        value, gradient = bowl(q)
        return value + 1e-9 * np.sin(1e9 * q.sum()), gradient + 1e-7

    assert CarriedBfgs(np.ones(3)).minimise(coarse, np.zeros(3), 1e-14, 0.0, 40)[1] > 1e-14
    q, left = CarriedBfgs(np.ones(3)).minimise(coarse, np.zeros(3), 1e-14, 1e-8, 60)
    assert left <= 1e-14 and np.abs(HESSIAN @ q - bowl.pull).max() < 1e-4


def test_a_hessian_that_leads_nowhere_is_forgotten():
    search = CarriedBfgs(np.ones(3))
    search._inverse = -np.eye(3)
    q, left = search.minimise(Bowl([1.0, -2.0, 3.0]), np.zeros(3), 1e-8, 0.0, 50)
    assert left <= 1e-8
    assert search.minimise(lambda q: (0.0, np.full(3, np.nan)), q, 1e-8, 0.0, 50)[1] != 0.0
