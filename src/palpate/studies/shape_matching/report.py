"""Report on paper 3, chapter 3: integrators, modes, clusters, what shape matching costs, dampers, body springs."""

from typing import Any

import numpy as np
import pandas as pd

from palpate.report.report import Report
from palpate.report.words import spaced
from palpate.studies.shape_matching.claims import held, lacking, limit, tips
from palpate.studies.shape_matching.maxwell_creep import closeness
from palpate.studies.shape_matching.shape_matching_timing import HEADLINE, exponents, headline

TITLE = "Paper 3: shape matching"
CASES = {"none": "without", "dampers_only": "with their dampers only"}
VARIANTS = {
    ("tetrahedra", "mean"): "covered once, averaged",
    ("tetrahedra", "sum"): "covered once, added",
    ("each_tetrahedron", "mean"): "one a tetrahedron, averaged",
    ("each_tetrahedron", "sum"): "one a tetrahedron, added",
}


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    found = report.tables
    stability, clusters, timing = found["integrator_stability"], found["clusters"], found["shape_matching_timing"]
    calm = stability.groupby("scheme", sort=False)["blow_up_measured"].min()
    modes = found["deformation_modes"]
    pokes = found["body_springs"].groupby(["case", "body_springs_n_m"], sort=False)
    return {
        "case": HEADLINE,
        "step_s": 1e-3 * headline(timing),
        "limit": limit(stability),
        "never": [spaced(str(name)) for name in calm.index[np.isinf(calm)]],
        "growth_error": float((stability["growth_measured"] / stability["spectral_radius"] - 1).abs().max()),
        "column_particles": clusters["particle"].nunique(),
        "column_force_n": clusters["force_n"].iloc[0],
        "tips_cm": {int(count): 100 * most for count, most in tips(clusters).items()},
        "slopes": list(exponents(timing).groupby("mode", sort=False)["exponent"].agg(["min", "max"]).itertuples()),
        "poked": [_poked(case, stiffness, rows) for (case, stiffness), rows in pokes],
        "block_particles": modes["particle"].nunique(),
        "left": lacking(modes).T.to_dict(),
        **_goals(found["cluster_goals"]),
        "creep": _creep(found["maxwell_creep"]) if "maxwell_creep" in found else None,
    }


def _poked(case: str, stiffness: float, rows: pd.DataFrame) -> dict[str, Any]:
    """Return how deep and wide a surface gives way at the end of the hold, and what is left of it in the end."""
    end, last = held(rows), rows[rows["time_s"] == rows["time_s"].max()]
    depth = end["max_displacement_m"].max()
    return {
        "name": f"{stiffness:g} N/m" if case == "body_springs" else CASES.get(case, case),
        "depth_mm": 1e3 * depth,
        "moved": int(end["moved"].sum()),
        "nodes": int(end["nodes"].sum()),
        "left": last["max_displacement_m"].max() / depth,
    }


def _goals(table: pd.DataFrame) -> dict[str, Any]:
    """Return how clusters to the letter compare with averaged ones."""
    rows = table.set_index(["kind", "goals"])
    letter, own = rows.loc[("each_tetrahedron", "sum")], rows.loc[("tetrahedra", "mean")]
    return {
        "letter": letter,
        "cheaper": own["memberships"] / letter["memberships"],
        "variants_cm": {VARIANTS[key]: 100 * row["peak_m"] for key, row in rows.iterrows()},
        "drift": table["drift"].max(),
    }


def _creep(table: pd.DataFrame) -> dict[str, Any]:
    """Return how near the creep of a scene is to its closed solution."""
    full = table[table["load"] > 1.0 - 1e-6]["creep_m"].iloc[0]
    late = 1.0 - full / table["closed_m"].max()
    return {"scene": spaced(table["scene"].iloc[0]), "error": closeness(table), "late": late}
