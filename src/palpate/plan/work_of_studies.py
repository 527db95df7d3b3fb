"""Say what the work of the rules of single studies consists of."""

from collections.abc import Callable

from palpate.plan.work import QUADRATIC, Amounts, Case, Job
from palpate.plan.work_of_models import reduced_nodes

MOST_NODES = 12_000
"""Of the level that a portable model is made from, as the schema has it for contact modes."""
BETWEEN = 40
"""Contacts that take as long as the places between them, where the error of a portable model is measured."""


def _scene(job: Job, case: Case) -> Amounts:
    """Count elements times steps, of all bodies."""
    from palpate.scenes.scene import bodies_in

    scene = case.config["scenes"][job.wildcards["scene"]]
    elements = sum(case.sizes[body].levels[scene["level"]].elements for body in bodies_in(scene))
    # how many substeps auto takes is known when the scene runs
    parts = scene["substeps"] if isinstance(scene.get("substeps"), int) else 1
    return {"element_steps": parts * scene["duration_s"] / scene["step_s"] * elements}


def _compared(job: Job, case: Case) -> Amounts:
    """Count the solutions of all presses of all variants of a body, on the last of three levels."""
    from palpate.studies.law.settings import changes_of

    body, depths = job.wildcards["body"], len(case.config["law"]["depths"])
    tried, size = changes_of(case.config, body), case.sizes[body]
    regions = bool(case.config["bodies"][body].get("regions"))
    finest = size.fine if len(size.levels) > 2 else size.fine.refined()
    # one law and one ratio are the body's own; above a region there is one contact more
    variants = max(len(tried["laws"]), 1) + max(len(tried["poissons"]) - 1, 0) + regions
    solutions = variants * (tried["contacts"] + regions) * depths
    return {"solve_s": QUADRATIC * max(solutions, 1) * case.solve_s(finest.elements, 1)}


def _any_load(job: Job, case: Case) -> Amounts:
    """Count the converged answers of the fine operator to three kinds of loads; models take as long again at most."""
    size, asked = case.sizes[job.wildcards["body"]], case.config["tradeoff"]["any_load"]
    return {"solve_s": QUADRATIC * 3 * asked["samples"] * case.solve_s(size.fine.elements, 1) * case.harder(job)}


def _beyond_design(job: Job, case: Case) -> Amounts:
    """Count the solves of six presses of each contact, of which some have no answer; models take less."""
    size, asked = case.sizes[job.wildcards["body"]], case.config["tradeoff"]["beyond_design"]
    return {"solve_s": QUADRATIC * 6 * asked["samples"] * case.solve_s(size.fine.elements, 1) * case.harder(job)}


def _exported(job: Job, case: Case) -> Amounts:
    """Count the contacts of a portable model, and as many as the places between them take, times their nodes."""
    return {"contact_nodes": (case.config["press"]["contacts"] + BETWEEN) * reduced_nodes(job, case, MOST_NODES)}


def _trial(job: Job, case: Case) -> Amounts:
    """Count elements times steps, of which there are more, the less halving them may change a motion."""
    from palpate.scenes.scene import bodies_in

    scene, own = _followed(job, case)
    # steps of second order, where nothing is touched or yields, need the square root of their number
    first = {"contact", "plasticity"} & set(scene)
    steps = own["frames"] / own["change_of_peak"] if first else 5.0 * own["frames"] / own["change_of_peak"] ** 0.5
    return {"element_steps": steps * _elements(scene, own, case) * len(bodies_in(scene))}


def _elsewhere(job: Job, case: Case) -> Amounts:
    """Count elements times steps of a reference at each place: one a frame, halved twice."""
    scene, own = _followed(job, case)
    return {"element_steps": 7.0 * own["frames"] * own["elsewhere"]["places"] * _elements(scene, own, case)}


def _followed(job: Job, case: Case) -> tuple[dict, dict]:
    """Return a scene, and how it is followed."""
    name, dynamic = job.wildcards["scene"], case.config["dynamic"]
    return case.config["scenes"][name], dynamic | dynamic.get("scenes", {}).get(name, {})


def _elements(scene: dict, own: dict, case: Case) -> float:
    """Return the number of elements of a scene's reference."""
    levels = case.sizes[scene["body"]].levels
    last = own.get("level", max(scene["level"], 1))
    # a sheet has one level, and half of it
    elements = levels[min(last, len(levels) - 1)].elements
    if last >= len(levels) and case.config["bodies"][scene["body"]]["kind"] != "sheet":
        elements *= 8 ** (last + 1 - len(levels))
    return elements


def _time_methods(job: Job, case: Case) -> Amounts:
    surface = case.sizes[job.wildcards["body"]].fine.surface
    return {"calls": float(case.config["timing"]["repeats"] * surface)}


def _complexity(job: Job, case: Case) -> Amounts:
    return {"samples": float(sum(case.config["enrichment"]["complexity_samples"]))}


def _premises(job: Job, case: Case) -> Amounts:
    """Count the splits of all premises; the study's own samples are one for each body."""
    settings, bodies = case.config["enrichment"]["premises"], case.config["bodies"].values()
    return {"fits": float(settings["splits"] * (sum("train" in body for body in bodies) + len(settings["cases"])))}


def _weighed(job: Job, case: Case) -> Amounts:
    bodies = sum(body["kind"] == "ct" for body in case.config["bodies"].values())
    return {"surface_nodes": float(bodies * sum(case.config["ct"]["surface_nodes"]))}


def _imaged(job: Job, case: Case) -> Amounts:
    """Count the samples of a picture that rays make, and the voxels of the synthetic scans."""
    imaging = case.config["ct"]["imaging"]
    return {"samples": imaging["pixels"] ** 2 / imaging["voxel_m"], "voxels": imaging["voxel_m"] ** -3}


def _spring_steps(case: Case) -> float:
    springs = case.config["springs"]
    return springs["duration_s"] / springs["step_s"]


def _spring_reference(job: Job, case: Case) -> Amounts:
    return {"steps": _spring_steps(case)}


def _spring_floor(job: Job, case: Case) -> Amounts:
    return {"steps": _spring_steps(case) * case.config["springs"]["floor"]["evaluations"]}


def _spring_fit(job: Job, case: Case) -> Amounts:
    """Count the steps of all motions that a search evaluates."""
    searches, method = case.config["springs"]["searches"], job.wildcards["method"]
    counts = {
        "genetic": searches["seeds"] * searches["population"] * searches["generations"],
        "cma_es": searches["seeds"] * searches["cma_es_evaluations"],
        **dict.fromkeys(("gradient", "gradient_smooth", "gradient_all"), searches["gradient_evaluations"]),
    }
    return {"steps": counts.get(method, 0) * _spring_steps(case)}


def _organ(job: Job, case: Case) -> Amounts:
    """Count the motions of the fitted presses that all searches evaluate, times the coarse elements."""
    settings, size = case.config["organ_springs"], case.sizes[job.wildcards["body"]]
    searches = settings["searches"]
    seeded = searches["population"] * searches["generations"] / 2 + searches["cma_es_evaluations"]
    tried = searches["seeds"] * seeded + 12 * searches["gradient_evaluations"]
    presses = settings["fitted"] * len(settings["volume_force"])
    return {"element_motions": float(tried * presses * size.levels[0].elements)}


def _scaled(job: Job, case: Case) -> Amounts:
    sizes = case.config["scaling"].get(job.wildcards["component"], [])
    elements = [628 * 8**size for size in sizes] if job.wildcards["component"] == "fem" else sizes
    return {"size": float(sum(elements))}


def _collided(job: Job, case: Case) -> Amounts:
    settings = case.config["collision"]
    return {"frames": float(settings["frames"] * 4 ** settings["refinements"] * (len(settings["depths"]) + 4))}


def _collision_precision(job: Job, case: Case) -> Amounts:
    """Count frames of stopped trees, and placements of bodies that are apart, times structures and triangles."""
    settings = case.config["collision"]
    stopped, apart, size = settings["stopped"], settings["apart"], 4 ** settings["refinements"]
    kinds = (len(stopped["depths"]) + 2) * (len(stopped["layers"]) + 1)
    return {
        "frames": float(stopped["frames"] * kinds * size),
        "placements": float(apart["placements"] * len(apart["gaps_m"]) * (len(settings["depths"]) + 8) * size),
    }


def _collision_scaling(job: Job, case: Case) -> Amounts:
    return {"triangles": float(sum(case.config["collision"]["triangles"]))}


def _shapes_timed(job: Job, case: Case) -> Amounts:
    return {"repeats": float(case.config["shape_matching"]["shape_matching_timing"]["repeats"])}


STUDIES: dict[str, Callable[[Job, Case], Amounts]] = {
    **dict.fromkeys(("simulate_scene", "leave_out_effects", "time_effects"), _scene),
    **dict.fromkeys(("simulate_dynamic_reference", "measure_dynamic"), _trial),
    "measure_elsewhere": _elsewhere,
    "export_model": _exported,
    "compare_laws": _compared,
    "measure_any_load": _any_load,
    "measure_beyond_design": _beyond_design,
    "time_methods": _time_methods,
    "time_complexity": _complexity,
    "compare_premises": _premises,
    "tabulate_node_mass": _weighed,
    "measure_imaging": _imaged,
    "simulate_spring_reference": _spring_reference,
    "tabulate_spring_floor": _spring_floor,
    "fit_springs": _spring_fit,
    "fit_organ_springs": _organ,
    "measure_scaling": _scaled,
    "measure_collision": _collided,
    "measure_collision_precision": _collision_precision,
    "measure_collision_scaling": _collision_scaling,
    "time_shape_matching": _shapes_timed,
}
"""The work of the rules of one study."""
