"""Identified numbers as a flex body of MuJoCo: an MJCF scene, beside a mesh in Gmsh's format, with the ball at a place.

The ball is a mocap body named ``ball``, at first touch: move it along ``direction`` of ``exported.json`` and step.

MuJoCo's contact is a spring and a damper between the ball and the point of each outer tetrahedron deepest in it. Its
stiffness follows from an impedance d and a time constant t: m / ((1 - d) t²), with the mass m that all nodes of a
flex have alike. Here t makes it so many times the stiffness of a node of the body.
"""

import numpy as np

from palpate.benchmark.touch import Touch
from palpate.bodies.mesh import Mesh
from palpate.effects.linear_elements import LinearElements
from palpate.identification.export.numbers import EngineMesh

LAW = "st_venant_kirchhoff"
PENALTY, ITERATIONS, TOLERANCE, STORE = 1.0, 100, 1e-10, "2G"
"""Stiffness of contact over that of a node; iterations of conjugate gradients in a step, their tolerance; memory."""
THICKNESS_M = 1e-6
"""By which MuJoCo makes a flex thicker where it is touched: its radius, which may not be 0."""
IMPEDANCE = 0.99
STEP = 40.0
"""Time of a step over that in which a node on its contact would swing by a radian; with more than 100 MuJoCo makes the
contact softer, as its impedances end at 0.9999."""


def scene(mesh: EngineMesh, mesh_file: str, touch: Touch) -> str:
    """Return the MJCF text of a scene with the body of ``mesh_file`` and the ball of ``touch`` at first touch.

    Without ``refsafe="disable"`` MuJoCo would soften contacts until their time constant is that of a step.
    """
    body, level, pose = mesh.corrected, mesh.level, touch.poses[mesh.body]
    elements, material = LinearElements(body.levels[level], body.tissue(level)), body.material
    contact, step_s = _contact(elements, material.density_kg_m3)
    mass = material.density_kg_m3 * elements.volumes.sum()
    tip = " ".join(f"{each:.9g}" for each in pose.tip)
    # the ball's centre lies off its tip along its third axis
    x, y, z = touch.instrument.radius_m * pose.axes[2]
    geom = f'type="sphere" size="{touch.instrument.radius_m - THICKNESS_M}" pos="{x:.9g} {y:.9g} {z:.9g}"'
    comment = mesh.comment.replace("--", "-") + (
        f" The step of {step_s:.3g} s is for presses at rest, where a damping of a step settles contact: for motion"
        f" take steps of milliseconds and damping={mesh.numbers.damping_s:.4g}, and contact that goes with them."
    )
    return f"""<mujoco>
  <!-- {comment} -->
  <option timestep="{step_s}" gravity="0 0 0" integrator="discrete" solver="CG" iterations="{ITERATIONS}"
    tolerance="{TOLERANCE}"><flag refsafe="disable"/></option>
  <size memory="{STORE}"/>
  <worldbody>
    <body name="ball" mocap="true" pos="{tip}"><geom {geom} {contact}/></body>
    <flexcomp name="body" type="gmsh" file="{mesh_file}" dim="3" dof="full" radius="{THICKNESS_M}" mass="{mass}">
      <edge equality="false"/>
      <elasticity young="{material.young_pa}" poisson="{material.poisson}" damping="{step_s}"/>
      <contact selfcollide="none" {contact}/>
      <pin id="{" ".join(map(str, body.anchors[level]))}"/>
    </flexcomp>
  </worldbody>
</mujoco>"""


def _contact(elements: LinearElements, density_kg_m3: float) -> tuple[str, float]:
    """Return MJCF attributes of a contact that is PENALTY times as stiff as a node, and the step [s] for it."""
    resistance = elements.resistance()
    mass = density_kg_m3 * elements.volumes.sum() / len(resistance)  # of a node [kg]
    rate = float(np.sqrt(PENALTY * np.median(resistance) / mass))  # [1/s] of a node on its contact
    constant_s = 1.0 / (rate * np.sqrt(1.0 - IMPEDANCE))
    return f'condim="1" solref="{constant_s} 1" solimp="{IMPEDANCE} {IMPEDANCE} 1"', STEP / rate


def gmsh(mesh: Mesh) -> bytes:
    """Write a mesh of tetrahedra in Gmsh's format 2.2."""
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(mesh.nodes))]
    lines += [f"{i} {x:.17g} {y:.17g} {z:.17g}" for i, (x, y, z) in enumerate(mesh.nodes, start=1)]
    lines += ["$EndNodes", "$Elements", str(len(mesh.tetrahedra))]
    lines += [f"{i} 4 2 0 0 " + " ".join(map(str, t + 1)) for i, t in enumerate(mesh.tetrahedra, start=1)]
    return "\n".join([*lines, "$EndElements", ""]).encode()
