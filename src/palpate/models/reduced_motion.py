"""Move a body in few modes: the implicit midpoint rule of the elements, in the coordinates of a reduced body."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from palpate.effects.elements import OnePass
from palpate.effects.push import disc, factor
from palpate.models.contact_modes.reduced_contact import ReducedContact, cell_stresses, clamped_tangent
from palpate.models.reduced_body import ReducedBody
from palpate.solvers.quadratic_motion import Midpoint


class CellEnergy(OnePass):
    """Σ V Ψ(F) + ½ qᵀ R q of the cells of a reduced body, in coordinates (r, 1)."""

    def __init__(self, model: ReducedContact):
        super().__init__()
        self._model, count = model, len(model.cells.volumes)
        self._flat = model.cells.slopes.reshape(9 * count, -1)
        self._scratch = np.empty((9, count)), np.empty((9, count)), np.empty(count), np.empty(count, dtype=bool)

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        _, volumes, mu, lam = self._model.cells
        f, stresses, *rest = self._scratch
        energy = cell_stresses(x[:, 0], self._flat, volumes, mu, lam, *self._model.law, f, stresses, *rest)
        pull = self._model.rest @ x
        force[:, 0] -= stresses.ravel() @ self._flat
        force -= pull
        return energy + 0.5 * float(np.vdot(x, pull))

    def clamped(self, x: np.ndarray) -> np.ndarray:
        """Return the Hessian (r, r) with that of each cell clamped positive."""
        return self._model.rest + clamped_tangent(x[:, 0], *self._model.cells, *self._model.law)

    def least_det(self, x: np.ndarray) -> float:
        """Return the smallest det F of all cells."""
        f = (self._flat @ x).reshape(3, 3, -1).transpose(2, 0, 1) + np.eye(3)
        return float(np.linalg.det(f).min())


class ReducedMotion(Midpoint):
    def __init__(self, body: ReducedBody, loads: dict[str, dict], rayleigh: dict):
        r = len(body.masses)
        self.body, self.cells = body, CellEnergy(body.model)
        self.rest, self.held, self.masses = np.zeros((r, 1)), np.zeros(r, dtype=bool), np.diag(body.masses)
        self._alpha, self._beta = rayleigh["mass_1_s"], rayleigh["stiffness_s"]
        weight = np.array(loads.get("gravity", {}).get("acceleration_m_s2", [0.0, 0.0, 0.0]), dtype=float)
        self._weight = body.project(body.of.weigh() @ weight)[:, None]
        pushes = loads.get("push", {}).get("loads", [])
        self._pushes = [(body.project(body.of.spread(disc(p)) @ np.array(p["force_n"], float))[:, None], p) for p in pushes]
        self.scale_n = float(np.linalg.norm(self._weight)) + sum(float(np.linalg.norm(f)) for f, _ in self._pushes)

    def load_at(self, t):
        return self._weight + sum(factor(push, t) * forces for forces, push in self._pushes)

    def energy(self, x):
        return self.cells.energy(x) - float(np.vdot(self.load, x))

    def force(self, x):
        return self.cells.force(x) + self.load

    def damping(self, x):
        self._clamped = self.cells.clamped(x)
        self._factor = None
        matrix = self._alpha * self.masses + self._beta * self._clamped
        return lambda v: matrix @ v

    def _preconditioner(self, h, x):
        mass, share = (4.0 / h**2 + 2.0 * self._alpha / h) * self.masses, 1.0 + 2.0 * self._beta / h

        def solve(force):
            if self._factor is None:
                self._factor = cho_factor(mass + share * self._clamped)
            return cho_solve(self._factor, force)
        return solve
