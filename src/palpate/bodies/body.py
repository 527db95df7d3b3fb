"""A body: nested meshes with material, density and anchors."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from scipy import sparse

from palpate.bodies.material import LAWS, Material, Tissue, uniform
from palpate.bodies.mesh import Sheet, TetMesh
from palpate.bodies.refinement import Snap, finer
from palpate.bodies.supports import Bed, inner_nodes
from palpate.errors import InputError

if TYPE_CHECKING:  # it checks the quality of bodies
    from skfem import MeshTet

    from palpate.bodies.organs import SmoothSurface
    from palpate.bodies.settings import Anchors, Plane, Sphere

    Rule = Anchors | Plane | Sphere


SHAPE_LEVEL = 1
"""The level whose surface is moved to that of a file or a CT; all finer ones keep its shape."""


@dataclass(frozen=True, eq=False)
class Body:
    """Nested meshes, coarse first; node i of a level is node i of every finer level.

    levels : the meshes, ``levels[0]`` coarse … ``levels[-1]`` fine; a sheet has one only
    prolongations : sparse matrices (n_finer, n_coarser), one between each two neighbouring levels
    anchors : the held nodes of each level, increasing; a new node is held if both ends of its edge are,
        so that the coarse displacements are a subspace of the fine ones
    bed : springs under a part of the surface, beside anchors or instead of them
    regions : the tissue of the coarse tetrahedra if they are of several materials; those that they are split into have
        the same. ``material`` is the body's own, of what lies in no region
    densities : at the nodes of each level [kg/m³], of a body whose masses are those of its CT; else the materials'
    smooth : the surface that the surface nodes of every level lie on; without it, finer levels keep a level's facets.
        Trap: levels then differ a little in shape, and only displacements are interpolated exactly between them
    """

    name: str
    levels: Sequence[TetMesh | Sheet]
    prolongations: list[sparse.csr_array]
    anchors: list[np.ndarray]
    material: Material
    bed: Bed | None = None
    regions: Tissue | None = None
    densities: list[np.ndarray] | None = None
    smooth: "SmoothSurface | None" = None

    def __repr__(self) -> str:
        nodes = ", ".join(str(len(mesh.nodes)) for mesh in self.levels)
        return f"<Body {self.name}: levels of {nodes} nodes, {len(self.anchors[-1])} of the last held>"

    @property
    def coarse(self) -> TetMesh | Sheet:
        return self.levels[0]

    @property
    def fine(self) -> TetMesh | Sheet:
        return self.levels[-1]

    def to_skfem(self, level: int | None = None) -> "MeshTet":
        """Return the tetrahedra of a level, the finest if none is given, as a mesh of scikit-fem, in the same order."""
        from skfem import MeshTet

        mesh = self.fine if level is None else self.levels[self._checked(level)]
        if not len(mesh.tetrahedra):
            raise InputError(f"{self.name} is a sheet and has no tetrahedra; give a solid body.")
        return MeshTet(np.ascontiguousarray(mesh.nodes.T), np.ascontiguousarray(mesh.tetrahedra.T))

    @staticmethod
    def from_skfem(
        mesh: "MeshTet",
        *,
        young_pa: float,
        poisson: float,
        density_kg_m3: float = 1000.0,
        law: str = LAWS[0],
        anchors: "np.ndarray | Sequence[int] | Rule | None" = None,
        refinements: int = 0,
        name: str = "body",
    ) -> "Body":
        """Return a body of a mesh of scikit-fem in metres, whose nodes stay in their order.

        anchors : numbers of the nodes that are held, a mask (n,) bool of them, or a Plane or Sphere that holds them;
            None for a free body
        Raises InputError for elements other than tetrahedra with 4 nodes, for a size that no body has, and as for the
        mesh of a file.
        """
        from palpate.bodies.mesh_file import read_skfem
        from palpate.bodies.settings import Solid, check_laws
        from palpate.bodies.supports import choose_anchors

        check_laws(f"body {name}: law", [law], Path())
        coarse = read_skfem(f"body {name}", mesh)
        if isinstance(anchors, np.ndarray) and anchors.dtype == bool and anchors.shape != (len(coarse.nodes),):
            raise InputError(f"body {name}: anchors is a mask {anchors.shape}; give one of ({len(coarse.nodes)},).")
        fields: dict[str, Any] = {"young_pa": young_pa, "poisson": poisson, "density_kg_m3": density_kg_m3, "law": law}
        settings = Solid(anchors=anchors, refinements=refinements, **fields)  # type: ignore[arg-type]
        return nest(name, coarse, refinements, choose_anchors(name, settings.anchors, coarse), Material(**fields))

    def node_at(self, point_m: Sequence[float]) -> int:
        """Return the number of the node of the coarse surface nearest to a point (3,) [m]; all levels have it."""
        if np.shape(point_m) != (3,) or not np.isfinite(point_m).all():
            raise InputError(f"node_at is asked for {point_m}; give three finite numbers [m].")
        surface = self.coarse.surface
        return int(surface[np.linalg.norm(self.coarse.nodes[surface] - point_m, axis=1).argmin()])

    def plot(self, path: str | Path | None = None) -> bytes:
        """Draw the finest level; return the PNG, and write it to ``path`` if there is one."""
        from palpate import pictures

        return pictures.body(self, path)

    def _repr_png_(self) -> bytes:
        return self.plot()

    def tissue(self, level: int) -> Tissue:
        """Return the materials of the tetrahedra of a level."""
        count = len(self.levels[level].tetrahedra)
        if self.regions is None:
            return uniform(self.material, count)
        # refinement puts the eight parts of an element next to each other, in the order of the elements
        parts = count // len(self.regions.region)
        share = None if self.regions.share is None else np.repeat(self.regions.share, parts)
        return Tissue(self.regions.materials, np.repeat(self.regions.region, parts), share)

    def supported(self, level: int) -> np.ndarray:
        """Return the nodes of a level that are held or lie on the bed, increasing."""
        held = self.anchors[level]
        return held if self.bed is None else np.union1d(held, inner_nodes(self.levels[level], self.bed))

    def up_to(self, level: int) -> "Body":
        """Return the body without the levels finer than ``level``, counted from 0."""
        return self._between(0, self._checked(level) + 1)

    def from_level(self, level: int) -> "Body":
        """Return the body without the levels coarser than ``level``, counted from 0."""
        regions = None if self.regions is None else self.tissue(level)
        return replace(self._between(self._checked(level), len(self.levels)), regions=regions)

    def _checked(self, level: int) -> int:
        if not isinstance(level, int | np.integer) or not 0 <= level < len(self.levels):
            raise InputError(f"{self.name} has the levels 0 to {len(self.levels) - 1}, and not {level!r}.")
        return level

    def _between(self, first: int, end: int) -> "Body":
        return replace(
            self,
            levels=self.levels[first:end],
            prolongations=self.prolongations[first : end - 1],
            anchors=self.anchors[first:end],
            densities=None if self.densities is None else self.densities[first:end],
        )

    @property
    def shape_level(self) -> int:
        """The first level of the finest one's shape: all that follow have new nodes halfway between old ones."""
        for level in range(len(self.levels) - 1, 0, -1):
            nodes = self.prolongations[level - 1] @ self.levels[level - 1].nodes
            if not np.allclose(nodes, self.levels[level].nodes, rtol=0.0, atol=1e-9 * self.coarse.size):
                return level
        return 0

    @cached_property
    def prolongation(self) -> sparse.csr_array:
        """Linear interpolation from coarse to fine nodes, (n_fine, n_coarse)."""
        identity = sparse.eye_array(len(self.coarse.nodes), format="csr")
        return reduce(lambda product, p: p @ product, self.prolongations, identity)


class Makes(Protocol):
    """Settings of a body."""

    def make(self) -> Body: ...


def as_body(given: Any) -> Body:
    """Return a body, or that of its settings; InputError for anything else."""
    if isinstance(given, type) or not (isinstance(given, Body) or callable(getattr(given, "make", None))):
        raise InputError(f"{given!r} is no body; give one, or its settings, such as Box(...).")
    made: Body = given if isinstance(given, Body) else given.make()
    return made


def nest(
    name: str,
    coarse: TetMesh | Sheet,
    refinements: int,
    anchors: np.ndarray,
    material: Material,
    snap: Snap | None = None,
    bed: Bed | None = None,
    regions: Tissue | None = None,
    smooth: "SmoothSurface | None" = None,
) -> Body:
    """Return the body of a coarse mesh that is refined so many times (0 for a sheet), with its anchors on every level.

    ``snap``, if given, moves the new nodes of the first refinement. Finer levels keep that shape, facets and all, so
    that answers on them have a limit. Displacements are still interpolated linearly; only the rest positions then are
    not. ``smooth`` is for a body whose every level, later ones too, is snapped to a surface that has a formula.
    """
    body = Body(name, [coarse], [], [np.unique(anchors)], material, bed, regions, smooth=smooth)
    for level in range(1, refinements + 1):
        body = finer(body, snap=snap if level == SHAPE_LEVEL else None)
    return body
