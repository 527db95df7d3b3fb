"""What a scene says of each effect and of how time is stepped: one class each, of which the effect is made."""

import math
from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from palpate.setting_types import (
    Axis,
    Block,
    Count,
    Index,
    Name,
    NotNegative,
    Number,
    Pair,
    Positive,
    Switch,
    Vector,
    key,
    optional,
)  # fmt: skip

Fraction = Annotated[NotNegative, Field(le=1)]


class Load(Block):
    """A force on the surface that grows, stays and falls."""

    at_m: Vector = key("Middle of the load [m]; the point of the surface nearest to it at rest")
    force_n: Vector = key("Force [N]")
    radius_m: NotNegative = key("Radius of the disc that the force is spread over [m]; 0 is a point", 0)
    normal: Vector | None = optional("Normal of the disc; by default the surface's, nearest to at_m")
    start_s: NotNegative = key("When it begins [s]", 0)
    press_s: NotNegative = key("How long it grows [s]", 0.1)
    hold_s: NotNegative = key("How long it stays [s]", 0.5)
    release_s: NotNegative = key("How long it falls [s]", 0.1)


class _Tool(Block):
    name: Name | None = optional("What tables call it")
    times_s: list[Number] | None = optional("When it is where [s], increasing", min_length=1)
    shifts_m: list[Vector] | None = optional("How far it is then from its first place [m]", min_length=1)


class Ball(_Tool):
    """An instrument that is a ball."""

    kind: Literal["sphere"] = key("A ball", "sphere")
    center_m: Vector = key("Centre [m]")
    radius_m: Positive = key("Radius [m]")


class Capsule(_Tool):
    """An instrument that is a rod with round ends."""

    kind: Literal["capsule"] = key("A rod with round ends", "capsule")
    from_m: Vector = key("Middle of one round end [m]")
    to_m: Vector = key("Middle of the other round end [m]")
    radius_m: Positive = key("Radius [m]")


class Floor(_Tool):
    """An instrument that fills all below a height."""

    kind: Literal["floor"] = key("All below a height", "floor")
    axis: Axis = key("Which way is up", "z")
    height_m: Number = key("Height [m]")


class Triangles(_Tool):
    """An instrument that is a surface in a file."""

    kind: Literal["mesh"] = key("Triangles of a file", "mesh")
    file: str = key("STL, OBJ, PLY, VTK … relative to this configuration")
    scale_m: Positive = key("Length of the file's unit [m]", 1)
    radius_m: NotNegative = key("How thick its skin is [m]", 0)


Instrument = Annotated[Ball | Capsule | Floor | Triangles, Field(discriminator="kind", description="What shape it has")]


class Gravity(Block):
    """The weight of bodies."""

    acceleration_m_s2: Vector = key("Acceleration [m/s²]", [0, 0, -9.81])


class Push(Block):
    loads: list[Load] = key("One entry a load", min_length=1)


class Hook(Block):
    """A patch of the surface that is grasped, moved or pulled, and let go."""

    model_config = ConfigDict(json_schema_extra={"anyOf": [{"required": ["shift_m"]}, {"required": ["force_n"]}]})

    at_m: Vector = key("Point [m] whose nearest surface point is grasped at rest, with what is around it")
    radius_m: NotNegative = key("Radius [m] of what is grasped; 0 for the facet at the point", 0)
    shift_m: Vector | None = optional("How far it is moved from where it is at the start [m]")
    force_n: Vector | None = optional("Force [N] that pulls instead, spread over the patch as a load's")
    start_s: NotNegative = key("When it grasps [s]", 0)
    pull_s: NotNegative = key("How long it moves, or the force grows [s]", 0.1)
    hold_s: NotNegative = key("How long it stays [s]", 0.5)
    release_s: NotNegative = key("How long it goes back before it lets go [s]; 0: it lets go where it is", 0.1)


class Thread(Block):
    """A suture between two points of a surface, which only pulls."""

    ends_m: Pair[Vector] = key("Points [m] whose nearest surface points at rest it joins")
    stiffness_n_m: Positive = key(
        "Stiffness [N/m], by default that of 3 cm of polypropylene 3-0: 4.0 GPa (Nindhia et al. 2021), 0.22 mm thick",
        5000,
    )
    start_s: NotNegative = key("When it is tied, as long as its ends are then apart [s]", 0)
    tighten_s: NotNegative = key("How long it is tightened [s]", 0.5)
    tightened_to: NotNegative = key("Length that it is tightened to, over the distance of its ends at rest", 1)
    length_m: NotNegative | None = optional("The same length [m], instead")


class Other(Block):
    body: str = key("Which of the bodies")
    shift_m: Vector = key("Where to, from where the body is defined [m]")


class Contact(Block):
    """What bodies can meet: instruments, each other and themselves."""

    instruments: list[Instrument] = key("Rigid things, at rest or driven along a path", [])
    gap_m: Positive | None = optional(
        "Distance at which surfaces begin to repel [m]; by default a thousandth of the smallest body"
    )
    friction: NotNegative = key("Coulomb's coefficient", 0)
    slip_m_s: Positive = key("Speed above which surfaces slip fully [m/s]; below they creep", 0.001)
    self_contact: Switch = key("Whether a body can meet itself", False)
    push_out: Switch = key("Whether what overlaps at the beginning is moved apart, instead of refused", False)


class Springs(Block):
    """Springs along edges, diagonals and across edges, which hold a body together."""

    structural_n_m: NotNegative | None = optional("Stiffness of the edges' springs [N/m]")
    shear_n_m: NotNegative | None = optional("Stiffness of the diagonals' springs [N/m]")
    bending_n_m: NotNegative | None = optional("Stiffness of the springs across edges [N/m]")


class Clusters(Block):
    """How the particles of shape matching are grouped."""

    kind: Literal["one", "tetrahedra", "each_tetrahedron", "cubes"] = key(
        "Which groups; each_tetrahedron makes many and is slow", "one"
    )
    edge_m: Positive | None = optional("Edge of the cubes [m]")
    overlap: Fraction = key("Share of its edge by which a cube reaches into the next", 0.5)


class ShapeMatching(Block):
    """Clusters of particles that are drawn to their shape at rest, moved, turned and deformed."""

    mode: Literal["rigid", "linear", "quadratic"] = key("How a cluster may deform", "linear")
    alpha: Fraction = key("Stiffness, from 0 to 1", 0.5)
    beta: Fraction = key("Deformation, from 0 to 1", 0.5)
    goals: Literal["mean", "sum"] = key(
        "A particle of several clusters moves to the goals' mean, or by their sum (paper 3)", "mean"
    )
    clusters: Clusters = key("How particles are grouped", {})


class Bending(Block):
    """A sheet's resistance to bending, which follows from its modulus and thickness."""


class Volume(Block):
    """A force that preserves the volume."""

    stiffness_n_m: NotNegative | None = optional("Stiffness [N/m]; by default what the body's Poisson's ratio asks for")


class BodySprings(Block):
    """Springs that tie each node to its place at rest, so that a surface resists like a solid."""

    stiffness_n_m: NotNegative | None = optional("Stiffness [N/m]; by default what the body's modulus asks for")
    damping_ratio: NotNegative = key("Share of critical damping", 0.5)


class Plasticity(Block):
    """Lasting deformation beyond a yield strain."""

    yield_strain: Positive = key("Elastic strain above which it flows")
    creep_1_s: Positive = key("Rate of the flow [1/s]", 10)
    max_strain: NotNegative = key("Largest lasting strain")


class Prony(Block):
    """Relaxation of the elements' shear modulus, as a Prony series."""

    shares: list[Positive] = key(
        "Shares of the instantaneous shear modulus that relax, 0.99 in all at most", min_length=1
    )
    times_s: list[Annotated[Number, Field(ge=1e-9)]] = key(
        "Time in which each of them relaxes to 1/e [s]", min_length=1
    )


class Rayleigh(Block):
    """Damping by shares of mass and stiffness."""

    mass_1_s: NotNegative = key("Share of the mass [1/s]", 1)
    stiffness_s: NotNegative = key("Share of the stiffness [s]", 0.01)


class Xpbd(Block):
    iterations: Count = key("Iterations of each step; 1 with small steps", 1)


class ProjectiveDynamics(Block):
    iterations: Count = key("Iterations of each step", 10)
    memory: Index = key("Steps by which the matrix is improved (Liu, Bouaziz and Kavan, 2017); 0 for the original", 0)


class VertexBlockDescent(Block):
    sweeps: Count = key("Sweeps over all nodes in each step", 10)
    radius: NotNegative = key(
        "Spectral radius of a sweep that Chebyshev's semi-iterative method assumes; 0 for none", 0, lt=1
    )


class Touching(Block):
    vibrations: Index = key("Vibration modes, slowest first", 10)
    modes: Count = key("Modes of the motions that strokes beside the path show, strongest first", 75)
    states: Count = key("At how many of these motions few points pull as all elements do", 40)
    thinning: Fraction = key("How nearly they do, relative; 0 keeps all elements", 0.03)
    tolerance: Positive = key("A step is found where another would gain less than its square of the energy", 6e-3)


class Kelvin(Block):
    """Dampers beside the springs."""

    ratio: NotNegative = key("Share of critical damping", 0.1)


class Maxwell(Block):
    """Springs in series with dampers, which relax, beside the others."""

    stiffness_ratio: NotNegative = key("Their stiffness, relative to the springs")
    relaxation_s: Positive = key("Time in which they relax [s]")


class VelocityDamping(Block):
    """Decay of all velocities."""

    rate_1_s: NotNegative = key("Rate of decay [1/s]", 1)


class Loads(Block):
    """Loads, contact and plasticity of a body, which a scene and a study of motions describe alike."""

    gravity: Gravity | None = optional("Weight")
    push: Push | None = optional("Loads that are pressed on, held, and released")
    contact: Contact | None = optional("What the bodies can meet, each other included")
    plasticity: Plasticity | None = optional("Lasting deformation")

    @property
    def acceleration_m_s2(self) -> list[float]:
        """That of the weight [m/s²]."""
        return self.gravity.acceleration_m_s2 if self.gravity else [0.0, 0.0, 0.0]

    @property
    def pushes(self) -> list[Load]:
        """All loads that are pressed on."""
        return self.push.loads if self.push else []

    @property
    def instruments(self) -> list[Instrument]:
        """All instruments that can be met."""
        return self.contact.instruments if self.contact else []


class Stepping(Block):
    """How time is stepped."""

    integrator: Literal[
        "symplectic_euler", "backward_euler", "bdf2", "touching", "goal_position", "xpbd",
        "projective_dynamics", "vertex_block_descent",
    ] = key("How time is stepped", "backward_euler")  # fmt: skip
    step_s: Positive = key("Time step [s]")
    substeps: Count | Literal["auto"] = key(
        "Equal parts of each step; auto: as many as an explicit integrator needs", 1
    )
    duration_s: Positive = key("Simulated time [s]")
    frames: Count = key("Pictures kept of the motion", 60)
    tolerance: Positive = key("Relative residual at which an implicit step counts as found", 1e-8, le=1e-4)
    allow_unstable: Switch = key("Whether to run a step that is known to be unstable, to see it fail", False)
    xpbd: Xpbd | None = optional("Steps of integrator xpbd")
    projective_dynamics: ProjectiveDynamics | None = optional("Steps of integrator projective_dynamics")
    vertex_block_descent: VertexBlockDescent | None = optional("Steps of integrator vertex_block_descent")
    touching: Touching | None = optional("Modes that finite elements move in, of integrator touching")

    @property
    def steps(self) -> int:
        """The number of steps that cover the duration."""
        return max(1, math.ceil(self.duration_s / self.step_s - 1e-9))
