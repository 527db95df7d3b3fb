"""Record what the jobs of a finished run took, for the tests of the estimate, and fit timings.yaml to all records.

python tests/tools/record_run.py record NAME FOLDER CONFIG CORES SECONDS
    writes tests/plan/recorded/NAME.json: run in FOLDER with CONFIG, which took so many SECONDS on so many CORES
python tests/tools/record_run.py fit
    prints the lines of timings.yaml that fit the records best
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "src"), str(ROOT / "tests/plan")]
RECORDED = ROOT / "tests/plan/recorded"


def record(name: str, folder: str, config: str, cores: str, seconds: str) -> None:
    """Ask snakemake for all jobs of the run, and read from their logs what each took."""
    import os

    import palpate.plan.plan as planning
    from palpate.files import read_yaml
    from palpate.plan.jobs import is_parallel, seconds_taken
    from palpate.plan.work import kind_of

    target, settings = RECORDED / f"{name}.json", Path(config).resolve()
    own = str(settings.relative_to(ROOT)) if ROOT in settings.parents else read_yaml(settings)

    def write(plan: planning.Plan) -> list[str]:
        rows = []
        for job in plan._jobs:
            took = seconds_taken(Path(job.log), 0.0, is_parallel(kind_of(job, plan._case)))
            rows.append([job.rule, job.wildcards, job.threads, list(job.after), took or 0.0])
        sizes = {
            body: [[[level.nodes, level.surface, level.elements] for level in size.levels], size.contacts]
            for body, size in plan._case.sizes.items()
        }
        lines = ",\n".join(json.dumps(row) for row in rows)
        target.write_text(
            f'{{"settings": {json.dumps(own)},\n "cores": {cores}, "took_s": {seconds},\n'
            f' "sizes": {json.dumps(sizes)},\n "jobs": [\n{lines}\n]}}\n'
        )
        return [f"{target.name}: {len(rows)} jobs"]

    planning.Plan.describe = write  # type: ignore[method-assign]
    from snakemake.cli import main

    profile = ["--workflow-profile", str(ROOT / "profiles/default")]
    os.chdir(folder)
    main(["--snakefile", str(ROOT / "Snakefile"), "--configfile", str(settings), *profile, "-n", "--forceall", "-q"])


def fit() -> None:
    """Print a line for each kind of job: its base and rates, none of them negative, by least relative squares."""
    from scipy.optimize import nnls
    from test_describe import recorded

    from palpate.plan.work import amounts, kind_of

    found: dict[str, list[tuple[dict, float]]] = defaultdict(list)
    for file in sorted(RECORDED.glob("*.json")):
        jobs, case, took, _ = recorded(file.stem)
        for job, seconds in zip(jobs, took, strict=True):
            found[kind_of(job, case)].append((amounts(job, case), seconds))
    for kind, rows in sorted(found.items()):
        names = sorted({name for amount, _ in rows for name in amount})
        matrix = np.array([[1.0, *(amount.get(name, 0.0) for name in names)] for amount, _ in rows])
        wanted = np.array([max(seconds, 0.05) for _, seconds in rows])
        scale = np.maximum(np.abs(matrix).max(axis=0), 1e-30)
        weights = 1.0 / np.maximum(wanted, 0.5)
        rates, _ = nnls(matrix / scale * weights[:, None], wanted * weights)
        found_rates = dict(zip(["base", *names], rates / scale, strict=True))
        found_rates["base"] = max(0.05, found_rates["base"])
        print(f"{kind}: {{{', '.join(f'{name}: {_yaml(rate)}' for name, rate in found_rates.items() if rate)}}}")


def _yaml(rate: float) -> str:
    """Write a number so that YAML takes it for one."""
    text = f"{rate:.2g}"
    return text.replace("e", ".0e") if "." not in text else text


if __name__ == "__main__":
    {"record": record, "fit": fit}[sys.argv[1]](*sys.argv[2:])
