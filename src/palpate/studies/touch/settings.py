"""Settings of the study of touches."""

from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field

from palpate.benchmark.settings import (
    LEVEL,
    Given,
    Instrument,
    OnLevel,
    ProjectiveDynamics,
    TouchTruthSettings,
    VertexBlockDescent,
    Xpbd,
    check_instruments,
    check_refined,
    pressed_bodies,
)
from palpate.errors import InputError, describe_unknown
from palpate.setting_types import (
    Block,
    Count,
    Distinct,
    Index,
    Pair,
    Positive,
    Some,
    Switch,
    key,
    rows,
)


class TouchModel(NamedTuple):
    """A model of touches.

    place : the module with ``settings(case)`` and ``online(case, **setting)``, as ``TouchSolver`` says
    keywords : further arguments of both; tried_as : the key of ``touch.settings`` that it is tried with
    """

    place: str
    keywords: dict[str, Any]
    tried_as: str


MODELS = {name: TouchModel(f"palpate.models.touch.{name}", {}, name) for name in ("fem", "modes", "linear")}
MODELS |= {
    name: TouchModel("palpate.models.relaxed", {"method": name}, "relaxed")
    for name in ("xpbd", "vertex_block_descent", "projective_dynamics")
}
MODELS |= {
    "springs": TouchModel("palpate.models.springs.mass_spring", {"volume": False}, "springs"),
    "springs_volume": TouchModel("palpate.models.springs.mass_spring", {"volume": True}, "springs"),
    "shape_matching": TouchModel("palpate.models.shape_matching", {}, "shape_matching"),
}
"""Models of touches by name, in the order of tables."""


class LevelMesh(Block):
    order: Literal[1, 2] = key("Linear elements, 1, or quadratic ones, 2")
    level: Index = key(LEVEL)


HELD = "Level, from the first of the body's shape, that the rim of what is held is refined to"
TOUCHED = "Level that it is refined to where it is touched"


class LocalMesh(Block):
    held: Index = key(HELD)
    level: Index = key(TOUCHED)


class Fem(Block):
    levels: Distinct[LevelMesh] = key(
        "Meshes of the body, from cheap to expensive", rows("order level", (1, 1), (1, 2), (2, 0), (2, 1))
    )
    local: Distinct[LocalMesh] = key(
        "Meshes that are refined where they are touched, with quadratic elements, from cheap to expensive",
        rows("held level", (0, 2), (2, 3)),
    )


class LinearMesh(Block):
    warped: Switch = key("Whether the sum of their responses is turned by its own rotations", False)
    discs: Count = key("Discs of pressure that cover what may be touched")
    held: Index = key(HELD)
    level: Index = key(TOUCHED)


class Relaxed(Block):
    xpbd: Distinct[Xpbd] = key(
        "Extended position-based dynamics, from cheap to expensive",
        rows(
            "level steps iterations step",
            (1, 10, 1, 3.0),
            (1, 30, 1, 2.0),
            (1, 100, 1, 1.0),
            (2, 10, 1, 3.0),
            (2, 40, 1, 1.0),
        ),
    )
    vertex_block_descent: Distinct[VertexBlockDescent] = key(
        "Vertex block descent, from cheap to expensive",
        rows("level sweeps radius", (1, 10, 0.998), (1, 30, 0.998), (1, 100, 0.9995), (2, 10, 0.9995)),
    )
    projective_dynamics: Distinct[ProjectiveDynamics] = key(
        "Projective dynamics, from cheap to expensive",
        rows("level iterations memory", (1, 2, 5), (1, 10, 5), (2, 5, 5), (2, 10, 5), (2, 30, 5)),
    )


class Springs(OnLevel):
    iterations: Count = key("Iterations at each of five stops of the instrument")


class Shapes(OnLevel):
    mode: Literal["rigid", "linear", "quadratic"] = key("How a cluster may deform")
    clusters: Literal["one", "tetrahedra", "cubes"] = key("How particles are grouped")
    steps: Count = key("Steps at each of five stops of the instrument")


class Families(Block):
    fem: Fem = key("Finite elements, converged", {})
    modes: Distinct[LocalMesh] = key(
        "Reduced models of a place, made of presses on meshes from cheap to expensive",
        rows("held level", (0, 2), (2, 3)),
    )
    linear: Distinct[LinearMesh] = key(
        "Linear responses of a place with contact solved in them",
        rows("discs held level warped", *((discs, 2, 3, warped) for warped in (False, True) for discs in (20, 40))),
    )
    relaxed: Relaxed = key("Methods of graphics and games, with contact as they have it in practice", {})
    springs: Distinct[Springs] = key(
        "Springs with moduli of the material times a fitted factor, from cheap to expensive",
        rows("level iterations", (1, 1), (1, 4), (2, 1), (2, 10)),
    )
    shape_matching: Distinct[Shapes] = key(
        "Shape matching, fitted to touches that are not asked",
        rows(
            "level mode clusters steps",
            *((level, "linear", "cubes", steps) for level in (1, 2) for steps in (10, 40)),
            (2, "linear", "tetrahedra", 40),
        ),
    )


class Settings(Block):
    """What an instrument that is pushed into a body moves, and what the hand feels, for every model."""

    bodies: Some[str] | None = key("Bodies that are touched, by name; null takes all that are refined", None)
    instruments: list[Instrument] = key(
        "Rigid instruments, or grasps", rows("kind radius_m", ("sphere", 0.008)), min_length=1
    )
    samples: Count = key("Touches of each body by each instrument, at places drawn by area", 4)
    at: list[Given] = key("Touches at places of your own, which are asked of their bodies instead of drawn ones", [])
    depth_of_radius: Pair[Annotated[Positive, Field(le=2)]] = key(
        "Least and largest depth of a touch from where it begins, over the instrument's radius; depths are lowered "
        "where the body gives way",
        [0.25, 0.75],
    )
    truth: TouchTruthSettings = key(
        "What models are judged by, the limit of quadratic elements that are refined at the place", {}
    )
    models: Distinct[str] | None = key("Models by name; null takes all that palpate has", None)
    settings: Families = key("What each model is tried with: a point in the diagram for each", {})


def check(config: Any, file: Path) -> None:
    """Raise InputError for models and bodies that there are not, and for instruments and depths that are none."""
    place, settings = f"{file}: touch", config.touch
    if wrong := describe_unknown(settings.models or [], list(MODELS)):
        raise InputError(f"{place}.models names {wrong}")
    if taken := [name for name in config.own_models if name in MODELS]:
        raise InputError(
            f"{file}: own_models names {taken[0]}, which is a model of palpate's; call your own otherwise."
        )
    bodies = pressed_bodies(config, "touch")
    check_refined(f"{place}.bodies", bodies, config.bodies)
    if not bodies:
        raise InputError(f"{place} is there and no body is refined; give one refinements of at least 1.")
    if settings.depth_of_radius[0] > settings.depth_of_radius[1]:
        raise InputError(f"{place}.depth_of_radius is {settings.depth_of_radius}; give the lower number first.")
    for i, given in enumerate(settings.at):
        if given.body not in bodies:
            raise InputError(f"{place}.at[{i}].body is {given.body}; give one of {', '.join(bodies)}.")
        if given.direction is not None and not any(given.direction):
            raise InputError(f"{place}.at[{i}].direction is [0, 0, 0]; give the way of the instrument, or null.")
    check_instruments(f"{place}.instruments", settings.instruments, bodies, config.bodies)
