# What all rules share: checked settings, the studies that are asked for, names of files, and the code behind a job.

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
        lazily = [*lazily, "palpate.report.drawing", *sorted(places)]
    drawing = {"figures": draws} if draws else {}
    return {"call": function, "lazily": list(lazily), "code": digest(function, *lazily)} | drawing


def own_that(answer):
    """The user's own models whose file has a method, such as "touch"."""
    return {name: path for name, path in OWN_MODELS.items() if answer in answers(Path(path))}


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
