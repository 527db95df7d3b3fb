"""What a scene moves: the nodes of one level of a body as point masses."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.bodies.body import Body, Material
from palpate.bodies.mesh import Mesh, TetMesh
from palpate.errors import InputError


@dataclass(frozen=True, eq=False)
class Particles(Mesh):
    """Point masses and the elements among them.

    nodes : (n, 3) rest positions [m]; masses : (n,) [kg]; held : (k,) anchors
    triangles : (t, 3) of the surface, wound outward; tetrahedra : (m, 4), none for sheets and surface models
    thickness_m : of a sheet, 0 for anything else
    """

    name: str
    nodes: np.ndarray
    masses: np.ndarray
    held: np.ndarray
    triangles: np.ndarray
    tetrahedra: np.ndarray
    material: Material
    thickness_m: float = 0.0


def particles_of(body: Body, level: int, surface: bool) -> Particles:
    """One level of ``body`` as particles, or with ``surface`` its boundary only, which then carries all the mass.

    A solid's mass goes in quarters to the corners of its tetrahedra (paper 2, eq. 4), a sheet's in thirds to those
    of its triangles, a surface model's by area. Raises InputError for a level that the body does not have.
    """
    if not -len(body.levels) <= level < len(body.levels):
        raise InputError(
            f"scene of {body.name}: level is {level} and the body has levels 0 to {len(body.levels) - 1}; "
            "choose one of them."
        )
    mesh, held = body.levels[level], body.anchors[level]
    thickness = getattr(mesh, "thickness_m", 0.0)
    if thickness:
        masses = body.material.density_kg_m3 * thickness * mesh.areas
        return Particles(body.name, mesh.nodes, masses, held, mesh.triangles, mesh.tetrahedra, body.material, thickness)
    whole = solid(mesh, held, body.material, body.name)
    if not surface:
        return whole
    kept = mesh.surface
    areas = mesh.areas[kept]
    return Particles(
        body.name,
        np.ascontiguousarray(mesh.nodes[kept]),
        whole.masses.sum() * areas / areas.sum(),
        np.searchsorted(kept, np.intersect1d(held, kept)),
        np.searchsorted(kept, mesh.triangles),
        np.empty((0, 4), dtype=np.int64),
        body.material,
    )


def together(parts: list[Particles], shifts: list[Sequence[float]], place: str) -> Particles:
    """Several bodies as one set of particles, each moved by its shift (3,) [m].

    Raises InputError, naming ``place``, unless they are of one stiffness and all sheets of one thickness or all not:
    densities may differ.
    """
    first = parts[0]
    for part in parts[1:]:
        for name, mine, its in (
            ("young_pa", first.material.young_pa, part.material.young_pa),
            ("poisson", first.material.poisson, part.material.poisson),
            ("thickness_m", first.thickness_m, part.thickness_m),
        ):
            if mine != its:
                raise InputError(
                    f"{place}: {first.name} has {name} {mine:g} and {part.name} {its:g}; "
                    "bodies of one scene must be of one stiffness and thickness: make them equal."
                )
    starts = np.cumsum([0, *(len(part.nodes) for part in parts)])

    def joined(field: str) -> np.ndarray:
        return np.concatenate([getattr(part, field) + start for part, start in zip(parts, starts, strict=False)])

    return Particles(
        ", ".join(dict.fromkeys(part.name for part in parts)),
        np.concatenate([part.nodes + np.array(shift, dtype=float) for part, shift in zip(parts, shifts, strict=True)]),
        np.concatenate([part.masses for part in parts]),
        joined("held"),
        joined("triangles"),
        joined("tetrahedra"),
        first.material,
        first.thickness_m,
    )


def solid(mesh: TetMesh, held: np.ndarray, material: Material, name: str) -> Particles:
    """The nodes of ``mesh`` as point masses, its density the same everywhere."""
    masses = lumped(mesh, material.density_kg_m3 * mesh.volumes)
    return Particles(name, mesh.nodes, masses, held, mesh.triangles, mesh.tetrahedra, material)


def lumped(mesh: TetMesh, element_masses: np.ndarray) -> np.ndarray:
    """Masses (n_nodes,) [kg]: quarters of those, (n_tetrahedra,), of the elements around a node (paper 2, eq. 4)."""
    return np.bincount(mesh.tetrahedra.ravel(), np.repeat(element_masses / 4.0, 4), minlength=len(mesh.nodes))
