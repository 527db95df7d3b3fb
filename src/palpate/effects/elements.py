"""The base of linear and quadratic elements: tissue, one pass for energy and force, stiffness, warning of locking."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property

import numpy as np
from scipy import sparse

from palpate.bodies.material import LAWS, Material, Tissue, uniform
from palpate.bodies.mesh import Mesh
from palpate.effects.effect import Energy, Stiffness
from palpate.effects.law import INVERTED, PLAIN, evaluate, law_of
from palpate.errors import NotConverged
from palpate.linalg.block_pattern import BlockPattern, pattern_of

PLAIN_POISSON = 0.45
"""Poisson's ratio up to which plain elements suffice; above it, quadratic ones are of mean dilatation."""
LOCKED = {0.3: 0.04, 0.45: 0.06, 0.49: 0.12, 0.499: 0.28, 0.4999: 0.49}
"""Relative error of linear elements by Poisson's ratio: of the displacement under a finger, its mean weighted by the
pressure, on the bedded liver, level 2, 7865 nodes, 2 % deep (docs/numerics.md)."""


def largest_poisson(tissue: Tissue) -> float:
    """Return the largest Poisson's ratio of the materials of ``tissue``."""
    return max(each.poisson for each in tissue.materials)


def warn_of_locking(name: str, poisson: float) -> None:
    """Warn if linear elements lock at this Poisson's ratio, and give the error that was measured on a liver."""
    if poisson <= PLAIN_POISSON:
        return
    measured = [-np.log(1.0 - 2.0 * nu) for nu in LOCKED]
    error = float(np.interp(-np.log(1.0 - 2.0 * poisson), measured, list(LOCKED.values())))
    warnings.warn(
        f"{name}: linear elements lock at Poisson's ratio {poisson:g}; on a liver of 7865 nodes they missed about "
        f"{error:.0%} of the displacement under a finger: use quadratic elements (fem_p2), or a ratio up to 0.45.",
        stacklevel=2,
    )


@contextmanager
def locking_is_measured() -> Iterator[None]:
    """Suppress the warning of locking in a block that measures how much linear elements lock."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*linear elements lock")
        yield


KEPT = 2
"""Number of positions whose energy and force are stored: a line search returns to the last but one, and a step in time
begins at one of two."""


class OnePass:
    """Energy and force by one pass over the elements, of which the results at the last positions are stored.

    Newton's method asks for the energy at the end of each step, and then for the force there. Positions are stored as
    copies and compared by value, since integrators may change ``x`` in place.
    """

    forbids = False
    """Whether the energy of a flat or inverted element is infinite."""

    def __init__(self) -> None:
        self._kept: list[tuple[np.ndarray, float, np.ndarray]] = []

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        """Add the nodal forces [N] at ``x`` (n_nodes, 3) [m] to ``force`` (n_nodes, 3), and return the energy [J]."""
        raise NotImplementedError

    def forget(self) -> None:
        """Discard the stored results, after a change of the elements."""
        self._kept.clear()

    def _at(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        for kept, energy, force in self._kept:
            if np.array_equal(kept, x):
                return energy, force
        force = np.zeros_like(x)
        energy = self.evaluate(x, force)
        self._kept = [(x.copy(), energy, force), *self._kept[: KEPT - 1]]
        return energy, force

    def energy(self, x: np.ndarray) -> float:
        return self._at(x)[0]

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the elastic nodal forces (n_nodes, 3) [N] at positions ``x``: minus the energy's gradient.

        Raises NotConverged where the energy is infinite, as some laws have it of inverted elements.
        """
        return self._finite(x).copy()

    def add_force(self, x: np.ndarray, v: np.ndarray | None, force: np.ndarray) -> None:
        force += self._finite(x)

    def _finite(self, x: np.ndarray) -> np.ndarray:
        energy, force = self._at(x)
        if self.forbids and energy == np.inf:
            raise NotConverged(
                "an element is flat or inverted, or strained further than its law allows; choose stable_neo_hookean or "
                "corotational, a smaller step, or a smaller load",
                [],
            )
        return force


class Elements(OnePass, Energy, Stiffness):
    """Elastic elements between ``n_nodes`` nodes, at rest the tetrahedra of ``mesh``.

    couples : (n_elements, k) their nodes; moduli : Lamé's constants μ and λ of each at rest, two (n_elements,) [Pa]
    law : the compiled functions of the elements' law
    gradients : (n_elements, 4, 3) of the barycentric coordinates [1/m]; volumes : (n_elements,) [m³]
    slopes : (p, k, 3) derivatives of the shape functions at p points of equal weight, with respect to the barycentric
        coordinates of the second to fourth corner
    """

    slopes: np.ndarray

    def __init__(
        self, mesh: Mesh, couples: np.ndarray, n_nodes: int, tissue: Tissue | Material, pattern: BlockPattern | None
    ):
        super().__init__()
        self.couples, self._n_nodes, self._given = np.ascontiguousarray(couples), n_nodes, pattern
        self.gradients, self.volumes = shape_gradients(mesh)
        self.tissue = uniform(tissue, len(couples)) if isinstance(tissue, Material) else tissue
        self.moduli = (self.tissue.shear_pa, self.tissue.lame_pa)
        self.law = PLAIN if self.tissue.law == LAWS[0] else law_of(self.tissue.law)
        self.forbids = self.law.shape is not None and evaluate(self.law, INVERTED, 1.0, 1.0)[0] == np.inf

    @cached_property
    def pattern(self) -> BlockPattern:
        """The pattern of ``stiffness``."""
        return self._given or pattern_of(self.couples, self._n_nodes)

    def stiffness(self, x: np.ndarray, definite: bool = False) -> sparse.bsr_array:
        """Return the Hessian of the energy (3 n_nodes, 3 n_nodes) [N/m] in 3 × 3 blocks.

        ``definite`` clamps negative eigenvalues at each point to zero (Smith, de Goes, Kim 2019, section 5).
        """
        values = np.zeros((len(self.pattern.indices), 3, 3))
        self.add_stiffness(x, definite, self.pattern.slots[0], values)
        return self.pattern.matrix(values)

    def resistance(self) -> np.ndarray:
        """Return a bound Σ (2μ + λ) ∫ |∇N|² of the stiffness against the motion of one node, (n_nodes,) [N/m]."""
        (mu, lam), squares = self.moduli, np.zeros(self.couples.shape)
        for slopes in self.slopes:
            each = np.einsum("ac,ecj->eaj", slopes, self.gradients[:, 1:])
            squares += np.einsum("eaj,eaj->ea", each, each) * (self.volumes[:, None] / len(self.slopes))
        weights = (2.0 * mu + lam)[:, None] * squares
        return np.bincount(self.couples.ravel(), weights.ravel(), minlength=self._n_nodes)

    def least_det(self, x: np.ndarray) -> float:
        """Return the smallest det F at the elements' points; an element is inverted where it is negative."""
        corners, at_rest = np.swapaxes(x[self.couples], 1, 2), np.linalg.det(self.gradients[:, 1:])
        return float(np.min([np.linalg.det(corners @ slopes) * at_rest for slopes in self.slopes]))


def shape_gradients(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Compute gradients of the linear shape functions (n_elements, 4, 3) [1/m] and volumes (n_elements,) [m³]."""
    corners = mesh.nodes[mesh.tetrahedra]
    a, b, c = (corners[:, i] - corners[:, 0] for i in (1, 2, 3))
    normals = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    volumes = np.einsum("ei,ei->e", a, normals[:, 0]) / 6.0
    gradients = np.empty((len(corners), 4, 3))
    gradients[:, 1:] = normals / (6.0 * volumes[:, None, None])
    gradients[:, 0] = -gradients[:, 1:].sum(axis=1)
    return gradients, volumes
