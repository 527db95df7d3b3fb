"""Particles: the nodes of one level of a body as point masses, which scenes move."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.material import Material, Tissue, joined, uniform
from palpate.bodies.mesh import Mesh, Sheet, TetMesh, edge_lengths
from palpate.bodies.supports import Bed
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.bodies.cutting.ties import Ties

STIFFNESS = ("young_pa", "poisson")
"""Constants of a material that say how it deforms."""


@dataclass(frozen=True, eq=False)
class Particles(Mesh):
    """Point masses and the elements between them.

    nodes : (n, 3) rest positions [m]; masses : (n,) [kg]; held : (k,) anchors
    triangles : (t, 3) of the surface, wound outward; tetrahedra : (m, 4), none for sheets and surface models
    thickness_m : of a sheet, else 0
    beds : the elastic beds, each with the triangles (t, 3) of its own body
    regions : the tissue of the tetrahedra if they are of several materials; ``material`` is then the first body's own
    body : whose finest level they are, None of several bodies and of surfaces
    ties : of a body with cuts, which nodes are one until a blade passes; ``triangles`` are then the skin, without lips
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
    regions: Tissue | None = None
    body: Body | None = None
    ties: "Ties | None" = None

    @property
    def tissue(self) -> Tissue:
        """The materials of the tetrahedra."""
        return uniform(self.material, len(self.tetrahedra)) if self.regions is None else self.regions

    def nodal_young_pa(self) -> np.ndarray:
        """Return the mean Young's modulus of the tetrahedra around each node, by volume, (n,) [Pa]."""
        if self.regions is None:
            return np.full(len(self.nodes), float(self.material.young_pa))
        volumes = TetMesh(self.nodes, self.tetrahedra).volumes
        corners, count = self.tetrahedra.ravel(), len(self.nodes)
        stiffness_sum, volume_sum = (
            np.bincount(corners, np.repeat(weights, 4), count) for weights in (volumes * self.regions.young_pa, volumes)
        )
        return stiffness_sum / volume_sum

    def refuse_regions(self, what: str) -> None:
        """Raise InputError if the elements differ in stiffness; what : begins the reason, such as "springs have"."""
        if self.regions is not None and not self.regions.is_one_stiffness:
            raise InputError(
                f"{self.name}: {what} one stiffness only, and its tetrahedra have several; choose an elastic effect of "
                "finite elements, such as corotational, or leave the regions out."
            )


def particles_of(body: Body, level: int, surface: bool) -> Particles:
    """Make particles of one level of ``body``, or with ``surface`` of its boundary only, with all of its mass.

    A solid's mass goes in quarters to the corners of its tetrahedra (paper 2, eq. 4), a sheet's in thirds to those
    of its triangles, a surface model's by area. Densities are those of the body's CT, if it has them. Raises InputError
    for a level that the body does not have, and for the surface alone of a body with regions.
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
    regions = None if body.regions is None else body.tissue(level)
    densities = None if body.densities is None else body.densities[level]
    solid = solid_particles(mesh, held, body.material, body.name, body.bed, regions, densities)
    if not surface:
        return replace(solid, body=body.up_to(level % len(body.levels)))
    if regions is not None:
        raise InputError(f"scene of {body.name}: a surface has no inside that could have regions; leave surface out.")
    surface_nodes = mesh.surface
    triangles = np.searchsorted(surface_nodes, mesh.triangles)
    areas = mesh.areas[surface_nodes]
    return Particles(
        body.name,
        np.ascontiguousarray(mesh.nodes[surface_nodes]),
        solid.masses.sum() * areas / areas.sum(),
        np.searchsorted(surface_nodes, np.intersect1d(held, surface_nodes)),
        triangles,
        np.empty((0, 4), dtype=np.int64),
        body.material,
        beds=_beds(body.bed, triangles),
    )


def merge_particles(parts: list[Particles], shifts: Sequence[Sequence[float]], place: str) -> Particles:
    """Merge several bodies into one set of particles, each moved by its shift (3,) [m].

    Materials of solids may differ. Raises InputError, naming ``place``, unless all obey the same law, all are sheets of
    the same thickness or none is a sheet, and sheets and surfaces have the same stiffness.
    """
    first, ties = parts[0], parts[0].ties
    for part in parts[1:]:
        _check_alike(first, part, place)
    starts = np.cumsum([0, *(len(part.nodes) for part in parts)])
    tissue = joined([part.tissue for part in parts]) if all(len(part.tetrahedra) for part in parts) else None

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
        tissue if tissue is not None and len(tissue.materials) > 1 else None,
        ties=None if ties is None else ties.beside(shifted("triangles")[len(first.triangles) :], int(starts[-1])),
    )


def _check_alike(one: Particles, other: Particles, place: str) -> None:
    """Raise InputError unless two bodies can be particles of one scene."""
    if one.material.law != other.material.law:
        raise InputError(
            f"{place}: {one.name} has law {one.material.law} and {other.name} {other.material.law}; "
            "bodies of one scene must have the same law: make them equal."
        )
    solid = len(one.tetrahedra) > 0 and len(other.tetrahedra) > 0
    to_compare = [("thickness_m", one.thickness_m, other.thickness_m)]
    if not solid:
        to_compare += [(name, getattr(one.material, name), getattr(other.material, name)) for name in STIFFNESS]
    for name, of_first, of_part in to_compare:
        if of_first != of_part:
            raise InputError(
                f"{place}: {one.name} has {name} {of_first:g} and {other.name} {of_part:g}; "
                "sheets and surfaces of one scene must have the same stiffness and thickness: make them equal."
            )


def solid_particles(
    mesh: TetMesh,
    held: np.ndarray,
    material: Material,
    name: str,
    bed: Bed | None = None,
    regions: Tissue | None = None,
    densities: np.ndarray | None = None,
) -> Particles:
    """Make point masses of the nodes of ``mesh``; ``regions`` is its tissue if it has several materials.

    densities : at the nodes (n,) [kg/m³], in place of the materials'; a tetrahedron has the mean of its corners'
    """
    if densities is not None:
        of_elements = densities[mesh.tetrahedra].mean(axis=1)
    else:
        of_elements = material.density_kg_m3 if regions is None else regions.density_kg_m3
    masses = lump_masses(mesh, of_elements * mesh.volumes)
    cells = mesh.triangles, mesh.tetrahedra
    return Particles(name, mesh.nodes, masses, held, *cells, material, beds=_beds(bed, mesh.triangles), regions=regions)


def _beds(bed: Bed | None, triangles: np.ndarray) -> tuple[tuple[Bed, np.ndarray], ...]:
    return () if bed is None else ((bed, triangles),)


def default_stiffness(particles: Particles) -> float:
    """Return E times the mean edge of the surface [N/m]: the default spring of body_springs and volume_force.

    Raises InputError for tetrahedra of several stiffnesses.
    """
    particles.refuse_regions("a stiffness that follows from Young's modulus needs")
    ends = particles.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return particles.material.young_pa * float(edge_lengths(particles.nodes, ends).mean())


def lump_masses(mesh: TetMesh, element_masses: np.ndarray) -> np.ndarray:
    """Lump element masses (n_tetrahedra,) [kg] in quarters to their nodes, (n_nodes,) [kg] (paper 2, eq. 4)."""
    return np.bincount(mesh.tetrahedra.ravel(), np.repeat(element_masses / 4.0, 4), minlength=len(mesh.nodes))
