"""Body files (HDF5), so that a body is made only once."""

from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import Sheet, TetMesh
from palpate.bodies.organs import SmoothSurface
from palpate.bodies.supports import Bed
from palpate.errors import InputError
from palpate.files import read_hdf5, write_whole

if TYPE_CHECKING:
    import h5py

VERSION = 6
"""Number of the layout below; increase it with every change of the layout."""


def save(body: Body, path: str | Path) -> None:
    """Write a body; the file appears under its name only once it is complete."""
    import h5py

    with write_whole(path) as part, h5py.File(part, "w") as file:
        file.attrs.update(kind="body", version=VERSION, name=body.name, units="m", **asdict(body.material))
        file.attrs["levels"] = len(body.levels)
        if body.bed is not None:
            given = {key: value for key, value in asdict(body.bed).items() if value is not None}
            file.create_group("bed").attrs.update(given)
        if body.smooth is not None:
            file.create_group("smooth").attrs.update(asdict(body.smooth))
        if body.regions is not None:
            _put(file, "regions/region", body.regions.region)
            for i, each in enumerate(body.regions.materials):
                file.create_group(f"regions/material_{i}").attrs.update(asdict(each))
        for i, (mesh, held) in enumerate(zip(body.levels, body.anchors, strict=True)):
            _put(file, f"level_{i}/nodes", mesh.nodes)
            if isinstance(mesh, Sheet):
                _put(file, f"level_{i}/triangles", mesh.triangles)
                file[f"level_{i}"].attrs["thickness_m"] = mesh.thickness_m
            else:
                _put(file, f"level_{i}/tetrahedra", mesh.tetrahedra)
            _put(file, f"level_{i}/anchors", held)
            if body.densities is not None:
                _put(file, f"level_{i}/densities_kg_m3", body.densities[i])
        for i, p in enumerate(body.prolongations):
            for part_name in ("data", "indices", "indptr"):
                _put(file, f"prolongation_{i}/{part_name}", getattr(p, part_name))


def load(path: str | Path) -> Body:
    """Read a body; raise InputError naming the field if the file is missing, damaged or of another version."""
    with read_hdf5(path) as file:
        return _read(Path(path), file)


def _read(path: Path, file: "h5py.File") -> Body:
    attributes = file.attrs
    if attributes.get("kind") != "body" or attributes.get("version") != VERSION:
        raise InputError(f"{path}: version is not {VERSION} of a body file; delete it and type make.")
    levels: list[TetMesh | Sheet] = []
    held: list[np.ndarray] = []
    for i in range(attributes["levels"]):
        group = file[f"level_{i}"]
        nodes = group["nodes"][()]
        if "triangles" in group:
            levels.append(Sheet(nodes, group["triangles"][()], float(group.attrs["thickness_m"])))
        else:
            levels.append(TetMesh(nodes, group["tetrahedra"][()]))
        held.append(group["anchors"][()])
    prolongations = []
    for i, (coarse, fine) in enumerate(pairwise(levels)):
        group = file[f"prolongation_{i}"]
        parts = tuple(group[name][()] for name in ("data", "indices", "indptr"))
        prolongations.append(sparse.csr_array(parts, shape=(len(fine.nodes), len(coarse.nodes))))
    name, material = str(attributes["name"]), _material(attributes)
    bed: Bed | None = None
    smooth: SmoothSurface | None = None
    regions: Tissue | None = None
    densities: list[np.ndarray] | None = None
    if "regions" in file:
        found = file["regions"]
        materials = tuple(_material(found[f"material_{i}"].attrs) for i in range(len(found) - 1))
        regions = Tissue(materials, found["region"][()])
    if "level_0/densities_kg_m3" in file:
        densities = [file[f"level_{i}/densities_kg_m3"][()] for i in range(len(levels))]
    if "bed" in file:
        found = file["bed"].attrs
        radius_m, stiffness_n_m3 = float(found["radius_m"]), float(found["stiffness_n_m3"])
        bed = Bed(found["center_m"], radius_m, stiffness_n_m3, found.get("facing"))
    if "smooth" in file:
        smooth = SmoothSurface(str(file["smooth"].attrs["kind"]), float(file["smooth"].attrs["size_m"]))
    return Body(name, levels, prolongations, held, material, bed, regions, densities, smooth)


def _material(found: "h5py.AttributeManager") -> Material:
    young, poisson, density = (float(found[key]) for key in ("young_pa", "poisson", "density_kg_m3"))
    return Material(young, poisson, density, str(found["law"]))


def _put(file: "h5py.File", name: str, array: np.ndarray) -> None:
    file.create_dataset(name, data=array, compression="gzip", fletcher32=True)
