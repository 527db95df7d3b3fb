# What accuracy costs in time: every model over its knob, on samples whose contacts it never saw.

TRADING = sources(
    "bodies", "effects", "solvers", "scenes", "enrichment", "calibration", "collision", "models"
)
# errors and online times come from the same answers
MEASURED_ON = {
    "body": "results/data/{body}/body.h5",
    "database": "results/data/{body}/{regime}/database.h5",
    "split": "results/data/{body}/{regime}/split.csv",
    "coarse": "results/data/{body}/{regime}/coarse.h5",
}


rule measure_models:
    input:
        **MEASURED_ON,
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        fine=lambda wildcards: fine_batches(wildcards.body, wildcards.regime),
        own=lambda wildcards: [OWN_MODELS[wildcards.family]] if wildcards.family in OWN_MODELS else [],
        code=TRADING + sources("evaluation/accuracy", "evaluation/tradeoff"),
    output:
        samples="results/data/{body}/{regime}/tradeoff/families/{family}_samples.csv",
        knobs="results/data/{body}/{regime}/tradeoff/families/{family}_knobs.csv",
    log:
        "results/logs/{body}/{regime}/measure_models_{family}.log",
    threads: HALF
    params:
        models=lambda wildcards: FAMILIES[wildcards.family],
        own=OWN_MODELS,
        enrichment=config["enrichment"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        radius=lambda wildcards: config["regimes"][wildcards.regime]["radius_m"],
        repeats=config["timing"]["repeats"],
        budget=config["tradeoff"]["budget_s"],
    message:
        "measure the models of {wildcards.family}: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/measure_models.py"


rule measure_own_error:
    input:
        **MEASURED_ON,
        fine=lambda wildcards: fine_batches(wildcards.body, wildcards.regime),
        code=TRADING + sources("evaluation/accuracy", "evaluation/tradeoff", "evaluation/own_error"),
    output:
        samples="results/data/{body}/{regime}/tradeoff/families/reference_samples.csv",
        knobs="results/data/{body}/{regime}/tradeoff/families/reference_knobs.csv",
    log:
        "results/logs/{body}/{regime}/measure_own_error.log",
    params:
        enrichment=config["enrichment"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        radius=lambda wildcards: config["regimes"][wildcards.regime]["radius_m"],
        samples=config["tradeoff"]["reference_samples"],
    message:
        "simulate one level finer: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/measure_own_error.py"


ruleorder: measure_own_error > measure_models


rule tabulate_tradeoff:
    input:
        knobs=expand(each("tradeoff/families/{{family}}_knobs.csv"), family=[*FAMILIES, "reference"]),
        samples=expand(each("tradeoff/families/{{family}}_samples.csv"), family=[*FAMILIES, "reference"]),
        code=TRADING + sources("evaluation/accuracy_vs_time", "evaluation/provenance"),
    output:
        table="results/tables/accuracy_vs_time.csv",
        samples=expand(each("tradeoff/{{model}}.csv"), model=[*COMPARED, "reference"]),
    log:
        "results/logs/tabulate_tradeoff.log",
    message:
        "tabulate what accuracy costs in time"
    script:
        "../scripts/tabulate_tradeoff.py"
