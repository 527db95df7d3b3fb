# Pictures, each as PNG and SVG. They read tables; those of bodies also read body, database and predictions.

DRAWING = PICTURES + sources("bodies", "enrichment/database", "enrichment/database_fields")


rule draw_meshes:
    input:
        bodies=expand("results/data/{body}/body.h5", body=BODIES),
        code=DRAWING,
    output:
        drawn("mesh_levels"),
    log:
        "results/logs/draw_meshes.log",
    message:
        "draw the meshes"
    script:
        "../scripts/draw_meshes.py"


rule draw_responses:
    input:
        body="results/data/{body}/body.h5",
        database="results/data/{body}/{regime}/database.h5",
        predictions="results/data/{body}/{regime}/predictions.h5",
        code=DRAWING,
    output:
        deformed=drawn("deformed_{body}_{regime}"),
        errors=drawn("error_over_body_{body}_{regime}"),
        turnable="results/figures/error_over_body_{body}_{regime}.json",
    log:
        "results/logs/{body}/{regime}/draw_responses.log",
    message:
        "draw responses and errors: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/draw_responses.py"


rule draw_sweep:
    input:
        sweep="results/tables/sigma_sweep.csv",
        accuracy="results/tables/enrichment_accuracy.csv",
        paper=PAPER,
        code=DRAWING,
    output:
        drawn("sigma_sweep"),
    log:
        "results/logs/draw_sweep.log",
    message:
        "draw the sweep of sigma"
    script:
        "../scripts/draw_sweep.py"


rule draw_costs:
    input:
        timing="results/tables/enrichment_timing.csv",
        complexity="results/tables/complexity.csv",
        accuracy="results/tables/enrichment_accuracy.csv",
        online="results/tables/online_cost.csv",
        fem="results/tables/fem_cost.csv",
        peaks="results/tables/sample_peaks.csv",
        code=DRAWING,
    output:
        timing=drawn("timing_bars"),
        complexity=drawn("complexity"),
        tradeoff=drawn("accuracy_vs_time"),
        fem=drawn("fem_cost"),
    log:
        "results/logs/draw_costs.log",
    message:
        "draw times and costs"
    script:
        "../scripts/draw_costs.py"
