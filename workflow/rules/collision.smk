# Paper 3, chapter 4: bounding structures on deforming scenes, beside python-fcl and coal where they are installed.

TARGETS["collision"] = settled(
    "palpate.studies.collision.compare_trees:measure_collision",
    "collision",
    threads=HALF,
    settings=some("collision", "frames", "refinements", "depths"),
    seed=config["seed"],
)
TARGETS["collision"] += settled(
    "palpate.studies.collision.compare_trees:measure_collision_scaling",
    "collision_scaling",
    threads=HALF,
    triangles=config["collision"]["triangles"],
    depths=config["collision"]["depths"][:1],
)
TARGETS["collision"] += settled(
    "palpate.studies.collision.stopped_precision:measure_collision_precision",
    "collision_precision",
    "collision_apart",
    threads=HALF,
    seed=config["seed"],
    **some("collision", "stopped", "apart", "depths", "refinements"),
)
TARGETS["collision"] += figures("collision", "collision", "collision_scaling", "collision_precision", "collision_apart")
