"""What answers a cut, and the settings that each is tried with: on what level, in which way it is cut, how exactly."""

from collections.abc import Callable
from functools import partial
from typing import Any

from palpate.bodies.cutting.ways import WAYS
from palpate.models.cut import elements, linear
from palpate.models.cut.enriched import Enriched
from palpate.models.cut.opened import CutModel
from palpate.models.relaxed import CutRelaxed
from palpate.models.shape_matching import CutShapes
from palpate.models.springs.mass_spring import CutSprings
from palpate.setting_types import rows

MODELS: dict[str, Callable[..., CutModel]] = {
    "fem": elements.online,
    "linear_responses": linear.online,
    "enriched_responses": Enriched,
    "springs": CutSprings,
    "shape_matching": CutShapes,
    **{name: partial(CutRelaxed, name) for name in ("xpbd", "vertex_block_descent", "projective_dynamics")},
}
"""From a case and a setting's keywords to what is ready for the cut; Refused where it cannot follow one."""
TRIED: dict[str, list[dict[str, Any]]] = {
    "fem": rows(
        "level way",
        *((level, way) for level in (0, 1) for way in WAYS), (0, "conform"), (1, "conform"), (2, "virtual_nodes"),
    ),
    "linear_responses": rows("level update", (0, False), (0, True), (1, False), (1, True)),
    "enriched_responses": rows("level order", (0, 1), (1, 1), (0, 2)),
    "springs": rows(
        "level way iterations",
        *((level, way, 10) for level in (0, 1) for way in ("deleted", *WAYS[1:])),
        (1, "virtual_nodes", 1), (2, "virtual_nodes", 10),
    ),
    "shape_matching": rows(
        "level mode clusters steps",
        *((level, "linear", "tetrahedra", steps) for level, steps in ((0, 40), (1, 10), (1, 40))),
        (0, "quadratic", "cubes", 40),
    ),
    "xpbd": rows("level steps iterations step", (0, 20, 2, 2.0), (1, 5, 1, 2.0), (1, 20, 2, 2.0)),
    "vertex_block_descent": rows("level sweeps radius", (0, 20, 0.95), (1, 5, 0.95), (1, 20, 0.998)),
    "projective_dynamics": rows("level iterations memory", (0, 10, 5), (1, 2, 5), (1, 10, 5)),
}  # fmt: skip
"""By model, from cheap to expensive."""
