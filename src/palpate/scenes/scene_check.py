"""Check a scene by its settings alone: its effects suit each other, its body and its integrator."""

import re
from collections.abc import Mapping
from itertools import pairwise

from palpate.bodies import material
from palpate.bodies.material import LAWS
from palpate.bodies.settings import Body
from palpate.effects.settings import Hook, Load, Springs
from palpate.errors import InputError
from palpate.scenes.acting_effects import BodyTraits, acting, assumed
from palpate.scenes.effect_registry import EFFECTS, FINITE_ELEMENTS, NOT_STEPPED, RESERVED
from palpate.scenes.settings import Scene

FORM_WORDS = {"solid": "a body with tetrahedra", "surface": "a surface alone", "sheet": "a body of kind sheet"}
ONE_STIFFNESS = ("springs", "shape_matching", "triangles")
"""Elastic effects that have one stiffness for all bodies of a scene."""
STRETCHED = ("structural_n_m", "shear_n_m", "bending_n_m")
"""Stiffnesses of springs that have no solid to take them from."""
RELAXED = ("xpbd", "projective_dynamics", "vertex_block_descent")
"""Integrators that relax elements one by one."""


def check_effects(place: str, scene: Scene, bodies: Mapping[str, Body]) -> None:
    """Raise InputError for effects that exclude or lack each other, or do not suit a body.

    place : of the scene in the settings, with which messages begin; bodies : by name
    """
    for name in scene.own:
        if name in EFFECTS or name in RESERVED:
            raise InputError(f"{place}.own.{name} has a name that palpate uses itself; call it something else.")
    traits = assumed(scene, bodies[scene.body])
    check_together(place, scene, traits)
    _check_stiffness(place, scene, bodies, acting(scene, traits)[0])


def check_together(place: str, scene: Scene, traits: BodyTraits) -> None:
    """Raise InputError for effects that exclude each other, or do not suit the bodies or the integrator."""
    if scene.springs is not None and scene.shape_matching is not None:
        raise InputError(f"{place} has both springs and shape_matching; keep one of them.")
    names, form = acting(scene, traits), traits.form
    elastic = names[0]
    for name in names:
        if name in scene.own:
            continue
        entry = EFFECTS[name]
        if form not in entry.forms:
            wanted = " or ".join(FORM_WORDS[each] for each in entry.forms)
            raise InputError(
                f"{place} has {name}, which needs {wanted}, and {scene.body} is moved as {FORM_WORDS[form]}; remove it."
            )
        if elastic not in entry.elastic:
            raise InputError(
                f"{place} has {name}, which works with {' or '.join(entry.elastic)}, and {elastic} holds the body "
                "together; remove one of them."
            )
    _check_integrator(place, scene, elastic, names)
    _check_settings(place, scene, elastic, form)


def _check_stiffness(place: str, scene: Scene, bodies: Mapping[str, Body], elastic: str) -> None:
    """Raise InputError for bodies of different stiffness or thickness where the elastic effect has only one."""
    reference = bodies[scene.body]
    for name in scene.bodies:
        for key in ["thickness_m", *(("young_pa", "poisson") if elastic in ONE_STIFFNESS else ())]:
            expected, actual = getattr(reference, key, 0.0), getattr(bodies[name], key, 0.0)
            if expected != actual:
                raise InputError(
                    f"{place}.others: {scene.body} has {key} {expected:g} and {name} {actual:g}; bodies of a scene "
                    f"with {elastic} must have the same stiffness and thickness: make them equal."
                )
        if elastic in ONE_STIFFNESS and getattr(bodies[name], "regions", None):
            raise InputError(
                f"{place}: {name} has regions, and {elastic} has one stiffness; take finite elements, or a body "
                "without regions."
            )


def _check_integrator(place: str, scene: Scene, elastic: str, names: list[str]) -> None:
    """Raise InputError for an integrator that does not suit the effects, and for settings of another integrator."""
    chosen = scene.integrator
    block = next((name for name in (*RELAXED, "touching") if getattr(scene, name) and name != chosen), None)
    if block:
        raise InputError(
            f"{place}.{block} describes steps, and the integrator is {chosen}; choose {block}, or leave the block out."
        )
    if chosen in RELAXED and elastic not in (LAWS[0], "triangles"):
        raise InputError(
            f"{place}.integrator is {chosen}, which steps {LAWS[0]} elements or triangles, and the elastic effect is "
            f"{elastic}; choose one of them, or another integrator."
        )
    if chosen == "touching":
        _check_touching(place, scene, elastic, names)
    if ignored := [name for name in names if name in NOT_STEPPED.get(chosen, ())]:
        raise InputError(
            f"{place}.integrator is {chosen}, which has no part for {ignored[0]}; leave that out, or choose "
            "backward_euler."
        )
    if chosen == "goal_position" and elastic != "shape_matching":
        raise InputError(
            f"{place}.integrator is goal_position, which needs shape_matching, and the elastic effect is {elastic}; "
            "describe shape_matching, or choose another integrator."
        )
    if chosen != "goal_position" and elastic == "shape_matching":
        raise InputError(
            f"{place}.integrator is {chosen}, and shape_matching needs goal_position; choose that, or leave "
            "shape_matching out."
        )


def _check_touching(place: str, scene: Scene, elastic: str, names: list[str]) -> None:
    """Raise InputError unless the scene is a held body of finite elements at rest under moving instruments."""
    contact = scene.contact
    reason = (
        (f"the elastic effect is {elastic}" if elastic not in FINITE_ELEMENTS else "")
        or ("nothing holds the body" if "held" not in names else "")
        or ("bodies touch each other or themselves" if (contact and contact.self_contact) or scene.others else "")
        or (f"the start is {scene.start}" if scene.start != "rest" else "")
        or ("contact pushes out what overlaps" if contact and contact.push_out else "")
        or ("no instrument moves" if contact is None or not any(tool.times_s for tool in contact.instruments) else "")
    )
    if reason:
        raise InputError(
            f"{place}.integrator is touching, for a held body of finite elements under instruments that move, and "
            f"{reason}; choose backward_euler."
        )


def _check_settings(place: str, scene: Scene, elastic: str, form: str) -> None:
    """Raise InputError for blocks that do not suit the elastic effect or the body."""
    if scene.cut is not None:
        _check_cut(place, scene, elastic)
    if scene.prony is not None and (flaw := material.prony_fault(scene.prony)):
        raise InputError(f"{place}.prony.{flaw}.")
    if elastic == "springs":
        _check_springs(place, scene.springs or Springs(), form)
    if scene.shape_matching is None:
        return
    clusters = scene.shape_matching.clusters
    if clusters.kind == "cubes" and clusters.edge_m is None:
        raise InputError(f"{place}.shape_matching.clusters lacks edge_m; give the edge of the cubes in metres.")
    if clusters.kind in ("tetrahedra", "each_tetrahedron") and form != "solid":
        raise InputError(
            f"{place}.shape_matching.clusters.kind is {clusters.kind}, and {scene.body} is moved as "
            f"{FORM_WORDS[form]}; choose cubes or one."
        )
    if scene.rayleigh is not None and scene.rayleigh.stiffness_s > 0:
        raise InputError(
            f"{place}.rayleigh.stiffness_s is above 0, and shape_matching has no stiffness matrix; set it to 0, "
            "or choose velocity_damping."
        )
    if scene.plasticity is not None and not 0.0 < scene.plasticity.max_strain < 1.0:
        raise InputError(
            f"{place}.plasticity.max_strain is {scene.plasticity.max_strain:g}; give a number between 0 and 1 for "
            "shape_matching."
        )


def _check_cut(place: str, scene: Scene, elastic: str) -> None:
    """Raise InputError for a cut after the scene's end, or one that does not suit other effects or the integrator."""
    assert scene.cut is not None
    begin_s = max(stroke.at_s for stroke in (scene.cut, *(scene.cut.more or [])))
    if begin_s >= scene.duration_s:
        raise InputError(
            f"{place}.cut begins at {begin_s:g} s, and the scene ends at {scene.duration_s:g} s; let it begin earlier."
        )
    reason = (
        ("contact touches faces" if scene.contact else "")
        or ("springs are edges" if elastic == "springs" else "")
        or ("other bodies touch faces" if scene.others else "")
    )
    if scene.cut.way == "virtual_nodes" and reason:
        raise InputError(f"{place}.cut.way is virtual_nodes, and {reason} of the mesh; say split_faces.")
    projected = "contact" if scene.contact else "hooks" if scene.hooks else ""
    if projected and scene.integrator in RELAXED:
        raise InputError(
            f"{place}.integrator is {scene.integrator}, which has no part for cut and {projected} together; leave "
            "one of them out, or choose backward_euler."
        )
    if scene.contact and scene.contact.self_contact:
        raise InputError(
            f"{place}.contact.self_contact is true, and the lips of a cut begin in touch; set it to false, or leave "
            "cut out."
        )


def _check_springs(place: str, springs: Springs, form: str) -> None:
    """Raise InputError for stiffnesses of the springs of a solid, and for lacking ones of a surface or a sheet."""
    values = {key: getattr(springs, key) for key in STRETCHED if getattr(springs, key) is not None}
    if form == "solid" and values:
        raise InputError(
            f"{place}.springs.{next(iter(values))} has no use: a solid's springs follow from its Young's modulus; "
            "leave the block empty, or set surface: true."
        )
    missing = [key for key in STRETCHED if key not in values]
    if form != "solid" and missing:
        raise InputError(
            f"{place}.springs lacks {missing[0]}, and {FORM_WORDS[form]} has no other stiffness; "
            "give it in N/m, 0 for none."
        )
    if form != "solid" and not any(values[key] > 0 for key in STRETCHED):
        raise InputError(f"{place}.springs has no stiffness above 0; give structural_n_m in N/m.")


def check_loads(place: str, scene: Scene) -> None:
    """Raise InputError, naming ``place``, for a load shorter than a step, and for a hook with both shift and force."""
    rises: dict[str, tuple[Hook | Load, float]] = {
        f"hooks[{i}]": (hook, hook.pull_s) for i, hook in enumerate(scene.hooks or [])
    }
    rises |= {f"push.loads[{i}]": (load, load.press_s) for i, load in enumerate(scene.pushes)}
    for name, (load, rise_s) in rises.items():
        length_s = rise_s + load.hold_s + load.release_s
        if scene.step_s >= length_s:
            raise InputError(
                f"{place}.step_s is {scene.step_s:g}, and {name} lasts {length_s:g} s, so that no step "
                "may see it; give a shorter step, or a longer load."
            )
    for i, hook in enumerate(scene.hooks or []):
        if hook.shift_m is not None and hook.force_n is not None:
            raise InputError(f"{place}.hooks[{i}] has shift_m and force_n; give one of them.")


def check_instruments(place: str, scene: Scene) -> None:
    """Raise InputError, naming ``place``, for an incomplete path of an instrument, and for a name that occurs twice."""
    # the name that contact gives to the body, to its pieces, or to several bodies together
    bodies = re.escape(", ".join(dict.fromkeys(scene.bodies)))
    taken: dict[str, str] = {}
    for number, tool in enumerate(scene.instruments):
        where = f"{place}.contact.instruments[{number}]"
        times, shifts = tool.times_s or [], tool.shifts_m or []
        if len(times) != len(shifts):
            raise InputError(
                f"{where}.times_s has {len(times)} entries, and shifts_m has {len(shifts)}; give one shift for each "
                "time."
            )
        for earlier, later in pairwise(times):
            if later <= earlier:
                raise InputError(f"{where}.times_s has {later:g} after {earlier:g}; give times in increasing order.")
        name = tool.name or f"{tool.kind}_{number}"
        if re.fullmatch(rf"{bodies}(_\d+)?", name):
            raise InputError(f"{where} is called {name}, as a body is; give it a name of its own.")
        if name in taken:
            raise InputError(f"{where} is called {name}, as {taken[name]} is; give it a name of its own.")
        taken[name] = f"instruments[{number}]"
