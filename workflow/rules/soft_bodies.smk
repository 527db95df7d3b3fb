# Paper 3's own experiments: integrators, clusters, what shape matching costs, virtual body springs.


rule tabulate_integrator_stability:
    input:
        code=sources("bodies", "effects", "solvers", "scenes", "evaluation/integrator_stability"),
    output:
        "results/tables/integrator_stability.csv",
    log:
        "results/logs/tabulate_integrator_stability.log",
    params:
        settings=config["soft_bodies"]["integrator_stability"],
    message:
        "measure which steps integrators stand"
    script:
        "../scripts/tabulate_integrator_stability.py"


rule tabulate_clusters:
    input:
        code=sources("bodies", "effects", "solvers", "scenes", "evaluation/clusters"),
    output:
        "results/tables/clusters.csv",
    log:
        "results/logs/tabulate_clusters.log",
    params:
        settings=config["soft_bodies"]["clusters"],
    message:
        "bend the column of 60 particles in clusters"
    script:
        "../scripts/tabulate_clusters.py"


rule time_shape_matching:
    input:
        code=sources(
            "bodies",
            "effects",
            "solvers",
            "scenes",
            "evaluation/shape_matching_growth",
            "evaluation/shape_matching_timing",
        ),
    output:
        "results/tables/shape_matching_timing.csv",
    log:
        "results/logs/time_shape_matching.log",
    threads: workflow.cores
    params:
        settings=config["soft_bodies"]["shape_matching_timing"],
    message:
        "time shape matching, alone"
    script:
        "../scripts/time_shape_matching.py"


rule tabulate_body_springs:
    input:
        code=sources("bodies", "effects", "solvers", "scenes", "evaluation/body_springs"),
    output:
        "results/tables/body_springs.csv",
    log:
        "results/logs/tabulate_body_springs.log",
    params:
        settings=config["soft_bodies"]["body_springs"],
    message:
        "poke a surface with and without virtual body springs"
    script:
        "../scripts/tabulate_body_springs.py"


rule draw_soft_bodies:
    input:
        tabulated(*SOFT_BODIES),
        code=PICTURES,
    output:
        drawn(*SOFT_BODIES),
    log:
        "results/logs/draw_soft_bodies.log",
    message:
        "draw paper 3's experiments"
    script:
        "../scripts/draw_soft_bodies.py"
