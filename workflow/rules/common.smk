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
REGIMES, SCENES = list(config.get("regimes", {})), list(config["scenes"])
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


# jobs run beside each other, so each gets one thread; snakemake would hand timing jobs all of them
THREADS = [f"{library}_NUM_THREADS=1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")]
shell.prefix(
    f"export PALPATE_RUN={os.getpid()} {' '.join(THREADS)} NUMBA_CACHE_DIR={quote(str(kernel_cache()))}; "
)


def sources(*names):
    """Modules, to list as inputs of what runs them: snakemake does not notice edits of imported modules.

    A name is a package ("enrichment") or one module ("scenes/press").
    """
    places = [ROOT / "src/palpate" / name for name in names]
    modules = [sorted(p.glob("*.py")) if p.is_dir() else [p.with_suffix(".py")] for p in places]
    return [relpath(module) for found in modules for module in found]


# what draws, and what of the other packages it imports
PICTURES = sources("figures", "evaluation/shape_matching_growth", "scenes/motion", "scenes/registry")


def entry(wildcards):
    """What a body is made from."""
    body = config["bodies"][wildcards.body]
    return {key: value for key, value in body.items() if key not in NOT_OF_THE_BODY}


def mesh_file(wildcards):
    """The mesh file of a body that has one; its path is relative to the folder of the config file."""
    path = config["bodies"][wildcards.body].get("path")
    return [] if path is None else normpath(CONFIG_FILE.parent / path)


def own_effects(wildcards):
    """The files of effects that a scene brings along, by name; given relative to the folder of the config file."""
    own = config["scenes"][wildcards.scene].get("own", {})
    return {name: normpath(CONFIG_FILE.parent / path) for name, path in own.items()}


def scene(wildcards):
    """What a scene is made from."""
    entry = config["scenes"][wildcards.scene] | {"own": own_effects(wildcards)}
    return {"entry": entry, "seed": config["seed"]}


def body_of(wildcards):
    return f"results/data/{config['scenes'][wildcards.scene]['body']}/body.h5"


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


# tables of which each body, or each body and regime, makes its part
PARTS = {
    table: each(f"{table}.csv") for table in ("sigma_sweep", "enrichment_accuracy", "sample_peaks", "splits")
} | {
    table: expand("results/data/{body}/{table}.csv", body=BODIES, table=table)
    for table in ("enrichment_timing", "online_cost")
}
TABLES = [*PARTS, "mesh_sizes", "mesh_quality", "fem_cost", "complexity", "claims"]
FIGURES = [
    "mesh_levels",
    "sigma_sweep",
    "complexity",
    "timing_bars",
    "accuracy_vs_time",
    "fem_cost",
] + expand(
    "{figure}_{body}_{regime}",
    figure=["deformed", "error_over_body"],
    body=BODIES,
    regime=REGIMES,
)
# paper 3's experiments, each a table and a figure
SOFT_BODIES = ["integrator_stability", "clusters", "shape_matching_timing", "body_springs"]


def drawn(*stems):
    """The files of some figures."""
    return [f"results/figures/{stem}.{suffix}" for stem in stems for suffix in ("png", "svg")]


def tabulated(*names):
    """The files of some tables."""
    return [f"results/tables/{name}.csv" for name in names]


# what reproducing a paper means, and what the scenes leave behind
PAPERS = {
    "enrichment": tabulated(*TABLES) + drawn(*FIGURES),
    "soft_bodies": tabulated(*SOFT_BODIES) + drawn(*SOFT_BODIES),
}
MOTIONS = (
    tabulated("scene_effects", "effects", "energy")
    + drawn("energy", "effects", *(f"motion_{scene}" for scene in SCENES))
    + expand("results/figures/motion_{scene}.gif", scene=SCENES)
    + expand("results/motion/{scene}", scene=SCENES)
    if SCENES
    else []
)


def hold_folder():
    """Refuse to run twice in one folder. The kernel lets go of this lock when the run ends, however it ends."""
    global held
    held = open(".snakemake/palpate.lock", "w")
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        sys.exit(f"{FAILED}another run is under way in this folder; wait for it or stop it first.")


def failures():
    """What the jobs that failed in this run said, and where they said it."""
    logs = [log for log in Path("results/logs").rglob("*.log") if log.stat().st_mtime >= STARTED]
    lines = [(log, line) for log in logs for line in log.read_text().splitlines() if line.startswith(FAILED)]
    return "\n" + "\n".join(f"{line}\n       (log: {log})" for log, line in lines)
