# Paper 3's own experiments: integrators, clusters, what shape matching costs, virtual body springs.

EXPERIMENTS = ["integrator_stability", "clusters", "shape_matching_timing", "body_springs"]
TARGETS["shape_matching"] = tabulated(*EXPERIMENTS) + figures("shape_matching", *EXPERIMENTS)


rule tabulate_integrator_stability:
    output:
        "results/tables/integrator_stability.csv",
    log:
        "results/logs/tabulate_integrator_stability.log",
    params:
        settings=config["shape_matching"]["integrator_stability"],
        code=code_of("tabulate_integrator_stability"),
    message:
        "measure which steps integrators stand"
    script:
        "../scripts/tabulate_integrator_stability.py"


rule tabulate_clusters:
    output:
        "results/tables/clusters.csv",
    log:
        "results/logs/tabulate_clusters.log",
    params:
        settings=config["shape_matching"]["clusters"],
        code=code_of("tabulate_clusters", "palpate.effects", "palpate.solvers"),
    message:
        "bend the column of 60 particles in clusters"
    script:
        "../scripts/tabulate_clusters.py"


rule time_shape_matching:
    output:
        "results/tables/shape_matching_timing.csv",
    log:
        "results/logs/time_shape_matching.log",
    threads: workflow.cores
    params:
        settings=config["shape_matching"]["shape_matching_timing"],
        code=code_of("time_shape_matching"),
    message:
        "time shape matching, alone"
    script:
        "../scripts/time_shape_matching.py"


rule tabulate_body_springs:
    output:
        "results/tables/body_springs.csv",
    log:
        "results/logs/tabulate_body_springs.log",
    params:
        settings=config["shape_matching"]["body_springs"],
        code=code_of("tabulate_body_springs", "palpate.effects", "palpate.solvers"),
    message:
        "poke a surface with and without virtual body springs"
    script:
        "../scripts/tabulate_body_springs.py"
