# How wrong each method is, what it costs online, and what that says of the paper's claims.


rule evaluate_methods:
    input:
        database="results/data/{body}/{regime}/database.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        split="results/data/{body}/{regime}/split.csv",
        code=sources("bodies", "effects", "solvers", "enrichment", "evaluation/accuracy"),
    output:
        accuracy="results/data/{body}/{regime}/enrichment_accuracy.csv",
        predictions="results/data/{body}/{regime}/predictions.h5",
    log:
        "results/logs/{body}/{regime}/evaluate_methods.log",
    params:
        enrichment=config["enrichment"],
        cases=CASES,
        shown=SHOWN,
        seed=config["seed"],
    message:
        "evaluate all methods: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/evaluate_methods.py"


rule time_methods:
    input:
        body="results/data/{body}/body.h5",
        loads=f"results/data/{{body}}/{REGIMES[0]}/loads.csv",
        database=f"results/data/{{body}}/{REGIMES[0]}/database.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, REGIMES[0]),
        split=f"results/data/{{body}}/{REGIMES[0]}/split.csv",
        paper=PAPER,
        code=sources("bodies", "effects", "solvers", "scenes", "enrichment", "evaluation"),
    output:
        timing="results/data/{body}/enrichment_timing.csv",
        cost="results/data/{body}/online_cost.csv",
    log:
        "results/logs/{body}/time_methods.log",
    threads: HALF
    params:
        enrichment=config["enrichment"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        repeats=config["timing"]["repeats"],
    message:
        "time all methods: {wildcards.body}"
    script:
        "../scripts/time_methods.py"


rule time_complexity:
    input:
        code=sources(
            "enrichment/kernel",
            "enrichment/ordering",
            "enrichment/weights",
            "evaluation/complexity",
        ),
    output:
        "results/tables/complexity.csv",
    log:
        "results/logs/time_complexity.log",
    threads: workflow.cores
    params:
        samples=config["timing"]["complexity_samples"],
        seed=config["seed"],
    message:
        "time how the cost grows with features and samples, alone"
    script:
        "../scripts/time_complexity.py"


rule check_claims:
    input:
        accuracy="results/tables/enrichment_accuracy.csv",
        sweep="results/tables/sigma_sweep.csv",
        complexity="results/tables/complexity.csv",
        timing="results/tables/enrichment_timing.csv",
        paper=PAPER,
        code=sources("evaluation/claims"),
    output:
        "results/tables/claims.csv",
    log:
        "results/logs/check_claims.log",
    message:
        "check the paper's claims"
    script:
        "../scripts/check_claims.py"
