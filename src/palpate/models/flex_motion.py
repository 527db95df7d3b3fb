"""Move a flex body of MuJoCo, an optional engine, under weight, pushes, and spheres and capsules on a path.

A step is one of linearly implicit Euler, of first order, and of ever shorter steps the motion is that of the St.
Venant–Kirchhoff law on the level's nodal masses, with the stress C : (E + d Ė) of strains E whose damping time is d.
Where strains are small that is Rayleigh's damping; where a body turns far it is not that of other models, which damp
by a stiffness clamped positive. What damps by mass is a damper at each node.

An instrument is a body on three slides that is put on its path before each step. Trap: one that MuJoCo calls mocap has
no velocity, so that its friction would be that of an instrument at rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from palpate.benchmark.model import OfBody
from palpate.bodies.particles import particles_of
from palpate.collision.contact.obstacles import Obstacle, make_obstacle
from palpate.effects import push
from palpate.effects.linear_elements import LinearElements
from palpate.effects.settings import Loads, Rayleigh
from palpate.models.mujoco_flex import THICKNESS_M, FlexBody

ITERATIONS, TOLERANCE = 100, 1e-6
"""Of conjugate gradients in a step; with 20 iterations, long steps are not found."""
PENALTY, IMPEDANCE = 4.0, 0.9
"""Stiffness of contact over that of a node of the surface, and the share of it that MuJoCo calls impedance."""
HEAVIER = 1e3
"""Mass of an instrument over that of the body, so that contact does not push it off its path within a step."""


class FlexMotion:
    """A level of a body that MuJoCo moves from rest, in steps of ``step_s`` [s].

    loads : weight, pushes and contact, of spheres and capsules
    Raises InputError and NotConverged as ``FlexBody``.
    """

    def __init__(self, case: OfBody, level: int, loads: Loads, rayleigh: Rayleigh, step_s: float):
        particles, mesh, contact = particles_of(case.body, level, False), case.body.levels[level], loads.contact
        self._h, self._rest = step_s, mesh.nodes
        self._weight = np.outer(particles.masses, np.array(loads.acceleration_m_s2, dtype=float))
        self._pushed = [push.make(particles, loads.push, None)] if loads.push else []
        self._tools = [
            make_obstacle(tool, case.body.name, str(number), mesh.size, np.zeros(3))
            for number, tool in enumerate(loads.instruments)
        ]
        words, beside = 'contype="0" conaffinity="0"', ""
        if contact:
            stiffness = LinearElements(mesh, case.body.tissue(level)).resistance() / particles.masses
            free = np.setdiff1d(mesh.surface, case.body.anchors[level])
            touch = _contact(PENALTY * float(np.median(stiffness[free])), step_s, contact.friction)
            words = f'{touch} contype="2" conaffinity="1"'  # instruments do not touch each other
            beside = "".join(_on_slides(tool, touch, HEAVIER * particles.masses.sum()) for tool in self._tools)
        asked = ITERATIONS, rayleigh.stiffness_s, words, beside, 'refsafe="disable"'
        self._flex = flex = FlexBody(case, level, step_s, *asked)
        model, self._free = flex.model, flex.bodies > 0  # held nodes belong to the world
        self._bodies, masses = flex.bodies[self._free], particles.masses[self._free]
        model.opt.tolerance, model.opt.cone = TOLERANCE, flex.engine.mjtCone.mjCONE_ELLIPTIC
        model.body_mass[self._bodies] = masses  # MuJoCo's own are all alike
        dampers = model.body_dofadr[self._bodies][:, None] + np.arange(3)
        model.dof_damping[dampers] = rayleigh.mass_1_s * masses[:, None]
        flex.engine.mj_setConst(model, flex.data)
        first = model.geom_bodyid[: len(self._tools)]
        self._slides = model.body_dofadr[first][:, None] + np.arange(3)
        self._places = model.jnt_qposadr[model.body_jntadr[first]][:, None] + np.arange(3)

    def step(self, number: int) -> np.ndarray:
        """Make the step of that number, the first is 0; return the force (k, 3) [N] of each instrument on the body.

        Loads and forces are those at its end. NotConverged where the body flies apart.
        """
        flex, begin, end = self._flex, number * self._h, (number + 1) * self._h
        pull = self._weight.copy()
        for pushed in self._pushed:  # dead loads, which no position or velocity changes
            pushed.at(end)
            pushed.add_force(self._rest, self._rest, pull)
        flex.data.xfrc_applied[self._bodies, :3] = pull[self._free]
        for tool, slides, places in zip(self._tools, self._slides, self._places, strict=True):
            here, there = (tool.at(t)[0] - tool.points[0] for t in (begin, end))
            flex.data.qpos[places], flex.data.qvel[slides] = here, (there - here) / self._h
        flex.step()
        return self._felt()

    def displaced(self) -> np.ndarray:
        """Return the displacement (n, 3) [m] of the nodes."""
        return self._flex.displaced()

    def _felt(self) -> np.ndarray:
        found, own, flex = np.zeros((len(self._tools), 3)), np.zeros(6), self._flex
        for number, contact in enumerate(flex.data.contact if self._tools else ()):
            flex.engine.mj_contactForce(flex.model, flex.data, number, own)
            found[max(contact.geom)] += contact.frame.reshape(3, 3).T @ own[:3]  # from the geom to the flex
        return found


@dataclass(frozen=True, eq=False)
class MovedFlex:
    """Displacements ``moved`` (f, n, 3) [m] of a level's nodes at the ends of f frames, and ``forces`` (f, k, 3) [N].

    forces : of each instrument on the body, the mean over a frame by the trapezoidal rule
    seconds : (steps,) [s] of each step
    """

    moved: np.ndarray
    forces: np.ndarray
    seconds: np.ndarray


def move(motion: FlexMotion, frames: int, steps: int) -> MovedFlex:
    """Make so many ``steps``, a multiple of ``frames``; NotConverged where the body flies apart."""
    moved, seconds, forces = [], [], []
    for number in range(steps):
        begin = perf_counter()
        forces.append(motion.step(number))
        seconds.append(perf_counter() - begin)
        if (number + 1) % (steps // frames) == 0:
            moved.append(motion.displaced())
    felt = np.array([np.zeros_like(forces[0]), *forces])
    means = (0.5 * (felt[1:] + felt[:-1])).reshape(frames, steps // frames, -1, 3).mean(axis=1)
    return MovedFlex(np.array(moved), means, np.array(seconds))


def _contact(stiffness_1_s2: float, damping_s: float, friction: float) -> str:
    """Describe contact of a stiffness over mass [1/s²], damped by a time [s] of it, with Coulomb's coefficient."""
    rate = IMPEDANCE * (1.0 - IMPEDANCE) * stiffness_1_s2
    rubs = f'condim="3" friction="{friction} 0 0"' if friction else 'condim="1"'
    return f'{rubs} solref="{-rate} {-rate * damping_s}" solimp="{IMPEDANCE} {IMPEDANCE} 1"'


def _on_slides(tool: Obstacle, contact: str, mass_kg: float) -> str:
    """Describe an instrument that moves along three axes and does not turn."""
    at = "pos" if len(tool.points) == 1 else "fromto"
    geom = f'type="{tool.kind}" size="{tool.radius_m - THICKNESS_M}" {at}="{_numbers(tool.points.ravel())}"'
    slides = "".join(f'<joint type="slide" axis="{_numbers(axis)}"/>' for axis in np.eye(3))
    inertia = f'<inertial pos="0 0 0" mass="{mass_kg}" diaginertia="{mass_kg} {mass_kg} {mass_kg}"/>'
    return f'<body>{slides}{inertia}<geom {geom} {contact} contype="1" conaffinity="2"/></body>'


def _numbers(values: Sequence[float] | np.ndarray) -> str:
    return " ".join(map(str, map(float, values)))
