"""Hard cases of tissue: regions, viscosity, plasticity, segmentation of its image, and the search for its moduli."""

import numpy as np

from palpate.bodies.body import nest
from palpate.bodies.ct.image import Image
from palpate.bodies.ct.masses import density
from palpate.bodies.ct.segmentation import segment
from palpate.bodies.material import Material, Tissue
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.simple_shapes import box
from palpate.effects.body_springs import BodySprings
from palpate.effects.effect import Effect
from palpate.effects.fem_plasticity import FemPlasticity
from palpate.effects.held import Held
from palpate.effects.linear_elements import LinearElements
from palpate.effects.maxwell import Maxwell
from palpate.effects.springs import Springs
from palpate.models.springs.fitness import Range
from palpate.models.springs.searches import cma_es, evolve
from palpate.scenes.run_scene import initial_positions
from palpate.solvers.backward_euler import BackwardEuler
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.system import System
from palpate.studies.hard_cases.stage import SOFT, Answer, Case, NodalForce, bar_mesh, end_face, point_masses, refuses

YIELD, STRETCH = 0.05, 3.0
"""Yield strain of plastic flow, and the stretch at which it is tried."""
MOST_STRAIN = 2.0, 0.5
"""Limits of the plastic strain: one that is not reached, and one that is."""


def still() -> list[Case]:
    return [
        Case("regions_of_contrast_1e6", "two regions, one a million times as stiff as the other, and a bar that is "
             "pulled", "the elongation of theory", "relative error of the elongation", 1e-3, _regions,
             ("fem_static", "fem_multigrid")),
    ]  # fmt: skip


def moving() -> list[Case]:
    return [
        Case("maxwell_times", "a Maxwell element relaxes in a millionth of a step, and in a million steps",
             "the elongation of the spring alone, and of both springs", "largest relative error of the elongations",
             1e-3, _maxwell, ("springs_implicit",)),
        Case("plastic_flow", "a block of three times its length yields for ever in one step, with a limit of 2 and 0.5",
             "a lasting strain of all but the yield strain, and of the limit",
             "largest error of the lasting strain of an element / that strain", 1e-6, _plastic, ("fem_plasticity",)),
        Case("body_springs_from_point", "a surface on body springs starts as one point, under a weight",
             "each node as far from rest as its own spring gives way",
             "largest error of a node's place / how far the weight moves it", 0.02, _tied, ("springs_implicit",)),
    ]  # fmt: skip


def _regions(model: str) -> Answer:
    """Pull a bar of ν = 0 whose halves are regions of moduli E and E' by 1 N: it lengthens by L / 2A (1/E + 1/E')."""
    level = {"fem_static": 0, "fem_multigrid": 1}[model]
    mesh = bar_mesh()
    soft, hard = Material(3000.0, 0.0, 1000.0), Material(3e9, 0.0, 1000.0)
    region = (mesh.nodes[mesh.tetrahedra].mean(axis=1)[:, 0] < 0.1).astype(np.int64)
    body = nest("bar", mesh, level, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft, regions=Tissue((soft, hard), region))
    weights = end_face(body.fine)
    moved = Equilibrium(body, level).linear_solver(1e-8)(np.outer(weights, [1.0, 0.0, 0.0]))
    expected = 0.1 / 0.05**2 * (1.0 / soft.young_pa + 1.0 / hard.young_pa)
    return Answer(moved, np.zeros_like(moved), lambda a: abs(float(weights @ a[:, 0]) / expected - 1.0))


def _maxwell(model: str) -> Answer:
    """Pull a spring of 100 N/m with a Maxwell element of the same stiffness beside it by 1 N, over 20 steps.

    It lengthens by 1/100 m if the element relaxes much faster than a step, by 1/200 m if much slower than all.
    """
    nodes = np.outer([0.0, 1.0], [1.0, 0.0, 0.0])
    particles, elongations = point_masses("pair", nodes, [0]), []
    for steps_to_relax in (1e-6, 1e6):
        springs = Springs(np.array([[0, 1]]), np.array([100.0]), np.ones(1))
        maxwell = Maxwell(springs, 1.0, 10.0 * steps_to_relax)
        loaded = {"held": Held(np.array([0])), "load": NodalForce(np.array([0.0, 1.0]))}
        system = System(particles, {"springs": springs, "maxwell": maxwell, **loaded})
        integrator, x = BackwardEuler(system, 1e-10), nodes
        for _ in range(20):  # steps so long that inertia is negligible
            x, _ = integrator.step(x, np.zeros_like(x), 10.0)
            system.relax(x, 10.0)
        elongations.append(x[1, 0] - 1.0)
    expected = np.array([1.0 / 100.0, 1.0 / 200.0])
    return Answer(np.array(elongations), np.zeros(2), lambda a: float(np.abs(a / expected - 1.0).max()))


def _plastic(model: str) -> Answer:
    """Let a block yield at a held stretch of constant volume; the answer is the plastic strain of each element.

    Strains are Hencky's: that of the block is the logarithm of the stretch.
    """
    mesh, strains = box([0.1, 0.1, 0.1], [2, 2, 2]), []
    x = mesh.nodes * [STRETCH, STRETCH**-0.5, STRETCH**-0.5]
    for limit in MOST_STRAIN:
        plastic = FemPlasticity(LinearElements(mesh, SOFT), YIELD, 10.0, limit)
        plastic.relax(x, 1e6)
        logs = np.log(np.linalg.svd(plastic.plastic, compute_uv=False))
        strains.append(np.sqrt(2.0 / 3.0 * np.square(logs - logs.mean(axis=1, keepdims=True)).sum(axis=1)))
    expected = np.minimum(np.log(STRETCH) - YIELD, MOST_STRAIN)[:, None]
    return Answer(np.array(strains), np.zeros(1), lambda a: float(np.abs(a / expected - 1.0).max()))


def _tied(model: str) -> Answer:
    """Let a surface of weak springs, which hangs on body springs, start from one point under its weight.

    All masses are equal, so that each node has to sink by m g / k and the springs of the surface stay at rest.
    """
    cube = particles_of(nest("cube", box([0.1, 0.1, 0.1], [2, 2, 2]), 0, np.array([0]), SOFT), 0, True)
    masses = np.full(len(cube.nodes), 0.01)
    particles = Particles("shell", cube.nodes, masses, cube.held, cube.triangles, cube.tetrahedra, SOFT)
    pairs = np.unique(np.sort(particles.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    rest_lengths = np.linalg.norm(particles.nodes[pairs[:, 0]] - particles.nodes[pairs[:, 1]], axis=1)
    effects: dict[str, Effect] = {
        "springs": Springs(pairs, np.full(len(pairs), 1.0), rest_lengths),
        "body_springs": BodySprings(particles, 10.0, 0.5),
        "weight": NodalForce(masses, [0.0, 0.0, -9.81]),
    }
    integrator = BackwardEuler(System(particles, effects), 1e-8)
    start = initial_positions(particles, np.ones(len(masses), dtype=bool), "point", 1)
    x, v = start, np.zeros_like(start)
    for step_s in [0.05] * 100 + [10.0] * 10:
        x, v = integrator.step(x, v, step_s)
    rest, sink_m = particles.nodes, 0.01 * 9.81 / 10.0
    expected = rest - [0.0, 0.0, sink_m]
    return Answer(x, start, lambda a: float(np.abs(a - expected).max()) / sink_m, zero=rest, origin=rest)


RADIUS_M = 0.03
"""Radius of the organ, a ball."""
LIVER_HU, AROUND_HU = 60.0, -100.0
VOLUME = "relative error of volume or mass"


def organs() -> list[Case]:
    """List the cases of images from CT, and one of a search for moduli."""
    return [
        Case("ct_thick_slices", "a ball in slices ten times as thick as the pixels", "its volume and mass", VOLUME,
             0.05, lambda model: _ball([0.001, 0.001, 0.01], 20.0), ("segmentation",), blunt=("segmentation",)),
        Case("ct_noise", "a ball in noise of half the contrast", "its volume and mass", VOLUME, 0.05,
             lambda model: _ball([0.002, 0.002, 0.002], 80.0), ("segmentation",), blunt=("segmentation",)),
        Case("ct_bridge", "a ball that a rod of 4 mm joins to another", "the volume and mass of one ball", VOLUME,
             0.03, lambda model: _ball([0.0015, 0.0015, 0.0015], 20.0, bridge=True), ("segmentation",)),
        Case("ct_of_one_value", "an image of air alone", "refused: no voxel in the range", VOLUME, 0.05,
             refuses(_segment_air), ("segmentation",), ("refused",)),
        Case("search_where_most_diverge", "moduli of six nodes; one individual in twenty does not diverge",
             "the moduli of which the best fitness is known", "largest relative error of a modulus", 0.05, _search,
             ("genetic_algorithm", "cma_es")),
    ]  # fmt: skip


def _ball(spacing_m: list[float], noise_hu: float, bridge: bool = False) -> Answer:
    """Segment the synthetic CT of a ball, with a ``bridge`` to a smaller one or not; judge its volume and mass."""
    spacing, half_sizes = np.array(spacing_m), np.array([0.09 if bridge else 0.045, 0.045, 0.045])
    counts = np.ceil(2.0 * half_sizes / spacing).astype(int)
    x, y, z = (s * (np.arange(n) - (n - 1) / 2.0) for s, n in zip(spacing, counts, strict=True))
    grid = x[None, None, :], y[None, :, None], z[:, None, None]
    filled = _filled_by_ball(grid, spacing, -0.04 if bridge else 0.0)
    if bridge:
        rod = (np.hypot(grid[1], grid[2]) < 0.002) & (np.abs(grid[0]) < 0.02)
        smaller = _filled_by_ball(grid, spacing, 0.04, 0.8 * RADIUS_M)
        filled = np.maximum(np.maximum(filled, smaller), rod)
    noise = noise_hu * np.random.default_rng(1).normal(size=filled.shape)
    grey = AROUND_HU + (LIVER_HU - AROUND_HU) * filled + noise
    image = Image(grey.astype(np.float32), np.zeros(3), spacing, "ball")
    mask = segment(image, (-20.0, 140.0))
    volume = 4.0 / 3.0 * np.pi * RADIUS_M**3
    expected = np.array([volume, volume * float(density(np.array(LIVER_HU)))])
    whole_image = image.voxel_m3 * np.array([mask.size, density(image.hu).sum()])
    segmented = image.voxel_m3 * np.array([mask.sum(), density(image.hu[mask]).sum()])
    return Answer(segmented, whole_image, lambda a: float(np.abs(a / expected - 1.0).max()), np.zeros(2), np.zeros(2))


def _filled_by_ball(grid: tuple, spacing: np.ndarray, center: float, radius: float = RADIUS_M) -> np.ndarray:
    """Return which share of 4³ points in each voxel, of centres ``grid``, is in a ball around (center, 0, 0) [m]."""
    offsets = (np.arange(4) + 0.5) / 4.0 - 0.5
    inside = np.zeros(np.broadcast_shapes(*(axis.shape for axis in grid)))
    for dx, dy, dz in np.stack(np.meshgrid(*[offsets] * 3), axis=-1).reshape(-1, 3) * spacing:
        inside = inside + ((grid[0] + dx - center) ** 2 + (grid[1] + dy) ** 2 + (grid[2] + dz) ** 2 < radius**2)
    return inside / 64.0


def _segment_air() -> None:
    image = Image(np.full((20, 20, 20), -1000.0, dtype=np.float32), np.zeros(3), np.full(3, 0.002), "air")
    segment(image, (-20.0, 140.0))


def _search(model: str) -> Answer:
    """Search six moduli whose fitness has its maximum at known ones, and is −∞ where any of them is too large."""
    limits, best = Range(100.0, 10_000.0), np.array([300.0, 500.0, 800.0, 400.0, 600.0, 900.0])

    def fitness(young: np.ndarray) -> np.ndarray:
        distance = np.abs(np.log(young / best)).sum(axis=1)
        return np.where((young > 6000.0).any(axis=1), -np.inf, -distance)

    start = np.full(6, 1000.0)
    if model == "cma_es":
        best_young = cma_es(fitness, start, limits, 3000, 1).young
    else:
        best_young = evolve(fitness, 6, 60, limits, 1, 400).young
    return Answer(best_young, start, lambda a: float(np.abs(a / best - 1.0).max()), np.zeros(6), np.zeros(6))
