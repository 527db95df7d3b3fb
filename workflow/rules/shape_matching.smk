# Paper 3's own experiments: integrators, modes, clusters, what shape matching costs, dampers, virtual body springs.


from palpate.scenes.scene import bodies_in

MEASURED_HERE = ["integrator_stability", "deformation_modes", "clusters", "cluster_goals", "body_springs"]
CREEP = (config["shape_matching"]["creep"] or {}).get("scene")
OPTIONAL["shape_matching"] += ["maxwell_creep"] if CREEP else []
TARGETS["shape_matching"] = settled(
    "palpate.studies.shape_matching.clusters:measure_experiments",
    *MEASURED_HERE,
    lazily=["palpate.effects", "palpate.solvers"],
    **some("shape_matching", "integrator_stability", "clusters", "body_springs"),
) + settled(
    "palpate.studies.shape_matching.shape_matching_timing:time_shape_matching",
    "shape_matching_timing",
    threads=HALF,
    settings=config["shape_matching"]["shape_matching_timing"],
)
TARGETS["shape_matching"] += (tabulated("maxwell_creep") if CREEP else []) + figures(
    "shape_matching", *MEASURED_HERE, "shape_matching_timing", *(["maxwell_creep"] if CREEP else [])
)


rule tabulate_maxwell_creep:
    input:
        bodies=lambda wildcards: [f"results/data/{body}/body.h5" for body in bodies_in(config["scenes"][CREEP])],
        motion=f"results/data/scenes/{CREEP}/motion.h5",
    output:
        "results/tables/maxwell_creep.csv",
    log:
        "results/logs/tabulate_maxwell_creep.log",
    params:
        **calls("palpate.studies.shape_matching.maxwell_creep:tabulate_maxwell_creep", ["palpate.effects"]),
        name=CREEP,
        entry=lambda wildcards: config["scenes"][CREEP],
    script:
        "../job.py"
