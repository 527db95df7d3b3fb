# What all rules share: checked settings, the studies that are asked for, names of files, and the code behind a job;
# the functions of bodies, samples and the report, which several rules call.

from os.path import normpath, relpath
from pathlib import Path

from palpate.benchmark.settings import pressed_bodies
from palpate.errors import InputError
from palpate.files import read_yaml
from palpate.own_file import answers
from palpate.report import declared
from palpate.run.dependencies import digest
from palpate.run.settings import asked_for, complete, defaults, read_settings
from palpate.setting_types import plain
from snakemake.utils import update_config

ROOT = Path(workflow.basedir)
CONFIG_FILES = [Path(relpath(file)) for file in workflow.configfiles]
CONFIG_FILE = CONFIG_FILES[0]

try:
    # read again: snakemake takes the last of two equal keys, and 1e-8 for a text
    config = {}
    for file in CONFIG_FILES:
        update_config(config, read_settings(file))
    update_config(config, dict(workflow.config_settings.config))
    settings = complete(config, CONFIG_FILE)
except InputError as error:
    sys.exit(f"error: {error}")

# the same as plain data, parts of which jobs get
config = plain(settings)
# the studies whose block is in the settings, in the order of the report: each can be asked for by its name
ASKED = asked_for(config)
# those of a run that asks for none
RUN = [study for study in ASKED if study in (settings.studies or ASKED)]
# what is advised between: models of presses, of motions, or of both
ADVISED = {"tradeoff", "dynamic"} & set(RUN) or {"tradeoff", "dynamic"} & set(ASKED)

# bodies that are pressed under a finger, and how hard
PRESSED = pressed_bodies(settings)
REGIMES = (settings.tradeoff.regimes or list(settings.regimes)) if PRESSED else []
# bodies that get paper 1's forces on single nodes, and how hard they are pressed
BODIES = [name for name, body in settings.bodies.items() if getattr(body, "train", None)] if settings.enrichment else []
POINTS = list(settings.enrichment.regimes) if BODIES else []
# bodies made from a CT, which get pictures and masses of their own
CTS = [name for name, body in settings.bodies.items() if body.kind == "ct"]
SCENES = list(settings.scenes or {})
# the user's own models, by their files
OWN_MODELS = {name: normpath(CONFIG_FILE.parent / path) for name, path in settings.own_models.items()}


wildcard_constraints:
    # names may have underscores, as what stands between them
    body="|".join(settings.bodies) or "nothing",
    regime="|".join([*config.get("regimes", {}), *POINTS]) or "nothing",
    scene="[a-z][a-z0-9_]*",
    batch=r"\d+",
    radius="[0-9.e-]+",
    split=r"\d",


# what is timed for long has half of the machine: on one of two cores, beside another single-threaded job, medians of
# 1 ms and more are within 8 % of those of a job that runs alone; shorter ones may be up to half longer
HALF = max(1, (workflow.cores or 1) // 2)
BODY = "results/data/{body}/body.h5"
PRESS = "results/data/{body}/{regime}"
CAPTION = "../report.rst"


def calls(function, *lazily, draws=None):
    """The function of palpate that a job calls, and a digest of its code, as parameters: snakemake notices no edits of modules.

    lazily : modules or packages of palpate that are imported by name at run time, or one function of the wildcards
    draws : the figures, of ``drawn``, that the job draws once the tables are written that its function returns
    """
    if lazily and callable(lazily[0]):
        [named] = lazily
        return {"call": function, "lazily": named, "code": lambda wildcards: digest(function, *named(wildcards))}
    if draws:
        places = {figure["place"].partition(":")[0] for figure in draws.values()}
        lazily = [*lazily, "palpate.report.style", *sorted(places)]
    drawing = {"figures": draws} if draws else {}
    return {"call": function, "lazily": list(lazily), "code": digest(function, *lazily)} | drawing


def own_that(answer):
    """The user's own models whose file has a method, such as "touch"."""
    return {name: path for name, path in OWN_MODELS.items() if answer in answers(Path(path))}


def here(path):
    """A path that is relative to the settings, as it can be opened from here."""
    return normpath(CONFIG_FILE.parent / path)


def some(block, *keys):
    """Some of the settings of a block."""
    return {key: config[block][key] for key in keys}


def tables(*names):
    """The files of some tables."""
    return [f"results/tables/{name}.csv" for name in names]


def in_report(table):
    """A table as an output, which snakemake --report shows."""
    return report(table, caption=CAPTION, category="tables")


def figures(*names):
    """The files of some figures as outputs, which snakemake --report shows."""
    shown = [report(f"results/figures/{name}.png", caption=CAPTION, category="figures") for name in names]
    return [*shown, *(f"results/figures/{name}.svg" for name in names)]


def published_of(study):
    """The file of the numbers that the paper of a study published."""
    return relpath(ROOT / f"src/palpate/studies/{study}/published.yaml")


def drawn(study, *names, scenes=(None,), published=None):
    """The figures of a study by name, with the function that draws each from tables; with ``scenes`` one for each.

    published : the file of the numbers of the paper, which they show, too
    """
    found = {}
    for name in names:
        _, place, read = declared.figures(study)[name]
        about = {"place": place, "tables": read, "published": published}
        found |= {f"{name}_{scene}" if scene else name: about | {"scene": scene} for scene in scenes}
    return found


def read_by(shown, *made):
    """The tables that these figures are drawn from, without those that are made by the job that draws them."""
    return sorted({file for figure in shown.values() for file in tables(*figure["tables"])} - set(tables(*made)))


def warned_of(bodies):
    """The warnings of jobs that make bodies, and what these took of files."""
    return expand("results/data/{body}/{said}.txt", body=bodies, said=["taken", "warned"])


def templates(*studies):
    """The templates of the report about some studies, the numbers that their papers published, and what a page is made of."""
    folders = [ROOT / "src/palpate/report", *(ROOT / f"src/palpate/studies/{study}" for study in studies)]
    found = [path for folder in folders for kind in ("md", "yaml") for path in sorted(folder.rglob(f"*.{kind}"))]
    return [relpath(path) for path in [*found, *sorted((ROOT / "src/palpate/report/assets").iterdir())]]


# settings of a body that say how many samples it gets and what the paper had, not what it is
NOT_OF_THE_BODY = {"magnitudes", "train", "test", "paper_surface"}


def body_files(name):
    """The files a body is made from; of a folder, such as a DICOM series, every one in it."""
    paths = map(Path, settings.bodies[name].paths(CONFIG_FILE.parent).values())
    return [str(file) for path in paths for file in (sorted(path.iterdir()) if path.is_dir() else [path])]


def body_entry(name):
    """What a body is made from."""
    body = plain(settings.bodies[name].seen_from(CONFIG_FILE.parent))
    return {key: value for key, value in body.items() if key not in NOT_OF_THE_BODY}


def count(body, regime):
    """How many samples a body gets in a regime."""
    if regime in POINTS:
        return settings.bodies[body].train + settings.bodies[body].test
    return settings.tradeoff.contacts * len(settings.tradeoff.presses)


def split(body, regime):
    """How many samples train and test paper 1's methods; nothing for presses, whose contacts are dealt into folds."""
    return [settings.bodies[body].train, settings.bodies[body].test] if regime in POINTS else []


def radius(body, regime):
    """The radius of the disc that is pressed, 0 for a single node."""
    return 0.0 if regime in POINTS else settings.regimes[regime].radius_on(body)


def loads_entry(body, regime):
    """What the loads of a body follow from."""
    if regime in POINTS:
        return config["enrichment"]["regimes"][regime] | {"magnitudes": settings.bodies[body].magnitudes}
    return config["regimes"][regime] | {key: config["tradeoff"][key] for key in ("contacts", "presses")}


def fine_batches(body, regime):
    jobs = -(-count(body, regime) // settings.solver.samples_per_job)
    return [f"results/data/{body}/{regime}/fine_{batch}.h5" for batch in range(jobs)]


def compliance_of(body, regime):
    """A body's compliance depends on the regime only through the radius of the press."""
    return f"results/data/{body}/compliance_{radius(body, regime)}m.h5"


def points(pattern):
    """One file for each body and regime of paper 1."""
    return expand(f"{PRESS}/{pattern}", body=BODIES, regime=POINTS)


def presses(pattern):
    """One file for each body and regime of the trade-off."""
    return expand(f"{PRESS}/{pattern}", body=PRESSED, regime=REGIMES)


def shown(*studies):
    """The tables, figures and warnings that the page about some studies is made of: what each study asks for."""
    asked = [getattr(rules, study).input for study in studies]
    return [file for files in asked for file in files if file != files.page]


def reported(wildcards):
    """The studies that a page is about."""
    return [wildcards.of.removeprefix("_")] if wildcards.of else RUN


def told(wildcards):
    """What the writer of a page is told."""
    studies = reported(wildcards)
    alone = {"alone": True} if wildcards.of else {"left_out": [study for study in ASKED if study not in RUN]}
    return alone | {
        "studies": studies,
        "scenes": SCENES if "scenes" in studies else [],
        "cts": CTS if "ct" in studies else [],
        "driven": DRIVEN if "scenes" in studies else [],
    }


def numbered(wildcards):
    """The modules that compute numbers for the templates of a page."""
    places = {study: ROOT / f"src/palpate/studies/{study}/report.py" for study in reported(wildcards)}
    return [f"palpate.studies.{study}.report" for study, place in places.items() if place.is_file()]
