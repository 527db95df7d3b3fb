"""The hanging bar of AustrianTradingMachine/Newton at 9e5d430: on its own mesh node for node, and its limit."""

from pathlib import Path

import numpy as np

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import particles_of
from palpate.files import read_table
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.outside.supported import TOLERANCE, Supported, block

SIZES_M, CELLS, GRAVITY = (0.6, 0.6, 1.6), (6, 6, 16), 9.80665
SHEAR_PA, LAME_PA = 1e4, 5e4
RUBBER = Material(
    SHEAR_PA * (3.0 * LAME_PA + 2.0 * SHEAR_PA) / (LAME_PA + SHEAR_PA),
    LAME_PA / (2.0 * (LAME_PA + SHEAR_PA)),
    100.0,
    "neo_hookean",
)
CORNERS = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)])
"""Corners of a cell in the order of its nodes, the first axis fastest."""


def grid(cells: tuple[int, int, int], sizes_m: tuple[float, float, float]) -> TetMesh:
    """Make the mesh of a block as Newton's ``add_soft_grid``, of five tetrahedra in each cell, in mirrored cells.

    Four tetrahedra cut off corners of a cell that share no edge, and the fifth is the inner rest; which corners these
    are alternates between even and odd cells. Nodes are rounded to single precision.
    """
    counts = np.array(cells)
    nodes = np.array([[i, j, k] for k in range(cells[2] + 1) for j in range(cells[1] + 1) for i in range(cells[0] + 1)])
    strides = np.array([1, cells[0] + 1, (cells[0] + 1) * (cells[1] + 1)])
    parity = CORNERS.sum(axis=1) % 2
    splits = []
    for odd in (0, 1):
        inner = np.flatnonzero(parity == odd)
        cut = np.flatnonzero(parity != odd)
        nearest = [inner[np.abs(CORNERS[inner] - CORNERS[each]).sum(axis=1) == 1] for each in cut]
        splits.append(np.array([[each, *others] for each, others in zip(cut, nearest, strict=True)] + [list(inner)]))
    origins = nodes[(nodes < counts).all(axis=1)]
    tetrahedra = (origins @ strides)[:, None, None] + (CORNERS @ strides)[np.array(splits)[origins.sum(axis=1) % 2]]
    positions = (nodes * (np.array(sizes_m) / counts)).astype(np.float32).astype(float)
    mesh = TetMesh(positions, tetrahedra.reshape(-1, 4))
    mesh.tetrahedra[mesh.volumes < 0] = mesh.tetrahedra[mesh.volumes < 0][:, [1, 0, 2, 3]]
    return TetMesh(positions, mesh.tetrahedra)


def read_displacements(path: str | Path) -> np.ndarray:
    """Read the displacements (833, 3) [m] of the nodes of ``grid`` by FEniCSx; InputError if a column is missing."""
    return 1e-12 * read_table(path, ["x_pm", "y_pm", "z_pm"]).to_numpy(dtype=float)


def on_its_mesh() -> np.ndarray:
    """Compute the displacements (833, 3) [m] of the hanging bar by palpate's linear elements on Newton's mesh."""
    mesh = grid(CELLS, SIZES_M)
    body = nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] > SIZES_M[2] - 1e-3), RUBBER)
    problem = Equilibrium(body, 0)
    weight = np.outer(particles_of(body, 0, False).masses, [0.0, 0.0, -GRAVITY])
    return problem.solve(weight, TOLERANCE).x - mesh.nodes


def tip_and_energy(cells: int) -> tuple[float, float]:
    """Compute the hanging bar's tip displacement [mm] and strain energy [J] by quadratic elements on a quarter of it.

    cells : across the quarter
    """
    half, length = 0.5 * SIZES_M[0], SIZES_M[2]
    mesh = block([cells, cells, 3 * cells], lambda p: p * [half, half, length])

    def held(p: np.ndarray) -> np.ndarray:
        top = p[:, 2] > length - 1e-9
        return np.column_stack([top | (p[:, 0] > half - 1e-9), top | (p[:, 1] > half - 1e-9), top])

    quarter = Supported(mesh, RUBBER, held)
    quarter.load = np.outer(quarter.masses().sum(axis=1), [0.0, 0.0, -GRAVITY])
    moved = quarter.settle()
    tip = np.argmin(np.linalg.norm(quarter.nodes - [half, half, 0.0], axis=1))
    return -1e3 * moved[tip, 2], 4.0 * quarter.elements.energy(quarter.nodes + moved)
