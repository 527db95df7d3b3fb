# What all rules share: checked settings, the studies that are asked for, names of files, and the code behind a job.

import fcntl
import sys
from os.path import normpath, relpath
from pathlib import Path
from shlex import quote

from palpate.benchmark.settings import finger_regimes, pressed_bodies, radius_of
from palpate.bodies.settings import paths_of_body
from palpate.errors import InputError
from palpate.files import read_yaml
from palpate.report import declared
from palpate.run.dependencies import digest
from palpate.run.estimate import Estimate, jobs_of, sizes
from palpate.run.job import FAILED, kernel_cache, warnings_in_logs
from palpate.run.job_server import start as start_job_server
from palpate.run.settings import STUDIES, asked_for, complete, defaults
from palpate.run.settings_yaml import read_settings
from palpate.run.system_faults import check_environment
from snakemake.io import get_wildcard_names, strip_wildcard_constraints
from snakemake.utils import update_config
from snakemake_logger_plugin_palpate import interrupt, watch
from snakemake_logger_plugin_palpate.last_words import offer

ROOT = Path(workflow.basedir)
CONFIG_FILES = [Path(relpath(file)) for file in workflow.config_settings.configfiles] or [Path("config.yaml")]
CONFIG_FILE = CONFIG_FILES[0]
# what this run will do, once that is known
planned = None

# snakemake begins the command of a script with this: it asks the server of jobs, or starts the interpreter itself
PYTHON = sys.executable
sys.executable = f"{quote(PYTHON)} -IS {quote(str(ROOT / 'workflow/start_job.py'))}"

try:
    check_environment()
    # read again: snakemake takes the last of two equal keys, and 1e-8 for a text
    config = {}
    for file in CONFIG_FILES:
        update_config(config, read_settings(file))
    update_config(config, dict(workflow.config_settings.config))
    config = complete(config, CONFIG_FILE)
except InputError as error:
    # make is typed in palpate's folder, and runs this in that of the settings
    typed = relpath(CONFIG_FILE, os.getenv("PWD")) if os.getenv("PALPATE_COMMAND") else CONFIG_FILE
    sys.exit(f"{FAILED}{error}".replace(f"{FAILED}{CONFIG_FILE}: ", f"{FAILED}{typed}: "))

# the studies whose block is in the settings, in the order of the report: each can be asked for by its name
ASKED = asked_for(config)
# those of a run that asks for none
RUN = [study for study in ASKED if study in (config["studies"] or ASKED)]
# what is advised between: models of presses, of motions, or of both
ADVISED = {"tradeoff", "dynamic"} & set(RUN) or {"tradeoff", "dynamic"} & set(ASKED)
# what each study makes, by its name; its rules file says so
TARGETS = {}
# the warnings of jobs that each study needs; the report lists them
WARNED = {study: [] for study in ASKED}
# tables that the report reads, and that not every run of a study makes
OPTIONAL = {study: [] for study in ASKED}
# by study: tables that several jobs fill, and their parts; figures that only read tables
MERGED, FIGURES = {}, {}
# jobs that make tables of settings alone, by the names of their rules
SETTLED = {}

# bodies that are pressed under a finger, and how hard
PRESSED = pressed_bodies(config)
REGIMES = (config["tradeoff"]["regimes"] or list(config["regimes"])) if PRESSED else []
# fingers of other radii, as regimes of their own: they are in no diagram
FINGERS = finger_regimes(config) if PRESSED else {}
config["regimes"] = config.get("regimes", {}) | FINGERS
# bodies that get paper 1's forces on single nodes, and how hard they are pressed
BODIES = [name for name, body in config["bodies"].items() if "train" in body] if "enrichment" in ASKED else []
POINTS = list(config["enrichment"]["regimes"]) if BODIES else []


wildcard_constraints:
    # names may have underscores, as what stands between them
    body="|".join(config["bodies"]) or "nothing",
    regime="|".join([*config["regimes"], *POINTS]) or "nothing",
    scene="[a-z][a-z0-9_]*",
    batch=r"\d+",
    radius="[0-9.e-]+",


# jobs run beside each other, so each gets one thread; snakemake would hand timing jobs all of them
JOBS = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
JOBS |= {"PALPATE_RUN": str(os.getpid()), "PALPATE_JOBS": f".snakemake/jobs-{os.getpid()}"}
JOBS |= {"NUMBA_CACHE_DIR": str(kernel_cache())}
# and Ctrl-C ends them by way of the run
EXPORTS = " ".join(f"{name}={quote(value)}" for name, value in JOBS.items())
# snakemake formats this text, and a folder's name may have braces
shell.prefix(f"trap '' INT; export {EXPORTS.replace('{', '{{').replace('}', '}}')}; ")

# what is timed for long has half of the machine: on one of two cores, beside another single-threaded job, medians of
# 1 ms and more are within 8 % of those of a job that runs alone; shorter ones may be up to half longer
HALF = max(1, (workflow.cores or 1) // 2)


BODY = "results/data/{body}/body.h5"
PRESS = "results/data/{body}/{regime}"


def calls(function, lazily=()):
    """The function of palpate that a job calls, and a digest of its code, as parameters: snakemake notices no edits of modules.

    lazily : modules or packages of palpate that are imported by name at run time, or a function of the wildcards
    """
    if callable(lazily):
        code = lambda wildcards: digest(function, *lazily(wildcards))
    else:
        code = digest(function, *lazily)
    return {"call": function, "lazily": lazily, "code": code}


def some(block, *keys):
    """Some of the settings of a block."""
    return {key: config[block][key] for key in keys}


def tabulated(*names):
    """The files of some tables."""
    return [f"results/tables/{name}.csv" for name in names]


def drawn(*names):
    """The files of some figures."""
    return [f"results/figures/{name}.{suffix}" for name in names for suffix in ("png", "svg")]


def figures(study, *names, scenes=(None,), **options):
    """The files of figures that one job of a study draws from tables alone; with ``scenes`` one for each of these.

    published=True : they show what the paper published, too
    """
    shown = {}
    for name in names:
        _, place, tables = declared.figures(study)[name]
        shared = {"place": place, "tables": tables}
        shared["published"] = published_of(study) if options.get("published") else None
        shown |= {f"{name}_{scene}" if scene else name: shared | {"scene": scene} for scene in scenes}
    FIGURES[study] = FIGURES.get(study, {}) | shown
    return drawn(*shown)


def claims_of(study):
    """What of a study judges claims of the papers, by its tables, as far as this run makes all of these."""
    made = {file for asked in RUN for file in TARGETS[asked]}
    judges = declared.claims(study).items()
    return {place: tables for place, tables in judges if made.issuperset(tabulated(*tables))}


def merged(study, **tables):
    """The files of tables that one job of a study merges from the parts of each."""
    MERGED[study] = MERGED.get(study, {}) | tables
    return tabulated(*tables)


def settled(function, *tables, lazily=(), threads=1, **settings):
    """The files of tables that one job, of the name of its function, makes of settings alone."""
    SETTLED[function.partition(":")[2]] = tables, threads, calls(function, lazily) | settings
    return tabulated(*tables)


def published_of(study):
    """The file of the numbers that the paper of a study published."""
    return relpath(ROOT / f"src/palpate/studies/{study}/published.yaml")


def templates(*studies):
    """The templates of the report about some studies, and the numbers that their papers published."""
    folders = [ROOT / "src/palpate/report", *(ROOT / f"src/palpate/studies/{study}" for study in studies)]
    return [
        relpath(path) for folder in folders for kind in ("md", "yaml") for path in sorted(folder.rglob(f"*.{kind}"))
    ]


def hold_folder():
    """Refuse to run twice in one folder. The kernel lets go of this lock when the run ends, however it ends."""
    global held
    held = open(".snakemake/palpate.lock", "w")
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        sys.exit(f"{FAILED}another run is under way in this folder; wait for it or stop it first.")


def announce():
    """Print what a run will cost before it begins. An estimate is no reason to stop a run."""
    global planned
    try:
        todo, ended = jobs_of(workflow.dag)
        block = config.get("tradeoff")
        presses = block["contacts"] * len(block["presses"]) if block else None
        cores = workflow.cores if workflow.local_exec else None
        planned = Estimate(todo, sizes(config["bodies"], "results/data"), cores, presses, ended)
        print("\n".join(planned.describe()), file=sys.stderr)
        if cores:
            watch(planned)
    except Exception as error:
        print(f"no estimate of what this run will cost ({type(error).__name__}: {error})", file=sys.stderr)


def announce_once(record):
    """Announce a dry run, for which snakemake calls no onstart, at the record by which its jobs are known."""
    known = getattr(record, "event", None) == "run_info" or record.getMessage().startswith("Nothing to be done")
    if known and workflow.dryrun and planned is None:
        announce()
    return True


def conclude():
    """Print what jobs warned of where it does not scroll by: also those done before this run."""
    if lines := warnings_in_logs(sorted({log for job in workflow.dag.jobs for log in job.log})):
        print("warnings about these results:", *(f"warning: {line}" for line in lines), sep="\n", file=sys.stderr)


def files_to_ask_for():
    """The files that can be made from these settings, as far as their names are known before the jobs are."""
    known = {
        "body": list(config["bodies"]),
        "regime": REGIMES + POINTS,
        "scene": list(config.get("scenes", {})),
    }
    found = []
    for output in (output for made in workflow.rules for output in made.output):
        names = get_wildcard_names(output)
        if names <= set(known):
            found += expand(strip_wildcard_constraints(output), **{name: known[name] for name in names})
    return found
