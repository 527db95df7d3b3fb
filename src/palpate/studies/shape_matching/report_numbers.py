"""Put the modes, the clusters to the letter and the creep of paper 3, chapter 3, into the words of captions."""

import pandas as pd

from palpate.report.number_format import percent
from palpate.report.words import spaced
from palpate.studies.shape_matching.maxwell_creep import closeness

_VARIANTS = {
    ("tetrahedra", "mean"): "covered once, averaged",
    ("tetrahedra", "sum"): "covered once, added",
    ("each_tetrahedron", "mean"): "one a tetrahedron, averaged",
    ("each_tetrahedron", "sum"): "one a tetrahedron, added",
}


def of_modes(modes: pd.DataFrame) -> dict[str, str]:
    """Return what each mode leaves of the deformations."""
    left = modes.groupby(["mode", "deformation"], sort=False)["left"].first()
    missed, rigid = (
        ", ".join(f"{percent(share)} of the {name}" for name, share in left[mode].items() if share > 1e-9)
        for mode in ("linear", "rigid")
    )
    return {
        "block_particles": str(modes["particle"].nunique()),
        "quadratic_left": f"{left['quadratic'].max():.0e}",
        "linear_left": f"{missed} deformation",
        "rigid_left": rigid,
    }


def of_goals(table: pd.DataFrame) -> dict[str, str]:
    """Return how clusters to the letter compare with averaged ones."""
    rows = table.set_index(["kind", "goals"])
    letter, own = rows.loc[("each_tetrahedron", "sum")], rows.loc[("tetrahedra", "mean")]
    tips = ", ".join(f"{100 * row['peak_m']:.2g} cm ({_VARIANTS[key]})" for key, row in rows.iterrows())
    return {
        "literal": (
            f"{letter['clusters']:.0f} clusters, {letter['clusters_mean']:.0f} a particle and "
            f"{letter['clusters_most']:.0f} at most, are unstable from α = {letter['alpha_limit_measured']:.3f} on "
            f"(by the largest eigenvalue {letter['alpha_limit']:.3f})"
        ),
        "cheaper": percent(own["memberships"] / letter["memberships"]),
        "tips": f"the tip moves {tips}",
        "drift": f"{table['drift'].max():.0e}",
    }


def of_creep(table: pd.DataFrame) -> dict[str, str]:
    """Return how near the creep of a scene is to its closed solution."""
    largest = table["closed_m"].max()
    full = table[table["load"] > 1.0 - 1e-6]["creep_m"].iloc[0]
    return {
        "creep_scene": spaced(table["scene"].iloc[0]),
        "creep_error": percent(closeness(table)),
        "creep_late": percent(1.0 - full / largest),
    }
