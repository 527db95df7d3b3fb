# Paper 3, chapter 4: bounding structures on deforming scenes, beside python-fcl and coal where they are installed.

COLLIDING = sources(
    "bodies",
    "collision",
    "evaluation/collision",
    "evaluation/collision_scenes",
    "evaluation/collision_truth",
    "evaluation/rival_trees",
)


rule measure_collision:
    input:
        code=COLLIDING,
    output:
        "results/tables/collision.csv",
    log:
        "results/logs/measure_collision.log",
    threads: HALF
    params:
        settings={key: config["collision"][key] for key in ("frames", "refinements", "depths")},
        seed=config["seed"],
    message:
        "compare bounding structures on deforming scenes"
    script:
        "../scripts/measure_collision.py"


rule measure_collision_scaling:
    input:
        code=COLLIDING + sources("evaluation/collision_growth", "evaluation/collision_scaling"),
    output:
        "results/tables/collision_scaling.csv",
    log:
        "results/logs/measure_collision_scaling.log",
    threads: HALF
    params:
        triangles=config["collision"]["triangles"],
        depths=config["collision"]["depths"][:1],
    message:
        "grow bounding structures"
    script:
        "../scripts/measure_collision_scaling.py"


rule check_collision_claims:
    input:
        "results/tables/collision.csv",
        code=sources("evaluation/claims", "evaluation/collision_claims"),
    output:
        "results/tables/collision_claims.csv",
    log:
        "results/logs/check_collision_claims.log",
    message:
        "check what paper 3 says of its composite tree"
    script:
        "../scripts/check_collision_claims.py"


rule draw_collision:
    input:
        tabulated("collision", "collision_scaling"),
        code=PICTURES,
    output:
        drawn("collision", "collision_scaling"),
    log:
        "results/logs/draw_collision.log",
    message:
        "draw bounding structures"
    script:
        "../scripts/draw_collision.py"
