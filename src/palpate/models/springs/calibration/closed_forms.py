"""Spring parameters in closed form, or by a search for a single number: baselines for the searches."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from palpate.bodies.material import Material
from palpate.bodies.mesh import EDGES, TetMesh
from palpate.effects.volume_force import rest_distance_sum
from palpate.models.springs.calibration.fitness import Fit, Range, Track
from palpate.models.springs.calibration.spring_model import SpringModel

STARTS = 12
"""Evaluations that bracket the best uniform modulus: the fitness may have several maxima."""


def van_gelder(model: SpringModel, material: Material) -> tuple[SpringModel, np.ndarray]:
    """Set k = E ΣV/l² with the material's E everywhere (Van Gelder 1998): moduli (n,) [Pa] for the unchanged model.

    Averaged over directions that is the given E at a Poisson ratio of 1/4.
    """
    return model, np.full(len(model.masses), float(material.young_pa))


def lloyd(model: SpringModel, material: Material) -> tuple[SpringModel, np.ndarray]:
    """Set k = Σ (2√2/25) l E over the tetrahedra around a spring (Lloyd, Székely, Harders 2007).

    Derived for regular tetrahedra of edge l, by the least difference to the stiffness matrix of linear finite elements
    at a Poisson ratio of 1/4; there k is 24/25 of Van Gelder's. For other shapes l is, here, the edge of the regular
    tetrahedron of the same volume: the long and the short edges of an element get equal springs.
    """
    regular = np.cbrt(6.0 * np.sqrt(2.0) * TetMesh(model.nodes, model.tetrahedra).volumes)
    ends = np.sort(model.tetrahedra[:, EDGES].reshape(-1, 2), axis=1)
    pairs, edge = np.unique(ends, axis=0, return_inverse=True)
    assert np.array_equal(pairs, model.pairs)
    shares = np.repeat(2.0 * np.sqrt(2.0) / 25.0 * regular, len(EDGES))
    weights = np.bincount(edge.ravel(), shares, minlength=len(pairs))
    return replace(model, weights=weights), np.full(len(model.masses), float(material.young_pa))


def uniform(fitness: Callable[[np.ndarray], np.ndarray], nodes: int, limits: Range) -> Fit:
    """Find the fittest modulus common to all ``nodes``: evenly in log E, then by Brent's method around the best."""
    track = Track(fitness)
    low, high = np.log(limits.low_pa), np.log(limits.high_pa)
    logs = np.linspace(low, high, STARTS)
    best = int(np.argmax(track(np.exp(np.repeat(logs[:, None], nodes, axis=1)))))
    around = (logs[max(best - 1, 0)], logs[min(best + 1, STARTS - 1)])

    def unfitness(log: float) -> float:
        return -float(track(np.full((1, nodes), np.exp(log)))[0])

    minimize_scalar(unfitness, bounds=around, method="bounded", options={"xatol": 1e-4})
    return track.fit()


def volume_stiffness(model: SpringModel, material: Material) -> float:
    """Compute κ [N/m] of the volume force that gives springs of modulus E the material's bulk modulus; 0 below ν = 1/4.

    A swelling by ε costs springs ½ Σ k l² ε², which makes their bulk modulus 2E/3, and the volume force ½ κ ΣL² ε²,
    so 9V (E/(3 (1 − 2ν)) − 2E/3) = κ ΣL². In shear, L of a regular tetrahedron does not change.
    """
    missing = material.young_pa / (3.0 * (1.0 - 2.0 * material.poisson)) - 2.0 * material.young_pa / 3.0
    volume = float(TetMesh(model.nodes, model.tetrahedra).volumes.sum())
    return max(0.0, 9.0 * volume * missing / float((rest_distance_sum(model.nodes, model.tetrahedra) ** 2).sum()))
