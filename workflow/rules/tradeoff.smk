# What accuracy costs in time: every model over its settings, on samples whose contacts it never saw.


include: "functions/tradeoff.smk"


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
    + figures("tradeoff", "work_precision", "best_models", scenes=STATIC)
)
WARNED += warned_of(BODIES) + each("loads_warned.txt")


rule measure_models:
    input:
        body="results/data/{body}/body.h5",
        database="results/data/{body}/{regime}/database.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        samples="results/data/{body}/{regime}/samples.csv",
        own=lambda wildcards: [OWN_MODELS[wildcards.family]] if wildcards.family in OWN_MODELS else [],
    output:
        samples="results/data/{body}/{regime}/tradeoff/{family}_samples.csv",
        settings="results/data/{body}/{regime}/tradeoff/{family}_settings.csv",
    log:
        "results/logs/{body}/{regime}/measure_models_{family}.log",
    wildcard_constraints:
        family="|".join(FAMILIES),
    threads: HALF
    params:
        models=lambda wildcards: FAMILIES[wildcards.family],
        settings=lambda wildcards: config["tradeoff"]["settings"].get(wildcards.family, {}),
        regression=config["tradeoff"]["regression"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        radius_m=lambda wildcards: config["regimes"][wildcards.regime]["radius_m"],
        repeats=config["timing"]["repeats"],
        budget_s=config["tradeoff"]["budget_s"],
        code=lambda wildcards: code_of("measure_models", *modules_of(wildcards.family)),
    message:
        "measure the models of {wildcards.family}: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/measure_models.py"


rule measure_reference_error:
    input:
        body="results/data/{body}/body.h5",
        database="results/data/{body}/{regime}/database.h5",
        samples="results/data/{body}/{regime}/samples.csv",
    output:
        samples="results/data/{body}/{regime}/tradeoff/reference_samples.csv",
        settings="results/data/{body}/{regime}/tradeoff/reference_settings.csv",
    log:
        "results/logs/{body}/{regime}/measure_reference_error.log",
    params:
        regression=config["tradeoff"]["regression"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        radius_m=lambda wildcards: config["regimes"][wildcards.regime]["radius_m"],
        reference_samples=config["tradeoff"]["reference_samples"],
        code=code_of("measure_reference_error"),
    message:
        "simulate one level finer: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/measure_reference_error.py"


rule tabulate_tradeoff:
    input:
        settings=family_files("settings"),
    output:
        "results/tables/accuracy_vs_time.csv",
    log:
        "results/logs/tabulate_tradeoff.log",
    params:
        code=code_of("tabulate_tradeoff"),
    message:
        "tabulate what accuracy costs in time"
    script:
        "../scripts/tabulate_tradeoff.py"
