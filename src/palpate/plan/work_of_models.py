"""Say what measuring a family of models consists of: how its settings are prepared, and how long each is asked."""

from palpate.plan.work import QUADRATIC, Amounts, Case, Job


def fem(job: Job, case: Case) -> Amounts:
    """Count the settings of each level and order: of the finest quadratic elements there are few."""
    levels, grid = case.sizes[job.wildcards["body"]].levels, _grid(job, case)
    caps, warm, loose = len(grid["iterations"]), len(grid["warm_iterations"]), len(grid["tolerances"])
    each, fewest = 2 * (warm + loose) + caps + loose + 1, 1 + len(grid["finest_warm_iterations"])
    solves = [case.solve_s(level.elements, i) * case.harder(job) for i, level in enumerate(levels)]
    linear = sum(each * case.asked_s(seconds) for seconds in solves)
    *middle, last = [case.asked_s(QUADRATIC * seconds) for seconds in solves]
    return {"asked_s": linear + each * sum(middle) + fewest * last}


def fast(job: Job, case: Case) -> Amounts:
    """Count the settings of each level, of which frames before are found once for each sample."""
    levels, grid = case.sizes[job.wildcards["body"]].levels, _grid(job, case)
    each = sum(len(grid[name]) for name in ("iterations", "linear_iterations", "tolerances"))
    total = 0.0
    for i in range(max(0, len(levels) - grid["levels"]), len(levels)):
        warm = len(grid["finest_frame_iterations" if i == len(levels) - 1 else "frame_iterations"])
        solve = QUADRATIC * case.solve_s(levels[i].elements, i) * case.harder(job)
        total += (each + warm + (warm > 0)) * case.asked_s(solve)
    return {"asked_s": total}


def local(job: Job, case: Case) -> Amounts:
    """Count the settings of each mesh as if they were coarse ones, and the meshes of all contacts."""
    grid, size = _grid(job, case), case.sizes[job.wildcards["body"]]
    meshes = [mesh for mesh in grid["meshes"] if mesh["depth"] < len(size.levels)]
    each = len(grid["warm_iterations"]) + len(grid["tolerances"])
    solve = case.solve_s(size.coarse.elements, 0) * case.harder(job)
    asked = sum(each * case.asked_s(4 ** mesh["order"] * solve) for mesh in meshes)
    return {"asked_s": asked, "meshes": float(len(meshes) * case.config["tradeoff"]["contacts"])}


def reduced(job: Job, case: Case) -> Amounts:
    """Count the contacts that are asked for, all where more than a split's are, and the kinds of models of each."""
    grid, share = _grid(job, case), 1.0 if case.config["tradeoff"]["training_contacts_of"] else 0.4
    contacts = share * case.config["tradeoff"]["contacts"]
    kinds = len(grid["rings"]) + len(grid["tolerances"]) + 1
    asked = kinds * len(grid["targets"]) * case.config["tradeoff"]["budget_s"]
    return {"contact_nodes": contacts * reduced_nodes(job, case, grid["nodes"]), "asked_s": asked}


def reduced_nodes(job: Job, case: Case, most: int) -> int:
    """Return the nodes of quadratic elements of the level that is reduced: the finest that has ``most`` of them."""
    sizes = [level.refined().nodes for level in case.sizes[job.wildcards["body"]].levels]
    return max([size for size in sizes if size <= most], default=sizes[0])


def galerkin(job: Job, case: Case) -> Amounts:
    """Count the training samples' volumes, and the modes that all settings choose cells for."""
    grid, trained = _grid(job, case), case.trained()
    nodes = reduced_nodes(job, case, grid["nodes"])
    kinds = [min(count, trained) for count in grid["modes"]] + [trained] * (len(grid["tolerances"]) - 1)
    return {"volumes": trained * nodes, "modes": sum(kinds) * nodes}


def corrected(job: Job, case: Case) -> Amounts:
    """Count the coarse answers, and the shares of the samples with the last of them."""
    return _learnt(job, case, _coarse(case) + 1 + len(_grid(job, case)["training_shares"]))


def stored(job: Job, case: Case) -> Amounts:
    """Count what is read of the compliance and learnt; answers take no simulation."""
    amounts = _learnt(job, case, len(_grid(job, case).get("training_shares", [1])))
    return amounts | {"asked_s": case.config["tradeoff"]["budget_s"]}


def staged(job: Job, case: Case) -> Amounts:
    """Count the answers of a coarse simulation to what the bounds are found on, and the time that is asked."""
    solve = case.solve_s(case.sizes[job.wildcards["body"]].coarse.elements, 0) * case.harder(job)
    each = case.asked_s(solve) * len(_grid(job, case)["asked_errors"])
    return {"asked_s": case.trained() * solve + each}


def regression(job: Job, case: Case) -> Amounts:
    """Count two models, each with all coarse answers and with so many shares of the samples."""
    return _learnt(job, case, 2 * (_coarse(case) + len(_grid(job, case)["training_shares"]) - 1))


def modes(job: Job, case: Case) -> Amounts:
    """Count the coarse answers, and the numbers of modes."""
    return _learnt(job, case, _coarse(case) + len(_grid(job, case)["modes"]))


def paper(job: Job, case: Case) -> Amounts:
    """Count coarse answers and shares for each kind of feature and of weights, and the neighbours of ordered ones."""
    from palpate.models.enrichment.features import FEATURES
    from palpate.models.enrichment.paper_enrichment import WEIGHTS

    grid, named = _grid(job, case), case.config["tradeoff"]["models"]
    kinds = [f"{features}_{weights}" for features in FEATURES for weights in WEIGHTS]
    kinds = [kind for kind in kinds if named is None or kind in named]
    ordered = sum(kind.startswith("ordered") for kind in kinds)
    each = _coarse(case) + len(grid["training_shares"]) - 1
    return _learnt(job, case, len(kinds) * each + ordered * len(grid["neighbours"]))


def springs(job: Job, case: Case) -> Amounts:
    """Count equilibria of the fits of four models, and the time that each number of iterations is asked."""
    grid, size = _grid(job, case), case.sizes[job.wildcards["body"]]
    uniform, nodal = grid["evaluations_uniform"], grid["evaluations_nodal"]
    fits = case.trained() * size.coarse.elements * (4 * uniform + 2 * nodal)
    settings = 4 * len(grid["iterations"])
    if len(size.levels) > 2:
        fits += grid["middle_samples"] * size.levels[1].elements * uniform
        settings += len(grid["middle_iterations"])
    return {"fits": fits * (0.5 + 10.0 * case.peak(job)), "asked_s": settings * case.config["tradeoff"]["budget_s"]}


def shapes(job: Job, case: Case) -> Amounts:
    """Count the steps of particles in the fits, and the time that each combination is asked."""
    grid, nodes = _grid(job, case), case.sizes[job.wildcards["body"]].coarse.nodes
    steps = sum(each["steps"] for each in grid["combinations"])
    fits = grid["samples"] * grid["evaluations"] * steps * nodes
    return {"fits": fits, "asked_s": len(grid["combinations"]) * case.config["tradeoff"]["budget_s"]}


def relaxed(job: Job, case: Case) -> Amounts:
    """Count the time that each setting is asked: some go through all elements as often as there are steps."""
    grid = _grid(job, case)
    return {"asked_s": sum(map(len, grid.values())) * case.config["tradeoff"]["budget_s"]}


FAMILIES = {
    "fem": fem,
    "fast_fem": fast,
    "fem_local": local,
    "contact_modes": reduced,
    "pod_galerkin": galerkin,
    "detail_correction": corrected,
    "warped_compliance": stored,
    "linear_fem": stored,
    "linear_residual": stored,
    "cascade": staged,
    "ridge": regression,
    "pod_rbf": modes,
    "interpolation": lambda job, case: _learnt(job, case, _coarse(case)),
    "paper_enrichment": paper,
    "mass_spring": springs,
    "shape_matching": shapes,
    "relaxed": relaxed,
    "mujoco_flex": lambda job, case: {},
    "newton_vbd": lambda job, case: {},
    "pod_of_loads": lambda job, case: {},
}
"""The work of each family of models; a user's own is not known before it has run."""


def _coarse(case: Case) -> int:
    return len(case.config["tradeoff"]["settings"]["coarse_answers"])


def _grid(job: Job, case: Case) -> dict:
    return case.config["tradeoff"]["settings"].get(job.wildcards["family"], {})


def _learnt(job: Job, case: Case, settings: int) -> Amounts:
    """Count ``settings`` on top of a coarse simulation, or of none for what stores its answers."""
    size, contacts = case.sizes[job.wildcards["body"]], case.config["tradeoff"]["contacts"]
    asked = case.asked_s(case.solve_s(size.coarse.elements, 0) * case.harder(job))
    return {
        "asked_s": settings * asked,
        "learnt": settings * case.trained() * size.fine.surface,
        "stored": 9.0 * settings * contacts * size.fine.surface,
    }
