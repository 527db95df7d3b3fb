"""An elastic bed: the closed solution of a block that sinks, and the integral behind it."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.contacts import contacts_of, pressed_contacts
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import merge_particles, particles_of
from palpate.bodies.refinement import refine
from palpate.bodies.settings import Bed as Rule
from palpate.bodies.settings import Sphere
from palpate.bodies.simple_shapes import box as simple_box
from palpate.bodies.supports import Bed, inner_nodes, read_bed
from palpate.bodies.surfaces.triangles import drop_unused
from palpate.effects.bed import BedSprings, make
from palpate.effects.settings import Gravity, Rayleigh
from palpate.errors import InputError
from palpate.scenes.run_scene import effect_names, run
from palpate.scenes.settings import Scene
from palpate.solvers.equilibrium import Equilibrium

BELOW = np.array([0.11, 0.09, 0.0])
BED = Bed(BELOW, 0.06, 2e4)
WHOLE = np.pi * BED.radius_m**2 / 3 * BED.stiffness_n_m3
"""∫ k over the plane: of (1 − q²)² over the unit disc it is π/3."""


@pytest.fixture(scope="module")
def block(box):
    """A block far stiffer than its bed, in the middle of whose underside the bed is."""
    mesh = box([5, 5, 2], [0.2, 0.2, 0.08], jitter=0.2)
    return nest("block", mesh, 1, np.empty(0, dtype=np.int64), Material(1e9, 0.3, 1000.0), bed=BED)


@pytest.mark.parametrize("order", [1, 2])
def test_the_stiffness_of_all_is_the_integral(block, order):
    springs = BedSprings(block.coarse, BED, order)
    count = springs.matrix.shape[0] // 3
    for axis in range(3):
        together = np.tile(np.eye(3)[axis], count)
        assert together @ springs.matrix @ together == pytest.approx(WHOLE, rel=1e-12)
    assert np.linalg.eigvalsh(springs.matrix.toarray()).min() > -1e-10 * WHOLE
    assert abs(springs.matrix - springs.matrix.T).max() < 1e-12 * WHOLE


@pytest.mark.parametrize("order", [1, 2])
def test_levels_have_the_same_energy(block, order):
    """Of a displacement that both can have: (x y, z, x²) for quadratic elements, a linear one for the others."""
    energies = []
    for level in (0, 1):
        nodes = block.levels[level].nodes if order == 1 else refine(block.levels[level])[0].nodes
        x, y, z = nodes.T
        moved = np.column_stack([x * y, z, x * x] if order == 2 else [x + y, z, 2 * x - 1])
        energies.append(BedSprings(block.levels[level], BED, order).energy(nodes + moved))
    assert energies[0] == pytest.approx(energies[1], rel=1e-12) and energies[0] > 0


def test_roots_have_the_energy(block):
    springs = BedSprings(block.coarse, BED)
    moved = np.random.default_rng(0).normal(size=block.coarse.nodes.shape)
    stretched = springs.roots @ moved[springs.couples]
    assert 0.5 * np.sum(stretched**2) == pytest.approx(springs.energy(block.coarse.nodes + moved), rel=1e-12)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("force", [[0.0, 0.0, -3.0], [2.0, -1.0, 0.5]])
def test_a_stiff_block_sinks_by_force_over_stiffness(block, order, force):
    """Under a force on the bed's middle, as it does not tilt then; spread over the block's underside."""
    problem = Equilibrium(block, 0, order)
    load = np.zeros_like(problem.mesh.nodes)
    springs = BedSprings(block.coarse, BED, order)
    load += (springs.matrix @ np.ones(load.size)).reshape(load.shape) / WHOLE * force
    solution = problem.solve(load, 1e-10)
    assert solution.x - problem.mesh.nodes == pytest.approx(np.tile(force, (len(load), 1)) / WHOLE, rel=1e-4, abs=1e-7)


def test_a_force_beside_the_middle_tilts_the_block(block):
    """By moment over ∫ k x², which over the unit disc is π/24."""
    nodes, height = block.coarse.nodes, 0.08
    second = np.pi * BED.radius_m**4 / 24 * BED.stiffness_n_m3
    problem = Equilibrium(block, 0)
    above = np.flatnonzero(np.isclose(nodes[:, 2], height))
    node = above[np.argmin(np.linalg.norm(nodes[above, :2] - [0.15, 0.1], axis=1))]
    load = np.zeros_like(nodes)
    load[node, 2] = -1e-4  # small, as a tilt is linear to first order only
    moved = problem.solve(load, 1e-10).x - nodes
    tilt = 1e-4 * (nodes[node, :2] - BELOW[:2]) / second
    expected = -1e-4 / WHOLE - (nodes[:, :2] - BELOW[:2]) @ tilt
    assert moved[:, 2] == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


@pytest.mark.parametrize("surface", [False, True])
def test_force_and_stiffness_are_derivatives_of_the_energy(slab, force_of, stiffness_of, check_derivatives, surface):
    body = replace(slab, bed=Bed(np.array([0.1, 0.05, 0.0]), 0.07, 3e4))
    particles = particles_of(body, 0, surface)
    springs = make(particles, None, None)
    x = particles.nodes + np.random.default_rng(1).normal(scale=0.01, size=particles.nodes.shape)
    check_derivatives(springs, x, 1e-4, force_error=1e-8, stiffness_error=1e-8)
    stiffness = stiffness_of(springs, x)
    assert stiffness == pytest.approx(springs.matrix.toarray(), abs=1e-12 * stiffness.max())
    assert springs.energy(particles.nodes) == 0.0 and not force_of(springs, particles.nodes).any()


def test_beds_of_several_bodies_hold_their_own(slab):
    """Moved with the body, and not the other body, although it reaches into the sphere."""
    bed = Bed(np.array([0.1, 0.05, 0.0]), 0.07, 3e4)
    part = particles_of(replace(slab, bed=bed), 0, False)
    both = merge_particles([part, part], [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]], "scene")
    one, two = BedSprings(part, part.beds), BedSprings(both, both.beds)
    moved = np.random.default_rng(0).normal(size=part.nodes.shape)
    n = len(part.nodes)
    for shift in ((moved, 0 * moved), (0 * moved, moved)):
        x = both.nodes + np.vstack(shift)
        assert two.energy(x) == pytest.approx(one.energy(part.nodes + moved), rel=1e-12)
    assert two.couples[: len(one.couples)].max() < n <= two.couples[len(one.couples) :].min()


def test_what_cannot_be_a_bed_is_refused(slab):
    rule = Rule(sphere=Sphere(center_m=[0.1, 0.05, 0.0], radius_m=0.07), stiffness_n_m3=3e4)
    assert read_bed("slab", rule, slab.coarse).radius_m == 0.07
    wrong = [
        (rule.but(sphere=Sphere(center_m=[1.0, 1.0, 1.0], radius_m=0.07)), "holds 0 nodes .* move or enlarge it"),
        (rule.but(sphere=Sphere(center_m=[0.1, 0.05, 0.0], radius_m=9.0)), "holds the whole surface, .* smaller"),
    ]
    for entry, message in wrong:
        with pytest.raises(InputError, match=rf"^body slab: bed.*{message}.*\.$"):
            read_bed("slab", entry, slab.coarse)


def test_what_lies_on_the_bed_is_not_pressed(slab):
    body = replace(slab, bed=Bed(np.array([0.2, 0.05, 0.0]), 0.06, 3e4))
    gone = np.setdiff1d(pressed_contacts(slab, contacts_of(slab)), pressed_contacts(body, contacts_of(body)))
    distance = np.linalg.norm(slab.coarse.nodes - body.bed.center_m, axis=1)
    assert len(gone) and np.array_equal(gone, np.intersect1d(np.flatnonzero(distance < 0.06), contacts_of(slab)))


def test_a_scene_finds_the_bed_by_itself_and_comes_to_rest_on_it(block):
    """Its weight is spread over the block and the bed is not under its middle, so that only the mean sinks by F / k."""
    heavy = replace(block, bed=replace(BED, center_m=np.array([0.1, 0.1, 0.0]), stiffness_n_m3=4e6))
    particles = particles_of(heavy, 0, False)
    blocks = {"gravity": Gravity(acceleration_m_s2=[0, 0, -9.81]), "rayleigh": Rayleigh(mass_1_s=20.0, stiffness_s=0.0)}
    scene = Scene(body="block", step_s=0.02, duration_s=1.0, **blocks)
    assert set(effect_names(scene, particles)) == {"corotational", "gravity", "bed", "rayleigh"}
    moved = run(scene, particles).motion.positions[-1] - particles.nodes
    middle = np.linalg.norm(particles.nodes[:, :2] - 0.1, axis=1) < 0.05
    weight = 9.81 * particles.masses.sum()
    assert moved[middle, 2].mean() == pytest.approx(-weight / (WHOLE * 200), rel=0.02)


def test_a_bed_holds_only_the_side_that_faces_it(block):
    """A ball of a bed so large that k hardly fades: what resists is the area of the underside times k."""
    rule = Rule(sphere=Sphere(center_m=[0.1, 0.1, 0.04], radius_m=1e3), stiffness_n_m3=2e4, facing=[0, 0, -3])
    bed = read_bed("block", rule, block.coarse)
    matrix = BedSprings(block.coarse, bed).matrix
    together = np.tile([1.0, 0.0, 0.0], len(block.coarse.nodes))
    assert together @ matrix @ together == pytest.approx(2e4 * 0.2 * 0.2, rel=1e-6)
    held = inner_nodes(block.coarse, bed)
    assert np.array_equal(held, np.flatnonzero(block.coarse.nodes[:, 2] == 0.0))
    whole = BedSprings(block.coarse, replace(bed, facing=None)).matrix
    assert together @ whole @ together == pytest.approx(2e4 * (2 * 0.04 + 4 * 0.2 * 0.08), rel=1e-6)
    with pytest.raises(InputError, match="holds the whole surface"):
        read_bed("block", rule.but(facing=None), block.coarse)
    with pytest.raises(InputError, match=r"bed\.facing is \[0, 0, 0\]"):
        read_bed("block", rule.but(facing=[0, 0, 0]), block.coarse)


SIDE = [0.2, 0.2, 0.2]
CUT_OUT = {
    "hollow": lambda x, y, z: (np.abs([x - 0.1, y - 0.1, z - 0.1]) < 0.06).all(axis=0),
    "slot": lambda x, y, z: (x > 0.06) & (np.abs(z - 0.1) < 0.03),
    "hollows one above the other": lambda x, y, z: (np.abs(x - 0.1) < 0.06) & (np.abs(np.abs(z - 0.1) - 0.05) < 0.03),
}


@pytest.mark.parametrize("name", CUT_OUT)
@pytest.mark.parametrize("facing", [[0, 0, -1], [0, 0, 1]])
@pytest.mark.parametrize("refinements", [0, 1])
def test_a_bed_holds_no_ceiling_over_another_part_of_the_body(name, facing, refinements):
    mesh = simple_box(SIDE, [10, 10, 10])
    left = TetMesh(
        *drop_unused(mesh.nodes, mesh.tetrahedra[~CUT_OUT[name](*mesh.nodes[mesh.tetrahedra].mean(axis=1).T)])
    )
    body = nest("block", left, refinements, np.arange(2), Material(1e4, 0.3, 1000.0))
    bed = Bed(np.array([0.1, 0.1, 0.1]), 1e3, 2e4, np.array(facing, dtype=float))
    together = np.tile([1.0, 0.0, 0.0], len(body.fine.nodes))
    assert together @ BedSprings(body.fine, bed).matrix @ together == pytest.approx(2e4 * 0.2 * 0.2, rel=1e-6)
    assert (body.fine.nodes[inner_nodes(body.fine, bed), 2] == (0.0 if facing[2] < 0 else 0.2)).all()
