"""Settings of the study of cuts."""

from pathlib import Path
from typing import Any, Literal

from palpate.benchmark.settings import OnLevel, ProjectiveDynamics, VertexBlockDescent, Xpbd, check_refined
from palpate.bodies.cutting.settings import CutSettings
from palpate.errors import InputError
from palpate.setting_types import Block, Count, Distinct, Name, Positive, Switch, Vector, key, rows


class Hook(Block):
    at_m: Vector = key("Point [m] whose nearest surface node of the coarsest level is grasped, with what is around it")
    radius_m: Positive = key("Radius [m] of what is grasped")
    shift_m: Vector = key("How far that is moved [m]")


class Pull(Block):
    body: str = key("Body that is cut, by name")
    cut: CutSettings = key("The cut")
    hooks: list[Hook] = key("What pulls the lips apart", min_length=1)


class Elements(OnLevel):
    way: Literal["removal", "split_faces", "virtual_nodes", "conform"] = key(
        "Crossed elements are removed, faces split, elements doubled, or the mesh is made anew (quadratic elements)"
    )


class Linear(OnLevel):
    update: Switch = key("Whether the compliance of the whole body is updated, or the cut one factorised")


class Enriched(OnLevel):
    order: Literal[1, 2] = key("Linear (1) or quadratic (2) elements, to which the jump is added")


class Springs(OnLevel):
    way: Literal["deleted", "split_faces", "virtual_nodes"] = key("Crossed springs are deleted, or nodes are doubled")
    iterations: Count = key("Quasi-Newton iterations from the linear answer")


class ShapeMatching(OnLevel):
    mode: Literal["linear", "quadratic"] = key("Shapes that clusters may take")
    clusters: Literal["tetrahedra", "cubes"] = key("Neighbourhoods of tetrahedra, or cubes")
    steps: Count = key("Steps at each of five stops of the hooks")


PAIRS = [(level, way) for level in (0, 1) for way in ("removal", "split_faces", "virtual_nodes")]


class Families(Block):
    fem: Distinct[Elements] = key(
        "Finite elements, converged", rows("level way", *PAIRS, (0, "conform"), (1, "conform"), (2, "virtual_nodes"))
    )
    linear_responses: Distinct[Linear] = key(
        "Linear responses", rows("level update", (0, False), (0, True), (1, False), (1, True))
    )
    enriched_responses: Distinct[Enriched] = key(
        "Linear responses of the whole body, enriched by functions that jump at the cut",
        rows("level order", (0, 1), (1, 1), (0, 2)),
    )
    springs: Distinct[Springs] = key(
        "Springs with moduli of the material",
        rows(
            "level way iterations",
            *((level, way, 10) for level in (0, 1) for way in ("deleted", "split_faces", "virtual_nodes")),
            (1, "virtual_nodes", 1),
            (2, "virtual_nodes", 10),
        ),
    )
    shape_matching: Distinct[ShapeMatching] = key(
        "Shape matching on doubled elements, with clusters split",
        rows(
            "level mode clusters steps",
            *((level, "linear", "tetrahedra", steps) for level, steps in ((0, 40), (1, 10), (1, 40))),
            (0, "quadratic", "cubes", 40),
        ),
    )
    xpbd: Distinct[Xpbd] = key(
        "Extended position-based dynamics on doubled elements",
        rows("level steps iterations step", (0, 20, 2, 2.0), (1, 5, 1, 2.0), (1, 20, 2, 2.0)),
    )
    vertex_block_descent: Distinct[VertexBlockDescent] = key(
        "Vertex block descent on doubled elements",
        rows("level sweeps radius", (0, 20, 0.95), (1, 5, 0.95), (1, 20, 0.998)),
    )
    projective_dynamics: Distinct[ProjectiveDynamics] = key(
        "Projective dynamics on doubled elements",
        rows("level iterations memory", (0, 10, 5), (1, 2, 5), (1, 10, 5)),
    )


class Settings(Block):
    """Bodies that are cut and whose lips hooks pull apart, for every model that can follow a cut."""

    cuts: dict[Name, Pull] = key("Cuts and what pulls, by name", {})
    settings: Families = key("What each model is tried with: a point in the diagram for each", {})
    budget_s: Positive = key("Time [s] for which each setting is cut and asked again, beyond once", 1.0)


def check(config: Any, file: Path) -> None:
    """Raise InputError where nothing is cut, or bodies that there are not or that are not refined."""
    place, cuts = f"{file}: cut.cuts", config.cut.cuts
    if not cuts:
        raise InputError(f"{place} is empty; give it an entry, or remove the block cut.")
    for name, entry in cuts.items():
        check_refined(f"{place}.{name}.body", [entry.body], config.bodies)
