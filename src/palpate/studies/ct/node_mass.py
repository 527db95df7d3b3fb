"""Masses of an organ's nodes from its CT, over meshes of increasing resolution (paper 2, claims on masses)."""

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.masses import node_masses, organ_densities, raw_densities, voxel_mass
from palpate.bodies.ct.mesh_from_ct import segment_entry
from palpate.bodies.mesh import TetMesh
from palpate.bodies.settings import Ct
from palpate.bodies.surfaces.mask_surface import surface
from palpate.bodies.surfaces.tetrahedralize import tetrahedralize
from palpate.errors import InputError, about
from palpate.run.job import steps
from palpate.table_declaration import Table

_MORE = (1.0, 1.1, 1.2)  # factors of the surface nodes, tried in turn for thin organs

NODE_MASS = Table(
    "node_mass",
    "The mass of each body from CT at several mesh sizes, and its deviation from the mass of the voxels.",
    """
    body elements nodes: a body, and the size of its mesh
    total_mass_kg mean_density_kg_m3: sum of the nodes' masses [kg], and over the mesh's volume [kg/m³]
    deviation_from_voxels raw_deviation: relative deviation from the voxels' sum, and without the correction at the rim
    surface_nodes: nodes on the surface
    voxel_mass_kg least_node_kg largest_node_kg: masses of the voxels, and of the lightest and the heaviest node [kg]
    """,
    always=False,
)


def measure(
    name: str, image: Image, mask: np.ndarray, surface_nodes: Sequence[int], progress: Callable = iter
) -> pd.DataFrame:
    """Compute the rows of node_mass.csv of the body ``name``, one for each resolution of its mesh.

    mask : of the organ, (nz, ny, nx); surface_nodes : of the meshes; progress : wraps them, as ``tqdm`` does
    Every mesh encloses the volume of the voxels. Raises InputError if the organ cannot be meshed.
    """
    voxels = voxel_mass(image, mask)
    rows = []
    for nodes_wanted in progress(surface_nodes):
        mesh = _mesh(image, mask, nodes_wanted)
        masses = node_masses(mesh, organ_densities(mesh.nodes, image, mask))
        raw_masses = node_masses(mesh, raw_densities(mesh.nodes, image, mask))
        mass, deviations = masses.sum(), (masses.sum() / voxels - 1, raw_masses.sum() / voxels - 1)
        row = name, len(mesh.tetrahedra), len(mesh.nodes), mass, mass / mesh.volumes.sum(), *deviations
        rows.append((*row, len(mesh.surface), voxels, masses.min(), masses.max()))
    return NODE_MASS.frame(rows)


def _mesh(image: Image, mask: np.ndarray, wanted: int) -> TetMesh:
    """Make a mesh of about ``wanted`` surface nodes, or of a few more if its surface intersects itself."""
    for factor in _MORE:
        try:
            return tetrahedralize(*surface(mask, image, round(factor * wanted)), source=image.source)
        except InputError as error:
            failure = error
    raise failure


def tabulate_node_mass(say: Callable, entries: dict[str, Ct], sizes: list[int]) -> pd.DataFrame:
    """Measure the node masses of all bodies from CT, for the rule of this name."""
    tables = []
    for body, entry in entries.items():
        with about(f"bodies.{body}"):
            image, mask = segment_entry(entry)
        progress = steps(say, f"{body}: node masses, resolution")
        tables.append(measure(body, image, mask, sizes, progress=progress))
    return pd.concat(tables)
