# What all rules share: checked settings, names of bodies and batches, the modules that run.

import fcntl
import sys
import time
from os.path import normpath, relpath
from pathlib import Path
from shlex import quote

from palpate.config import complete
from palpate.files import read_yaml
from palpate.errors import InputError
from palpate.job import FAILED, kernel_cache
from palpate.models.registry import MODELS, families
from palpate.scenes.instruments import bodies_in, has_contact, has_moving_instrument

ROOT = Path(workflow.basedir)
CONFIG_FILE = Path(relpath([*workflow.overwrite_configfiles, *workflow.configfiles][0]))
CAPTIONS = ROOT / "workflow/report"
PAPER = relpath(CAPTIONS / "paper.yaml")
STARTED = time.time()

try:
    config = complete(config, read_yaml(ROOT / "workflow/schemas/config.schema.yaml"), CONFIG_FILE)
except InputError as error:
    sys.exit(f"{FAILED}{error}")

# paper 1's bodies are those that get samples; the others are for scenes
BODIES = [name for name, body in config["bodies"].items() if "train" in body]
# bodies made from a CT, which get pictures and masses of their own
CTS = [name for name, body in config["bodies"].items() if body["kind"] == "ct"]
# bodies whose meshes are tabulated
MEASURED = list(dict.fromkeys((BODIES if "enrichment" in config["papers"] else []) + CTS))
REGIMES, SCENES = list(config.get("regimes", {})), list(config["scenes"])
# scenes in which contact acts, and those of them in which an instrument is moved
TOUCHING = [name for name, scene in config["scenes"].items() if has_contact(scene)]
DRIVEN = [name for name, scene in config["scenes"].items() if has_moving_instrument(scene)]
# every method is fitted and tested in each of these: protocol and split
CASES = [(protocol, split) for protocol in ("paper", "live") for split in ("samples", "contacts")]
# methods whose predictions are kept for pictures
SHOWN = ["unordered_nonnegative_a", "ordered_nonnegative_a", "interpolation", "ours"]
# settings of a body that say how many samples it gets and what the paper had, not what it is
NOT_OF_THE_BODY = {"magnitudes", "train", "test", "paper_surface"}


wildcard_constraints:
    body="[a-z][a-z0-9_]*",
    regime="[a-z][a-z0-9_]*",
    scene="[a-z][a-z0-9_]*",
    batch=r"\d+",
    radius="[0-9.e-]+",
    family="[a-z][a-z0-9_]*",


# jobs run beside each other, so each gets one thread; snakemake would hand timing jobs all of them
THREADS = [f"{library}_NUM_THREADS=1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")]
shell.prefix(
    f"export PALPATE_RUN={os.getpid()} {' '.join(THREADS)} NUMBA_CACHE_DIR={quote(str(kernel_cache()))}; "
)

# what is timed for long has half of the machine: on one of two cores, beside another single-threaded job, medians of
# 1 ms and more are within 8 % of those of a job that runs alone; shorter ones may be up to half longer
HALF = max(1, (workflow.cores or 1) // 2)


def sources(*names):
    """Modules, to list as inputs of what runs them: snakemake does not notice edits of imported modules.

    A name is a package ("enrichment") or one module ("scenes/press").
    """
    places = [ROOT / "src/palpate" / name for name in names]
    modules = [sorted(p.glob("*.py")) if p.is_dir() else [p.with_suffix(".py")] for p in places]
    return [relpath(module) for found in modules for module in found]


# what draws, and what of the other packages it imports; what the page carries with it
PICTURES = sources(
    "figures",
    "evaluation/advice",
    "evaluation/advice_reasons",
    "evaluation/resampling",
    "evaluation/ties",
    "evaluation/collision_growth",
    "evaluation/scaling_growth",
    "evaluation/shape_matching_growth",
    "scenes/motion",
    "scenes/registry",
)
ASSETS = [relpath(path) for path in sorted((ROOT / "src/palpate/figures/assets").iterdir())]


def body_paths(name):
    """The files or folders a body is made from, by key; given relative to the folder of the config file."""
    body = config["bodies"][name]
    return {
        key: normpath(CONFIG_FILE.parent / body[key])
        for key in ("path", "image", "mask")
        if body.get(key) is not None
    }


def body_files(name):
    """The files a body is made from; of a folder, such as a DICOM series, every one in it."""
    paths = map(Path, body_paths(name).values())
    return [str(file) for path in paths for file in (sorted(path.iterdir()) if path.is_dir() else [path])]


def body_entry(name):
    """What a body is made from."""
    body = config["bodies"][name] | body_paths(name)
    return {key: value for key, value in body.items() if key not in NOT_OF_THE_BODY}


def own_effects(wildcards):
    """The files of effects that a scene brings along, by name; given relative to the folder of the config file."""
    own = config["scenes"][wildcards.scene].get("own", {})
    return {name: normpath(CONFIG_FILE.parent / path) for name, path in own.items()}


def scene(wildcards):
    """What a scene is made from."""
    entry = config["scenes"][wildcards.scene] | {"own": own_effects(wildcards)}
    if "contact" in entry:
        tools = [own_file(tool) for tool in entry["contact"]["instruments"]]
        entry |= {"contact": entry["contact"] | {"instruments": tools}}
    return {"entry": entry, "seed": config["seed"]}


def own_file(tool):
    """An instrument of ``contact`` whose file, if it has one, can be opened as it is."""
    return tool | {"file": normpath(CONFIG_FILE.parent / tool["file"])} if "file" in tool else tool


def tool_files(wildcards):
    """The files of a scene's instruments."""
    tools = config["scenes"][wildcards.scene].get("contact", {}).get("instruments", [])
    return [own_file(tool)["file"] for tool in tools if "file" in tool]


def moving(wildcards):
    """The modules that simulate a scene; those of collision only where something can touch."""
    packages = ["bodies", "effects", "solvers", "scenes"]
    return sources(*packages, *(["collision"] if wildcards.scene in TOUCHING else []))


def bodies_of(wildcards):
    """The files of all bodies of a scene, its own first."""
    entry = config["scenes"][wildcards.scene]
    return [f"results/data/{body}/body.h5" for body in bodies_in(entry)]


def count(body):
    """How many samples a body gets in each regime."""
    return config["bodies"][body]["train"] + config["bodies"][body]["test"]


def fine_batches(body, regime):
    jobs = -(-count(body) // config["solver"]["samples_per_job"])
    return [f"results/data/{body}/{regime}/fine_{batch}.h5" for batch in range(jobs)]


def compliance_of(body, regime):
    """A body's compliance depends on the regime only through the radius of the press."""
    return f"results/data/{body}/compliance_{float(config['regimes'][regime]['radius_m'])}m.h5"


def each(pattern):
    """One file for each body and regime."""
    return expand(f"results/data/{{body}}/{{regime}}/{pattern}", body=BODIES, regime=REGIMES)


def trial_of(wildcards):
    """A scene as a trial of models."""
    entry = config["scenes"][wildcards.scene]
    duration = config["dynamic"]["durations_s"][wildcards.scene]
    return {
        "name": wildcards.scene,
        "entry": entry,
        "duration_s": duration,
        "frames": config["dynamic"]["frames"],
    }


def body_of_trial(wildcards):
    return f"results/data/{config['scenes'][wildcards.scene]['body']}/body.h5"


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


def failures():
    """What the jobs that failed in this run said, and where they said it."""
    logs = [log for log in Path("results/logs").rglob("*.log") if log.stat().st_mtime >= STARTED]
    lines = [(log, line) for log in logs for line in log.read_text().splitlines() if line.startswith(FAILED)]
    return "\n" + "\n".join(f"{line}\n       (log: {log})" for log, line in lines)
