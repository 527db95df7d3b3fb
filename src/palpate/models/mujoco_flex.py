"""Answer with MuJoCo's flex bodies, an optional engine: linear elements of the St. Venant–Kirchhoff law on a level.

MuJoCo 4 steps them implicitly ("discrete"), here with steps of a second and without gravity or damping, so that few of
them bring a body to rest. ``pip install "palpate[engines]"`` installs it.
"""

import numpy as np

from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, OfBody, Solver, held_mb, refuse_bed, refuse_regions
from palpate.bodies.body import Body
from palpate.bodies.mesh import Mesh
from palpate.effects.linear_elements import shape_gradients
from palpate.errors import InputError, NotConverged
from palpate.models import kinds
from palpate.models.fem_statics import ContactShares, to_surface

LAW = "st_venant_kirchhoff"
STEP_S, TOLERANCE, STORE = 1.0, 1e-10, "2G"
THICKNESS_M = 1e-6
"""By which MuJoCo makes a flex thicker where it is touched: its radius, which may not be 0."""


class FlexBody:
    """A level of a body in MuJoCo: its ``model`` and ``data``, and ``bodies`` (n,), that of each node, 0 where held.

    damping_s : damping matrix over the stiffness [s]
    contact : words on how it touches; beside : on what else is there; flags : on the solver
    InputError where MuJoCo is not installed, NotConverged for a body on a bed or of several stiffnesses.
    """

    def __init__(
        self,
        case: OfBody,
        level: int,
        step_s: float,
        iterations: int,
        damping_s: float = 0.0,
        contact: str = 'contype="0" conaffinity="0"',
        beside: str = "",
        flags: str = "",
    ):
        try:
            import mujoco
        except ModuleNotFoundError as missing:
            raise InputError("MuJoCo is not installed; docs/engines.md says how to install it.") from missing

        refuse_bed(case, "bodies of MuJoCo")
        refuse_regions(case, "bodies of MuJoCo")
        mujoco.set_mju_user_warning(lambda message: None)  # it warns of large steps
        mesh, file = case.body.levels[level], "body.msh"
        words = mjcf(case.body, level, file, step_s, iterations, damping_s, contact, beside, flags)
        self.engine = mujoco
        self.model = mujoco.MjModel.from_xml_string(words, {file: gmsh(mesh)})
        self.data = mujoco.MjData(self.model)
        self.bodies, self.rest = np.array(self.model.flex_vertbodyid), mesh.nodes

    def step(self, count: int = 1) -> None:
        """Make steps in time. NotConverged where the body flies apart, upon which MuJoCo begins from rest unasked."""
        self.engine.mj_step(self.model, self.data, count)
        wrong = self.engine.mjtWarning
        for kind in (wrong.mjWARN_BADQPOS, wrong.mjWARN_BADQVEL, wrong.mjWARN_BADQACC):
            if self.data.warning[kind].number:
                raise NotConverged("the body of MuJoCo flies apart; take more iterations", [float("nan")])

    def displaced(self) -> np.ndarray:
        """Return the displacement (n, 3) [m] of the nodes."""
        self.engine.mj_kinematics(self.model, self.data)
        self.engine.mj_flex(self.model, self.data)
        return np.array(self.data.flexvert_xpos) - self.rest


class Flex(Solver):
    """A flex body that makes so many ``steps`` from rest, each with so many iterations of conjugate gradients."""

    def __init__(self, case: Case, model: kinds.MuJoCo):
        level, self._steps = model.level, model.steps
        self._flex = FlexBody(case, level, STEP_S, model.iterations)
        self._shares, self._up = ContactShares(case, level), to_surface(case.body, level)

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB], the engine's own left out."""
        return held_mb([self._shares, self._up, self._flex.rest])

    def respond(self, load: Load) -> np.ndarray:
        flex = self._flex
        flex.engine.mj_resetData(flex.model, flex.data)
        free = flex.bodies > 0  # held nodes belong to the world
        flex.data.xfrc_applied[flex.bodies[free], :3] = self._shares.spread(load.forces(), len(free))[free]
        flex.step(self._steps)
        return self._up @ flex.displaced()


def mjcf(
    body: Body,
    level: int,
    file: str,
    step_s: float,
    iterations: int,
    damping_s: float,
    contact: str,
    beside: str = "",
    flags: str = "",
    said: str = "",
) -> str:
    """Describe a level of a body for MuJoCo, whose mesh is ``file``; the rest as of ``FlexBody``; said : a comment."""
    material, mass = body.material, body.material.density_kg_m3 * shape_gradients(body.levels[level])[1].sum()
    comment = f"  <!-- {said} -->\n" if said else ""
    return f"""<mujoco>
{comment}  <option timestep="{step_s}" gravity="0 0 0" integrator="discrete" solver="CG" iterations="{iterations}"
    tolerance="{TOLERANCE}"><flag {flags}/></option>
  <size memory="{STORE}"/>
  <worldbody>
    {beside}
    <flexcomp name="body" type="gmsh" file="{file}" dim="3" dof="full" radius="{THICKNESS_M}" mass="{mass}">
      <edge equality="false"/>
      <elasticity young="{material.young_pa}" poisson="{material.poisson}" damping="{damping_s}"/>
      <contact selfcollide="none" {contact}/>
      <pin id="{" ".join(map(str, body.anchors[level]))}"/>
    </flexcomp>
  </worldbody>
</mujoco>"""


def gmsh(mesh: Mesh) -> bytes:
    """Write a mesh of tetrahedra in Gmsh's format 2.2."""
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(mesh.nodes))]
    lines += [f"{i} {x:.17g} {y:.17g} {z:.17g}" for i, (x, y, z) in enumerate(mesh.nodes, start=1)]
    lines += ["$EndNodes", "$Elements", str(len(mesh.tetrahedra))]
    lines += [f"{i} 4 2 0 0 " + " ".join(map(str, t + 1)) for i, t in enumerate(mesh.tetrahedra, start=1)]
    return "\n".join([*lines, "$EndElements", ""]).encode()


prepare = Flex
