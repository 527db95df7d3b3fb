"""Construction of a body from its entry in the config; files as they are, or remeshed to few surface nodes."""

import warnings
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from palpate.bodies import settings as bodies
from palpate.bodies.body import Body, nest
from palpate.bodies.ct import mesh_from_ct
from palpate.bodies.ct.config_scan import described
from palpate.bodies.ct.masses import nodal_densities
from palpate.bodies.material import LAWS, Material
from palpate.bodies.mesh import TetMesh, components
from palpate.bodies.mesh_file import KEPT_NODES, checked, choose_scale, in_words, load_shape
from palpate.bodies.mesh_quality import LEAST_DEG, check_closed, check_quality, dihedral_angles, is_closed
from palpate.bodies.mesh_readers import read
from palpate.bodies.organs import SHAPES, coarse_body, surface_of
from palpate.bodies.refinement import Snap
from palpate.bodies.regions import balls_of, read_regions
from palpate.bodies.seams import weld_pieces
from palpate.bodies.settings import Box, Ct, Cylinder, File, Round, Sheet
from palpate.bodies.simple_shapes import box, cylinder, sheet
from palpate.bodies.supports import choose_anchors, default_anchors, read_bed
from palpate.bodies.surfaces.coarse_solid import NODES, CoarseSolid, remesh_solid
from palpate.bodies.surfaces.mend import Mended, find_holes, mend
from palpate.bodies.surfaces.solid import Solid, solidify
from palpate.bodies.surfaces.tetrahedralize import tetrahedralize
from palpate.bodies.surfaces.triangles import volume, weld
from palpate.errors import InputError, about

SECTION = 0.01
"""Share of a circle's area that a cylinder of facets may lack without a warning."""


def make_body(name: str, entry: bodies.Body) -> Body:
    """Make the coarse mesh that the settings ask for, choose its anchors and refine it.

    Raises InputError if they cannot be used; warnings begin with "bodies.<name>: ".
    """
    with about(f"bodies.{name}"):
        return _make(name, entry)


def _make(name: str, entry: bodies.Body) -> Body:
    """Make the body ``name`` of its settings: coarse mesh, held nodes, regions and densities, and all levels."""
    material = Material(entry.young_pa, entry.poisson, entry.density_kg_m3, entry.law or LAWS[0])
    if isinstance(entry, Sheet):
        cloth = sheet(entry.sizes_m, entry.divisions, entry.thickness_m)
        return nest(name, cloth, 0, choose_anchors(name, entry.anchors, cloth), material)
    mesh, snap, remeshed = _coarse(entry)
    bed = read_bed(name, entry.bed, mesh) if entry.bed is not None else None
    rule = entry.anchors
    if rule is None and bed is None and isinstance(entry, File | Ct):
        rule = default_anchors(name, mesh)
    if remeshed and rule and rule.nodes:
        raise InputError(
            f"body {name}: anchors.nodes counts nodes of a mesh that is remeshed; hold nodes by plane or sphere, or "
            "give surface_nodes as many as the file has."
        )
    anchors = choose_anchors(name, rule, mesh, bed)
    regions = read_regions(name, entry, mesh, material, remeshed)
    smooth = surface_of(entry) if isinstance(entry, Round) and entry.smooth else None
    body = nest(name, mesh, entry.refinements, anchors, material, snap, bed, regions, smooth)
    if isinstance(entry, Ct) and entry.modality == entry.masses == "ct":
        for region, constants in (entry.regions or {}).items():
            if constants.density_kg_m3 is not None:
                raise InputError(
                    f"body {name}: regions.{region} has a density_kg_m3, and the voxels of the CT have theirs; leave "
                    "it out, or give masses: uniform."
                )
        body = replace(body, densities=nodal_densities(entry, body.levels))
    if isinstance(entry, File | Ct):
        remedy = "improve the mesh in the program that made it"
        if len(body.coarse.surface) > NODES[0]:
            remedy += f", or give surface_nodes: {NODES[0]} to have it remeshed"
        check_quality(body.levels, "give more surface_nodes" if remeshed else remedy)
    if isinstance(entry, Cylinder) and entry.smooth is not False and isinstance(body.fine, TetMesh):
        mesh_m2, round_m2 = body.fine.volumes.sum() / entry.length_m, np.pi * entry.radius_m**2
        lacking_share = 1 - mesh_m2 / round_m2
        if mesh_m2 < (1 - SECTION) * round_m2:
            _warn(
                f"the section of the finest mesh is {1e4 * mesh_m2:.4g} cm², {100 * lacking_share:.2g} % less than the "
                "circle's, as its sides are flat; divide forces by that for stresses, or give smooth: true and more "
                "refinements, or smooth: false if that is meant."
            )
    return body


def _coarse(entry: bodies.SolidBody) -> tuple[TetMesh, Snap | None, bool]:
    """Return a body's coarse mesh, what snaps finer ones to the surface of a CT or a file, and if it was remeshed."""
    match entry:
        case File():
            return build(entry)
        case Ct():
            return *mesh_from_ct.build(entry), True
        case Cylinder():
            mesh = cylinder(entry.length_m, entry.radius_m)
        case Box():
            mesh = box(entry.sizes_m, entry.divisions)
        case _:
            mesh = coarse_body(SHAPES[entry.kind], entry.length_m, balls_of(entry))
    return mesh, None, False


def build(entry: File) -> tuple[TetMesh, Snap | None, bool]:
    """Build the coarse mesh of a file; also return what snaps finer ones to its surface, and whether it was remeshed.

    Tetrahedra are taken as they are. So is a closed surface of at most ``surface_nodes`` nodes (by default 400). Other
    surfaces are remeshed, and so are those that cannot be filled well, unless ``surface_nodes`` is just their number.
    Warns of all that was assumed and changed; raises InputError if no body can be made.
    """
    as_given, scale_m, count = own_mesh(entry)
    if as_given is not None:
        return as_given, None, False
    path, nodes = Path(entry.path), entry.surface_nodes
    made = _remesh(path, scale_m, None if nodes == count else nodes, entry.snap)
    if nodes is None:
        _warn(
            f"{path}: its surface of {count} nodes is remeshed to {made.nodes}; give surface_nodes to choose another "
            f"number, {count} to keep its own."
        )
    return made.mesh, made.snap, True


def own_mesh(entry: File) -> tuple[TetMesh | None, float, int]:
    """Build the mesh of a file as it is, None if it is to be remeshed; also return its unit [m] and surface nodes."""
    path, nodes = Path(entry.path), entry.surface_nodes
    points, triangles, tetrahedra, welded_note = _loaded(path, _changed(path))
    if welded_note:
        _warn(f"{path}: {welded_note}; give parts that are to stay apart a body each.")
    scale_m = choose_scale(str(path), points, entry.scale_m)
    points = points * scale_m
    count = len(np.unique(triangles))
    if tetrahedra is not None and count <= (nodes or count):
        mesh = checked(str(path), points, tetrahedra)
        if count > KEPT_NODES:
            _warn(
                f"{path}: its tetrahedra are kept as they are, with {count} surface nodes, and every refinement makes "
                f"eight times as many; if that takes too long, give surface_nodes: {NODES[0]} to have it remeshed."
            )
        return mesh, scale_m, count
    if count <= (nodes or KEPT_NODES):
        return _filled_as_given(path, points, triangles, entry, required=nodes == count), scale_m, count
    return None, scale_m, count


def _filled_as_given(
    path: Path, points: np.ndarray, triangles: np.ndarray, entry: File, required: bool
) -> TetMesh | None:
    """Fill a file's surface with tetrahedra, mended but not remeshed; None if that fails or makes bad elements."""
    mended = mend(str(path), points, triangles)
    try:
        closed = check_closed(str(path), mended.points, mended.triangles)
        mesh = tetrahedralize(mended.points, closed, source=str(path), balls=balls_of(entry))
    except InputError as error:
        if required:
            _warn(f"{error} It is remeshed instead of kept.".replace(". It is", ", or it is"))
        return None
    _report_mended(path, mended.notes)
    # where its nodes are asked for, a surface is kept, and its bad elements are reported with those of the levels
    return mesh if required or dihedral_angles(mesh).min() >= LEAST_DEG else None


def solid_of(path: Path, scale_m: float) -> tuple[Mended, Solid]:
    """Return the mended surface of a file, and the solid in it [m]; InputError if it encloses none."""
    return _solid(path, scale_m, _changed(path))


def _changed(path: Path) -> int:
    """Return when a file was changed last [ns], 0 if it is missing, for results that are kept until it changes."""
    return path.stat().st_mtime_ns if path.exists() else 0


# meshes of several sizes, and the body itself, are made of the same file one after another
@lru_cache(maxsize=1)
def _loaded(path: Path, changed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, str]:
    points, triangles, tetrahedra = load_shape(path)
    if tetrahedra is None:
        return points, triangles, None, ""
    points, tetrahedra, said = weld_pieces(points, tetrahedra)
    return points, TetMesh(points, tetrahedra).triangles, tetrahedra, said


@lru_cache(maxsize=1)
def _solid(path: Path, scale_m: float, changed: int) -> tuple[Mended, Solid]:
    points, triangles, *_ = _loaded(path, changed)
    # faces of tetrahedra that coincide have nodes of their own
    mended = mend(str(path), *weld(points * scale_m, triangles))
    return mended, solidify(str(path), mended)


@lru_cache(maxsize=4)
def _remeshed(path: Path, scale_m: float, nodes: int | None, snap: bool, changed: int) -> CoarseSolid:
    mended, solid = _solid(path, scale_m, changed)
    return remesh_solid(solid, mended, nodes, snap)


def _remesh(path: Path, scale_m: float, nodes: int | None, snap: bool) -> CoarseSolid:
    """Remesh a file's surface; warn of what was mended, and if the coarse body is far from the surface."""
    mended, solid = solid_of(path, scale_m)
    _report_mended(path, mended.notes + solid.notes)
    coarse_solid = _remeshed(path, scale_m, nodes, snap, _changed(path))
    likeness = coarse_solid.likeness
    if snap and not likeness.close:
        _warn(
            f"{path}: with {coarse_solid.nodes} surface nodes the refined body's surface is up to "
            f"{in_words(likeness.away_m)} ({100 * likeness.away:.2g} % of the size) from the file's and its "
            f"volume differs by {100 * likeness.volume:+.2g} %, "
            "as thin or sharp parts are lost; give more surface_nodes."
        )
    return coarse_solid


def taken(entry: bodies.Body, unit: str = "given") -> list[str]:
    """Describe in lines what is read from a body's files: frame, unit, pieces, holes and volume.

    unit : how the unit's length is known where ``scale_m`` is given
    """
    if isinstance(entry, Ct):
        return described(entry)[0] if entry.image is not None else []
    if not isinstance(entry, File):
        return []
    path = Path(entry.path)
    with warnings.catch_warnings(action="ignore"):  # of the frame, which is said here
        points, triangles, tetrahedra, welded_note = _loaded(path, _changed(path))
        frame = read(path).frame
        scale_m = choose_scale(str(path), points, entry.scale_m)
    sides = f"{frame} from its header{', turned to LPS' * (frame == 'RAS')}, so that its sides are the patient's"
    upright = "no frame in its header, so that z points up, y to the back and x to the right"
    corners = (triangles if tetrahedra is None else tetrahedra)[:, :, None]
    pairs = np.concatenate([corners[:, :-1], corners[:, 1:]], axis=2).reshape(-1, 2)
    count = len(np.unique(components(pairs, len(points))))
    pieces = welded_note or ("1 piece" if count == 1 else f"{count} pieces")
    element_words = "triangles" if tetrahedra is None else "tetrahedra"
    size = f"{1e6 * scale_m**3 * abs(volume(points, triangles)):.4g} mL, as its {element_words}"
    if holes := len(find_holes(points, triangles)):
        size = f"no volume of its own, as it has {holes} hole{'s' * (holes > 1)}"
    elif not is_closed(triangles):
        size = "no volume of its own, as its triangles are wound both ways"
    unit = unit if entry.scale_m else "guessed from the size"
    return [f"{path}: {sides if frame else upright}; a unit of {in_words(scale_m)}, {unit}; {pieces}; {size}"]


def _report_mended(path: Path, notes: list[str]) -> None:
    if notes:
        _warn(f"{path}: mended: {', '.join(notes)}; look at the body, or repair the file and export it again.")


def _warn(sentence: str) -> None:
    warnings.warn(sentence, stacklevel=3)
