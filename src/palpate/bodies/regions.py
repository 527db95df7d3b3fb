"""Regions of a body with a material of their own: by a sphere, a mesh file's tags, or the labels of a CT's mask."""

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from palpate.bodies.ct.config_scan import label_ball, label_region
from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import TetMesh, edge_lengths
from palpate.bodies.mesh_file import in_words, load_tagged
from palpate.bodies.refinement import refine
from palpate.bodies.settings import Ct, File, Region, Solid
from palpate.errors import InputError


def balls_of(entry: Solid) -> list[tuple[np.ndarray, float]]:
    """List centre (3,) [m] and radius [m] of the balls in which elements have to be small.

    They are the spheres of its regions, and of labels of a CT's mask balls of the same volume and middle.
    """
    balls = []
    for rule in (entry.regions or {}).values():
        if rule.sphere is not None:
            balls.append((np.array(rule.sphere.center_m, dtype=float), float(rule.sphere.radius_m)))
        elif rule.label is not None and isinstance(entry, Ct):
            balls.append(label_ball(entry, rule.label))
    return balls


CONTRAST = 1e4
"""Ratio of the moduli of a body up to which solvers are tested."""
VOLUME_OFF, MISPLACED = 0.2, 0.3
"""Shares of a region's volume from which on there is a warning: of the difference to that of its elements, and of what
lies in one of the two alone."""
AT_ONCE = 4096
"""Elements whose points are tested at once."""

Inside = Callable[[np.ndarray], np.ndarray]
"""A test whether points (n, 3) [m] lie in a region, (n,) bool."""


def read_regions(body: str, entry: Solid, mesh: TetMesh, base: Material, remeshed: bool) -> Tissue | None:
    """Read the tissue of the coarse ``mesh`` from its regions; None without such.

    base : material of what is in no region; remeshed : whether the elements are not those of the file

    A tetrahedron belongs to the first region that has half of its volume. Warns of regions that the mesh shows badly
    or lets reach the surface, and of a contrast above CONTRAST; raises InputError for a region that holds no
    tetrahedron.
    """
    if not entry.regions:
        return None
    materials, region = [base], np.zeros(len(mesh.tetrahedra), dtype=np.int64)
    for number, (name, rule) in enumerate(entry.regions.items(), start=1):
        place = f"{body}: regions.{name}"
        poisson = base.poisson if rule.poisson is None else rule.poisson
        materials.append(Material(rule.young_pa, poisson, rule.density_kg_m3 or base.density_kg_m3, base.law))
        inside = _inside(place, rule, entry)
        share_in_region = share_inside(mesh, inside) if inside else _tagged(place, rule, entry, mesh, remeshed)
        chosen = (share_in_region >= 0.5) & (region == 0)
        _check_held(place, mesh, share_in_region, chosen)
        _check_shown(place.partition(".")[2], mesh, share_in_region, inside)
        region[chosen] = number
    moduli = [material.young_pa for material in materials]
    contrast = max(moduli) / min(moduli)
    if contrast > CONTRAST:
        warnings.warn(
            f"regions: the moduli of {body} differ by a factor of {contrast:.2g}, and solvers are tested up to "
            f"{CONTRAST:g}; if one does not converge, lower the stiffest.",
            stacklevel=3,
        )
    return Tissue(tuple(materials), region)


def _inside(place: str, rule: Region, entry: Solid) -> Inside | None:
    """Return the test whether points lie in a region that is given by sphere or label; None if it is given by tag."""
    if rule.label is not None:
        if not isinstance(entry, Ct):
            raise InputError(f"body {place} has a label, which only a body of kind ct has; give a sphere.")
        return label_region(entry, rule.label)
    if rule.sphere is None:
        return None
    center, radius = np.array(rule.sphere.center_m, dtype=float), float(rule.sphere.radius_m)
    return lambda points: np.linalg.norm(points - center, axis=1) <= radius


def _tagged(place: str, rule: Region, entry: Solid, mesh: TetMesh, remeshed: bool) -> np.ndarray:
    """Return 1 for each tetrahedron (n_tetrahedra,) with the tag of a region, else 0."""
    if not isinstance(entry, File):
        raise InputError(f"body {place} has a tag, which only a body of kind file has; give a sphere.")
    if remeshed or rule.tag is None:
        raise InputError(
            f"body {place}.tag counts elements of a mesh that is remeshed; leave surface_nodes out to keep the file's "
            "tetrahedra, or give a sphere."
        )
    shares = np.zeros(len(mesh.tetrahedra))
    shares[load_tagged(Path(entry.path), rule.tag)] = 1.0
    return shares


def share_inside(mesh: TetMesh, inside: Inside) -> np.ndarray:
    """Compute the share (n_tetrahedra,) of 64 parts of each tetrahedron whose middles are inside."""
    part_middles = _middles()
    shares = np.empty(len(mesh.tetrahedra))
    for begin in range(0, len(shares), AT_ONCE):
        corners = mesh.nodes[mesh.tetrahedra[begin : begin + AT_ONCE]]
        points = np.einsum("pa,eai->epi", part_middles, corners)
        shares[begin : begin + AT_ONCE] = inside(points.reshape(-1, 3)).reshape(len(corners), -1).mean(axis=1)
    return shares


def _middles() -> np.ndarray:
    """Return barycentric coordinates (64, 4) of the middles of a tetrahedron refined twice."""
    corners = np.vstack([np.zeros(3), np.eye(3)])
    mesh = TetMesh(corners, np.arange(4)[None])
    for _ in range(2):
        mesh, _ = refine(mesh)
    middles = mesh.nodes[mesh.tetrahedra].mean(axis=1)
    return np.column_stack([1.0 - middles.sum(axis=1), middles])


def _check_held(place: str, mesh: TetMesh, shares: np.ndarray, free: np.ndarray) -> None:
    """Raise InputError if a region has no tetrahedron ``free`` (n_tetrahedra,), by half in it and in none before it."""
    if free.any():
        return
    if (shares >= 0.5).any():
        raise InputError(f"body {place} holds no tetrahedron that is not in a region before it; put it first.")
    edge = in_words(float(edge_lengths(mesh.nodes, mesh.edges).mean()))
    raise InputError(
        f"body {place} holds no tetrahedron by half; the edges of the coarse mesh are about {edge}: move or enlarge"
        " the region, or make that mesh finer."
    )


def _check_shown(name: str, mesh: TetMesh, shares: np.ndarray, inside: Inside | None) -> None:
    """Warn if a region's elements differ from it in volume or place, or reach the body's surface where it does not."""
    chosen = shares >= 0.5
    asked_m3, has_m3 = shares @ mesh.volumes, mesh.volumes[chosen].sum()
    beyond_m3, misplaced_m3 = (1.0 - shares[chosen]) @ mesh.volumes[chosen], np.abs(chosen - shares) @ mesh.volumes
    if abs(has_m3 / asked_m3 - 1.0) > VOLUME_OFF or misplaced_m3 > MISPLACED * asked_m3:
        warnings.warn(
            f"regions of the body are made of whole coarse tetrahedra: those of {name} have {1e6 * has_m3:.3g} mL, and "
            f"what is asked {1e6 * asked_m3:.3g} mL; {1e6 * beyond_m3:.3g} mL of the first are outside of the second; "
            "make the coarse mesh finer there.",
            stacklevel=5,
        )
    count = np.isin(mesh.surface, mesh.tetrahedra[chosen]).sum()
    barycentric = np.array([[i, j, 4 - i - j] for i in range(5) for j in range(5 - i)]) / 4.0
    on_surface = np.einsum("pa,tai->tpi", barycentric, mesh.nodes[mesh.triangles]).reshape(-1, 3)
    if inside is not None and count and not inside(on_surface).any():
        warnings.warn(
            f"tetrahedra of {name} have {count} nodes on the body's surface, which what is asked does not reach, so "
            "that a press there is on them; make the coarse mesh finer there, or move the region inwards.",
            stacklevel=5,
        )
