# Paper 3, chapter 4: bounding structures on deforming scenes, beside python-fcl and coal where they are installed.


rule measure_collision:
    output:
        collision=in_report("results/tables/collision.csv"),
        scaling=in_report("results/tables/collision_scaling.csv"),
    log:
        "results/logs/measure_collision.log",
    benchmark:
        "results/benchmarks/measure_collision.tsv"
    threads: HALF
    params:
        **calls("palpate.studies.collision.compare_trees:measure_collision"),
        **some("collision", "frames", "refinements", "depths", "triangles"),
        seed=config["seed"],
    script:
        "../job.py"


rule measure_collision_precision:
    output:
        collision_precision=in_report("results/tables/collision_precision.csv"),
        collision_apart=in_report("results/tables/collision_apart.csv"),
    log:
        "results/logs/measure_collision_precision.log",
    benchmark:
        "results/benchmarks/measure_collision_precision.tsv"
    threads: HALF
    params:
        **calls("palpate.studies.collision.stopped_precision:measure_collision_precision"),
        **some("collision", "stopped", "apart", "depths", "refinements"),
        seed=config["seed"],
    script:
        "../job.py"


COLLISION_SHOWN = drawn("collision", "collision", "collision_scaling", "collision_precision", "collision_apart")


rule draw_collision:
    input:
        read_by(COLLISION_SHOWN),
    output:
        figures(*COLLISION_SHOWN),
    log:
        "results/logs/draw_collision.log",
    localrule: True
    params:
        **calls("palpate.files:merge", draws=COLLISION_SHOWN),
    script:
        "../job.py"


rule collision:
    input:
        rules.measure_collision.output,
        rules.measure_collision_precision.output,
        rules.draw_collision.output,
        page="results/report_collision.html",
