"""Choose what a first configuration assumes of a body: what it lies on, how fine it is, and how it is pressed."""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.body_from_mesh import solid_of
from palpate.bodies.contacts import contacts_of, pressed_contacts
from palpate.bodies.ct.mesh_from_ct import segment_entry
from palpate.bodies.make_body import make_body
from palpate.bodies.mesh import TetMesh
from palpate.bodies.supports import Bed, inner_nodes
from palpate.bodies.surfaces.coarse_solid import MOST_AWAY, MOST_VOLUME, apart
from palpate.bodies.surfaces.mask_surface import dense_surface
from palpate.bodies.surfaces.triangles import area_normals
from palpate.errors import InputError
from palpate.init.recognise import sides_of

MATERIAL = {"young_pa": 3000, "poisson": 0.3, "density_kg_m3": 1050}  # of soft tissue, unless the user knows better
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
# radius of a fingertip [m], and between which shares of the longest side it stays; that of a flat hand, as a share
FINGERTIP, TIP_OF_SIZE, HAND = 0.012, (0.04, 0.15), 0.15
# the largest displacement of the large regime, as a share of the longest side; less where the body is thin, as no
# solver follows tissue that is pressed flat: this share of the way to the bed
PEAK, OF_WAY = 0.1, 0.4
# displacements of the small regime against the large one's; the pressure of the deep one against Young's modulus
SMALL, DEEP = 0.3, 0.25


@dataclass(frozen=True)
class Likeness:
    """Greatest distance [m] between two surfaces, either way; its share of the size; both volumes [m³]."""

    away_m: float
    away: float
    volume_m3: float
    data_m3: float

    @property
    def volume(self) -> float:
        """The mesh's volume over the data's, minus 1."""
        return self.volume_m3 / self.data_m3 - 1.0

    @property
    def penalty(self) -> float:
        """The worse of both, 1 where just good enough."""
        return max(self.away / MOST_AWAY, abs(self.volume) / MOST_VOLUME)

    @property
    def close(self) -> bool:
        """Whether the mesh has the shape of the data."""
        return self.penalty <= 1.0


def likeness(mesh: TetMesh, entry: dict) -> Likeness:
    """Compare ``mesh`` with the surface and the volume of what a config entry of kind file or ct was made from."""
    if entry["kind"] == "file":
        mended, solid = solid_of(Path(entry["path"]), entry["scale_m"])
        places, points, triangles, volume_m3 = solid.places, mended.points, mended.triangles, solid.volume_m3
    else:
        image, mask = segment_entry(entry)
        points, triangles = dense_surface(mask, image)
        places, volume_m3 = points, float(mask.sum() * image.voxel_m3)
    away_m = apart(mesh, places, points, triangles)
    return Likeness(away_m, away_m / float(np.ptp(places, axis=0).max()), float(mesh.volumes.sum()), volume_m3)


class Choice(NamedTuple):
    """The body that results, its coarse mesh, its whole entry, the regimes that suit it, how many contacts it has.

    likeness : to the data, or None where the data's own mesh is used
    """

    body: Body
    coarse: TetMesh
    entry: dict
    regimes: dict
    contacts: int
    likeness: Likeness | None


def choose(name: str, entry: dict, hold: str | None = None, say: Callable[[str], object] = str) -> Choice:
    """Make the coarse mesh of an entry, choose the rest of the entry for it, and make the body; InputError if it fails.

    entry : the keys that say where the mesh comes from; paths as they can be opened from here
    hold : the side that it lies on, as ``sides_of`` knows them; chosen if it is not given
    say : takes the words of each step, before it
    """
    entry, coarse, like = _resolved(name, entry, say)
    bed = _bed(name, coarse, sides_of(entry["kind"], hold), _too_few_nodes(entry, hold))
    refinements = 2 if 64 * len(coarse.tetrahedra) <= FINE_TETRAHEDRA else 1
    chosen = entry | MATERIAL | {"refinements": refinements, "bed": bed}
    say(f"a mesh that is refined {refinements} times")
    body = make_body(name, chosen)
    able = len(pressed_contacts(body, contacts_of(body)))
    if able < LEAST_PRESSED:
        raise InputError(f"{name}: its mesh has {able} nodes that can be pressed; give one with more triangles.")
    return Choice(body, coarse, chosen, _regimes(body), min(PRESSED, able), like)


def _regimes(body: Body) -> dict:
    """Choose how hard a body is pressed, and by what: a fingertip gently and firmly, a flat hand deep."""
    size = body.coarse.size
    largest = min(PEAK, OF_WAY * _way(body) / size)
    tip = rounded(float(np.clip(FINGERTIP, TIP_OF_SIZE[0] * size, TIP_OF_SIZE[1] * size)))
    return {
        "small": {"peak_of_size": rounded(SMALL * largest), "radius_m": tip},
        "deep": {"pressure_of_young": DEEP, "radius_m": tip},
        "large": {"peak_of_size": rounded(largest), "radius_m": rounded(HAND * size)},
    }


def _resolved(name: str, entry: dict, say: Callable[[str], object]) -> tuple[dict, TetMesh, Likeness | None]:
    """Make the coarse mesh with as few surface nodes as its shape needs; return the entry with that number, too."""
    if "surface_nodes" not in entry:
        say("a mesh of the file's own surface")
        return entry, _coarse(name, entry), None
    found: list[tuple[dict, TetMesh, Likeness]] = []
    for count in SURFACE_NODES:
        tried = entry | {"surface_nodes": count}
        say(f"a mesh of {count} surface nodes")
        try:
            mesh = _coarse(name, tried)
        except InputError as error:
            if "surface_nodes" not in str(error) or (count == SURFACE_NODES[-1] and not found):
                raise
            continue
        if found and 8 * len(mesh.tetrahedra) > FINE_TETRAHEDRA:
            break
        found.append((tried, mesh, likeness(mesh, tried)))
        if found[-1][2].close:
            break
    least = min(like.penalty for _, _, like in found)
    return next(each for each in found if each[2].penalty <= max(1.0, WORSE * least))


def _coarse(name: str, entry: dict) -> TetMesh:
    with warnings.catch_warnings(action="ignore"):  # they come again when the whole body is made
        mesh = make_body(name, entry | MATERIAL | {"refinements": 0}).coarse
    assert isinstance(mesh, TetMesh)
    return mesh


def rounded(value: float) -> float:
    """Round a positive number up to two digits."""
    digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / digit - 1e-9) * digit:.2g}")


def _way(body: Body) -> float:
    """Find the shortest way [m] from a contact along its inward normal, within 45 degrees, to what the body lies on."""
    mesh = body.coarse
    pressed = pressed_contacts(body, contacts_of(body))
    under = body.anchors[0] if body.bed is None else inner_nodes(mesh, body.bed)
    ways = mesh.nodes[None, under] - mesh.nodes[pressed, None]
    lengths = np.linalg.norm(ways, axis=2)
    inward = -np.einsum("cai,ci->ca", ways, mesh.normals[pressed]) > lengths * math.sqrt(0.5)
    return float(lengths[inward].min(initial=np.inf))


def _too_few_nodes(entry: dict, hold: str | None) -> str:
    """Say what is wrong and what to do if the body can lie on none of the sides that it may lie on."""
    if hold is not None:
        return f"its side {hold} has too few nodes to lie on; give another side, or none"
    if entry["kind"] != "ct":
        return "no side of it has enough nodes to lie on; give a mesh with more triangles"
    remedy = "give another side with --hold"
    if "mask" not in entry and "threshold_hu" in entry:
        low, high = entry["threshold_hu"]
        remedy += (
            f", or, if the largest piece between {low:g} and {high:g} is not the organ (in a whole CT it seldom is), a "
            "mask or a --threshold of its own"
        )
    return f"its back, on which an organ in an image lies, has too few nodes for that; {remedy}"


def _bed(name: str, mesh: TetMesh, sides: list[tuple[str, str]], fault: str) -> dict:
    """Choose the bed under all that faces the broadest of ``sides``; raise InputError with ``fault`` if there is none.

    An organ lies on soft tissue. Trap: nailed nodes end at a rim where stress is singular, so that elements converge by
    the order of 1 only; springs that fade do not.
    """
    beds = [_under(mesh, axis, side) for axis, side in sides]
    areas = np.array([area for _, area in beds])
    bed = beds[int(np.argmax(areas >= BROAD * areas.max()))][0]
    points = mesh.nodes[inner_nodes(mesh, bed)]
    if len(points) < 3 or np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1] < 0.1 * mesh.size:
        raise InputError(f"{name}: {fault}.")
    sphere = {"center_m": [float(f"{x:.4g}") for x in bed.center_m], "radius_m": bed.radius_m}
    assert bed.facing is not None
    facing = [int(x) for x in bed.facing]
    return {"sphere": sphere, "facing": facing, "stiffness_n_m3": bed.stiffness_n_m3}


def _under(mesh: TetMesh, axis: str, side: str) -> tuple[Bed, float]:
    """Return a bed under all that faces a side, and the area [m²] of that, seen along the axis.

    Its middle is that of the triangle nearest to the mean of all.
    """
    facing = np.zeros(3)
    facing["xyz".index(axis)] = 1.0 if side == "max" else -1.0
    stiffness = MATERIAL["young_pa"] / (BED_THICKNESS * mesh.size)
    endless = Bed(mesh.nodes.mean(axis=0), np.inf, float(f"{stiffness:.2g}"), facing)
    turned = mesh.triangles[endless.faces(mesh.nodes, mesh.triangles)]
    if not len(turned):
        return endless, 0.0
    areas = 0.5 * area_normals(mesh.nodes, turned) @ facing
    middles = mesh.nodes[turned].mean(axis=1)
    mean = np.average(middles, axis=0, weights=areas)
    center = middles[np.argmin(np.linalg.norm(middles - mean, axis=1))]
    reach = float(np.linalg.norm(mesh.nodes[np.unique(turned)] - center, axis=1).max())
    return Bed(center, rounded(1.01 * reach), endless.stiffness_n_m3, facing), float(areas.sum())
