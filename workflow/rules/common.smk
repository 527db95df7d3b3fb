# What all rules share: checked settings, the studies that are asked for, names of files, and the code behind a job.

import ast
import fcntl
import sys
import time
from os.path import normpath, relpath
from pathlib import Path
from shlex import quote

from palpate.config import asked_for, complete
from palpate.dependencies import digest, files_of
from palpate.errors import InputError
from palpate.files import read_yaml
from palpate.job import FAILED, kernel_cache
from palpate.plan.plan import Plan, when_known
from palpate.schema import defaults, read_schema

ROOT = Path(workflow.basedir)
CONFIG_FILE = Path(relpath([*workflow.overwrite_configfiles, *workflow.configfiles][0]))
SCHEMA = read_schema(ROOT / "workflow/schemas/config.schema.yaml")
STARTED = time.time()
# what this run will do, once that is known
planned = None

try:
    config = complete(config, SCHEMA, CONFIG_FILE)
except InputError as error:
    sys.exit(f"{FAILED}{error}")

# the studies whose block is in the settings, in the order of the report
ASKED = asked_for(config, SCHEMA)
# what each study makes, by its name; its rules file says so
TARGETS = {}
# tables that several jobs fill: the parts of each
MERGED = {}
# figures that only read tables: module, scene and published numbers of each
FIGURES = {}

# bodies that get samples; the others are for scenes
BODIES = [name for name, body in config["bodies"].items() if "train" in body]
REGIMES = list(config.get("regimes", {}))


wildcard_constraints:
    body="[a-z][a-z0-9_]*",
    regime="[a-z][a-z0-9_]*",
    scene="[a-z][a-z0-9_]*",
    batch=r"\d+",
    radius="[0-9.e-]+",


# jobs run beside each other, so each gets one thread; snakemake would hand timing jobs all of them
THREADS = [f"{library}_NUM_THREADS=1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")]
shell.prefix(
    f"export PALPATE_RUN={os.getpid()} {' '.join(THREADS)} NUMBA_CACHE_DIR={quote(str(kernel_cache()))}; "
)

# what is timed for long has half of the machine: on one of two cores, beside another single-threaded job, medians of
# 1 ms and more are within 8 % of those of a job that runs alone; shorter ones may be up to half longer
HALF = max(1, (workflow.cores or 1) // 2)


def code_of(script, *lazily):
    """A digest of the code that a script runs, as a parameter: snakemake notices no edits of imported modules.

    lazily : modules or packages of palpate that are imported by name at run time
    """
    return digest(ROOT / f"workflow/scripts/{script}.py", *lazily)


def tabulated(*names):
    """The files of some tables."""
    return [f"results/tables/{name}.csv" for name in names]


def drawn(*names):
    """The files of some figures."""
    return [f"results/figures/{name}.{suffix}" for name in names for suffix in ("png", "svg")]


def figures(study, *names, scenes=None, published=False):
    """The files of figures of a study that only read tables, one a module; with ``scenes`` one for each of these.

    published : whether they show what the paper published, too
    """
    found = []
    for name in names:
        for scene in [None] if scenes is None else scenes:
            stem = name if scene is None else f"{name}_{scene}"
            FIGURES[stem] = {
                "module": f"palpate.figures.{study}.{name}",
                "scene": scene,
                "published": [f"{relpath(ROOT)}/workflow/report/{study}/published.yaml"] if published else [],
            }
            found += drawn(stem)
    return found


def tables_of(module):
    """The tables that a figure's module reads, as its constant TABLES names them."""
    for line in ast.parse(files_of(module)[0].read_text()).body:
        if isinstance(line, ast.Assign) and line.targets[0].id == "TABLES":
            return ast.literal_eval(line.value)
    raise InputError(f"{module} does not name the tables that it reads; give it a constant TABLES.")


def merged(table, parts):
    """The file of a table that is merged from ``parts``."""
    MERGED[table] = parts
    return tabulated(table)


def captions(*studies):
    """The captions of some studies in the report, and the numbers that their papers published."""
    folders = [ROOT / "workflow/report" / study for study in studies]
    return [relpath(path) for folder in folders for path in sorted(folder.glob("*")) if path.is_file()]


def hold_folder():
    """Refuse to run twice in one folder. The kernel lets go of this lock when the run ends, however it ends."""
    global held
    held = open(".snakemake/palpate.lock", "w")
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        sys.exit(f"{FAILED}another run is under way in this folder; wait for it or stop it first.")


def stay_idle():
    """Keep snakemake from looking for jobs while none can start: without a limit of jobs a second it does so when one ends.

    With it, it does so once a second for each job that has ever ended, which in the end takes the half of a core.
    """
    workflow.scheduler.job_rate_limiter = None


def plan():
    """Return what this run will do, once snakemake knows it."""
    return Plan(workflow.dag, config, CONFIG_FILE.parent, workflow.cores if workflow.local_exec else None)


def announce():
    """Print what a run will cost before it begins. An estimate is no reason to stop a run."""
    global planned
    try:
        planned = plan()
        print("\n".join(planned.describe()), file=sys.stderr)
    except Exception as error:
        print(f"no estimate of what this run will cost ({type(error).__name__}: {error})", file=sys.stderr)


def remember():
    """Keep what the jobs of this run took, for the next estimate."""
    if planned is not None:
        planned.remember()


def failures():
    """What the jobs that failed in this run said, and where they said it."""
    logs = [log for log in Path("results/logs").rglob("*.log") if log.stat().st_mtime >= STARTED]
    lines = [(log, line) for log in logs for line in log.read_text().splitlines() if line.startswith(FAILED)]
    return "\n" + "\n".join(f"{line}\n       (log: {log})" for log, line in lines)
