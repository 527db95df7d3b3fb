# Paper 3's own experiments: integrators, modes, clusters, what shape matching costs, dampers, virtual body springs.


MEASURED_HERE = ["integrator_stability", "deformation_modes", "clusters", "cluster_goals", "body_springs"]
CREEP = (config["shape_matching"]["creep"] or {}).get("scene")
SHAPE_MATCHING_SHOWN = drawn(
    "shape_matching", *MEASURED_HERE, "shape_matching_timing", *(["maxwell_creep"] if CREEP else [])
)


rule measure_experiments:
    output:
        **dict(zip(MEASURED_HERE, map(in_report, tables(*MEASURED_HERE)))),
    log:
        "results/logs/measure_experiments.log",
    benchmark:
        "results/benchmarks/measure_experiments.tsv"
    params:
        **calls("palpate.studies.shape_matching.clusters:measure_experiments", "palpate.effects", "palpate.solvers"),
        **some("shape_matching", "integrator_stability", "clusters", "body_springs"),
    script:
        "../job.py"


rule time_shape_matching:
    output:
        in_report("results/tables/shape_matching_timing.csv"),
    log:
        "results/logs/time_shape_matching.log",
    threads: HALF
    params:
        **calls("palpate.studies.shape_matching.shape_matching_timing:time_shape_matching"),
        settings=config["shape_matching"]["shape_matching_timing"],
    script:
        "../job.py"


rule tabulate_maxwell_creep:
    input:
        bodies=lambda wildcards: [f"results/data/{body}/body.h5" for body in settings.scenes[CREEP].bodies],
        motion=f"results/data/scenes/{CREEP}/motion.h5",
    output:
        in_report("results/tables/maxwell_creep.csv"),
    log:
        "results/logs/tabulate_maxwell_creep.log",
    params:
        **calls("palpate.studies.shape_matching.maxwell_creep:tabulate_maxwell_creep", "palpate.effects"),
        scene=lambda wildcards: config["scenes"][CREEP] | {"name": CREEP},
    script:
        "../job.py"


rule draw_shape_matching:
    input:
        read_by(SHAPE_MATCHING_SHOWN),
    output:
        figures(*SHAPE_MATCHING_SHOWN),
    log:
        "results/logs/draw_shape_matching.log",
    localrule: True
    params:
        **draws(SHAPE_MATCHING_SHOWN),
    script:
        "../job.py"


rule shape_matching:
    input:
        rules.measure_experiments.output,
        rules.time_shape_matching.output,
        rules.tabulate_maxwell_creep.output if CREEP else [],
        rules.draw_shape_matching.output,
        page="results/report_shape_matching.html",
