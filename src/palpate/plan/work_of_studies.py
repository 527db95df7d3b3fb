"""Say what the work of the rules of single studies consists of."""

from collections.abc import Callable

from palpate.plan.work import QUADRATIC, Amounts, Case, Job


def _scene(job: Job, case: Case) -> Amounts:
    """Count elements times steps, of all bodies."""
    from palpate.scenes.contact_settings import bodies_in

    scene = case.config["scenes"][job.wildcards["scene"]]
    elements = sum(case.sizes[body].levels[scene["level"]].elements for body in bodies_in(scene))
    return {"element_steps": scene["duration_s"] / scene["step_s"] * elements}


def _compared(job: Job, case: Case) -> Amounts:
    """Count the solutions of all presses of all variants of a body, on the last of three levels."""
    law, size = case.config["law"], case.sizes[job.wildcards["body"]]
    finest = size.fine if len(size.levels) > 2 else size.fine.refined()
    solutions = (len(law["laws"]) + len(law["poissons"]) - 1) * law["contacts"] * len(law["depths"])
    return {"solve_s": QUADRATIC * max(solutions, 1) * case.solve_s(finest.elements, 1)}


def _trial(job: Job, case: Case) -> Amounts:
    """Count how often steps are halved until a motion changes little enough."""
    return {"steps": 1.0 / case.config["dynamic"]["change_of_peak"]}


def _time_methods(job: Job, case: Case) -> Amounts:
    surface = case.sizes[job.wildcards["body"]].fine.surface
    return {"calls": float(case.config["timing"]["repeats"] * surface)}


def _complexity(job: Job, case: Case) -> Amounts:
    return {"samples": float(sum(case.config["enrichment"]["complexity_samples"]))}


def _weighed(job: Job, case: Case) -> Amounts:
    bodies = sum(body["kind"] == "ct" for body in case.config["bodies"].values())
    return {"surface_nodes": float(bodies * sum(case.config["ct"]["surface_nodes"]))}


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
    share = searches["volume_share"] if job.wildcards["force"] == "volume" else 1.0
    return {"steps": share * counts.get(method, 0) * _spring_steps(case)}


def _scaled(job: Job, case: Case) -> Amounts:
    sizes = case.config["scaling"].get(job.wildcards["component"], [])
    elements = [628 * 8**size for size in sizes] if job.wildcards["component"] == "fem" else sizes
    return {"size": float(sum(elements))}


def _collided(job: Job, case: Case) -> Amounts:
    settings = case.config["collision"]
    return {"frames": float(settings["frames"] * 4 ** settings["refinements"] * (len(settings["depths"]) + 4))}


def _collision_scaling(job: Job, case: Case) -> Amounts:
    return {"triangles": float(sum(case.config["collision"]["triangles"]))}


def _shapes_timed(job: Job, case: Case) -> Amounts:
    return {"repeats": float(case.config["shape_matching"]["shape_matching_timing"]["repeats"])}


STUDIES: dict[str, Callable[[Job, Case], Amounts]] = {
    **dict.fromkeys(("simulate_scene", "leave_out_effects", "time_effects"), _scene),
    **dict.fromkeys(("simulate_dynamic_reference", "measure_dynamic"), _trial),
    "compare_laws": _compared,
    "time_methods": _time_methods,
    "time_complexity": _complexity,
    "tabulate_node_mass": _weighed,
    "simulate_spring_reference": _spring_reference,
    "tabulate_spring_floor": _spring_floor,
    "fit_springs": _spring_fit,
    "measure_scaling": _scaled,
    "measure_collision": _collided,
    "measure_collision_scaling": _collision_scaling,
    "time_shape_matching": _shapes_timed,
}
"""The work of the rules of one study."""
