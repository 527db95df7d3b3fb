"""Choose what a first configuration assumes of a body: what it lies on, how fine it is, and how it is pressed."""

import math
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from palpate.bodies import make_body as bodies
from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, pressed_contacts
from palpate.bodies.ct import mesh_from_ct
from palpate.bodies.make_body import make_body
from palpate.bodies.mesh import TetMesh, area_normals, components
from palpate.bodies.mesh_file import in_words
from palpate.bodies.mesh_quality import check_quality
from palpate.bodies.settings import Bed as BedSettings
from palpate.bodies.settings import Ct, File, Sphere
from palpate.bodies.supports import Bed, inner_nodes
from palpate.bodies.surfaces.coarse_solid import Likeness, apart
from palpate.bodies.surfaces.mask_surface import dense_surface
from palpate.errors import InputError
from palpate.init.recognise import MATERIAL, lies_as, sides_of

# tetrahedra of the fine mesh up to which the truth, which needs eight times as many quadratic ones, takes 5 GB at most
FINE_TETRAHEDRA = 50_000
# contacts that samples press, and the least that can be divided into those to test, to choose by and to learn from
PRESSED, LEAST_PRESSED = 24, 5
# of a mesh that is made anew, tried in this order until the body has the shape of the data
SURFACE_NODES = (140, 280, 560, 1120)
# how much less like the data a body of fewer surface nodes may be, where none has its shape
WORSE = 1.2
# thickness of the tissue that the body lies on, as a share of its longest side: 10 mm of fat and ligaments under a
# liver. Tissue as stiff as the body, and so thick, resists displacement by E / thickness
BED_THICKNESS = 0.05
# a side counts as the broadest if it has this share of the area of the broadest
BROAD = 0.95
# radius of a fingertip [m], and between which shares of the longest side it stays; that of a flat hand, as a share; the
# largest radius as a share of the middle side, since a disc lies on the broadest face
FINGERTIP, TIP_OF_SIZE, HAND, DISC = 0.012, (0.04, 0.15), 0.15, 0.5
# the largest displacement of the large regime, as a share of the longest side; less where the body is thin, as no
# solver follows tissue that is pressed flat: this share of the depth to the bed
PEAK, OF_DEPTH = 0.1, 0.4
# displacements of the small regime against the large one's; the pressure of the deep one against Young's modulus
SMALL, DEEP = 0.3, 0.25


def likeness(mesh: TetMesh, entry: File | Ct) -> Likeness:
    """Compare ``mesh`` with the surface and the volume of what it was made from."""
    if isinstance(entry, File):
        assert entry.scale_m is not None
        mended, solid = bodies.solid_of(Path(entry.path), entry.scale_m)
        places, points, triangles, volume_m3 = solid.places, mended.points, mended.triangles, solid.volume_m3
    else:
        image, mask = mesh_from_ct.segment_entry(entry)
        points, triangles = dense_surface(mask, image)
        places, volume_m3 = points, float(mask.sum() * image.voxel_m3)
    away_m, size_m = apart(mesh, places, points, triangles), float(np.ptp(places, axis=0).max())
    thick_m = 4.0 * volume_m3 / float(np.linalg.norm(area_normals(points, triangles), axis=1).sum())
    return Likeness(away_m, size_m, float(mesh.volumes.sum()), volume_m3, thick_m)


class Choice(NamedTuple):
    """The body that results, its coarse mesh, its settings, the regimes that suit it, how many contacts it has.

    likeness : to the data, or None where the data's own mesh is used
    tried : surface nodes → likeness, of all meshes that were made anew
    """

    body: Body
    coarse: TetMesh
    entry: File | Ct
    regimes: dict
    contacts: int
    likeness: Likeness | None
    tried: dict[int, Likeness]


def choose(name: str, entry: File | Ct, hold: str | None = None, say: Callable[[str], object] = str) -> Choice:
    """Make the coarse mesh, choose the rest of the settings for it, and make the body; InputError if it fails.

    entry : where the mesh comes from; paths as they can be opened from here
    hold : the side that it lies on, as ``sides_of`` knows them; chosen if it is not given
    say : takes the words of each step, before it
    """
    entry, coarse, tried = _with_coarse_mesh(entry, say)
    like = tried.get(entry.surface_nodes or 0)
    if like is not None and like.other:
        raise InputError(
            f"{name}: with {entry.surface_nodes} surface nodes the body's surface is up to {in_words(like.away_m)} "
            f"({100 * like.away:.2g} % of the size) from that of the data, whose thickness (2 volume / area) is "
            f"{in_words(like.thick_m)}, so that it is not the organ; cut off or thicken what is thin, or give "
            "tetrahedra that another program made."
        )
    kind = lies_as(entry)
    fault = _too_few_nodes(entry, kind, hold)
    bed = _bed(entry.path if isinstance(entry, File) else name, coarse, sides_of(kind, hold), fault)
    refinements = 2 if 64 * len(coarse.tetrahedra) <= FINE_TETRAHEDRA else 1
    ratio = entry.young_pa / MATERIAL["young_pa"]
    chosen = entry.but(refinements=refinements, bed=bed.but(stiffness_n_m3=ratio * bed.stiffness_n_m3))
    say(f"a mesh that is refined {refinements} times")
    body = make_body(name, chosen)
    pressable = len(pressed_contacts(body, contacts_of(body)))
    return Choice(body, coarse, chosen, _regimes(body), min(PRESSED, pressable), like, tried)


def _regimes(body: Body) -> dict:
    """Choose how hard a body is pressed, and by what: a fingertip gently and firmly, a flat hand deep."""
    size = body.coarse.size
    largest = min(PEAK, OF_DEPTH * _depth_to_bed(body) / size)
    widest = DISC * float(np.sort(np.ptp(body.coarse.nodes, axis=0))[1])
    tip = rounded(min(float(np.clip(FINGERTIP, TIP_OF_SIZE[0] * size, TIP_OF_SIZE[1] * size)), widest))
    return {
        "small": {"peak_of_size": rounded(SMALL * largest), "radius_m": tip},
        "deep": {"pressure_of_young": DEEP, "radius_m": tip},
        "large": {"peak_of_size": rounded(largest), "radius_m": rounded(min(HAND * size, widest))},
    }


def _with_coarse_mesh(entry: File | Ct, say: Callable[[str], object]) -> tuple[File | Ct, TetMesh, dict[int, Likeness]]:
    """Make the coarse mesh: the file's own, or one with as few surface nodes as its shape needs.

    Return the settings, with that number if there is one, the mesh, and the likeness of each mesh by its number.
    """
    if isinstance(entry, File) and entry.surface_nodes is None:
        say("a mesh of the file's own surface")
        with warnings.catch_warnings(action="ignore"):
            own_mesh, *_ = bodies.own_mesh(entry)
        if own_mesh is not None:
            return entry, own_mesh, {}
        entry = entry.but(snap=False)
    meshes: dict[int, tuple[File | Ct, TetMesh, Likeness]] = {}
    for count in SURFACE_NODES:
        tried = entry.but(surface_nodes=count)
        say(f"a mesh of {count} surface nodes")
        try:
            mesh = _coarse(tried)
        except InputError as error:
            if "surface_nodes" not in str(error) or (count == SURFACE_NODES[-1] and not meshes):
                raise
            continue
        if meshes and 8 * len(mesh.tetrahedra) > FINE_TETRAHEDRA:
            break
        meshes[count] = tried, mesh, likeness(mesh, tried)
        if meshes[count][2].close:
            break
    # the coarsest mesh that is close to the data or, where none is, hardly worse than the best
    least = min(like.penalty for _, _, like in meshes.values())
    chosen, mesh, _ = next(each for each in meshes.values() if each[2].penalty <= max(1.0, WORSE * least))
    return chosen, mesh, {count: like for count, (*_, like) in meshes.items()}


def _coarse(entry: File | Ct) -> TetMesh:
    with warnings.catch_warnings(action="ignore"):  # they come again when the whole body is made
        mesh = bodies.build(entry)[0] if isinstance(entry, File) else mesh_from_ct.build(entry)[0]
        check_quality([mesh], "give more surface_nodes")
    return mesh


def rounded(value: float) -> float:
    """Round a positive number up to two digits."""
    digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / digit - 1e-9) * digit:.2g}")


def _depth_to_bed(body: Body) -> float:
    """Return the least distance [m] from a contact to the nodes that the body lies on, where presses move it there.

    Only nodes within 45 degrees of the contact's inward normal count.
    """
    mesh = body.coarse
    pressed = pressed_contacts(body, contacts_of(body))
    bed_nodes = body.anchors[0] if body.bed is None else inner_nodes(mesh, body.bed)
    offsets = mesh.nodes[None, bed_nodes] - mesh.nodes[pressed, None]
    distances = np.linalg.norm(offsets, axis=2)
    inward = -np.einsum("cai,ci->ca", offsets, mesh.normals[pressed]) > distances * math.sqrt(0.5)
    return float(distances[inward].min(initial=np.inf))


def _too_few_nodes(entry: File | Ct, kind: str, hold: str | None) -> str:
    """Say what is wrong and what to do if the body can lie on none of the sides that it may lie on."""
    if hold is not None:
        return f"its side {hold} has too few nodes to lie on; give another side, or none"
    if kind != "ct":
        return "no side of it has enough nodes to lie on; give a mesh with more triangles"
    remedy = "give another side with --hold"
    if isinstance(entry, Ct) and entry.mask is None and entry.modality == "ct":
        low, high = entry.threshold_hu
        remedy += (
            f", or, if the largest piece between {low:g} and {high:g} is not the organ (in a whole CT it seldom is), a "
            "mask or a --threshold of its own"
        )
    return f"its back, on which an organ in an image lies, has too few nodes for that; {remedy}"


def _bed(name: str, mesh: TetMesh, sides: list[tuple[str, str]], fault: str) -> BedSettings:
    """Choose the bed under what faces the broadest of ``sides``; raise InputError with ``fault`` for nodes in a line.

    An organ lies on soft tissue. Trap: nailed nodes end at a rim where stress is singular, so that elements converge by
    the order of 1 only; springs that fade do not.
    """
    beds = [_bed_on_side(mesh, axis, side) for axis, side in sides]
    areas = np.array([area for _, area in beds])
    bed = beds[int(np.argmax(areas >= BROAD * areas.max()))][0]
    _warn_of_raised_parts(name, mesh, bed)
    points = mesh.nodes[inner_nodes(mesh, bed)]
    if len(points) < 3 or np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1] < 0.1 * mesh.size:
        raise InputError(f"{name}: {fault}.")
    if (free := len(mesh.surface) - len(points)) < LEAST_PRESSED:
        raise InputError(
            f"{name}: its surface has {len(mesh.surface)} nodes, of which it lies on {len(points)} and {free} can be "
            f"pressed, but {LEAST_PRESSED} have to be; give a mesh with more triangles, such as this with each divided "
            "into four, twice (Blender, Gmsh and MeshLab do that)."
        )
    sphere = Sphere(center_m=[float(f"{x:.4g}") for x in bed.center_m], radius_m=bed.radius_m)
    assert bed.facing is not None
    return BedSettings(sphere=sphere, facing=[int(x) for x in bed.facing], stiffness_n_m3=bed.stiffness_n_m3)


def _warn_of_raised_parts(name: str, mesh: TetMesh, bed: Bed) -> None:
    """Warn of parts of the side that a body lies on that are higher than the rest, as under an arch."""
    facing = mesh.triangles[bed.faces(mesh.nodes, mesh.triangles)]
    part = components(facing[:, [0, 1, 1, 2]].reshape(-1, 2), len(mesh.nodes))
    lowest = np.full(len(mesh.nodes), -np.inf)  # point of each part, along the direction of the bed
    np.maximum.at(lowest, part[facing], (mesh.nodes @ bed.facing)[facing])
    heights = lowest.max(initial=-np.inf) - lowest[part[facing[:, 0]]]
    if (raised := heights > BED_THICKNESS * mesh.size).any():
        warnings.warn(
            f"{name}: the springs that it lies on hold {raised.sum()} of {len(facing)} triangles up to "
            f"{in_words(heights.max())} above the rest, as under an arch; if nothing is below them, give anchors, or a "
            "smaller bed.sphere.",
            stacklevel=2,
        )


def _bed_on_side(mesh: TetMesh, axis: str, side: str) -> tuple[Bed, float]:
    """Return a bed under all that faces a side, and the area [m²] of that, seen along the axis.

    Its middle is that of the triangle nearest to the mean of all.
    """
    facing = np.zeros(3)
    facing["xyz".index(axis)] = 1.0 if side == "max" else -1.0
    stiffness = MATERIAL["young_pa"] / (BED_THICKNESS * mesh.size)
    unbounded = Bed(mesh.nodes.mean(axis=0), np.inf, float(f"{stiffness:.2g}"), facing)
    on_side = mesh.triangles[unbounded.faces(mesh.nodes, mesh.triangles)]
    if not len(on_side):
        return unbounded, 0.0
    areas = 0.5 * area_normals(mesh.nodes, on_side) @ facing
    middles = mesh.nodes[on_side].mean(axis=1)
    mean = np.average(middles, axis=0, weights=areas)
    center = middles[np.argmin(np.linalg.norm(middles - mean, axis=1))]
    reach = float(np.linalg.norm(mesh.nodes[np.unique(on_side)] - center, axis=1).max())
    return Bed(center, rounded(1.01 * reach), unbounded.stiffness_n_m3, facing), float(areas.sum())
