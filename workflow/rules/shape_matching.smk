# Paper 3's own experiments: integrators, modes, clusters, what shape matching costs, dampers, virtual body springs.


MEASURED_HERE = [
    "integrator_stability",
    "deformation_modes",
    "clusters",
    "cluster_goals",
    "body_springs",
    "shape_matching_timing",
]
CREEP = (config["shape_matching"]["creep"] or {}).get("scene")
SHAPE_MATCHING_SHOWN = drawn("shape_matching", *MEASURED_HERE, *(["maxwell_creep"] if CREEP else []))


rule measure_experiments:
    output:
        **dict(zip(MEASURED_HERE, map(in_report, tables(*MEASURED_HERE)))),
    log:
        "results/logs/measure_experiments.log",
    benchmark:
        "results/benchmarks/measure_experiments.tsv"
    # some are timed
    threads: HALF
    params:
        **calls("palpate.studies.shape_matching.clusters:measure_experiments", "palpate.effects", "palpate.solvers"),
        **some("shape_matching", "integrator_stability", "clusters", "body_springs", "shape_matching_timing"),
    script:
        "../job.py"


rule tabulate_shape_matching:
    input:
        read_by(SHAPE_MATCHING_SHOWN, "maxwell_creep"),
        bodies=[f"results/data/{body}/body.h5" for body in settings.scenes[CREEP].bodies] if CREEP else [],
        motion=f"results/data/scenes/{CREEP}/motion.h5" if CREEP else [],
    output:
        figures(*SHAPE_MATCHING_SHOWN),
        **({"creep": in_report("results/tables/maxwell_creep.csv")} if CREEP else {}),
    log:
        "results/logs/tabulate_shape_matching.log",
    params:
        **calls(
            "palpate.studies.shape_matching.maxwell_creep:tabulate_shape_matching",
            "palpate.effects",
            draws=SHAPE_MATCHING_SHOWN,
        ),
        scene=config["scenes"][CREEP] | {"name": CREEP} if CREEP else None,
    script:
        "../job.py"


rule shape_matching:
    input:
        rules.measure_experiments.output,
        rules.tabulate_shape_matching.output,
        page="results/report_shape_matching.html",
