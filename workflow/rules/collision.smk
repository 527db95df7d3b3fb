# Paper 3, chapter 4: bounding structures on deforming scenes, beside python-fcl and coal where they are installed.

TARGETS["collision"] = tabulated("collision", "collision_scaling", "collision_claims") + figures(
    "collision", "collision", "collision_scaling"
)


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


rule check_collision_claims:
    input:
        "results/tables/collision.csv",
    output:
        "results/tables/collision_claims.csv",
    log:
        "results/logs/check_collision_claims.log",
    params:
        code=code_of("check_collision_claims"),
    message:
        "check what paper 3 says of its composite tree"
    script:
        "../scripts/check_collision_claims.py"
