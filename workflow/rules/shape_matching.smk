# Paper 3's own experiments: integrators, modes, clusters, what shape matching costs, dampers, virtual body springs.


from palpate.scenes.scene import bodies_in

EXPERIMENTS = [
    "integrator_stability",
    "deformation_modes",
    "clusters",
    "cluster_goals",
    "shape_matching_timing",
    "body_springs",
]
CREEP = (config["shape_matching"]["creep"] or {}).get("scene")
if CREEP:
    EXPERIMENTS += ["maxwell_creep"]
    OPTIONAL += ["maxwell_creep"]
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
        clusters="results/tables/clusters.csv",
        goals="results/tables/cluster_goals.csv",
        modes="results/tables/deformation_modes.csv",
    log:
        "results/logs/tabulate_clusters.log",
    params:
        settings=config["shape_matching"]["clusters"],
        code=code_of("tabulate_clusters", "palpate.effects", "palpate.solvers"),
    message:
        "bend the column of 60 particles in clusters, and a block in each mode"
    script:
        "../scripts/tabulate_clusters.py"


rule tabulate_maxwell_creep:
    input:
        bodies=lambda wildcards: [
            f"results/data/{body}/body.h5" for body in bodies_in(config["scenes"][CREEP])
        ],
        motion=f"results/data/scenes/{CREEP}/motion.h5",
    output:
        "results/tables/maxwell_creep.csv",
    log:
        "results/logs/tabulate_maxwell_creep.log",
    params:
        name=CREEP,
        entry=lambda wildcards: config["scenes"][CREEP],
        code=code_of("tabulate_maxwell_creep", "palpate.effects"),
    message:
        "compare the creep of {params.name} with the closed solution"
    script:
        "../scripts/tabulate_maxwell_creep.py"


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
