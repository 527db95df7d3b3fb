"""Identified numbers as a Python script of Newton: a soft mesh stepped by vertex block descent."""

from pathlib import Path

from palpate.effects.laws import quadratic_neo_hookean
from palpate.identification.export.numbers import EngineMesh

LAW = str(Path(quadratic_neo_hookean.__file__))
"""The law of Newton's bodies, as a file of palpate's."""


def script(mesh: EngineMesh, arrays_file: str) -> str:
    """Return the text of a script that reads ``arrays_file`` beside it: nodes, tetrahedra and held nodes."""
    material = mesh.corrected.material
    return f'''"""{mesh.comment}

    python {mesh.numbers.name}_newton.py        # needs newton and warp
"""

from pathlib import Path

import numpy as np

YOUNG_PA, POISSON, DENSITY_KG_M3 = {material.young_pa!r}, {material.poisson!r}, {material.density_kg_m3!r}
MU_PA, LAMBDA_PA = {material.shear_pa!r}, {material.lame_pa!r}
DAMPING_S = {mesh.numbers.damping_s!r}
ARRAYS = Path(__file__).with_name({arrays_file!r})


def build(device="cpu"):
    """Return the model of Newton."""
    import newton
    import warp

    arrays, origin = np.load(ARRAYS), warp.vec3(0.0, 0.0, 0.0)
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    builder.add_soft_mesh(
        pos=origin,
        rot=warp.quat_identity(),
        scale=1.0,
        vel=origin,
        vertices=[warp.vec3(*place) for place in arrays["nodes_m"].tolist()],
        indices=arrays["tetrahedra"].ravel().tolist(),
        density=DENSITY_KG_M3,
        k_mu=MU_PA,
        k_lambda=LAMBDA_PA,
        k_damp=DAMPING_S,
        add_surface_mesh_edges=False,
    )
    for node in arrays["held"]:
        builder.particle_mass[node] = 0.0
        builder.particle_flags[node] = int(builder.particle_flags[node]) & ~newton.ParticleFlags.ACTIVE
    builder.color()
    return builder.finalize(device=device)


if __name__ == "__main__":
    import newton

    model = build()
    solver, now, after = newton.solvers.SolverVBD(model, iterations=10), model.state(), model.state()
    for _ in range(100):
        now.clear_forces()
        solver.step(now, after, model.control(), None, 1.0 / 240.0)
        now, after = after, now
    print(np.abs(now.particle_q.numpy() - model.particle_q.numpy()).max(), "m moved without a load")
'''
