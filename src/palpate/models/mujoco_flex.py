"""Answer with MuJoCo's flex bodies, an optional engine: linear elements of the St. Venant–Kirchhoff law on a level.

MuJoCo 4 steps them implicitly ("discrete"), here with steps of a second and without gravity or damping, so that few of
them bring a body to rest. ``pip install "palpate[engines]"`` installs it.
"""

from typing import Any

import numpy as np

from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, Setting, Solver, held_mb, on_own_levels, one_stage, refuse_bed, refuse_regions
from palpate.bodies.mesh import Mesh
from palpate.effects.linear_elements import shape_gradients
from palpate.errors import InputError
from palpate.models.fem_statics import ContactShares, to_surface

LAW = "st_venant_kirchhoff"
STEP_S, TOLERANCE, STORE = 1.0, 1e-10, "2G"


def settings(case: Case) -> list[Setting]:
    """List the grid's settings on levels that the body has."""
    return on_own_levels(case, case.grid["mujoco_flex"]["runs"])


class Flex(Solver):
    """A flex body that makes so many ``steps`` from rest, each with so many iterations of conjugate gradients."""

    def __init__(self, case: Case, setting: Setting):
        try:
            import mujoco
        except ModuleNotFoundError as missing:
            raise InputError("MuJoCo is not installed; docs/engines.md says how to install it.") from missing

        refuse_bed(case, "bodies of MuJoCo")
        refuse_regions(case, "bodies of MuJoCo")
        mujoco.set_mju_user_warning(lambda message: None)  # it warns of large steps
        level, body = setting["level"], case.body
        mesh, material = body.levels[level], body.material
        words = _described(mesh, body.anchors[level], material, setting["iterations"])
        self._model = mujoco.MjModel.from_xml_string(words, {"body.msh": _gmsh(mesh)})
        self._data = mujoco.MjData(self._model)
        self._rest, self._steps = mesh.nodes, setting["steps"]
        self._bodies = np.array(self._model.flex_vertbodyid)
        self._shares, self._up = ContactShares(case, level), to_surface(body, level)

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB], the engine's own left out."""
        return held_mb([self._shares, self._up, self._rest])

    def respond(self, load: Load) -> np.ndarray:
        import mujoco

        model, data = self._model, self._data
        mujoco.mj_resetData(model, data)
        free = self._bodies > 0  # held nodes belong to the world
        data.xfrc_applied[self._bodies[free], :3] = self._shares.spread(load.forces(), len(free))[free]
        mujoco.mj_step(model, data, self._steps)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_flex(model, data)
        return self._up @ (np.array(data.flexvert_xpos) - self._rest)


def _described(mesh: Mesh, held: np.ndarray, material: Any, iterations: int) -> str:
    """Write MuJoCo's description of the body."""
    mass = material.density_kg_m3 * shape_gradients(mesh)[1].sum()
    pinned = " ".join(map(str, held))
    return f"""<mujoco>
  <option timestep="{STEP_S}" gravity="0 0 0" integrator="discrete" solver="CG" iterations="{iterations}"
    tolerance="{TOLERANCE}"/>
  <size memory="{STORE}"/>
  <worldbody>
    <flexcomp name="body" type="gmsh" file="body.msh" dim="3" mass="{mass}" radius="0.0005" dof="full">
      <edge equality="false"/>
      <elasticity young="{material.young_pa}" poisson="{material.poisson}" damping="0"/>
      <contact selfcollide="none" contype="0" conaffinity="0"/>
      <pin id="{pinned}"/>
    </flexcomp>
  </worldbody>
</mujoco>"""


def _gmsh(mesh: Mesh) -> bytes:
    """Write a mesh of tetrahedra in Gmsh's format 2.2."""
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(mesh.nodes))]
    lines += [f"{i} {x:.17g} {y:.17g} {z:.17g}" for i, (x, y, z) in enumerate(mesh.nodes, start=1)]
    lines += ["$EndNodes", "$Elements", str(len(mesh.tetrahedra))]
    lines += [f"{i} 4 2 0 0 " + " ".join(map(str, t + 1)) for i, t in enumerate(mesh.tetrahedra, start=1)]
    return "\n".join([*lines, "$EndElements", ""]).encode()


offline = one_stage(Flex)
