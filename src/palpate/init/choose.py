"""Choose what a first configuration assumes of a body: what holds it, how fine it is, and how it is pressed."""

import math
import warnings
from typing import NamedTuple

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, pressed_contacts
from palpate.bodies.make_body import make_body
from palpate.bodies.mesh import TetMesh, components
from palpate.bodies.surfaces.remeshed import NODES
from palpate.bodies.surfaces.triangles import area_normals
from palpate.errors import InputError
from palpate.init.data import sides_of

MATERIAL = {"young_pa": 3000, "poisson": 0.3, "density_kg_m3": 1050}
"""Of soft tissue, unless the user knows better."""
# tetrahedra of the fine mesh up to which the truth, which needs eight times as many quadratic ones, takes 5 GB at most
FINE_TETRAHEDRA = 50_000
# contacts that samples press, and the least that can be divided into those to test, to choose by and to learn from
PRESSED, LEAST_PRESSED = 24, 5
# of the coarse mesh from a CT; more only if the shape cannot be had with fewer
SURFACE_NODES = (140, 280, 560)
# depths that are tried, as shares of the body's extent, and the share of the surface nodes that should be held
DEPTHS, HELD = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3), 0.15
# share of the surface's area that should be held, too: SOFA's liver, held by a strip of 6 % of it, hangs from its edge,
# where elements converge so slowly that 2 of 12 truths are believed; held by 8, 14 or 18 % it has 9 to 12 of 12
BROAD = 0.08
# radius of a fingertip [m], and between which shares of the longest side it stays; that of a flat hand, as a share
FINGERTIP, TIP_OF_SIZE, HAND = 0.012, (0.04, 0.15), 0.15
# the largest displacement of the large regime, as a share of the longest side; less where a contact lies over a held
# node, as no solver follows tissue that is pressed flat: this share of the way
PEAK, OF_WAY = 0.1, 0.4
# displacements of the small regime against the large one's; the pressure of the deep one against Young's modulus
SMALL, DEEP = 0.3, 0.25


class Choice(NamedTuple):
    """The body that results, its coarse mesh, its whole entry, the regimes that suit it, how many contacts it has."""

    body: Body
    coarse: TetMesh
    entry: dict
    regimes: dict
    contacts: int


def choose(name: str, entry: dict, hold: str | None = None) -> Choice:
    """Make the coarse mesh of an entry, choose the rest of the entry for it, and make the body; InputError if it fails.

    entry : the keys that say where the mesh comes from; paths as they can be opened from here
    hold : the side that it is held on, as ``sides_of`` knows them; chosen if it is not given
    """
    entry, coarse = _resolved(name, entry)
    anchors = {"plane": _hold(name, coarse, sides_of(entry["kind"], hold))}
    refinements = 2 if 64 * len(coarse.tetrahedra) <= FINE_TETRAHEDRA else 1
    chosen = entry | MATERIAL | {"refinements": refinements, "anchors": anchors}
    body = make_body(name, chosen)
    able = len(pressed_contacts(body, contacts_of(body)))
    if able < LEAST_PRESSED:
        raise InputError(f"{name}: its mesh has {able} nodes that can be pressed; give one with more triangles.")
    return Choice(body, coarse, chosen, _regimes(body), min(PRESSED, able))


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


def _resolved(name: str, entry: dict) -> tuple[dict, TetMesh]:
    """Make the coarse mesh with as many surface nodes as the shape needs; return the entry with that number, too."""
    if "surface_nodes" not in entry:
        return entry, _coarse(name, entry)
    if entry["kind"] == "file":  # chooses well without being told
        mesh = _coarse(name, {key: value for key, value in entry.items() if key != "surface_nodes"})
        return entry | {"surface_nodes": min(NODES, key=lambda count: abs(count - len(mesh.surface)))}, mesh
    for count in SURFACE_NODES:
        try:
            return entry | {"surface_nodes": count}, _coarse(name, entry | {"surface_nodes": count})
        except InputError as error:
            if count == SURFACE_NODES[-1] or "surface_nodes" not in str(error):
                raise
    raise AssertionError("the last count returns or raises")


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
    """Find the shortest way [m] from a contact along its inward normal, within 45 degrees, to a held node."""
    mesh = body.coarse
    pressed = pressed_contacts(body, contacts_of(body))
    ways = mesh.nodes[None, body.anchors[0]] - mesh.nodes[pressed, None]
    lengths = np.linalg.norm(ways, axis=2)
    inward = -np.einsum("cai,ci->ca", ways, mesh.normals[pressed]) > lengths * math.sqrt(0.5)
    return float(lengths[inward].min(initial=np.inf))


def _hold(name: str, mesh: TetMesh, sides: list[tuple[str, str]]) -> dict:
    """Choose the plane that holds the body on one of ``sides``, the flattest broad one: most area in the least depth.

    Trap: a body that is held at two places is an arch, which snaps through when it is pressed between them; so one
    patch is preferred.
    """
    planes = [plane for axis, side in sides for plane in _planes(mesh, axis, side)]
    if not planes:
        if len(sides) == 1:
            raise InputError(f"{name}: that side of it has too few nodes to be held; give another side, or none.")
        raise InputError(f"{name}: no side of it has enough nodes to be held; give a mesh with more triangles.")
    return min(planes, key=lambda plane: (plane.patches, plane.narrow, plane.share, -plane.area)).rule


class _Plane(NamedTuple):
    """A rule, its depth as a share of the extent, and what it holds: area in the plane [m²], number of patches.

    narrow : whether it holds less of the surface than it should
    """

    rule: dict
    share: float
    area: float
    patches: int
    narrow: bool


def _planes(mesh: TetMesh, axis: str, side: str) -> list[_Plane]:
    """List the planes on a side, deeper and deeper, that hold it well."""
    number = "xyz".index(axis)
    along = mesh.nodes[mesh.surface, number] * (1 if side == "min" else -1)
    distance = along - along.min()
    whole = np.linalg.norm(area_normals(mesh.nodes, mesh.triangles), axis=1).sum()
    found = []
    for share in DEPTHS:
        depth = rounded(share * distance.max())
        held = mesh.surface[distance <= depth]
        points = mesh.nodes[held] - mesh.nodes[held].mean(axis=0)
        broad = np.linalg.svd(points, compute_uv=False)[1] > 0.1 * mesh.size if len(held) >= 3 else False
        if broad and len(held) >= HELD * len(mesh.surface):
            triangles = mesh.triangles[np.isin(mesh.triangles, held).all(axis=1)]
            areas = area_normals(mesh.nodes, triangles)
            narrow = bool(np.linalg.norm(areas, axis=1).sum() < BROAD * whole)
            area = float(np.abs(areas[:, number]).sum()) / 2
            rule = {"axis": axis, "side": side, "depth_m": depth}
            found.append(_Plane(rule, share, area, _patches(mesh, held), narrow))
    return found


def _patches(mesh: TetMesh, held: np.ndarray) -> int:
    """Count the connected pieces of the held nodes."""
    both = np.searchsorted(held, mesh.edges[np.isin(mesh.edges, held).all(axis=1)])
    return int(components(both, len(held)).max()) + 1
