# Paper 1's regressors: the error for every kernel width, which is its figure 4.


rule sweep_sigma:
    input:
        database="results/data/{body}/{regime}/database.h5",
        split="results/data/{body}/{regime}/split.csv",
        code=sources("bodies", "enrichment", "evaluation/sweep"),
    output:
        "results/data/{body}/{regime}/sigma_sweep.csv",
    log:
        "results/logs/{body}/{regime}/sweep_sigma.log",
    params:
        enrichment=config["enrichment"],
        cases=CASES,
        seed=config["seed"],
    message:
        "sweep sigma: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/sweep_sigma.py"
