"""Correct a coarse motion by what linear responses say that the coarse mesh lacks, turned with the body."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.linalg.multigrid import Factor
from palpate.models.enrichment.detail_correction import NodalRotations
from palpate.models.fem_statics import to_surface
from palpate.scenes.build_system import compose
from palpate.scenes.dynamic_check import LOADS
from palpate.scenes.motion import Motion
from palpate.studies.dynamic.dynamic_fit import Fitted
from palpate.studies.dynamic.dynamic_trial import Trial


def corrects(trial: Trial) -> bool:
    """Return whether a trial has a linear response for all that acts: one held solid under gravity and pushes."""
    solid = trial.held and not trial.shifts_m and not trial.thickness_m
    return solid and set(trial.loads) <= set(LOADS) and len(trial.body.levels) > 1


class CorrectedMotion:
    """x_f = P x_c + R Σ a D: a coarse motion with the detail D of each load, scaled by how far the body has moved.

    The coarse modulus is divided by ``softness``, so that coarse and fine linear responses have the same compliance;
    a coarse mesh is too stiff, and would swing too fast. D is the linear fine response less the coarse one of that
    modulus, both interpolated to the fine surface, (k, n_surface, 3) [m] for k loads. a is the least-squares share of
    each coarse response in the coarse displacement, weighted by mass, so that detail follows inertia, too. R turns
    detail by the rotation of the coarse material, as corrected coarse FEM does in statics (docs/method.md).
    """

    def __init__(self, trial: Trial):
        last = len(trial.body.levels) - 1
        (coarse, loads), (fine, fine_loads) = _responses(trial, 0), _responses(trial, last)
        self.softness = float(np.vdot(fine_loads, fine) / np.vdot(loads, coarse))
        coarse = self.softness * coarse
        self._up = to_surface(trial.body, 0)
        fine_up = to_surface(trial.body, last)
        self.detail = np.array([fine_up @ u - self._up @ c for u, c in zip(fine, coarse, strict=True)])
        masses = np.sqrt(np.repeat(trial.particles(0).masses, 3))
        self._shares = np.linalg.pinv((coarse.reshape(len(coarse), -1) * masses).T) * masses
        assert isinstance(trial.body.coarse, TetMesh)  # as ``corrects`` asks for
        self._rotations = NodalRotations(trial.body.coarse)

    def correct(self, motion: Motion) -> np.ndarray:
        """Return displacements (f, n_surface, 3) [m] of the fine surface after each frame of a coarse motion."""
        return np.array([self._corrected(x - motion.rest) for x in motion.positions[1:]])

    def _corrected(self, moved: np.ndarray) -> np.ndarray:
        turns = (self._up @ self._rotations.at(moved).reshape(-1, 9)).reshape(-1, 3, 3)
        detail = np.tensordot(self._shares @ moved.ravel(), self.detail, axes=1)
        return self._up @ moved + (turns @ detail[:, :, None])[:, :, 0]


def fit_correction(trial: Trial) -> Fitted:
    """Prepare the correction of a trial; nothing is learnt, so no motion to fit to is needed."""
    begin = perf_counter()
    found = CorrectedMotion(trial)
    young = trial.body.material.young_pa / found.softness
    return Fitted(Trial.fem, young, perf_counter() - begin, found.correct)


def _responses(trial: Trial, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Return linear responses (k, n, 3) [m] of a level to each load at its height, and the loads (k, n, 3) [N]."""
    particles, loads = trial.particles(level), []
    for single in _singles(trial):
        system = compose(single.fem(single.frames), particles)
        for load in single.loads.get("push", {}).get("loads", []):
            system.at(load["start_s"] + load["press_s"])
        still = np.zeros_like(particles.nodes)
        loads.append(system.outer_force(particles.nodes, still) + system.potential_force(particles.nodes))
    matrix = system.stiffness(particles.nodes, definite=True)
    assert matrix is not None  # finite elements have one
    system.hold(matrix)
    factor = Factor(matrix)
    return np.array([factor.solve(load) for load in loads]), np.array(loads)


def _singles(trial: Trial) -> list[Trial]:
    """List trials of one load each."""
    found = [{"gravity": trial.loads["gravity"]}] if "gravity" in trial.loads else []
    found += [{"push": {"loads": [load]}} for load in trial.loads.get("push", {}).get("loads", [])]
    return [replace(trial, loads=loads) for loads in found]
