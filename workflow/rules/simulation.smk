# What is done to it: loads, and the fine and coarse simulations of each.

SIMULATING = sources("bodies", "effects", "solvers", "scenes/loads", "scenes/press")


rule choose_loads:
    input:
        body="results/data/{body}/body.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        code=sources("bodies", "effects", "solvers", "scenes/loads"),
    output:
        "results/data/{body}/{regime}/loads.csv",
    log:
        "results/logs/{body}/{regime}/choose_loads.log",
    params:
        magnitudes=lambda wildcards: config["bodies"][wildcards.body]["magnitudes"],
        regime=lambda wildcards: config["regimes"][wildcards.regime],
        samples=lambda wildcards: count(wildcards.body),
        seed=config["seed"],
    message:
        "choose loads: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/choose_loads.py"


rule simulate_fine:
    input:
        body="results/data/{body}/body.h5",
        loads="results/data/{body}/{regime}/loads.csv",
        code=SIMULATING,
    output:
        "results/data/{body}/{regime}/fine_{batch}.h5",
    log:
        "results/logs/{body}/{regime}/simulate_fine_{batch}.log",
    params:
        samples_per_job=config["solver"]["samples_per_job"],
        tolerance=config["solver"]["reference_tolerance"],
    message:
        "simulate the fine mesh: {wildcards.body}, {wildcards.regime}, batch {wildcards.batch}"
    script:
        "../scripts/simulate_fine.py"


rule simulate_coarse:
    input:
        body="results/data/{body}/body.h5",
        loads="results/data/{body}/{regime}/loads.csv",
        code=SIMULATING,
    output:
        "results/data/{body}/{regime}/coarse.h5",
    log:
        "results/logs/{body}/{regime}/simulate_coarse.log",
    params:
        tolerance=config["solver"]["tolerance"],
    message:
        "simulate the coarse mesh: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/simulate_coarse.py"


rule tabulate_fem_cost:
    input:
        fine=[file for body in BODIES for regime in REGIMES for file in fine_batches(body, regime)],
        code=SIMULATING,
    output:
        "results/tables/fem_cost.csv",
    log:
        "results/logs/tabulate_fem_cost.log",
    message:
        "tabulate what the fine simulations cost"
    script:
        "../scripts/tabulate_fem_cost.py"
