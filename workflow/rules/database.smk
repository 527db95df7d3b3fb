# Corresponding coarse and fine deformations in one file, and which of them are held out.


rule assemble_database:
    input:
        body="results/data/{body}/body.h5",
        loads="results/data/{body}/{regime}/loads.csv",
        fine=lambda wildcards: fine_batches(wildcards.body, wildcards.regime),
        coarse="results/data/{body}/{regime}/coarse.h5",
        code=SIMULATING + sources("enrichment/assemble", "enrichment/database", "enrichment/database_fields"),
    output:
        database="results/data/{body}/{regime}/database.h5",
        peaks="results/data/{body}/{regime}/sample_peaks.csv",
    log:
        "results/logs/{body}/{regime}/assemble_database.log",
    params:
        settings=lambda wildcards: {
            "seed": config["seed"],
            "body": body_entry(wildcards.body),
            "magnitudes": config["bodies"][wildcards.body]["magnitudes"],
            "regime": config["regimes"][wildcards.regime],
            "solver": config["solver"],
        },
    message:
        "assemble the database: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/assemble_database.py"


rule split_samples:
    input:
        loads="results/data/{body}/{regime}/loads.csv",
        code=sources("enrichment/split"),
    output:
        parts="results/data/{body}/{regime}/split.csv",
        counts="results/data/{body}/{regime}/splits.csv",
    log:
        "results/logs/{body}/{regime}/split_samples.log",
    params:
        train=lambda wildcards: config["bodies"][wildcards.body]["train"],
        test=lambda wildcards: config["bodies"][wildcards.body]["test"],
        seed=config["seed"],
    message:
        "split the samples: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/split_samples.py"
