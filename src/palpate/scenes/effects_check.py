"""Check that the effects of a scene suit each other, its body and its integrator, by its entry in the config alone."""

from palpate.bodies import material
from palpate.bodies.material import LAWS
from palpate.errors import InputError
from palpate.scenes.contact_settings import bodies_in, has_contact
from palpate.scenes.effect_registry import DAMPINGS, EFFECTS, ELASTIC, fault, of_law, unknown, wrong_law

FORM_WORDS = {"solid": "a body with tetrahedra", "surface": "a surface alone", "sheet": "a body of kind sheet"}
ONE_STIFFNESS = ("springs", "shape_matching", "triangles")
"""Elastic effects that have one stiffness for all bodies of a scene."""
STRETCHED = ("structural_n_m", "shear_n_m", "bending_n_m")
"""Stiffnesses of springs that have no solid to take them from."""


def check_effects(place: str, scene: dict, kind: str, law: str = LAWS[0]) -> None:
    """Raise InputError, beginning with ``place``, for effects that exclude, lack or do not suit each other.

    scene : its complete entry; kind, law : of its body
    """
    names, own = _named(place, scene), scene.get("own", {})
    form = _form(scene, kind)
    elastic = _elastic_of(place, scene, names, form, law)
    if wrong := wrong_law(elastic, scene["body"], law):
        raise InputError(f"{place}.{wrong}")
    asks = "effects names" if scene["effects"] != "auto" else "says effects: auto, which calls for"
    where = f"{place}.{asks}" if scene["effects"] != "auto" else f"{place} {asks}"
    for name in [elastic, *(name for name in names if name != elastic and name not in own)]:
        entry = EFFECTS[name]
        if form not in entry.forms:
            wanted = " or ".join(FORM_WORDS[each] for each in entry.forms)
            raise InputError(
                f"{where} {name}, which needs {wanted}, and {scene['body']} is moved as {FORM_WORDS[form]}; "
                f"{_instead(name, form)}."
            )
        if elastic not in entry.elastic:
            raise InputError(
                f"{where} {name}, which works with {' or '.join(entry.elastic)}, and the elastic effect is {elastic}; "
                f"name one of these for it, or leave {name} out."
            )
    _check_integrator(place, scene, elastic)
    _check_settings(place, scene, elastic, form, names)


def check_stiffness(place: str, scene: dict, bodies: dict) -> None:
    """Raise InputError, beginning with ``place``, for several stiffnesses where the elastic effect has one.

    scene : its complete entry; bodies : the entries of the config, by name
    """
    first = bodies[scene["body"]]
    law = first.get("law", LAWS[0])
    elastic = _elastic_of(place, scene, _named(place, scene), _form(scene, first["kind"]), law)
    for body in bodies_in(scene):
        same = ["thickness_m", *(("young_pa", "poisson") if elastic in ONE_STIFFNESS else ())]
        for key in same:
            of_first, of_this = first.get(key, 0.0), bodies[body].get(key, 0.0)
            if of_first != of_this:
                raise InputError(
                    f"{place}.others: {scene['body']} has {key} {of_first:g} and {body} {of_this:g}; bodies of a scene "
                    f"with {elastic} must have the same stiffness and thickness: make them equal."
                )
        if elastic in ONE_STIFFNESS and bodies[body].get("regions"):
            raise InputError(
                f"{place}: {body} has regions, and {elastic} has one stiffness; name corotational, or a body without "
                "regions."
            )


def _form(scene: dict, kind: str) -> str:
    return "sheet" if kind == "sheet" else "surface" if scene["surface"] else "solid"


def _elastic_of(place: str, scene: dict, names: list[str], form: str, law: str) -> str:
    return next((name for name in names if name in ELASTIC), None) or _elastic(place, scene, form, law)


def _named(place: str, scene: dict) -> list[str]:
    """Return the effects that a scene names; with auto, those of its blocks that it calls for on any body."""
    own = scene.get("own", {})
    if scene["effects"] != "auto":
        if wrong := fault(scene["effects"], own, scene, scene["held"]):
            raise InputError(f"{place}.{wrong}")
        return scene["effects"]
    if wrong := unknown([], own):
        raise InputError(f"{place}.{wrong}")
    moves = any(key in scene for key in ("gravity", "push")) or has_contact(scene) or own or scene["start"] != "rest"
    called = [name for name in DAMPINGS if name in scene and moves]
    called += ["prony"] if "prony" in scene else []
    return [*called, *(["plasticity"] if scene.get("plasticity", {}).get("max_strain", 0) > 0 else [])]


def _elastic(place: str, scene: dict, form: str, law: str) -> str:
    """Return the elastic effect that ``effects: auto`` calls for."""
    described = [name for name in ("springs", "shape_matching") if name in scene]
    if len(described) > 1:
        raise InputError(f"{place} describes both springs and shape_matching; keep one of them, or name the effects.")
    return described[0] if described else {"solid": of_law(law), "surface": "springs", "sheet": "triangles"}[form]


def _instead(name: str, form: str) -> str:
    """Return what to do about an effect that does not suit a body."""
    suiting = [other for other in ELASTIC if form in EFFECTS[other].forms]
    return f"name {' or '.join(suiting)}" if name in ELASTIC else f"leave {name} out"


def _check_integrator(place: str, scene: dict, elastic: str) -> None:
    _check_reduced(place, scene)
    goals = scene["integrator"] == "goal_position"
    if goals and elastic != "shape_matching":
        raise InputError(
            f"{place}.integrator is goal_position, which needs shape_matching, and the elastic effect is {elastic}; "
            "choose shape_matching, or another integrator."
        )
    if not goals and elastic == "shape_matching":
        raise InputError(
            f"{place}.integrator is {scene['integrator']}, and shape_matching needs goal_position; choose that, "
            "or another elastic effect."
        )


def _check_reduced(place: str, scene: dict) -> None:
    """Raise InputError for modes without their integrator, and for cells that are coarser than the coarse mesh."""
    modes, level = scene.get("reduced"), scene.get("level", 0)
    if modes is not None and scene["integrator"] != "reduced":
        raise InputError(
            f"{place}.reduced describes modes, and the integrator is {scene['integrator']}; "
            "choose reduced, or leave the block out."
        )
    if modes is not None and modes["coarsened"] > level:
        raise InputError(
            f"{place}.reduced.coarsened is {modes['coarsened']}, and the scene is on level {level}; give {level} at "
            "most, or a finer level."
        )


def _check_settings(place: str, scene: dict, elastic: str, form: str, names: list[str]) -> None:
    """Raise InputError for blocks that do not suit the elastic effect or the body."""
    if "prony" in names and (wrong := material.prony_fault(scene["prony"])):
        raise InputError(f"{place}.prony.{wrong}.")
    if elastic == "springs":
        _check_springs(place, scene.get("springs", {}), form)
    if elastic != "shape_matching":
        return
    clusters = scene["shape_matching"]["clusters"]
    if clusters["kind"] == "cubes" and "edge_m" not in clusters:
        raise InputError(f"{place}.shape_matching.clusters lacks edge_m; give the edge of the cubes in metres.")
    if clusters["kind"] in ("tetrahedra", "each_tetrahedron") and form != "solid":
        raise InputError(
            f"{place}.shape_matching.clusters.kind is {clusters['kind']}, and {scene['body']} is moved as "
            f"{FORM_WORDS[form]}; choose cubes or one."
        )
    if "rayleigh" in names and scene.get("rayleigh", {"stiffness_s": 0.01})["stiffness_s"] > 0:
        raise InputError(
            f"{place}.rayleigh.stiffness_s is above 0, and shape_matching has no stiffness matrix; set it to 0, "
            "or choose velocity_damping."
        )
    if "plasticity" in names and not 0.0 < scene["plasticity"]["max_strain"] < 1.0:
        raise InputError(
            f"{place}.plasticity.max_strain is {scene['plasticity']['max_strain']:g}; "
            "give a number between 0 and 1 for shape_matching."
        )


def _check_springs(place: str, springs: dict, form: str) -> None:
    if form == "solid" and springs:
        raise InputError(
            f"{place}.springs.{next(iter(springs))} has no use: a solid's springs follow from its Young's modulus; "
            "leave the block empty, or set surface: true."
        )
    missing = [key for key in STRETCHED if key not in springs]
    if form != "solid" and missing:
        raise InputError(
            f"{place}.springs lacks {missing[0]}, and {FORM_WORDS[form]} has no other stiffness; "
            "give it in N/m, 0 for none."
        )
    if form != "solid" and not any(springs[key] > 0 for key in STRETCHED):
        raise InputError(f"{place}.springs has no stiffness above 0; give structural_n_m in N/m.")
