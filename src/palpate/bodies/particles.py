"""Particles: the nodes of one level of a body as point masses, which scenes move."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.bodies.bed import Bed
from palpate.bodies.body import Body, Material
from palpate.bodies.mesh import Mesh, TetMesh
from palpate.bodies.sheet import Sheet
from palpate.errors import InputError


@dataclass(frozen=True, eq=False)
class Particles(Mesh):
    """Point masses and the elements between them.

    nodes : (n, 3) rest positions [m]; masses : (n,) [kg]; held : (k,) anchors
    triangles : (t, 3) of the surface, wound outward; tetrahedra : (m, 4), none for sheets and surface models
    thickness_m : of a sheet, else 0
    beds : the elastic beds, each with the triangles (t, 3) of its own body
    """

    name: str
    nodes: np.ndarray
    masses: np.ndarray
    held: np.ndarray
    triangles: np.ndarray
    tetrahedra: np.ndarray
    material: Material
    thickness_m: float = 0.0
    beds: tuple[tuple[Bed, np.ndarray], ...] = ()


def particles_of(body: Body, level: int, surface: bool) -> Particles:
    """Make particles of one level of ``body``, or with ``surface`` of its boundary only, with all of its mass.

    A solid's mass goes in quarters to the corners of its tetrahedra (paper 2, eq. 4), a sheet's in thirds to those
    of its triangles, a surface model's by area. Raises InputError for a level that the body does not have.
    """
    if not -len(body.levels) <= level < len(body.levels):
        raise InputError(
            f"scene of {body.name}: level is {level} and the body has levels 0 to {len(body.levels) - 1}; "
            "choose one of them."
        )
    mesh, held = body.levels[level], body.anchors[level]
    if isinstance(mesh, Sheet):
        masses = body.material.density_kg_m3 * mesh.thickness_m * mesh.areas
        cells = mesh.triangles, mesh.tetrahedra
        return Particles(body.name, mesh.nodes, masses, held, *cells, body.material, mesh.thickness_m)
    whole = solid_particles(mesh, held, body.material, body.name, body.bed)
    if not surface:
        return whole
    kept = mesh.surface
    triangles = np.searchsorted(kept, mesh.triangles)
    areas = mesh.areas[kept]
    return Particles(
        body.name,
        np.ascontiguousarray(mesh.nodes[kept]),
        whole.masses.sum() * areas / areas.sum(),
        np.searchsorted(kept, np.intersect1d(held, kept)),
        triangles,
        np.empty((0, 4), dtype=np.int64),
        body.material,
        beds=_beds(body.bed, triangles),
    )


def merge_particles(parts: list[Particles], shifts: Sequence[Sequence[float]], place: str) -> Particles:
    """Merge several bodies into one set of particles, each moved by its shift (3,) [m].

    Densities may differ. Raises InputError, naming ``place``, unless all have the same stiffness, and all are sheets
    of the same thickness or none is a sheet.
    """
    first = parts[0]
    for part in parts[1:]:
        for name, of_first, of_part in (
            ("young_pa", first.material.young_pa, part.material.young_pa),
            ("poisson", first.material.poisson, part.material.poisson),
            ("thickness_m", first.thickness_m, part.thickness_m),
        ):
            if of_first != of_part:
                raise InputError(
                    f"{place}: {first.name} has {name} {of_first:g} and {part.name} {of_part:g}; "
                    "bodies of one scene must have the same stiffness and thickness: make them equal."
                )
    starts = np.cumsum([0, *(len(part.nodes) for part in parts)])

    def shifted(field: str) -> np.ndarray:
        return np.concatenate([getattr(part, field) + start for part, start in zip(parts, starts, strict=False)])

    return Particles(
        ", ".join(dict.fromkeys(part.name for part in parts)),
        np.concatenate([part.nodes + np.array(shift, dtype=float) for part, shift in zip(parts, shifts, strict=True)]),
        np.concatenate([part.masses for part in parts]),
        shifted("held"),
        shifted("triangles"),
        shifted("tetrahedra"),
        first.material,
        first.thickness_m,
        tuple(
            (bed.moved(np.array(shift, dtype=float)), triangles + start)
            for part, shift, start in zip(parts, shifts, starts, strict=False)
            for bed, triangles in part.beds
        ),
    )


def solid_particles(
    mesh: TetMesh, held: np.ndarray, material: Material, name: str, bed: Bed | None = None
) -> Particles:
    """Make point masses of the nodes of ``mesh``, with the same density everywhere."""
    masses = lump_masses(mesh, material.density_kg_m3 * mesh.volumes)
    beds = _beds(bed, mesh.triangles)
    return Particles(name, mesh.nodes, masses, held, mesh.triangles, mesh.tetrahedra, material, beds=beds)


def _beds(bed: Bed | None, triangles: np.ndarray) -> tuple[tuple[Bed, np.ndarray], ...]:
    return () if bed is None else ((bed, triangles),)


def lump_masses(mesh: TetMesh, element_masses: np.ndarray) -> np.ndarray:
    """Lump element masses (n_tetrahedra,) [kg] in quarters to their nodes, (n_nodes,) [kg] (paper 2, eq. 4)."""
    return np.bincount(mesh.tetrahedra.ravel(), np.repeat(element_masses / 4.0, 4), minlength=len(mesh.nodes))
