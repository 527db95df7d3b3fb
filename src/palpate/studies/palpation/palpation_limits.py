"""Limits of palpation: how deep in a slab, and how little stiffer than it, a ball may be to be felt by a finger."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_file import load_shape, load_tagged
from palpate.bodies.mesh_quality import check_tetrahedra
from palpate.bodies.surfaces.tetrahedralize import gmsh_session, set_sizes
from palpate.errors import InputError
from palpate.studies.palpation.palpation import PressCurves
from palpate.table import Table

TAG = 1
"""Tag of the ball; the slab around it has the next."""
DENSITY_KG_M3 = 1000.0
"""Density, which has no effect on a press."""
IN_BALL, UNDER_FINGER, FAR = 0.4, 0.4, 0.2
"""Lengths of edges as shares of the ball's radius, the finger's, and the slab's height."""


def ball_in_slab(slab: Mapping, ball_radius_m: float, cover_m: float, finger_m: float, contrast: float) -> Body:
    """Make a slab of two levels with a ball, ``contrast`` times as stiff, whose top is ``cover_m`` [m] deep.

    slab : ``sizes_m`` along x, y and z, ``young_pa`` and ``poisson``; its lowest plane is held
    finger_m : radius of the finger that will press the middle of the top, where there is a node
    Raises InputError if the ball is not in the slab.
    """
    x, y, z = slab["sizes_m"]
    center = np.array([x / 2, y / 2, z - cover_m - ball_radius_m])
    if not (cover_m > 0.0 and center.min() > ball_radius_m):
        raise InputError(
            f"palpation: a ball of radius {ball_radius_m:g} m, {cover_m:g} m deep, is not inside the slab of "
            f"{x:g} × {y:g} × {z:g} m; change covers_m, ball_radius_m or slab.sizes_m."
        )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "slab.msh"
        with gmsh_session() as gmsh:
            _mesh(gmsh, np.array(slab["sizes_m"]), center, ball_radius_m, finger_m)
            gmsh.write(str(path))
        nodes, _, tetrahedra = load_shape(path)
        assert tetrahedra is not None, "gmsh was asked for tetrahedra"
        region = np.zeros(len(tetrahedra), dtype=np.int64)
        region[load_tagged(path, TAG)] = 1
    mesh = TetMesh(nodes, check_tetrahedra("slab", nodes, tetrahedra))
    own = Material(slab["young_pa"], slab["poisson"], DENSITY_KG_M3)
    held = np.flatnonzero(nodes[:, 2] < 1e-6 * z)
    return nest("slab", mesh, 1, held, own, regions=_ball_in(own, contrast, region))


def _ball_in(own: Material, contrast: float, region: np.ndarray) -> Tissue:
    """Return the tissue of a slab of its ``own`` material whose elements of ``region`` 1 are stiffer."""
    return Tissue((own, replace(own, young_pa=contrast * own.young_pa)), region)


def _mesh(gmsh: Any, sizes: np.ndarray, center: np.ndarray, radius: float, finger: float) -> None:
    """Build the mesh of the slab with the surface of the ball, in two groups: TAG is the ball."""
    occ, middle = gmsh.model.occ, sizes * [0.5, 0.5, 1.0]
    box, ball, top = occ.addBox(0.0, 0.0, 0.0, *sizes), occ.addSphere(*center, radius), occ.addPoint(*middle)
    occ.fragment([(3, box)], [(3, ball), (0, top)])
    occ.synchronize()
    volumes = sorted((tag for _, tag in gmsh.model.getEntities(3)), key=lambda tag: occ.getMass(3, tag))
    for number, volume in enumerate(volumes, start=TAG):
        gmsh.model.addPhysicalGroup(3, [volume], number)
    near = [(center, radius, IN_BALL * radius), (middle, finger, UNDER_FINGER * finger)]
    set_sizes(gmsh, near, FAR * sizes[2])
    for option in ("MeshSizeFromPoints", "MeshSizeExtendFromBoundary", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.optimize("Netgen", niter=3)


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


def palpation_limits(
    slab: Mapping,
    ball_radius_m: float,
    covers_m: Sequence[float],
    contrasts: Sequence[float],
    radius_m: float,
    pressure_of_young: float,
    felt: float,
    progress: Callable = iter,
) -> pd.DataFrame:
    """Press a slab above a ball under each of ``covers_m`` [m] and of each of ``contrasts``.

    slab : as ``ball_in_slab`` takes it; contrast : modulus of the ball over that of the slab
    radius_m : of the finger; pressure_of_young : peak pressure of the press as a share of the slab's modulus
    felt : as ``palpation.palpate`` takes it
    Raises InputError if a ball is not in the slab, NotConverged if a press has no equilibrium.
    """
    rows = []
    for cover in progress(covers_m):
        body = ball_in_slab(slab, ball_radius_m, cover, radius_m, contrasts[0])
        middle = np.array(slab["sizes_m"]) * [0.5, 0.5, 1.0]
        contact = int(np.argmin(np.linalg.norm(body.coarse.nodes - middle, axis=1)))
        plain = PressCurves(body, radius_m)
        forces = plain.forces([pressure_of_young])
        without = float(plain.depths(contact, forces, regions=False)[0])
        for contrast in contrasts:
            tissue = _ball_in(body.material, contrast, body.tissue(0).region)
            curves = PressCurves(replace(body, regions=tissue), radius_m)
            depth = float(curves.depths(contact, forces, regions=True)[0])
            stiffer = without / depth - 1.0
            row = [cover, ball_radius_m, contrast, forces[0], depth, without, stiffer, abs(stiffer) >= felt]
            rows.append([*row, felt, curves.products])
    return PALPATION_LIMITS.frame(rows)


def least_contrasts(table: pd.DataFrame) -> dict[float, float]:
    """Return for each cover [m] of ``palpation_limits`` the least contrast that is felt, infinite if none is.

    Between two contrasts of the table ``stiffer`` is taken as linear in the logarithm of the contrast.
    """
    found = {}
    for cover, rows in table[table["contrast"] >= 1.0].groupby("cover_m"):
        rows = rows.sort_values("contrast")
        # a ball as stiff as the slab changes nothing
        stiffer, log = np.append(0.0, rows["stiffer"]), np.append(0.0, np.log(rows["contrast"]))
        edge = rows["threshold"].iloc[0]
        first = int(np.argmax(stiffer >= edge))
        if not first:
            found[float(cover)] = np.inf
            continue
        share = (edge - stiffer[first - 1]) / (stiffer[first] - stiffer[first - 1])
        found[float(cover)] = float(np.exp(log[first - 1] + share * (log[first] - log[first - 1])))
    return found
