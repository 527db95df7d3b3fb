"""Palpation: force against depth on a body with and without its regions, and how deep in a slab a ball is felt."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.bodies import body_file
from palpate.bodies.body import Body, nest
from palpate.bodies.contacts import contacts_near_regions
from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import check_tetrahedra
from palpate.bodies.refinement import finer
from palpate.bodies.surfaces.tetrahedralize import TETRAHEDRON, gmsh_mesh, gmsh_session, set_sizes
from palpate.effects.patch_load import nodal_load
from palpate.errors import InputError
from palpate.run.job import steps
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.palpation.settings import Settings
from palpate.table_declaration import Table

TOLERANCE = 1e-7
"""Relative residual of the solves: differences between two bodies are to be exact to 1e-5."""
FELT = 0.15
"""Least relative difference of force over depth at which two places feel different: the Weber fraction of Bergmann
Tiest and Kappers (Cues for haptic perception of compliance, IEEE Trans. Haptics 2, 2009)."""


class Slab(NamedTuple):
    """A slab on a rigid ground, with a ball of its Poisson's ratio below the middle of its top."""

    sizes_m: Sequence[float] = (0.12, 0.12, 0.06)
    young_pa: float = 3000
    poisson: float = 0.45


SLAB = Slab()


class PressCurves:
    """Presses of a body with its regions, and of the same mesh of its own material alone, by quadratic elements.

    The elements are on the last level but one, so that their nodes are those of the finest, or on the only level.
    ``products`` counts the products with a stiffness matrix so far.
    """

    def __init__(self, body: Body, radius_m: float):
        self._level, self._radius_m, self.products = max(len(body.levels) - 2, 0), radius_m, 0
        self._body = body if len(body.levels) > 1 else finer(body)
        self._problems: dict[bool, Equilibrium] = {}

    def forces(self, pressures: Sequence[float]) -> np.ndarray:
        """Return the forces (k,) [N] of presses with peak ``pressures`` over the body's own Young's modulus."""
        return np.asarray(pressures) * self._body.material.young_pa * np.pi * self._radius_m**2 / 2.0

    def depths(self, contact: int, forces: np.ndarray, regions: bool) -> np.ndarray:
        """Compute the depth (k,) [m] of the patch at a coarse node under each inward force [N], smallest first.

        The depth is the mean of the inward displacement weighted with the pressure, so that force times depth is the
        work of a constant force. regions : whether the body has them. Raises NotConverged without an equilibrium.
        """
        inward = -self._body.fine.normals[contact]
        unit = nodal_load(self._body, self._level, contact, inward, self._radius_m, order=2)
        problem, depths = self._problem(regions), []
        rest, moved, last_force = problem.mesh.nodes, np.zeros_like(unit), 1.0
        for force in forces:
            # the search starts from the last displacements, scaled by the force
            solution = problem.solve(force * unit, TOLERANCE, start=rest + moved * (force / last_force))
            moved, last_force = solution.x - rest, force
            self.products += solution.products
            depths.append(float(np.vdot(unit, moved)))
        return np.array(depths)

    def _problem(self, regions: bool) -> Equilibrium:
        if regions not in self._problems:
            body = self._body if regions else replace(self._body, regions=None)
            self._problems[regions] = Equilibrium(body, self._level, order=2)
        return self._problems[regions]


PALPATION = Table(
    "palpation",
    "Force and depth of a finger's presses at places ever farther from a region, and the depth without it.",
    """
    body contact: a body, and the node that is pressed
    cover_m: distance from the place to the elements of a region, 0 where they reach it [m]
    force_n depth_m depth_without_m: force [N], depth of the press, and that on the body of its own material alone [m]
    stiffer: by what share the place resists more than without regions
    felt threshold: whether a finger feels the difference, and from what share on
    """,
)


def palpate(body: Body, settings: Settings, progress: Callable = iter) -> pd.DataFrame:
    """Press a body at contacts ever farther from a region, with and without its regions; one row of PALPATION a force.

    Raises InputError if the body has no regions, NotConverged if a press has no equilibrium.
    """
    if body.regions is None:
        raise InputError(f"bodies.{body.name} has no regions, so there is nothing to feel; give it some.")
    contacts, covers = contacts_near_regions(body, settings.places)
    curves, rows = PressCurves(body, settings.radius_m), []
    forces = curves.forces(sorted(settings.pressures_of_young))
    for contact, cover in progress(list(zip(contacts, covers, strict=True))):
        with_regions, without = (curves.depths(int(contact), forces, regions) for regions in (True, False))
        stiffer = without / with_regions - 1.0
        columns = (forces, with_regions, without, stiffer, np.abs(stiffer) >= FELT)
        rows += [[body.name, int(contact), cover, *row, FELT] for row in zip(*columns, strict=True)]
    return PALPATION.frame(rows)


IN_BALL, UNDER_FINGER, COARSENED = 0.4, 0.4, 0.2
"""Lengths of edges over the ball's radius, over the finger's radius, and elsewhere over the slab's height."""


def ball_in_slab(slab: Slab, ball_radius_m: float, cover_m: float, finger_m: float, contrast: float) -> Body:
    """Make a slab of two levels with a ball, ``contrast`` times as stiff, whose top is ``cover_m`` [m] deep.

    The lowest plane of the slab is held, and there is a node in the middle of its top.
    finger_m : radius of the finger that will press there; raises InputError if the ball is not in the slab
    """
    x, y, z = slab.sizes_m
    center = np.array([x / 2, y / 2, z - cover_m - ball_radius_m])
    if not (cover_m > 0.0 and center.min() > ball_radius_m):
        raise InputError(
            f"palpation: a ball of radius {ball_radius_m:g} m, {cover_m:g} m deep, is not inside the slab of "
            f"{x:g} × {y:g} × {z:g} m; change covers_m."
        )
    with gmsh_session() as gmsh:
        ball = _mesh(gmsh, np.array(slab.sizes_m), center, ball_radius_m, finger_m)
        nodes, elements = gmsh_mesh(gmsh)
        all_tags, ball_tags = (gmsh.model.mesh.getElementsByType(TETRAHEDRON, tag)[0] for tag in (-1, ball))
    region = np.isin(all_tags, ball_tags).astype(np.int64)
    mesh = TetMesh(nodes, check_tetrahedra("slab", nodes, elements[TETRAHEDRON]))
    material = Material(slab.young_pa, slab.poisson, 1000.0)  # the density has no effect on a press
    held = np.flatnonzero(nodes[:, 2] < 1e-6 * z)
    return nest("slab", mesh, 1, held, material, regions=_ball_in(material, contrast, region))


def _ball_in(material: Material, contrast: float, region: np.ndarray) -> Tissue:
    """Return the tissue of a slab of ``material``, ``contrast`` times as stiff in elements of ``region`` 1."""
    return Tissue((material, replace(material, young_pa=contrast * material.young_pa)), region)


def _mesh(gmsh: Any, sizes: np.ndarray, center: np.ndarray, radius: float, finger: float) -> int:
    """Mesh the slab with the ball's surface in it by gmsh; return the tag of the ball's volume."""
    occ, middle = gmsh.model.occ, sizes * [0.5, 0.5, 1.0]
    box, ball, top = occ.addBox(0.0, 0.0, 0.0, *sizes), occ.addSphere(*center, radius), occ.addPoint(*middle)
    occ.fragment([(3, box)], [(3, ball), (0, top)])
    occ.synchronize()
    fine_balls = [(center, radius, IN_BALL * radius), (middle, finger, UNDER_FINGER * finger)]
    set_sizes(gmsh, fine_balls, COARSENED * sizes[2])
    for option in ("MeshSizeFromPoints", "MeshSizeExtendFromBoundary", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.optimize("Netgen", niter=3)
    return min((tag for _, tag in gmsh.model.getEntities(3)), key=lambda tag: occ.getMass(3, tag))


PALPATION_LIMITS = Table(
    "palpation_limits",
    "By how much a ball in a slab makes a finger's press stiffer, by its depth and its contrast.",
    """
    cover_m ball_radius_m contrast: depth of the ball's top [m], its radius [m], and its modulus over the slab's
    force_n depth_m depth_without_m: force [N], depth of the press, and that without the ball [m]
    stiffer felt threshold: as in palpation.csv
    products: products with the stiffness matrix that the solution took
    """,
)


BALL_M, PRESSURE_OF_YOUNG = 0.01, 0.1
"""Radius [m] of the ball, and peak pressure of the press on the slab over its Young's modulus."""


def palpation_limits(settings: Settings, progress: Callable = iter, slab: Slab = SLAB) -> pd.DataFrame:
    """Press a slab above a ball of each of the depths and contrasts of ``settings``; rows of PALPATION_LIMITS.

    Raises InputError if a ball is not in the slab, NotConverged if a press has no equilibrium.
    """
    rows = []
    for cover in progress(settings.covers_m):
        body = ball_in_slab(slab, BALL_M, cover, settings.radius_m, settings.contrasts[0])
        middle = np.array(slab.sizes_m) * [0.5, 0.5, 1.0]
        contact = int(np.argmin(np.linalg.norm(body.coarse.nodes - middle, axis=1)))
        plain = PressCurves(body, settings.radius_m)
        forces = plain.forces([PRESSURE_OF_YOUNG])
        without = float(plain.depths(contact, forces, regions=False)[0])
        for contrast in settings.contrasts:
            tissue = _ball_in(body.material, contrast, body.tissue(0).region)
            curves = PressCurves(replace(body, regions=tissue), settings.radius_m)
            depth = float(curves.depths(contact, forces, regions=True)[0])
            stiffer = without / depth - 1.0
            row = [cover, BALL_M, contrast, forces[0], depth, without, stiffer, abs(stiffer) >= FELT]
            rows.append([*row, FELT, curves.products])
    return PALPATION_LIMITS.frame(rows)


def least_contrasts(table: pd.DataFrame) -> dict[float, float]:
    """Return the least contrast that is felt for each cover [m] of ``palpation_limits``, infinite if none is.

    Between two contrasts of the table ``stiffer`` is interpolated linearly in the logarithm of the contrast.
    """
    least = {}
    for cover, rows in table[table["contrast"] >= 1.0].groupby("cover_m"):
        rows = rows.sort_values("contrast")
        # a ball as stiff as the slab changes nothing
        stiffer, logs = np.append(0.0, rows["stiffer"]), np.append(0.0, np.log(rows["contrast"]))
        threshold = rows["threshold"].iloc[0]
        above = int(np.argmax(stiffer >= threshold))
        if not above:
            least[float(cover)] = np.inf
            continue
        fraction = (threshold - stiffer[above - 1]) / (stiffer[above] - stiffer[above - 1])
        least[float(cover)] = float(np.exp(logs[above - 1] + fraction * (logs[above] - logs[above - 1])))
    return least


def measure_palpation(input: Any, say: Callable, settings: Settings) -> pd.DataFrame:
    """Palpate one body, for the rule of this name."""
    body = body_file.load(input.body)
    return palpate(body, settings, progress=steps(say, f"{body.name}: a finger at place"))


def measure_palpation_limits(say: Callable, settings: Settings) -> pd.DataFrame:
    """Palpate a slab with a ball at several depths, for the rule of this name."""
    return palpation_limits(settings, progress=steps(say, "a finger above a ball at depth"))
