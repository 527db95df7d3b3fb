# Paper 3, chapter 4: bounding structures on deforming scenes, beside python-fcl and coal where they are installed.

TREES = "palpate.studies.collision.compare_trees"
COLLISION = config["collision"]

TARGETS["collision"] = settled(
    f"{TREES}:measure_collision",
    "collision",
    threads=HALF,
    settings=some("collision", "frames", "refinements", "depths"),
    seed=config["seed"],
)
TARGETS["collision"] += settled(
    f"{TREES}:measure_collision_scaling",
    "collision_scaling",
    threads=HALF,
    triangles=COLLISION["triangles"],
    depths=COLLISION["depths"][:1],
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
