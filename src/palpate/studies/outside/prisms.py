"""Problems of plates and prisms whose answers others published."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import eigsh

from palpate.bodies.material import Material
from palpate.studies.outside.hanging_bar import RUBBER
from palpate.studies.outside.supported import Supported, block

ON_FACE = 1e-9
"""Distance [m, mm] within which a node is on a face."""
ISOCHORIC = str(Path(__file__).with_name("isochoric_neo_hookean.py"))
MODES, OUT_OF_PLANE = 16, 0.02
"""Vibrations that are computed, and the part of kinetic energy across a plate below which one is in its plane."""


def confined_stress(length: float) -> float:
    """Return the nominal stress [kPa] of the hanging bar's rubber at the stretch ``length`` between rigid sides."""
    cube = Supported(block([1, 1, 1], lambda p: p), RUBBER, lambda p: np.ones(p.shape, dtype=bool))
    force = cube.elements.force(cube.nodes * [1.0, 1.0, length])
    return -1e-3 * float(force[cube.nodes[:, 2] > 1.0 - ON_FACE, 2].sum())


def torsion_constant(cells: int) -> float:
    """Compute the torsional moment of a square prism of side a over G a⁴ and twist per length, free to warp."""
    poisson, length = 0.3, 2.0 / cells
    mesh = block([cells, cells, 2], lambda p: p * [1.0, 1.0, length] - [0.5, 0.5, 0.0])

    def held(p: np.ndarray) -> np.ndarray:
        end = (p[:, 2] < ON_FACE) | (p[:, 2] > length - ON_FACE)
        return np.column_stack([end, end, np.linalg.norm(p[:, :2], axis=1) < ON_FACE])

    prism = Supported(mesh, Material(2.0 * (1.0 + poisson), poisson, 1.0), held)
    x, y, z = prism.nodes.T
    u = prism.respond(np.column_stack([-y * z, x * z, np.zeros_like(z)]))
    force = (prism.elements.stiffness(prism.nodes) @ u.ravel()).reshape(u.shape)
    end = z > length - ON_FACE
    return float(x[end] @ force[end, 1] - y[end] @ force[end, 0])


def plate_frequencies(cells: int) -> tuple[float, float]:
    """Compute the first two frequencies [Hz] of NAFEMS FV52's plate (10 × 10 × 1 m, on lower edges) in its plane."""
    mesh = block([cells, cells, max(1, cells // 4)], lambda p: p * [10.0, 10.0, 1.0])

    def held(p: np.ndarray) -> np.ndarray:
        edge = (p[:, 2] < ON_FACE) & ((np.abs(p[:, :2] - 5.0) > 5.0 - ON_FACE).any(axis=1))
        return np.column_stack([np.zeros((len(p), 2), dtype=bool), edge])

    plate = Supported(mesh, Material(200e9, 0.3, 8000.0), held)
    free = ~plate.held.ravel()
    stiffness = sparse.csc_array(plate.elements.stiffness(plate.nodes))[free][:, free]
    masses = sparse.csc_array(sparse.kron(plate.masses(), sparse.eye_array(3)))[free][:, free]
    # the shift keeps the matrix definite, as nothing holds the plate in its plane
    squared_frequencies, modes = eigsh(stiffness, MODES, masses, sigma=-1e4, v0=np.ones(free.sum()))
    all_modes = np.zeros((len(free), MODES))
    all_modes[free] = modes
    energy_across = np.einsum("nk,nk->k", all_modes[2::3], plate.masses() @ all_modes[2::3])
    in_plane = np.sort(squared_frequencies[(energy_across < OUT_OF_PLANE) & (squared_frequencies > 1.0)])
    return tuple(np.sqrt(in_plane[:2]) / (2.0 * np.pi))


def cook(cells: int, material: Material, plane: bool, asked: tuple[float, float], settles: bool) -> float:
    """Compute the vertical displacement [mm] at ``asked`` (x, y) [mm] of Cook's membrane under 1 N a mm of thickness.

    plane : whether both faces are held (plane strain); otherwise it is 1 mm thick and its middle plane is held
    settles : whether displacements are large, or linearised at rest
    """
    thickness = 48.0 / cells if plane else 0.5
    mesh = block(
        [cells, cells, 1],
        lambda p: np.column_stack(
            [48.0 * p[:, 0], 44.0 * p[:, 0] + p[:, 1] * (44.0 - 28.0 * p[:, 0]), thickness * p[:, 2]]
        ),
    )

    def held(p: np.ndarray) -> np.ndarray:
        wall = p[:, 0] < ON_FACE
        return np.column_stack([wall, wall, wall | (plane | (p[:, 2] < ON_FACE))])

    membrane = Supported(mesh, material, held)
    membrane.press(lambda p: p[:, 0] > 48.0 - ON_FACE, np.array([0.0, 1.0 / 16.0, 0.0]))
    moved = membrane.settle() if settles else membrane.respond()
    distances = np.linalg.norm(membrane.nodes - [*asked, 0.0 if plane else thickness], axis=1)
    return float(moved[np.argmin(distances), 1])


def cook_incompressible(cells: int) -> float:
    """Compute the linear displacement [mm] of the middle of the loaded end, with G = 0.375 MPa and λ = 7.5 GPa."""
    shear, lame = 0.375, 7500.0
    poisson = lame / (2.0 * (lame + shear))
    return cook(cells, Material(2.0 * shear * (1.0 + poisson), poisson, 1.0), True, (48.0, 52.0), settles=False)


def cook_neo_hookean(plane: bool) -> Callable[[int], float]:
    """Return the function from cells to the upper corner's displacement [mm], with μ = 0.4225 MPa and ν = 0.3."""
    return lambda cells: cook(cells, Material(2.6 * 0.4225, 0.3, 1.0, ISOCHORIC), plane, (48.0, 60.0), settles=True)
