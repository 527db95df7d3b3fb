"""Obstacles that move take along what they run into."""

import numpy as np

from palpate.collision.contact.additive_ccd import limits
from palpate.collision.contact.proximity import Proximity
from palpate.errors import NotConverged

ROUNDS = 100
"""How often more may be found in the way of what is carried already."""


def carry(proximity: Proximity, points: np.ndarray, ways: np.ndarray, n_nodes: int, names: list[str]) -> np.ndarray:
    """Positions (n_nodes, 3) [m] of nodes when obstacles, the further ``points``, have gone their ``ways`` (n, 3) [m].

    What would be touched on the way goes the whole way along, and so does what that would touch: so nothing is ever
    gone through, however far the way. It is a place to start from, not where bodies end up. Raises NotConverged, by
    its name in ``names`` of the pieces, if an obstacle is driven into nodes that cannot move or that another one moves.
    """
    way = float(np.sqrt(np.square(ways).sum(axis=1).max()))
    near, ways = proximity.look(points, way), ways.copy()
    carried = np.zeros(len(points), dtype=bool)
    carried[n_nodes:] = True
    for _ in range(ROUNDS):
        stopped = limits(near.kinds, near.nodes, near.offsets, points, ways) < 1.0
        if not stopped.any():
            return (points + ways)[:n_nodes]
        before = int(carried.sum())
        for nodes in near.nodes[stopped]:
            driver = nodes[np.argmax(np.square(ways[nodes]).sum(axis=1))]
            if carried[driver]:
                taken = nodes[~carried[nodes] & proximity.movable[nodes]]
                ways[taken] = ways[driver]
                carried[taken] = True
        if int(carried.sum()) == before:
            break
    # what is carried goes the obstacle's way, to the bit
    by = (ways[n_nodes:] == ways[driver]).all(axis=1)
    name = names[proximity.owners[n_nodes:][by][0]]
    raise NotConverged(f"{name} is driven into what is held, or between two instruments; change its path", [])
