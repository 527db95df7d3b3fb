"""Write README.md of a folder of questions, which suffices for who knows nothing of palpate."""

from collections.abc import Mapping
from importlib.resources import files
from string import Template

from palpate.exchange.asked_body import formula
from palpate.exchange.folder import Questions

OWN_MESH = """
**A mesh of your own.** If displacements at the asked points are not at hand, give those of your mesh's nodes, or of those
of a level: `displacement_m` is then (k, n, 3) at `nodes_m` (n, 3) [m], the rest positions, with the triangles `triangles`
(t, 3) of its surface. The scorer interpolates linearly at the nearest point of these triangles, and says what that costs: the error
that the truth itself has when it is taken through those nodes. It is part of your error.
"""
BED = """
**Bed.** The surface lies on springs, `bed` in `questions.json`: a traction −k u on the surface at rest within `radius_m`
of `center_m`, with k = `stiffness_n_m3` · (1 − (distance/radius)²)², on triangles whose outward normal is within 60° of
`facing`, if that is given.
"""


def read_page(name: str) -> Template:
    """Return a page of this package with places to fill."""
    return Template(files("palpate.exchange").joinpath("pages", name).read_text(encoding="utf-8"))


def readme(questions: Questions, law: str, more: Mapping[str, str]) -> bytes:
    """Return the page; ``law`` is the body's, a name or a file, ``more`` what the kind of questions says by places."""
    info, levels = questions.info, range(questions.info["levels"])
    sizes = [questions.arrays[f"level_{i}"] for i in levels]
    rows = [
        f"| {i} | {len(each['nodes_m'])} | {len(each['tetrahedra'])} | {len(each['held'])} |"
        for i, each in enumerate(sizes)
    ]
    known = questions.truth is not None
    truths = (
        "`truth.npz` has the truth, `displacement_m` (k, p, 3), and its own errors (`own_…`, NaN where it is not "
        "believed). Look at it to find mistakes of your adapter, and say so where you have tuned by it."
        if known
        else "There is no truth here: whoever scores finds it."
    )
    materials = [f"E = {m['young_pa']:g} Pa, ν = {m['poisson']:g}, {m['density_kg_m3']:g} kg/m³" for m in info["materials"]]
    told = {
        "scene": info["scene"], "body": info["body"], "law": info["law"], "count": questions.count,
        "points": len(questions.points), "levels": info["levels"], "sizes": "\n".join(rows),
        "formula": formula(law), "material": "; ".join(f"{i}: {each}" for i, each in enumerate(materials)),
        "bed": BED if "bed" in info else "", "own_mesh": OWN_MESH, "truths": truths,
    }  # fmt: skip
    return read_page("readme.md").substitute(told | dict(more)).encode()
