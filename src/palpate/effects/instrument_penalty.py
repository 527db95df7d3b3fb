"""Penalty contact of nodes with a rigid instrument, for models; scenes have barrier contact instead.

Only nodes are pushed out of the instrument: edges and faces may pass through it.
"""

import numpy as np

from palpate.bodies.mesh import Mesh
from palpate.effects.effect import Energy
from palpate.effects.instrument import Pose


class NodeContact(Energy):
    """Contact with E = Σ ½ k g² over the nodes whose gap g to an instrument is negative; there is no friction.

    nodes : (k,) that may touch; stiffness_n_m : (k,) penalty of each
    pose : of the instrument; it is set anew where the instrument moves
    """

    def __init__(self, nodes: np.ndarray, stiffness_n_m: np.ndarray, pose: Pose):
        self.nodes, self.stiffness_n_m, self.pose = nodes, stiffness_n_m, pose

    def overlaps(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the depths (k,) [m] of the nodes in the instrument, 0 outside, and the outward normals (k, 3)."""
        gaps, normals = self.pose.gaps(x[self.nodes])
        return np.maximum(-gaps, 0.0), normals

    def energy(self, x: np.ndarray) -> float:
        return 0.5 * float(self.stiffness_n_m @ self.overlaps(x)[0] ** 2)

    def add_force(self, x: np.ndarray, v: np.ndarray | None, force: np.ndarray) -> None:
        force[self.nodes] += self.pushes(x)

    def pushes(self, x: np.ndarray) -> np.ndarray:
        """Return the forces (k, 3) [N] on the nodes."""
        overlaps, normals = self.overlaps(x)
        return (self.stiffness_n_m * overlaps)[:, None] * normals


def may_touch(mesh: Mesh, held: np.ndarray, last: Pose, reach_m: float) -> np.ndarray:
    """Return the surface nodes of ``mesh``, increasing, within ``reach_m`` of an instrument at the pose ``last``.

    held : (n,) bool, nodes that cannot move and are left out
    """
    nodes = mesh.surface[~held[mesh.surface]]
    return nodes[last.gaps(mesh.nodes[nodes])[0] < reach_m]
