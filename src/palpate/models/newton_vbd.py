"""Answer with Newton's vertex block descent, an optional engine: linear elements on a level, in single precision.

Vertex block descent (Chen and others 2024) steps a body in time. Without gravity, and damped by what is nearly critical
for the body's slowest vibration, it comes to rest. Too few sweeps for a long step end beside the equilibrium.
``pip install "palpate[engines]"`` installs it; its first use compiles it, which takes half a minute.
"""

from typing import Any

import numpy as np

from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, Solver, held_mb, refuse_bed
from palpate.bodies.body import Body
from palpate.bodies.particles import particles_of
from palpate.effects.linear_elements import LinearElements
from palpate.errors import InputError
from palpate.models import kinds
from palpate.models.fem_statics import ContactShares, to_surface
from palpate.models.reduced_body import vibrations
from palpate.solvers.equilibrium import Equilibrium

DAMPING = 0.8
"""As a share of the critical damping of the slowest vibration."""


class Vbd(Solver):
    """A soft body that makes so many ``steps`` from rest, each with so many ``sweeps`` over its nodes.

    step : its length, over the time in which a node would swing by a radian if all others stood still
    """

    def __init__(self, case: Case, model: kinds.NewtonVBD):
        try:
            import warp
        except ModuleNotFoundError as missing:
            raise InputError("Newton is not installed; docs/engines.md says how to install it.") from missing

        warp.config.log_level = warp.LOG_ERROR  # without a GPU it warns, and it says what it compiles
        import newton

        refuse_bed(case, "bodies of Newton")
        level, body = model.level, case.body
        self._rest = body.levels[level].nodes
        self._model = _built(newton, warp, body, level)
        self._solver = newton.solvers.SolverVBD(self._model, iterations=model.sweeps)
        self._states = self._model.state(), self._model.state()
        self._control = self._model.control()
        resistance = LinearElements(body.levels[level], body.tissue(level)).resistance()
        swing_s = np.sqrt(particles_of(body, level, surface=False).masses / resistance)
        self._steps, self._step_s = model.steps, model.step * float(np.median(swing_s))
        self._kept = np.float32(np.exp(-2.0 * DAMPING * _slowest(body) * self._step_s))
        self._shares, self._up = ContactShares(case, level), to_surface(body, level)

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB], the engine's own left out."""
        return held_mb([self._shares, self._up, self._rest])

    def respond(self, load: Load) -> np.ndarray:
        now, after = self._states
        nodal = self._shares.spread(load.forces(), len(self._rest)).astype(np.float32)
        for state in self._states:
            state.particle_f.assign(nodal)
        now.particle_q.assign(self._model.particle_q)
        now.particle_qd.zero_()
        for _ in range(self._steps):
            self._solver.step(now, after, self._control, None, self._step_s)
            now, after = after, now
            velocity = now.particle_qd.numpy()  # of the engine's own memory
            velocity *= self._kept
        return self._up @ (now.particle_q.numpy() - self._rest)


def _slowest(body: Body) -> float:
    """Return the angular frequency [1/s] of the slowest vibration of the coarsest mesh."""
    free = ~np.isin(np.arange(len(body.coarse.nodes)), body.anchors[0])
    masses = particles_of(body, 0, surface=False).masses
    return float(vibrations(Equilibrium(body, 0).linear_solver(), masses, free, 1)[1][0])


def _built(newton: Any, warp: Any, body: Body, level: int) -> Any:
    """Build Newton's model of ``level``; nodes that are held have no mass."""
    mesh, tissue, origin = body.levels[level], body.tissue(level), warp.vec3(0.0, 0.0, 0.0)
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    builder.add_soft_mesh(
        pos=origin,
        rot=warp.quat_identity(),
        scale=1.0,
        vel=origin,
        vertices=[warp.vec3(*place) for place in mesh.nodes.tolist()],
        indices=mesh.tetrahedra.ravel().tolist(),
        density=body.material.density_kg_m3,
        k_mu=tissue.shear_pa.astype(np.float32),
        k_lambda=tissue.lame_pa.astype(np.float32),
        k_damp=0.0,
        add_surface_mesh_edges=False,
    )
    for node in body.anchors[level]:
        builder.particle_mass[node] = 0.0
        builder.particle_flags[node] = int(builder.particle_flags[node]) & ~newton.ParticleFlags.ACTIVE
    builder.color()
    return builder.finalize(device="cpu")


prepare = Vbd
