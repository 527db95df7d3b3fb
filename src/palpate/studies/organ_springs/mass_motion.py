"""Effect of masses from a CT on motion, against the same density everywhere."""

from dataclasses import replace

import numpy as np
import pandas as pd
from scipy import sparse
from scipy.sparse.linalg import eigsh

from palpate.bodies.particles import Particles
from palpate.effects.linear_elements import LinearElements
from palpate.models.springs.spring_motion import reference_motion
from palpate.studies.organ_springs.organ import Motion, Organ, deviation

MODES = 3
"""Slowest modes whose frequencies are compared."""


def measure(found: Organ) -> pd.DataFrame:
    """Compute the rows of mass_motion.csv: coarse finite elements with each choice of masses, pressed and swinging.

    masses : own (the body's), uniform (density_kg_m3), mean (the own total mass, spread evenly)
    frequency_hz : of the slowest mode; change_of_frequency : the largest relative change of MODES against own masses
    change_of_motion : RMSE against the motion of own masses over all presses, of the peak
    """
    own = found.particles(0)
    uniform = found.particles(0) if found.body.densities is None else _uniform(found)
    even = replace(own, masses=uniform.masses * (own.masses.sum() / uniform.masses.sum()))
    frequencies, motions = frequencies_hz(own), _motions(found, own)
    rows = []
    for name, particles in {"own": own, "uniform": uniform, "mean": even}.items():
        other = frequencies_hz(particles)
        rows.append(
            {
                "body": found.body.name,
                "from_ct": found.body.densities is not None,
                "masses": name,
                "total_kg": particles.masses.sum(),
                "least_node_of_uniform": float((particles.masses / uniform.masses).min()),
                "most_node_of_uniform": float((particles.masses / uniform.masses).max()),
                "frequency_hz": other[0],
                "change_of_frequency": float(np.abs(other / frequencies - 1.0).max()),
                "change_of_motion": _change(found, _motions(found, particles), motions),
            }
        )
    return pd.DataFrame(rows)


def frequencies_hz(particles: Particles) -> np.ndarray:
    """Compute the lowest MODES frequencies [Hz] of K φ = ω² M φ at rest, held nodes left out."""
    free = np.repeat(np.isin(np.arange(len(particles.nodes)), particles.held, invert=True), 3)
    stiffness = LinearElements(particles, particles.tissue).stiffness(particles.nodes).tocsr()[free][:, free]
    masses = sparse.diags_array(np.repeat(particles.masses, 3)[free]).tocsc()
    start = np.random.default_rng(0).normal(size=masses.shape[0])  # fixed, so that results repeat
    squares = eigsh(stiffness.tocsc(), MODES, masses, sigma=0.0, v0=start, return_eigenvectors=False)
    return np.sqrt(np.sort(squares)) / (2.0 * np.pi)


def _uniform(found: Organ) -> Particles:
    return replace(found, body=replace(found.body, densities=None)).particles(0)


def _motions(found: Organ, particles: Particles) -> list[Motion]:
    settings, presses = found.in_steps(1), range(found.fitted)
    return [reference_motion(particles, found.model, found.press(i, 0), settings, 1) for i in presses]


def _change(found: Organ, motions: list[Motion], wanted: list[Motion]) -> float:
    rest = found.keys.of(found.body.coarse.nodes)
    return float(np.mean([deviation(x, y, rest) for (x, _), (y, _) in zip(motions, wanted, strict=True)]))
