"""Check a scene by its entry in the config alone: its effects suit each other, its body and its integrator."""

import re
from itertools import pairwise

from palpate.bodies import material
from palpate.bodies.material import LAWS
from palpate.errors import InputError, describe_unknown
from palpate.scenes.acting_effects import Moved, acting, assumed
from palpate.scenes.effect_registry import EFFECTS, ELASTIC, FINITE_ELEMENTS, NOT_STEPPED, RESERVED, of_law
from palpate.scenes.scene import RELAXED, bodies_in

FORM_WORDS = {"solid": "a body with tetrahedra", "surface": "a surface alone", "sheet": "a body of kind sheet"}
ONE_STIFFNESS = ("springs", "shape_matching", "triangles")
"""Elastic effects that have one stiffness for all bodies of a scene."""
STRETCHED = ("structural_n_m", "shear_n_m", "bending_n_m")
"""Stiffnesses of springs that have no solid to take them from."""


def check_effects(place: str, scene: dict, bodies: dict) -> None:
    """Raise InputError, beginning with ``place``, for effects that exclude, lack or do not suit each other or a body.

    scene : its complete entry; bodies : the entries of the config, by name
    """
    moved = assumed(scene, bodies[scene["body"]])
    names, form = _acting(place, scene, moved), moved.form
    elastic = next(name for name in names if name in ELASTIC)
    if elastic in FINITE_ELEMENTS and elastic != of_law(moved.law):
        raise InputError(
            f"{place}.effects names {elastic}, and the law of {scene['body']} is {moved.law}; "
            f"name {of_law(moved.law)}, or give {scene['body']} another law."
        )
    where = f"{place} says effects: auto, which calls for" if scene["effects"] == "auto" else f"{place}.effects names"
    for name in [elastic, *(name for name in names if name != elastic and name not in scene.get("own", {}))]:
        entry = EFFECTS[name]
        if form not in entry.forms:
            wanted = " or ".join(FORM_WORDS[each] for each in entry.forms)
            suiting = " or ".join(other for other in ELASTIC if form in EFFECTS[other].forms)
            remedy = f"name {suiting}" if name == elastic else f"leave {name} out"
            raise InputError(
                f"{where} {name}, which needs {wanted}, and {scene['body']} is moved as {FORM_WORDS[form]}; {remedy}."
            )
        if elastic not in entry.elastic:
            raise InputError(
                f"{where} {name}, which works with {' or '.join(entry.elastic)}, and the elastic effect is {elastic}; "
                f"name one of these for it, or leave {name} out."
            )
    _check_integrator(place, scene, elastic, names)
    _check_settings(place, scene, elastic, form, names)
    _check_stiffness(place, scene, bodies, elastic)


def _check_stiffness(place: str, scene: dict, bodies: dict, elastic: str) -> None:
    """Raise InputError for several stiffnesses where the elastic effect has one."""
    first = bodies[scene["body"]]
    for body in bodies_in(scene):
        for key in ["thickness_m", *(("young_pa", "poisson") if elastic in ONE_STIFFNESS else ())]:
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


def _acting(place: str, scene: dict, moved: Moved) -> list[str]:
    """Return the effects that a scene lists or, with auto, calls for; InputError if they cannot be."""
    for name in scene.get("own", {}):
        if name in EFFECTS or name in RESERVED:
            raise InputError(f"{place}.own.{name} has a name that palpate uses itself; call it something else.")
    if scene["effects"] != "auto":
        _check_listed(place, scene, scene["effects"])
    return acting(scene, moved, place)


def _check_listed(place: str, scene: dict, names: list[str]) -> None:
    """Raise InputError for effects that are unknown, not described or let go, and unless exactly one is elastic."""
    if found := describe_unknown(names, [*scene.get("own", {}), *EFFECTS]):
        raise InputError(f"{place}.effects names {found}")
    elastic = [name for name in names if name in ELASTIC]
    if len(elastic) != 1:
        raise InputError(
            f"{place}.effects must name exactly one of {', '.join(ELASTIC)}, but names "
            f"{' and '.join(elastic) or 'none'}; name one, or write effects: auto."
        )
    for name in names:
        if name in ("held", "bed") and not scene["held"]:
            raise InputError(f"{place}.effects names {name}, and the scene says held: false; remove one of them.")
        if name in EFFECTS and EFFECTS[name].settings is None and name not in scene:
            raise InputError(f"{place}.effects names {name}, and the scene does not describe it; add a block {name}.")


def _check_integrator(place: str, scene: dict, elastic: str, names: list[str]) -> None:
    """Raise InputError for an integrator that does not suit the elastic effect, or the block of another."""
    other = next((name for name in (*RELAXED, "touching") if name in scene and name != scene["integrator"]), None)
    if other:
        raise InputError(
            f"{place}.{other} describes steps, and the integrator is {scene['integrator']}; choose {other}, or leave "
            "the block out."
        )
    if scene["integrator"] in RELAXED and elastic not in (LAWS[0], "triangles"):
        raise InputError(
            f"{place}.integrator is {scene['integrator']}, which steps {LAWS[0]} elements or triangles, and the "
            f"elastic effect is {elastic}; choose one of them, or another integrator."
        )
    if scene["integrator"] == "touching":
        _check_touching(place, scene, elastic, names)
    if unknown := [name for name in names if name in NOT_STEPPED.get(scene["integrator"], ())]:
        raise InputError(
            f"{place}.integrator is {scene['integrator']}, which has no part for {unknown[0]}; leave that out, or "
            "choose backward_euler."
        )
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


def _check_touching(place: str, scene: dict, elastic: str, names: list[str]) -> None:
    """Raise InputError for a scene that is no held body at rest, of finite elements under instruments that move."""
    contact = scene.get("contact", {})
    tools = contact.get("instruments", [])
    reason = (
        (f"the elastic effect is {elastic}" if elastic not in FINITE_ELEMENTS else "")
        or ("nothing holds the body" if "held" not in names else "")
        or ("bodies touch each other or themselves" if contact.get("self_contact") or scene.get("others") else "")
        or (f"the start is {scene['start']}" if scene["start"] != "rest" else "")
        or ("contact pushes out what overlaps" if contact.get("push_out") else "")
        or ("no instrument moves" if "contact" not in names or not any(each.get("times_s") for each in tools) else "")
    )
    if reason:
        raise InputError(
            f"{place}.integrator is touching, for a held body of finite elements under instruments that move, and "
            f"{reason}; choose backward_euler."
        )


def _check_settings(place: str, scene: dict, elastic: str, form: str, names: list[str]) -> None:
    """Raise InputError for blocks that do not suit the elastic effect or the body."""
    if "cut" in names:
        _check_cut(place, scene, elastic, names)
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


def _check_cut(place: str, scene: dict, elastic: str, names: list[str]) -> None:
    """Raise InputError for a cut that comes too late, and for lips that contact or springs have no part for."""
    cut = scene["cut"]
    late = max(stroke["at_s"] for stroke in (cut, *cut.get("more", [])))
    if late >= scene["duration_s"]:
        raise InputError(
            f"{place}.cut begins at {late:g} s, and the scene ends at {scene['duration_s']:g} s; let it begin earlier."
        )
    doubled = (
        ("contact touches faces" if "contact" in names else "")
        or ("springs are edges" if elastic == "springs" else "")
        or ("other bodies touch faces" if scene.get("others") else "")
    )
    if cut["way"] == "virtual_nodes" and doubled:
        raise InputError(f"{place}.cut.way is virtual_nodes, and {doubled} of the mesh; say split_faces.")
    projected = next((name for name in ("contact", "hooks") if name in names), "")
    if projected and scene["integrator"] in RELAXED:
        raise InputError(
            f"{place}.integrator is {scene['integrator']}, which has no part for cut and {projected} together; leave "
            "one of them out, or choose backward_euler."
        )
    if "contact" in names and scene.get("contact", {}).get("self_contact"):
        raise InputError(
            f"{place}.contact.self_contact is true, and the lips of a cut begin in touch; set it to false, or leave "
            "cut out."
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


def check_loads(place: str, scene: dict) -> None:
    """Raise InputError, naming ``place``, for a load that may fall between two steps, and a hook of two kinds."""
    hooks = {f"hooks[{i}]": (hook, "pull_s") for i, hook in enumerate(scene.get("hooks", []))}
    loads = {f"push.loads[{i}]": (load, "press_s") for i, load in enumerate(scene.get("push", {}).get("loads", []))}
    for name, (load, rise) in (loads | hooks).items():
        lasts = load[rise] + load["hold_s"] + load["release_s"]
        if scene["step_s"] >= lasts:
            raise InputError(
                f"{place}.step_s is {scene['step_s']:g}, and {name} lasts {lasts:g} s, so that no step "
                "may see it; give a shorter step, or a longer load."
            )
        if "shift_m" in load and "force_n" in load:
            raise InputError(f"{place}.{name} has shift_m and force_n; give one of them.")


def check_instruments(place: str, scene: dict) -> None:
    """Raise InputError, naming ``place``, unless each path is complete and each name is different."""
    # the name that contact gives to the body, to its pieces, or to several bodies together
    together = re.escape(", ".join(dict.fromkeys(bodies_in(scene))))
    first: dict[str, str] = {}
    for number, tool in enumerate(scene.get("contact", {}).get("instruments", [])):
        where = f"{place}.contact.instruments[{number}]"
        times, shifts = tool.get("times_s", []), tool.get("shifts_m", [])
        if len(times) != len(shifts):
            raise InputError(
                f"{where}.times_s has {len(times)} entries, and shifts_m has {len(shifts)}; give one shift for each "
                "time."
            )
        for earlier, later in pairwise(times):
            if later <= earlier:
                raise InputError(f"{where}.times_s has {later:g} after {earlier:g}; give times in increasing order.")
        name = tool.get("name", f"{tool['kind']}_{number}")
        if re.fullmatch(rf"{together}(_\d+)?", name):
            raise InputError(f"{where} is called {name}, as a body is; give it a name of its own.")
        if name in first:
            raise InputError(f"{where} is called {name}, as {first[name]} is; give it a name of its own.")
        first[name] = f"instruments[{number}]"
