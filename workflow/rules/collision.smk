# Paper 3, chapter 4: bounding structures on deforming scenes, beside python-fcl and coal where they are installed.

COLLISION_TABLES = ("collision", "collision_scaling", "collision_precision", "collision_apart")
TARGETS["collision"] = tabulated(*COLLISION_TABLES) + figures("collision", *COLLISION_TABLES)


rule measure_collision:
    output:
        "results/tables/collision.csv",
    log:
        "results/logs/measure_collision.log",
    threads: HALF
    params:
        **calls("palpate.studies.collision.compare_trees:measure_collision"),
        settings=some("collision", "frames", "refinements", "depths"),
        seed=config["seed"],
    script:
        "../job.py"


rule measure_collision_scaling:
    output:
        "results/tables/collision_scaling.csv",
    log:
        "results/logs/measure_collision_scaling.log",
    threads: HALF
    params:
        **calls("palpate.studies.collision.compare_trees:measure_collision_scaling"),
        triangles=config["collision"]["triangles"],
        depths=config["collision"]["depths"][:1],
    script:
        "../job.py"


rule measure_collision_precision:
    output:
        precision="results/tables/collision_precision.csv",
        apart="results/tables/collision_apart.csv",
    log:
        "results/logs/measure_collision_precision.log",
    threads: HALF
    params:
        **some("collision", "stopped", "apart", "depths", "refinements"),
        **calls("palpate.studies.collision.stopped_precision:measure_collision_precision"),
        seed=config["seed"],
    script:
        "../job.py"
