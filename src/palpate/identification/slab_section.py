"""Mesh the half-section of a slab in r and z, by rings of quadrilaterals around a point of its surface, ever larger."""

from typing import NamedTuple

import numpy as np

FAR_RADII = 2000.0
"""Radius of a half-space, over that of the ball: a part of a / (2 FAR_RADII) of the force is lacking."""
WIDE = 10.0
"""Radius of a slab over its thickness, where it is held: what a press does there falls exponentially."""
WIDEST = 0.05
"""Largest width of a ring in the finely meshed part, over the radius of that part."""
STEEP = 1.8
"""Largest growth of a ring over the one before it, far from the contact."""


class Section(NamedTuple):
    """A mesh of the half-section of a slab, and its parts.

    nodes : (n, 2) r and z [m], z = 0 at the surface; quads : (m, 9), nodes row by row of a 3 × 3 grid
    surface, held, axis : numbers of nodes of the surface from the axis outward, of base and outer rim, and at r = 0
    """

    nodes: np.ndarray
    quads: np.ndarray
    surface: np.ndarray
    held: np.ndarray
    axis: np.ndarray


def _with_more_rings(radii: list[float], ratio: float, fine_radius: float, last_radius: float) -> list[float]:
    """Return ``radii`` of rings [m] and those of more rings, up to ``last_radius``.

    They grow by ``ratio`` up to ``fine_radius``, in rings at most WIDEST of it wide, then ever faster.
    """
    grown, width = radii.copy(), radii[-1] - radii[-2]
    while grown[-1] < last_radius:
        if grown[-1] < fine_radius:
            width = min((ratio - 1.0) * grown[-1], WIDEST * fine_radius)
        else:
            width = min(1.3 * width, (STEEP - 1.0) * grown[-1])
        grown.append(grown[-1] + width)
    if len(grown) > len(radii) + 1 and last_radius - grown[-2] < 0.4 * width:
        grown.pop()  # as the last ring would be narrow
    grown[-1] = last_radius
    return grown


def slab_section(
    thickness: float, first: float, ratio: float, near: float, angles: int, far: float | None = None
) -> Section:
    """Mesh the half-section of a slab, or of a half-space where ``thickness`` is infinite.

    first : radius of the innermost ring [m]; ratio : of the radii of rings, to ``near`` [m]
    angles : even number of quadrilaterals along a ring; far : outer radius [m], by default of FAR_RADII and WIDE
    Rings are circles near the axis, and squares at the slab's thickness; outside of that they are lines across it.
    """
    layered = np.isfinite(thickness)
    outer_radius = far or (WIDE * thickness + near if layered else FAR_RADII * near)
    ring_radii = _with_more_rings([0.0, first], ratio, near, min(thickness, outer_radius))
    if layered:
        ring_radii = _with_more_rings(ring_radii, ratio, near, outer_radius)
    # radii of nodes: those of rings, and of the middle of each ring
    radii = np.insert(ring_radii, np.arange(1, len(ring_radii)), 0.5 * (np.array(ring_radii[:-1]) + ring_radii[1:]))
    angle = np.linspace(0.0, 0.5 * np.pi, 2 * angles + 1)
    circle = np.stack([np.cos(angle), -np.sin(angle)], axis=1)
    square = circle / np.abs(circle).max(axis=1, keepdims=True)
    circle[-1, 0] = square[-1, 0] = 0.0
    node_blocks, counts = [np.zeros((1, 2))], [1]
    for radius in radii[1:]:
        if radius <= thickness:
            squareness = (radius / thickness) ** 2
            node_blocks.append(radius * ((1.0 - squareness) * circle + squareness * square))
        else:
            depths = thickness * square[: angles + 1, 1]
            node_blocks.append(np.stack([np.full(angles + 1, radius), depths], axis=1))
        counts.append(len(node_blocks[-1]))
    starts = np.cumsum([0, *counts])
    quads = []
    for ring in range(0, len(radii) - 2, 2):
        for k in range(0, min(counts[ring + 1 : ring + 3]) - 1, 2):
            rows = [[starts[ring + i] + (k + j if ring + i else 0) for j in range(3)] for i in range(3)]
            quads.append(np.ravel(rows))
    nodes = np.concatenate(node_blocks)
    # radially outward and then downward is clockwise: the two directions change places
    grids = np.array(quads).reshape(-1, 3, 3).transpose(0, 2, 1).reshape(-1, 9)
    outermost = np.arange(starts[-2], starts[-1])
    base = np.flatnonzero(nodes[:, 1] <= -thickness * (1.0 - 1e-12)) if layered else outermost
    return Section(nodes, grids, starts[:-1], np.union1d(base, outermost), np.flatnonzero(nodes[:, 0] == 0.0))
