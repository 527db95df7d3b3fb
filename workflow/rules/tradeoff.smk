# What accuracy costs in time: every model over its settings, on samples whose contacts it never saw.

from palpate.models.model_registry import MODELS, families

# models by family, one job each, and the user's own
OWN_MODELS = {
    name: normpath(CONFIG_FILE.parent / path) for name, path in config["tradeoff"]["own_models"].items()
}
COMPARED = [*(config["tradeoff"]["models"] or MODELS), *OWN_MODELS]
FAMILIES = families(COMPARED, OWN_MODELS)
STATIC = [f"{body}_{regime}" for body in BODIES for regime in REGIMES]

TARGETS["tradeoff"] = (
    tabulated("accuracy_vs_time", "advice")
    + figures("tradeoff", "advice", "break_even")
    + figures("tradeoff", "work_precision", scenes=STATIC)
)
# errors and online times come from the same answers
MEASURED_ON = {
    "body": "results/data/{body}/body.h5",
    "database": "results/data/{body}/{regime}/database.h5",
    "split": "results/data/{body}/{regime}/split.csv",
    "coarse": "results/data/{body}/{regime}/coarse.h5",
}


def modules_of(family):
    """The modules of palpate that the models of a family live in; a user's own model is an input instead."""
    return [] if family in OWN_MODELS else sorted({MODELS[name][0] for name in FAMILIES[family]})


rule measure_models:
    input:
        **MEASURED_ON,
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        fine=lambda wildcards: fine_batches(wildcards.body, wildcards.regime),
        own=lambda wildcards: [OWN_MODELS[wildcards.family]] if wildcards.family in OWN_MODELS else [],
    output:
        samples="results/data/{body}/{regime}/tradeoff/families/{family}_samples.csv",
        settings="results/data/{body}/{regime}/tradeoff/families/{family}_settings.csv",
    log:
        "results/logs/{body}/{regime}/measure_models_{family}.log",
    threads: HALF
    params:
        models=lambda wildcards: FAMILIES[wildcards.family],
        own=OWN_MODELS,
        enrichment=config["tradeoff"]["regression"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        radius=lambda wildcards: config["regimes"][wildcards.regime]["radius_m"],
        repeats=config["timing"]["repeats"],
        budget=config["tradeoff"]["budget_s"],
        code=lambda wildcards: code_of("measure_models", *modules_of(wildcards.family)),
    message:
        "measure the models of {wildcards.family}: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/measure_models.py"


rule measure_reference_error:
    input:
        **MEASURED_ON,
        fine=lambda wildcards: fine_batches(wildcards.body, wildcards.regime),
    output:
        samples="results/data/{body}/{regime}/tradeoff/families/reference_samples.csv",
        settings="results/data/{body}/{regime}/tradeoff/families/reference_settings.csv",
    log:
        "results/logs/{body}/{regime}/measure_reference_error.log",
    params:
        enrichment=config["tradeoff"]["regression"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        radius=lambda wildcards: config["regimes"][wildcards.regime]["radius_m"],
        samples=config["tradeoff"]["reference_samples"],
        code=code_of("measure_reference_error"),
    message:
        "simulate one level finer: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/measure_reference_error.py"


ruleorder: measure_reference_error > measure_models


rule tabulate_tradeoff:
    input:
        settings=expand(each("tradeoff/families/{{family}}_settings.csv"), family=[*FAMILIES, "reference"]),
        samples=expand(each("tradeoff/families/{{family}}_samples.csv"), family=[*FAMILIES, "reference"]),
    output:
        table="results/tables/accuracy_vs_time.csv",
        samples=expand(each("tradeoff/{{model}}.csv"), model=[*COMPARED, "reference"]),
    log:
        "results/logs/tabulate_tradeoff.log",
    params:
        code=code_of("tabulate_tradeoff"),
    message:
        "tabulate what accuracy costs in time"
    script:
        "../scripts/tabulate_tradeoff.py"


rule tabulate_advice:
    input:
        table="results/tables/accuracy_vs_time.csv",
        samples=expand(each("tradeoff/{{model}}.csv"), model=COMPARED),
        splits=each("split.csv"),
        motions=tabulated("dynamic_accuracy") if "dynamic" in ASKED else [],
    output:
        "results/tables/advice.csv",
    log:
        "results/logs/tabulate_advice.log",
    params:
        limits=config["tradeoff"]["advice"],
        code=code_of("tabulate_advice"),
    message:
        "advise a model for each budget and error"
    script:
        "../scripts/tabulate_advice.py"
