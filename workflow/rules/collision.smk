# Paper 3, chapter 4: bounding structures on deforming scenes, beside python-fcl and coal where they are installed.

TARGETS["collision"] = tabulated(
    "collision", "collision_scaling", "collision_precision", "collision_apart"
) + figures("collision", "collision", "collision_scaling", "collision_precision", "collision_apart")


rule measure_collision:
    output:
        "results/tables/collision.csv",
    log:
        "results/logs/measure_collision.log",
    threads: HALF
    params:
        settings={key: config["collision"][key] for key in ("frames", "refinements", "depths")},
        seed=config["seed"],
        code=code_of("measure_collision"),
    message:
        "compare bounding structures on deforming scenes"
    script:
        "../scripts/measure_collision.py"


rule measure_collision_scaling:
    output:
        "results/tables/collision_scaling.csv",
    log:
        "results/logs/measure_collision_scaling.log",
    threads: HALF
    params:
        triangles=config["collision"]["triangles"],
        depths=config["collision"]["depths"][:1],
        code=code_of("measure_collision_scaling"),
    message:
        "grow bounding structures"
    script:
        "../scripts/measure_collision_scaling.py"


rule measure_collision_precision:
    output:
        precision="results/tables/collision_precision.csv",
        apart="results/tables/collision_apart.csv",
    log:
        "results/logs/measure_collision_precision.log",
    threads: HALF
    params:
        stopped=config["collision"]["stopped"],
        apart=config["collision"]["apart"],
        depths=config["collision"]["depths"],
        refinements=config["collision"]["refinements"],
        seed=config["seed"],
        code=code_of("measure_collision_precision"),
    message:
        "stop bounding trees early, and search them between bodies that are apart"
    script:
        "../scripts/measure_collision_precision.py"
