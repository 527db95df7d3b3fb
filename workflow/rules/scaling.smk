# How cost and memory of each kernel grow, up to millions of elements.

SCALED = sources("bodies", "effects", "solvers", "enrichment", "calibration", "collision")


rule measure_scaling:
    input:
        code=SCALED
        + sources(
            "scenes",
            "evaluation/collision",
            "evaluation/collision_scenes",
            "evaluation/collision_truth",
            "evaluation/rival_trees",
            "evaluation/scaling",
            "evaluation/scaling_enrichment",
            "evaluation/scaling_growth",
            "evaluation/scaling_kernels",
            "evaluation/shape_matching_timing",
            "evaluation/spring_experiment",
        ),
    output:
        "results/data/scaling/{kernel}.csv",
    log:
        "results/logs/scaling/measure_scaling_{kernel}.log",
    wildcard_constraints:
        kernel="|".join(GROWING),
    # processor time needs no machine to itself, but a clock does
    threads: lambda wildcards: workflow.cores if wildcards.kernel == "cores" else 1
    resources:
        mem_mb=8000,
    params:
        sizes=lambda wildcards: config["scaling"].get(wildcards.kernel),
    message:
        "grow {wildcards.kernel}"
    script:
        "../scripts/measure_scaling.py"


rule draw_scaling:
    input:
        "results/tables/scaling.csv",
        code=PICTURES,
    output:
        drawn("scaling"),
    log:
        "results/logs/draw_scaling.log",
    message:
        "draw how cost and memory grow"
    script:
        "../scripts/draw_scaling.py"
