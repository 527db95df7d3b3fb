"""Compute what others published; limits are extrapolated from three meshes, with an estimate of their own error."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.richardson import number_limits
from palpate.files import read_yaml
from palpate.studies.outside import hanging_bar, prisms
from palpate.table_declaration import Table

OUTSIDE = Table(
    "outside",
    "Quantities that others published, and the same computed by palpate; where theirs is of a mesh, ours is the limit.",
    """
    case quantity unit: its name, what it is and its unit
    published ours: the published value, and that of this run
    own_error: how far ours may be off by its meshes, over ours; zero where mesh and problem are the published ones
    difference: of ours from the published value, over this
    source: where it was published
    """,
)


CELLS = 4
"""Elements along a side of the coarsest of three meshes, each of which halves the elements of the last."""


def compare_with_published(input: Any) -> pd.DataFrame:
    """Tabulate published values beside palpate's, the rows of OUTSIDE, for the rule of this name.

    input : files, ``published`` of the values by case and ``displacements`` of the hanging bar's nodes
    """
    published, rows = read_yaml(input.published), []
    for case, ours, error, difference in _found(hanging_bar.read_displacements(input.displacements)):
        entry = published[case]
        value = float(entry["value"])
        relative_difference = ours / value - 1.0 if difference is None else difference
        rows.append([case, entry["quantity"], entry["unit"], value, ours, error, relative_difference, entry["source"]])
    return OUTSIDE.frame(rows)


def _found(theirs: np.ndarray) -> Iterator[tuple[str, float, float, float | None]]:
    """Yield the name of each case, palpate's value, its relative error by the mesh, and the difference from published.

    The difference is relative, and None where the caller computes it from both values.
    theirs : (833, 3) [m], the published displacements of the hanging bar's nodes
    """
    ours = hanging_bar.on_its_mesh()
    worst_node = np.linalg.norm(ours - theirs, axis=1).max() / np.linalg.norm(theirs, axis=1).max()
    yield "bar_tip", -1e3 * ours[:, 2].min(), 0.0, None
    yield "bar_nodes", 1e3 * np.sqrt((ours**2).sum(axis=1).mean()), 0.0, float(worst_node)
    yield from _limits(["bar_limit", "bar_energy"], hanging_bar.tip_and_energy, CELLS // 4)
    yield "squeezed", prisms.confined_stress(0.7), 0.0, None
    yield "stretched", prisms.confined_stress(1.5), 0.0, None
    yield from _limits(["torsion"], prisms.torsion_constant, CELLS)
    yield from _limits(["in_plane", "in_plane_pair"], prisms.plate_frequencies, CELLS // 2)
    yield from _limits(["cook_incompressible"], prisms.cook_incompressible, CELLS)
    yield from _limits(["cook_plane_strain"], prisms.cook_neo_hookean(plane=True), CELLS)
    yield from _limits(["cook_free"], prisms.cook_neo_hookean(plane=False), CELLS)


def _limits(cases: list[str], value: Callable, cells: int) -> Iterator[tuple[str, float, float, None]]:
    """Yield each of ``cases``, the limit of ``value`` over 1, 2 and 4 times ``cells``, and its own error over that."""
    values = np.array([np.atleast_1d(value(factor * cells)) for factor in (1, 2, 4)])
    for case, limit, error in zip(cases, *number_limits(values), strict=True):
        yield case, float(limit), float(error / abs(limit)), None
