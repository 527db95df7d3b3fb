# What bodies are asked: loads, the fine and coarse responses to each, and both in one database; what is held out.


include: "functions/samples.smk"


rule choose_loads:
    input:
        body="results/data/{body}/body.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
    output:
        loads="results/data/{body}/{regime}/loads.csv",
        warned="results/data/{body}/{regime}/loads_warned.txt",
    log:
        "results/logs/{body}/{regime}/choose_loads.log",
    wildcard_constraints:
        regime="|".join(POINTS) or "nothing",
    params:
        magnitudes=lambda wildcards: config["bodies"][wildcards.body]["magnitudes"],
        peak_of_size=lambda wildcards: config["enrichment"]["regimes"][wildcards.regime]["peak_of_size"],
        samples=lambda wildcards: count(wildcards.body, wildcards.regime),
        seed=config["seed"],
        code=code_of("choose_loads"),
    message:
        "choose forces on nodes: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/choose_loads.py"


rule choose_presses:
    input:
        body="results/data/{body}/body.h5",
    output:
        loads="results/data/{body}/{regime}/loads.csv",
        warned="results/data/{body}/{regime}/loads_warned.txt",
    log:
        "results/logs/{body}/{regime}/choose_presses.log",
    wildcard_constraints:
        regime="|".join([*REGIMES, *FINGERS]) or "nothing",
    params:
        contacts=config.get("tradeoff", {}).get("contacts"),
        presses=config.get("tradeoff", {}).get("presses"),
        regime=lambda wildcards: config["regimes"][wildcards.regime],
        radius_m=lambda wildcards: radius(wildcards.body, wildcards.regime),
        seed=config["seed"],
        code=code_of("choose_presses"),
    message:
        "find the forces of presses: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/choose_presses.py"


rule simulate_fine:
    input:
        body="results/data/{body}/body.h5",
        loads="results/data/{body}/{regime}/loads.csv",
    output:
        "results/data/{body}/{regime}/fine_{batch}.h5",
    log:
        "results/logs/{body}/{regime}/simulate_fine_{batch}.log",
    params:
        samples_per_job=config["solver"]["samples_per_job"],
        order=lambda wildcards: order(wildcards.regime),
        tolerance=config["solver"]["reference_tolerance"],
        code=code_of("simulate_fine"),
    message:
        "simulate the fine mesh: {wildcards.body}, {wildcards.regime}, batch {wildcards.batch}"
    script:
        "../scripts/simulate_fine.py"


rule simulate_coarse:
    input:
        body="results/data/{body}/body.h5",
        loads="results/data/{body}/{regime}/loads.csv",
    output:
        "results/data/{body}/{regime}/coarse_live.h5",
    log:
        "results/logs/{body}/{regime}/simulate_coarse.log",
    params:
        tolerance=config["solver"]["tolerance"],
        code=code_of("simulate_coarse"),
    message:
        "simulate the coarse mesh: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/simulate_coarse.py"


rule subsample_coarse:
    input:
        body="results/data/{body}/body.h5",
        fine=lambda wildcards: fine_batches(wildcards.body, wildcards.regime),
    output:
        "results/data/{body}/{regime}/coarse_paper.h5",
    log:
        "results/logs/{body}/{regime}/subsample_coarse.log",
    params:
        code=code_of("subsample_coarse"),
    message:
        "subsample the coarse nodes from the fine mesh: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/subsample_coarse.py"


rule assemble_database:
    input:
        body="results/data/{body}/body.h5",
        loads="results/data/{body}/{regime}/loads.csv",
        fine=lambda wildcards: fine_batches(wildcards.body, wildcards.regime),
        paper="results/data/{body}/{regime}/coarse_paper.h5",
        live="results/data/{body}/{regime}/coarse_live.h5",
    output:
        "results/data/{body}/{regime}/database.h5",
    log:
        "results/logs/{body}/{regime}/assemble_database.log",
    params:
        settings=lambda wildcards: {
            "seed": config["seed"],
            "body": body_entry(wildcards.body),
            "loads": loads_entry(wildcards.body, wildcards.regime),
            "solver": config["solver"],
        },
        code=code_of("assemble_database"),
    message:
        "assemble the database: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/assemble_database.py"


rule split_samples:
    input:
        database="results/data/{body}/{regime}/database.h5",
    output:
        "results/data/{body}/{regime}/samples.csv",
    log:
        "results/logs/{body}/{regime}/split_samples.log",
    wildcard_constraints:
        regime="|".join(POINTS) or "nothing",
    params:
        train=lambda wildcards: config["bodies"][wildcards.body]["train"],
        test=lambda wildcards: config["bodies"][wildcards.body]["test"],
        seed=config["seed"],
        code=code_of("split_samples"),
    message:
        "split the samples: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/split_samples.py"


rule deal_folds:
    input:
        database="results/data/{body}/{regime}/database.h5",
    output:
        "results/data/{body}/{regime}/samples.csv",
    log:
        "results/logs/{body}/{regime}/deal_folds.log",
    wildcard_constraints:
        regime="|".join([*REGIMES, *FINGERS]) or "nothing",
    params:
        seed=config["seed"],
        code=code_of("deal_folds"),
    message:
        "deal the contacts into five folds: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/deal_folds.py"
