"""Identified numbers as a flex body of MuJoCo: an MJCF scene, beside a mesh in Gmsh's format, with the ball at a place.

The ball is a mocap body named ``ball``, at first touch: move it along ``direction`` of ``exported.json`` and step.
"""

from palpate.benchmark.touch import Touch
from palpate.identification.export.numbers import EngineMesh
from palpate.models.mujoco_flex import LAW, mjcf
from palpate.models.touch.mujoco_flex import HARD, geom_of, hard_contact

__all__ = ["ITERATIONS", "LAW", "PENALTY", "scene"]
PENALTY, ITERATIONS = 1.0, 100
"""Stiffness of contact over that of a node, and iterations of conjugate gradients in a step."""


def scene(mesh: EngineMesh, mesh_file: str, touch: Touch) -> str:
    """Return the MJCF text of a scene whose mesh is ``mesh_file``, and the ball of ``touch`` where it first touches."""
    body = mesh.corrected
    contact, step_s = hard_contact(body, mesh.level, PENALTY)
    pose = touch.poses[mesh.body]
    at = " ".join(f"{each:.9g}" for each in pose.tip)
    # of a ball the axes do not matter, but that of its middle does
    geom = geom_of(touch.instrument, body.fine.size)
    x, y, z = touch.instrument.radius_m * pose.axes[2]
    geom = geom[: geom.index("pos=")] + f'pos="{x:.9g} {y:.9g} {z:.9g}"'
    ball = f'<body name="ball" mocap="true" pos="{at}"><geom {geom} {contact}/></body>'
    said = mesh.comment.replace("--", "-") + (
        f" The step of {step_s:.3g} s is for presses at rest, where a damping of a step settles contact: for motion"
        f" take steps of milliseconds and damping={mesh.numbers.damping_s:.4g}, and contact that goes with them."
    )
    return mjcf(body, mesh.level, mesh_file, step_s, ITERATIONS, step_s, contact, ball, HARD, said)
