"""Quadratic elements in motion against closed solutions, modes, scikit-fem and statics."""

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh
from scipy.spatial import cKDTree
from skfem import Basis, BilinearForm, ElementTetP2, MeshTet

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import particles_of
from palpate.bodies.refinement import finer, quadratic_prolongation, refine
from palpate.effects import rayleigh
from palpate.effects.held import Held
from palpate.effects.push import placed
from palpate.effects.quadratic_elements import QuadraticElements
from palpate.effects.settings import Gravity, Load, Loads, Push, Rayleigh, Stepping
from palpate.errors import NotConverged
from palpate.solvers import bdf2
from palpate.solvers.equilibrium import Unbuckled
from palpate.solvers.quadratic_motion import QuadraticMotion, mass_matrix
from palpate.solvers.system import System

YOUNG, DENSITY, LENGTH = 20000.0, 1000.0, 0.2
NONE, LIGHT = Rayleigh(mass_1_s=0.0, stiffness_s=0.0), Rayleigh(mass_1_s=1.0, stiffness_s=0.01)
PUSH = Load(at_m=[0.2, 0.02, 0.04], force_n=[0, 0, -0.3], radius_m=0.03, press_s=0.2, hold_s=9.0, release_s=0.0)


def bar(box, poisson=0.3, divisions=(5, 1, 1), level=0) -> Body:
    mesh = box(list(divisions), [LENGTH, 0.04, 0.04])
    body = nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(YOUNG, poisson, DENSITY))
    return finer(body, level + 1)


def weight(acceleration: float) -> Loads:
    return Loads(gravity=Gravity(acceleration_m_s2=[acceleration, 0.0, 2.0 * acceleration]))


def pushed(body: Body, load: Load) -> Loads:
    return Loads(push=Push(loads=placed(body.levels[0], body.anchors[0], "bar", [load])))


def moved(motion: QuadraticMotion, duration_s: float, count: int, tolerance=1e-8) -> np.ndarray:
    """Return displacements (count, n, 3) [m] after each step."""
    steps = motion.steps(duration_s / count, count, tolerance)
    return np.array([reached.x for reached in steps]) - motion.mesh.nodes


def modes(motion: QuadraticMotion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return which unknowns are free (3n,), angular frequencies [1/s] and modes of a body at rest."""
    rest = motion.mesh.nodes
    free = np.repeat(~motion.held, 3)
    stiffness = motion.elements.stiffness(rest).toarray()[np.ix_(free, free)]
    masses = np.kron(motion.masses.toarray(), np.eye(3))[np.ix_(free, free)]
    squares, vectors = eigh(stiffness, masses)
    return free, np.sqrt(squares), vectors


def test_masses_are_those_of_scikit_fem(box):
    mesh = box([1, 1, 1], [0.1, 0.1, 0.1])
    mesh = TetMesh(mesh.nodes @ np.array([[1.0, 0.1, 0.2], [0.0, 1.0, 0.1], [-0.1, 0.0, 1.0]]), mesh.tetrahedra)
    basis = Basis(MeshTet(mesh.nodes.T.copy(), mesh.tetrahedra.T.copy(), sort_t=False), ElementTetP2(), intorder=4)
    order = cKDTree(basis.doflocs.T).query(refine(mesh)[0].nodes)[1]
    expected = BilinearForm(lambda u, v, w: DENSITY * u * v).assemble(basis).toarray()[np.ix_(order, order)]
    found = mass_matrix(mesh, DENSITY * mesh.volumes).toarray()
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


def test_a_bar_swings_along_itself_at_the_frequency_of_its_wave(box):
    """Without contraction ω = π/2L √(E/ρ); quadratic elements miss ω² by the order of 4 in their size."""
    exact, off = 0.5 * np.pi / LENGTH * np.sqrt(YOUNG / DENSITY), []
    for count in (2, 4, 8):
        motion = QuadraticMotion(bar(box, 0.0, (count, 1, 1)), 0, weight(0.1), NONE)
        free, frequencies, vectors = modes(motion)
        along = np.zeros((len(free), vectors.shape[1]))
        along[free] = vectors
        shares = np.einsum("nk,nk->k", along[::3], along[::3]) / np.einsum("nk,nk->k", along, along)
        off.append(frequencies[shares > 0.99][0] / exact - 1.0)
    assert off[0] > 12.0 * off[1] > 144.0 * off[2] > 0.0 and off[2] < 1e-5


@pytest.mark.parametrize("damping", [NONE, Rayleigh(mass_1_s=3.0, stiffness_s=0.01)])
def test_small_motions_are_the_sum_of_their_modes_to_the_second_order_of_the_step(box, damping):
    """Under a weight that acts from 0 on, each mode follows that of a damped oscillator in closed form."""
    motion = QuadraticMotion(bar(box, divisions=(3, 1, 1)), 0, weight(1e-3), damping)
    free, w, vectors = modes(motion)
    mass = np.kron(motion.masses.toarray(), np.eye(3))[np.ix_(free, free)]
    decay = 0.5 * (damping.mass_1_s + damping.stiffness_s * w**2)
    one, other = (-decay + side * np.sqrt((decay**2 - w**2).astype(complex)) for side in (1.0, -1.0))
    t = 0.25
    left = (one * np.exp(other * t) - other * np.exp(one * t)) / (one - other)
    expected = vectors @ (vectors.T @ motion.load_at(0.0).ravel()[free] / w**2 * (1.0 - left.real))
    slow = vectors[:, :4]  # steps do not resolve faster ones, which hardly move
    wanted, off = slow.T @ mass @ expected, []
    for count in (5, 10, 20):
        found = slow.T @ mass @ moved(motion, t, count, 1e-5)[-1].ravel()[free]
        off.append(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))
    assert off[2] < 1e-3 and 3.5 < off[0] / off[1] < 4.5 and 3.5 < off[1] / off[2] < 4.5


def test_what_the_loads_do_is_kept_or_damped_to_the_second_order_of_the_step(box):
    off = []
    motion = QuadraticMotion(bar(box), 0, weight(5.0), LIGHT)
    for count in (40, 80):
        done = list(motion.steps(0.4 / count, count, 1e-9))
        work, lost = sum(each.work_j for each in done), sum(each.lost_j for each in done)
        energy = motion.total_energy(done[-1].x, done[-1].v)
        assert np.linalg.norm(done[-1].middle, axis=1).max() > 0.3 * LENGTH and lost > 0.05 * work
        off.append(abs(energy + lost - work) / work)
    assert off[0] < 0.003 and off[0] > 3.0 * off[1]


@pytest.mark.parametrize("level", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_damped_body_comes_to_rest_in_equilibrium(box, level):
    body = bar(box, level=level)
    motion = QuadraticMotion(body, level, pushed(body, PUSH), Rayleigh(mass_1_s=8.0, stiffness_s=0.05))
    at_rest = moved(motion, 4.0, 80)[-1]
    still = Unbuckled(body, level, 2)
    expected = still.solve(motion.load_at(1.0), 1e-8).x - still.mesh.nodes
    assert np.abs(expected).max() > 0.1 * LENGTH
    assert np.abs(at_rest - expected).max() < 1e-4 * np.abs(expected).max()


def test_a_coarser_motion_to_begin_with_changes_nothing(box):
    body = bar(box, level=1)
    coarse, fine = (QuadraticMotion(body, level, weight(3.0), LIGHT) for level in (0, 1))
    up = quadratic_prolongation(*body.levels[:2])
    begun = (up @ reached.middle for reached in coarse.steps(0.01, 30, 1e-6))
    alone, guided = list(fine.steps(0.01, 30, 1e-6)), list(fine.steps(0.01, 30, 1e-6, begun))
    off = np.abs(alone[-1].x - guided[-1].x).max()
    assert off < 1e-6 * LENGTH and alone[-1].convex


def test_a_step_that_is_not_found_is_told_with_its_time(box, monkeypatch):
    monkeypatch.setattr("palpate.solvers.incremental_potential.MOST_ITERATIONS", 1)
    motion = QuadraticMotion(bar(box), 0, weight(5.0), NONE)
    with pytest.raises(NotConverged, match="the step at 0 s stopped after 1 iterations"):
        list(motion.steps(0.05, 2, 1e-8))


class _Pushed:
    """The loads of a motion as an effect."""

    outer = True

    def __init__(self, motion: QuadraticMotion):
        self._motion, self._load = motion, motion.load_at(0.0)

    def at(self, t: float) -> None:
        self._load = self._motion.load_at(t)

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        force += self._load


@pytest.mark.slow
def test_the_bdf2_of_scenes_finds_the_same_large_damped_motion(box):
    """Another integrator, Newton's method and assembled matrices, on the same elements with the masses lumped."""
    body, duration_s = bar(box), 0.3
    loads = pushed(body, PUSH.but(press_s=0.1, hold_s=0.05, release_s=0.1))
    damping = Rayleigh(mass_1_s=2.0, stiffness_s=0.02)
    motion, particles = QuadraticMotion(body, 0, loads, damping), particles_of(body, 1, surface=False)
    motion.masses = sparse.diags_array(particles.masses).tocsr()
    elastic = QuadraticElements(body.levels[0], body.material)
    damped = rayleigh.make(particles, damping, elastic)
    ends = []
    for count in (150, 300):
        system = System(
            particles,
            {"elastic": elastic, "rayleigh": damped, "held": Held(body.anchors[1]), "push": _Pushed(motion)},
        )
        stepping = Stepping(step_s=duration_s / count, duration_s=duration_s)
        integrator, x, v = bdf2.make(system, stepping), particles.nodes, np.zeros_like(particles.nodes)
        for step in range(count):
            system.at((step + 1) * duration_s / count)
            x, v = integrator.step(x, v, duration_s / count)
        ends.append(x - particles.nodes)
    theirs = ends[1] + (ends[1] - ends[0]) / 3.0
    half, whole = (moved(motion, duration_s, count, 1e-6)[-1] for count in (60, 30))
    ours = half + (half - whole) / 3.0
    peak = np.linalg.norm(ours, axis=1).max()
    off, of_step = (np.linalg.norm(each - theirs, axis=1).max() for each in (ours, whole))
    assert peak > 0.1 * LENGTH and off < 3e-4 * peak and off < 0.15 * of_step, (off / peak, of_step / peak)
