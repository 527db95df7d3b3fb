"""Answer a touch with a flex body of MuJoCo, an optional engine, that a rigid geom is moved into.

MuJoCo's contact is a spring and a damper between the geom and the point of each outer tetrahedron deepest in it. Its
stiffness follows from an impedance d and a time constant t: m / ((1 - d) t²), with the mass m that all nodes of a
flex have alike. Here t makes it so many times the stiffness of a node of the body. The force is MuJoCo's own.
"""

import numpy as np

from palpate.benchmark.model import LeftOut, Setting, held_mb
from palpate.benchmark.touch import Touch, TouchCase, Touched, TouchSolver, refuse_sticking
from palpate.bodies.body import Body
from palpate.effects.instrument import CAPSULE, PUNCH, Instrument
from palpate.effects.linear_elements import LinearElements
from palpate.models.fem_statics import to_surface
from palpate.models.mujoco_flex import LAW, THICKNESS_M, FlexBody
from palpate.setting_types import rows

__all__ = ["LAW", "FlexTouch", "online", "settings"]
IMPEDANCE = 0.99
HARD = 'refsafe="disable"'
"""Without it contacts would be softer, so that their time constant is that of a step."""
STEP = 40.0
"""Time of a step over that in which a node on its contact would swing by a radian; with more than 100 MuJoCo makes the
contact softer, as its impedances end at 0.9999."""


TRIED = rows("level penalty steps iterations", (1, 0.1, 10, 60), (1, 1.0, 20, 60), (2, 0.1, 20, 60), (2, 1.0, 40, 100))


def settings(case: TouchCase) -> list[Setting]:
    """List settings on levels that the body has, from cheap to expensive."""
    return [each for each in TRIED if each["level"] < len(case.body.levels)]


class FlexTouch(TouchSolver):
    """A flex body that makes half of its ``steps`` while the geom comes, and the others while it stands.

    penalty : the stiffness of a contact over that of a node whose neighbours stand still
    The supports feel the elastic force; the area is not told. LeftOut for an instrument that sticks, or has a rounded
    edge; NotConverged as ``FlexBody``, InputError where MuJoCo is not installed.
    """

    def __init__(self, case: TouchCase, level: int, penalty: float, steps: int, iterations: int):
        refuse_sticking(case, "bodies of MuJoCo without friction")
        self._steps = steps
        body = self._shape = case.body
        contact, step_s = hard_contact(body, level, penalty)
        geom = f'<body mocap="true"><geom {geom_of(case.instrument, body.fine.size)} {contact}/></body>'
        damping_s = step_s  # without it, nodes leave the geom in one step and are in it again after the next
        words = contact, geom, HARD
        self._flex = FlexBody(case, level, step_s, iterations, damping_s, *words)
        self._up = to_surface(body, level)

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB], the engine's own left out."""
        return held_mb([self._up, self._flex.rest])

    def respond(self, touch: Touch) -> Touched:
        """Answer as ``TouchSolver`` does; NotConverged where the body flies apart."""
        flex, first, coming = self._flex, touch.pose(self._shape), (self._steps + 1) // 2
        flex.engine.mj_resetData(flex.model, flex.data)
        flex.engine.mju_mat2Quat(flex.data.mocap_quat[0], first.axes.T.ravel())
        for step in range(coming):
            flex.data.mocap_pos[0] = first.tip + (step + 1) / coming * touch.depth_m * touch.direction
            flex.step()
        flex.step(self._steps - coming)
        force = self._pushed() @ touch.direction
        reaction = -flex.data.qfrc_passive.reshape(-1, 3).sum(axis=0) @ touch.direction
        return Touched(self._up @ flex.displaced(), float(force), reaction_n=float(reaction))

    def _pushed(self) -> np.ndarray:
        """Return the force (3,) [N] of the geom on the body in the last step."""
        flex, force, own = self._flex, np.zeros(3), np.zeros(6)
        for number, contact in enumerate(flex.data.contact):
            flex.engine.mj_contactForce(flex.model, flex.data, number, own)
            force += own[0] * contact.frame[:3]  # from the geom to the flex
        return force


def hard_contact(body: Body, level: int, penalty: float) -> tuple[str, float]:
    """Describe contact ``penalty`` times as stiff as a node of ``level``, and return the step [s] that goes with it."""
    elements = LinearElements(body.levels[level], body.tissue(level))
    resistance = elements.resistance()
    mass = body.material.density_kg_m3 * elements.volumes.sum() / len(resistance)  # of a node [kg]
    rate = float(np.sqrt(penalty * np.median(resistance) / mass))  # [1/s] of a node on its contact
    constant_s = 1.0 / (rate * np.sqrt(1.0 - IMPEDANCE))
    return f'condim="1" solref="{constant_s} 1" solimp="{IMPEDANCE} {IMPEDANCE} 1"', STEP / rate


def geom_of(instrument: Instrument, length_m: float) -> str:
    """Describe an instrument whose tip is the origin, a punch as long as ``length_m``; LeftOut for a rounded edge."""
    if instrument.edge_m:
        raise LeftOut("MuJoCo has no cylinder with a rounded edge", [float("nan")])
    radius, half = instrument.radius_m - THICKNESS_M, 0.5 * instrument.length_m
    if instrument.kind == PUNCH:
        return f'type="cylinder" size="{radius}" fromto="0 0 {THICKNESS_M} 0 0 {length_m}"'
    middle = instrument.radius_m
    if instrument.kind == CAPSULE and half:
        return f'type="capsule" size="{radius}" fromto="{-half} 0 {middle} {half} 0 {middle}"'
    return f'type="sphere" size="{radius}" pos="0 0 {middle}"'


online = FlexTouch
