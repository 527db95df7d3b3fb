"""Say what the work of a job consists of: amounts by their names, which timings.yaml gives seconds for."""

from collections.abc import Callable
from dataclasses import dataclass, field

from palpate.plan.sizes import Size

Amounts = dict[str, float]

SOLVE_S = 5.6e-6
"""Seconds that a converged solve takes for each tetrahedron under small loads, on the machine of timings.yaml."""
LARGE = 3.3
"""How much longer solves take under a load that moves the body by its whole size."""
QUADRATIC = 4.0
"""How much longer a solve with quadratic elements takes than one with as many linear ones."""
DEEP = 0.06
"""Peak displacement, as a share of the size, that the pressure of a fingertip makes at most."""
FOLDS = 5
"""Into so many the contacts are dealt: one tests, one chooses settings."""


@dataclass(frozen=True)
class Job:
    """One job of a run: its rule, wildcards, log, threads, and the numbers of the jobs that it waits for."""

    rule: str
    wildcards: dict[str, str] = field(default_factory=dict)
    log: str = ""
    threads: int = 1
    after: tuple[int, ...] = ()


@dataclass(frozen=True)
class Case:
    """All that the work of a job follows from: the settings, and the sizes of their bodies by name."""

    config: dict
    sizes: dict[str, Size]

    def is_point(self, job: Job) -> bool:
        """Return whether the loads of a job's regime are paper 1's forces on single nodes."""
        return job.wildcards["regime"] in self.config.get("enrichment", {}).get("regimes", {})

    def samples(self, job: Job) -> int:
        """Return how many samples the body of a job gets in its regime."""
        if self.is_point(job):
            body = self.config["bodies"][job.wildcards["body"]]
            return body["train"] + body["test"]
        return self.config["tradeoff"]["contacts"] * len(self.config["tradeoff"]["presses"])

    def tested(self) -> float:
        """Return how many samples a split of the trade-off tests on; as many choose settings."""
        return self.config["tradeoff"]["contacts"] * len(self.config["tradeoff"]["presses"]) / FOLDS

    def trained(self) -> float:
        """Return how many samples a split of the trade-off trains on."""
        return (FOLDS - 2) * self.tested()

    def peak(self, job: Job) -> float:
        """Return the peak displacement of a job's regime as a share of the body's size."""
        if self.is_point(job):
            return self.config["enrichment"]["regimes"][job.wildcards["regime"]]["peak_of_size"]
        return self.config["regimes"][job.wildcards["regime"]].get("peak_of_size", DEEP)

    def harder(self, job: Job) -> float:
        """Return how many times as long solves take under the loads of a job's regime as under small ones."""
        return 1.0 + LARGE * (self.peak(job) - 0.02)

    def solve_s(self, tetrahedra: int, level: int) -> float:
        """Estimate a converged solve [s]; on the coarsest level a factor of its stiffness grows faster than it does."""
        return SOLVE_S * tetrahedra * (1.0 if level else max(1.0, tetrahedra / 1000) ** 0.35)

    def asked_s(self, seconds: float) -> float:
        """Estimate how long a setting is asked [s] whose answers take ``seconds``: once a sample, or a budget."""
        return max(self.config["tradeoff"]["budget_s"], 2.0 * self.tested() * seconds)


def kind_of(job: Job, case: Case) -> str:
    """Return the entry of timings.yaml that a job falls under: its rule, and what its time differs much by."""
    more = {
        "make_body": lambda: case.config["bodies"][job.wildcards["body"]]["kind"],
        "measure_models": lambda: job.wildcards["family"],
        "measure_scaling": lambda: job.wildcards["component"],
        "fit_springs": lambda: f"{job.wildcards['method']} {job.wildcards['force']}",
        "try_hard_cases": lambda: job.wildcards["family"],
        **dict.fromkeys(("simulate_dynamic_reference", "measure_dynamic"), lambda: _touches(job, case)),
        **dict.fromkeys(("simulate_scene", "leave_out_effects", "time_effects"), lambda: _moves_by(job, case)),
    }
    return f"{job.rule} {more[job.rule]()}" if job.rule in more else job.rule


def amounts(job: Job, case: Case) -> Amounts:
    """Return the amounts of work of a job; of a rule that is not here, none."""
    from palpate.plan.work_of_studies import STUDIES

    found = (RULES | STUDIES).get(job.rule)
    return found(job, case) if found else {}


def _moves_by(job: Job, case: Case) -> str:
    found = _touches(job, case)
    return found if found == "contact" else case.config["scenes"][job.wildcards["scene"]]["integrator"]


def _touches(job: Job, case: Case) -> str:
    from palpate.scenes.acting_effects import has_contact

    return "contact" if has_contact(case.config["scenes"][job.wildcards["scene"]]) else "free"


def _size(job: Job, case: Case) -> Size:
    return case.sizes[job.wildcards["body"]]


def _body(job: Job, case: Case) -> Amounts:
    size = _size(job, case)
    return {"fine_tetrahedra": size.fine.elements, "remeshed": float(size.remeshed)}


def _compliance(job: Job, case: Case) -> Amounts:
    size, pressed = _size(job, case), float(job.wildcards["radius"]) > 0.0
    contacts = min(case.config["tradeoff"]["contacts"], size.contacts) if pressed else size.contacts
    slower = QUADRATIC if pressed else 1.0
    return {"columns": 3.0 * contacts * size.fine.elements * slower, "stored": 9.0 * contacts * size.fine.surface}


def _loads(job: Job, case: Case) -> Amounts:
    coarse = case.solve_s(_size(job, case).coarse.elements, 0)
    return {"solve_s": case.samples(job) * coarse * case.harder(job)}


def _presses(job: Job, case: Case) -> Amounts:
    middle = case.solve_s(_size(job, case).levels[-2].elements, 1)
    return {"solve_s": case.samples(job) * QUADRATIC * middle * case.harder(job)}


def _fine(job: Job, case: Case) -> Amounts:
    count, most = case.samples(job), case.config["solver"]["samples_per_job"]
    here = min(most, count - most * int(job.wildcards["batch"]))
    slower = 1.0 if case.is_point(job) else QUADRATIC
    return {"solve_s": slower * here * case.solve_s(_size(job, case).fine.elements, 1) * case.harder(job)}


def _fitted(job: Job, case: Case) -> Amounts:
    return {"sample_nodes": float(case.samples(job) * _size(job, case).fine.surface)}


def _truth(job: Job, case: Case) -> Amounts:
    finest = QUADRATIC * case.solve_s(_size(job, case).fine.refined().elements, 1)
    tested = min(FOLDS, len(case.config["tradeoff"]["splits"])) * case.tested()
    return {"solve_s": tested * finest * case.harder(job)}


def _models(job: Job, case: Case) -> Amounts:
    from palpate.plan.work_of_models import FAMILIES

    family = FAMILIES.get(job.wildcards["family"])
    return family(job, case) if family else {}


RULES: dict[str, Callable[[Job, Case], Amounts]] = {
    "make_body": _body,
    "compute_compliance": _compliance,
    "choose_loads": _loads,
    "choose_presses": _presses,
    "simulate_fine": _fine,
    "simulate_coarse": _loads,
    "subsample_coarse": _fitted,
    "assemble_database": _fitted,
    "evaluate_methods": _fitted,
    "sweep_sigma": _fitted,
    "draw_responses": _fitted,
    "simulate_truth": _truth,
    "measure_models": _models,
}
"""The work of the rules that most studies need."""
