# A rigid instrument pressed into tissue: what moves and what the hand feels, of every model, against a truth.


from palpate.benchmark.settings import instrument_name
from palpate.studies.touch.settings import MODELS as TOUCH_MODELS
from palpate.studies.touch.settings import TouchModel

TOUCH = config["touch"]
TOUCHED = pressed_bodies(settings, "touch")
# the instruments, by what scenes and folders call them
TOOLS = {instrument_name(tool): plain(tool) for tool in settings.touch.instruments}
TOUCHES = [(body, tool) for body in TOUCHED for tool in TOOLS]
# modules of models, and which of their variants; files of the user's own
TOUCH_PLACES = TOUCH_MODELS | {name: TouchModel(path, {}, name) for name, path in own_that("touch").items()}
COMPARED_TOUCH = [*(settings.touch.models or TOUCH_MODELS), *own_that("touch")]
TOUCHING = "results/data/{body}/touch/{tool}"

TOUCH_SHOWN = drawn("touch", "touch_precision", scenes=[f"{body}_{tool}" for body, tool in TOUCHES])


wildcard_constraints:
    tool="|".join(TOOLS).replace(".", "[.]"),


rule simulate_touch_truth:
    input:
        body=BODY,
    output:
        touches=f"{TOUCHING}/touches.csv",
        truth=f"{TOUCHING}/truth.h5",
        warned=f"{TOUCHING}/warned.txt",
    log:
        "results/logs/{body}/{tool}/simulate_touch_truth.log",
    benchmark:
        "results/benchmarks/{body}/{tool}/simulate_touch_truth.tsv"
    params:
        **calls("palpate.studies.touch.jobs:simulate_touch_truth"),
        **some("touch", "samples", "depth_of_radius", "truth"),
        at=lambda wildcards: [given for given in TOUCH["at"] if given["body"] == wildcards.body],
        instrument=lambda wildcards: TOOLS[wildcards.tool],
        seed=config["seed"],
    script:
        "../job.py"


rule measure_touch_models:
    input:
        body=BODY,
        touches=f"{TOUCHING}/touches.csv",
        truth=f"{TOUCHING}/truth.h5",
        own=lambda wildcards: own_that("touch").get(wildcards.model, []),
    output:
        samples=f"{TOUCHING}/{{model}}_samples.csv",
        settings=f"{TOUCHING}/{{model}}_settings.csv",
    log:
        "results/logs/{body}/{tool}/measure_touch_models_{model}.log",
    benchmark:
        "results/benchmarks/{body}/{tool}/measure_touch_models_{model}.tsv"
    wildcard_constraints:
        model="|".join(TOUCH_PLACES),
    threads: HALF
    params:
        **calls(
            "palpate.studies.touch.jobs:measure_touch_models",
            # a user's own is an input instead
            lambda wildcards: [TOUCH_MODELS[wildcards.model].place] if wildcards.model in TOUCH_MODELS else [],
        ),
        instrument=lambda wildcards: TOOLS[wildcards.tool],
        deepest_of_radius=TOUCH["depth_of_radius"][1],
        place=lambda wildcards: TOUCH_PLACES[wildcards.model].place,
        keywords=lambda wildcards: TOUCH_PLACES[wildcards.model].keywords,
        settings=lambda wildcards: {
            key: tried for key, tried in TOUCH["settings"].items() if key == TOUCH_PLACES[wildcards.model].tried_as
        },
        repeats=config["timing"]["repeats"],
        seed=config["seed"],
    script:
        "../job.py"


rule tabulate_touch:
    input:
        bodies=[BODY.format(body=body) for body, _ in TOUCHES],
        touches=expand(rules.simulate_touch_truth.output.touches, body=TOUCHED, tool=TOOLS),
        truths=expand(rules.simulate_touch_truth.output.truth, body=TOUCHED, tool=TOOLS),
        samples=expand(rules.measure_touch_models.output.samples, body=TOUCHED, tool=TOOLS, model=COMPARED_TOUCH),
        settings=expand(rules.measure_touch_models.output.settings, body=TOUCHED, tool=TOOLS, model=COMPARED_TOUCH),
    output:
        figures(*TOUCH_SHOWN),
        truth=in_report("results/tables/touch_truth.csv"),
        forces=in_report("results/tables/touch_forces.csv"),
        touch=in_report("results/tables/touch.csv"),
    log:
        "results/logs/tabulate_touch.log",
    params:
        **calls("palpate.studies.touch.jobs:tabulate_touch", draws=TOUCH_SHOWN),
        instruments=[TOOLS[tool] for _, tool in TOUCHES],
    script:
        "../job.py"


rule touch:
    input:
        rules.tabulate_touch.output,
        warned_of(TOUCHED),
        expand(rules.simulate_touch_truth.output.warned, body=TOUCHED, tool=TOOLS),
        page="results/report_touch.html",
