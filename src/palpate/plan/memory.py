"""Estimate how much memory a job needs, and say how much the machine has left."""

from contextlib import suppress
from pathlib import Path

from palpate.plan.sizes import Size
from palpate.plan.work import Case, Job

JOB_MB = 250.0
"""What a job needs before it does anything: Python, its packages, and compiled functions."""
SOLVER_MB = 1.3e-3
"""What finite elements need for each tetrahedron, multigrid included: 390 MB for 321 536, measured."""
QUADRATIC_MB = 1.2e-2
"""What quadratic finite elements need for each tetrahedron: 4.1 GB for 321 536, measured."""
COPIES = {"detail_correction": 3, "warped_compliance": 3}
"""How often a family of models holds the compliance, in whole or in parts; others once."""


def memory_mb(job: Job, case: Case) -> float:
    """Estimate the most memory [MB] that a job needs."""
    if job.rule == "measure_scaling" and job.wildcards["component"] == "fem":
        return JOB_MB + SOLVER_MB * max(628 * 8**size for size in case.config["scaling"]["fem"])
    if "body" not in job.wildcards:
        return JOB_MB
    size = case.sizes[job.wildcards["body"]]
    elements = SOLVER_MB * size.fine.elements
    needed = {
        "make_body": lambda: elements,
        "compute_compliance": lambda: QUADRATIC_MB * size.fine.elements + compliance_mb(size),
        "simulate_fine": lambda: QUADRATIC_MB * size.fine.elements,
        "simulate_truth": lambda: QUADRATIC_MB * 8 * size.fine.elements,
        "choose_presses": lambda: elements,
        "compare_laws": lambda: QUADRATIC_MB * size.fine.elements * (1 if len(size.levels) > 2 else 8),
        "measure_models": lambda: (
            QUADRATIC_MB * size.fine.elements + COPIES.get(job.wildcards["family"], 1) * compliance_mb(size)
        ),
        "measure_any_load": lambda: QUADRATIC_MB * size.fine.elements + 2 * compliance_mb(size),
        "measure_beyond_design": lambda: QUADRATIC_MB * size.fine.elements + 2 * compliance_mb(size),
        **dict.fromkeys(("choose_loads", "evaluate_methods", "time_methods"), lambda: compliance_mb(size)),
    }
    return JOB_MB + (needed[job.rule]() if job.rule in needed else 0.0)


def compliance_mb(size: Size) -> float:
    """Return the size [MB] of a body's compliance: for each contact three fields on the surface and twice inside."""
    return 72e-6 * size.contacts * (size.fine.surface + 2 * size.coarse.nodes)


def available_mb() -> float:
    """Return how much memory [MB] is free, or that is not used by the group of processes this one is limited with."""
    limits = []
    with suppress(OSError, ValueError):
        lines = dict(line.split(":") for line in Path("/proc/meminfo").read_text().splitlines())
        limits.append(float(lines["MemAvailable"].split()[0]) / 1e3)
    with suppress(OSError, ValueError):
        group = Path("/sys/fs/cgroup")
        most, used = (float((group / name).read_text()) for name in ("memory.max", "memory.current"))
        limits.append((most - used) / 1e6)
    return min(limits, default=float("inf"))
