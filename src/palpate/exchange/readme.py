"""Write README.md of a folder of questions, which suffices for who knows nothing of palpate."""

from collections.abc import Mapping
from importlib.resources import files
from string import Template

from palpate.bodies.material import LAWS
from palpate.exchange.asked_body import FURTHER, formula, law_named
from palpate.exchange.folder import Questions


def read_page(name: str) -> Template:
    """Return a page of this package with places to fill."""
    return Template(_text(name))


def _text(name: str) -> str:
    return files("palpate.exchange").joinpath("pages", name).read_text(encoding="utf-8")


def readme(questions: Questions, law: str, more: Mapping[str, str]) -> bytes:
    """Return the page; ``law`` is the body's, a name or a file, ``more`` what the kind of questions says by places."""
    info, levels = questions.info, range(questions.info["levels"])
    sizes = [questions.arrays[f"level_{i}"] for i in levels]
    rows = [
        f"| {i} | {len(each['nodes_m'])} | {len(each['tetrahedra'])} | {len(each['held'])} |"
        for i, each in enumerate(sizes)
    ]
    known, shape = questions.truth is not None, more.get("shape", "(k, p, 3)")
    truths = (
        f"`truth.npz` has the truth, `displacement_m` {shape}, and its own errors (`own_…`, NaN where it is not "
        "believed). Look at it to find mistakes of your adapter, and say so where you have tuned by it."
        if known
        else "There is no truth here: the scorer finds it once, and keeps it beside this folder as `….truth_<law>.npz`."
    )
    materials = [
        f"E = {m['young_pa']:g} Pa, ν = {m['poisson']:g}, {m['density_kg_m3']:g} kg/m³" for m in info["materials"]
    ]
    others = [f"- `{name}`: {formula(law_named(name))}" for name in (*LAWS, *FURTHER) if name != info["law"]]
    told = {
        "scene": info["scene"], "body": info["body"], "law": info["law"], "count": questions.count,
        "questions": questions.counted.removeprefix("1 "), "points": len(questions.points), "levels": info["levels"],
        "sizes": "\n".join(rows), "formula": formula(law), "laws": "\n".join(others), "truths": truths,
        "material": "; ".join(f"{i}: {each}" for i, each in enumerate(materials)),
        "bed": _text("bed.md") if "bed" in info else "",
        "own_mesh": read_page("own_mesh.md").substitute(shape=shape.replace("p", "n")),
    }  # fmt: skip
    return read_page("readme.md").substitute(told | dict(more)).encode()
