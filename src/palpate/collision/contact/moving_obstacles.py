"""Nodes in the path of moving obstacles, which are displaced with them."""

import numpy as np

from palpate.collision.contact.additive_ccd import limits
from palpate.collision.contact.proximity import Proximity
from palpate.errors import NotConverged

MAX_ROUNDS = 100
"""Most searches for further nodes in the path of those displaced already."""


def displace_nodes(
    proximity: Proximity, points: np.ndarray, motion: np.ndarray, n_nodes: int, names: list[str]
) -> np.ndarray:
    """Displace nodes, (n_nodes, 3) [m], to let obstacles, the further ``points``, make their ``motion`` (n, 3) [m].

    Whatever would be touched makes the whole motion, and so does whatever that would touch: so nothing ever
    intersects, however long the motion. It is a place to start from, not where bodies end up. Raises NotConverged, with
    its name in ``names`` of the pieces, if an obstacle is driven into nodes that cannot move or that another one moves.
    """
    travel = float(np.sqrt(np.square(motion).sum(axis=1).max()))
    near, motion = proximity.find_near(points, travel), motion.copy()
    displaced = np.zeros(len(points), dtype=bool)
    displaced[n_nodes:] = True
    for _ in range(MAX_ROUNDS):
        blocked = limits(near.kinds, near.nodes, near.offsets, points, motion) < 1.0
        if not blocked.any():
            return (points + motion)[:n_nodes]
        count = int(displaced.sum())
        for nodes in near.nodes[blocked]:
            driver = nodes[np.argmax(np.square(motion[nodes]).sum(axis=1))]
            if displaced[driver]:
                taken = nodes[~displaced[nodes] & proximity.movable[nodes]]
                motion[taken] = motion[driver]
                displaced[taken] = True
        if int(displaced.sum()) == count:
            break
    # displaced nodes have exactly the obstacle's motion
    driving = (motion[n_nodes:] == motion[driver]).all(axis=1)
    name = names[proximity.owners[n_nodes:][driving][0]]
    raise NotConverged(f"{name} is driven into held nodes, or between two instruments; change its path", [])
