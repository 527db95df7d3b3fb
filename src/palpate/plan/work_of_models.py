"""Say what measuring a family of models consists of: how its settings are prepared, and how long each is asked."""

from palpate.plan.work import Amounts, Case, Job


def fem(job: Job, case: Case) -> Amounts:
    """Count the settings of each level that is tried: the coarse, the middle if there is one, and the fine."""
    levels = case.sizes[job.wildcards["body"]].levels
    tried = {0: levels[0], 1: levels[1], len(levels) - 1: levels[-1]}
    grid = _grid(job, case)
    each = len(grid["iterations"]) + len(grid["tolerances"]) + 1
    asked = [case.solve_s(level.elements, i) * case.harder(job) for i, level in tried.items()]
    return {"asked_s": each * sum(case.asked_s(job.wildcards["body"], seconds) for seconds in asked)}


def detail(job: Job, case: Case) -> Amounts:
    """Count its settings, each of which stores the detail of every contact and learns from the samples."""
    grid = _grid(job, case)
    shares, tolerances = len(grid["training_shares"]), len(grid.get("tolerances", ()))
    return _learnt(job, case, shares + len(grid.get("iterations", ())) + 3 * tolerances)


def stored(job: Job, case: Case) -> Amounts:
    """Count what is read and turned of the compliance; answers take no simulation."""
    amounts = _learnt(job, case, 1)
    return amounts | {"asked_s": case.config["tradeoff"]["budget_s"]}


def regression(job: Job, case: Case) -> Amounts:
    """Count two models of so many shares of the samples."""
    return _learnt(job, case, 2 * len(_grid(job, case)["training_shares"]))


def modes(job: Job, case: Case) -> Amounts:
    """Count the numbers of modes, and one more."""
    return _learnt(job, case, len(_grid(job, case)["modes"]) + 1)


def paper(job: Job, case: Case) -> Amounts:
    """Count the shares for each kind of feature and of weights, and the neighbours of the ordered ones."""
    from palpate.enrichment.blend_kinds import FEATURES, WEIGHTS

    grid, named = _grid(job, case), case.config["tradeoff"]["models"]
    kinds = [f"{features}_{weights}" for features in FEATURES for weights in WEIGHTS]
    kinds = [kind for kind in kinds if named is None or kind in named]
    ordered = sum(kind.startswith("ordered") for kind in kinds)
    return _learnt(job, case, len(kinds) * len(grid["training_shares"]) + ordered * len(grid["neighbours"]))


def springs(job: Job, case: Case) -> Amounts:
    """Count equilibria of the fits of four models, and the time that each number of iterations is asked."""
    grid, size = _grid(job, case), case.sizes[job.wildcards["body"]]
    uniform, nodal = grid["evaluations_uniform"], grid["evaluations_nodal"]
    train = case.config["bodies"][job.wildcards["body"]]["train"]
    fits = train * size.coarse.elements * (4 * uniform + 2 * nodal)
    settings = 4 * len(grid["iterations"])
    if len(size.levels) > 2:
        fits += grid["middle_samples"] * size.levels[1].elements * uniform
        settings += len(grid["middle_iterations"])
    peak = case.config["regimes"][job.wildcards["regime"]]["peak_of_size"]
    return {"fits": fits * (0.5 + 10.0 * peak), "asked_s": settings * case.config["tradeoff"]["budget_s"]}


def shapes(job: Job, case: Case) -> Amounts:
    """Count the steps of particles in the fits, and the time that each combination is asked."""
    grid, nodes = _grid(job, case), case.sizes[job.wildcards["body"]].coarse.nodes
    steps = sum(each["steps"] for each in grid["combinations"])
    fits = grid["samples"] * grid["evaluations"] * steps * nodes
    return {"fits": fits, "asked_s": len(grid["combinations"]) * case.config["tradeoff"]["budget_s"]}


FAMILIES = {
    "fem": fem,
    "detail_correction": detail,
    "warped_compliance": stored,
    "linear_fem": stored,
    "ridge": regression,
    "pod_rbf": modes,
    "interpolation": lambda job, case: _learnt(job, case, 1),
    "paper_enrichment": paper,
    "mass_spring": springs,
    "shape_matching": shapes,
}
"""The work of each family of models; a user's own is not known before it has run."""


def _grid(job: Job, case: Case) -> dict:
    return case.config["tradeoff"]["settings"][job.wildcards["family"]]


def _learnt(job: Job, case: Case, settings: int) -> Amounts:
    """Count ``settings`` on top of a coarse simulation, or of none for what stores its answers."""
    body = job.wildcards["body"]
    size, train = case.sizes[body], case.config["bodies"][body]["train"]
    asked = case.asked_s(body, case.solve_s(size.coarse.elements, 0) * case.harder(job))
    return {
        "asked_s": settings * asked,
        "learnt": float(settings * train * size.fine.surface),
        "stored": 9.0 * settings * size.contacts * size.fine.surface,
    }
