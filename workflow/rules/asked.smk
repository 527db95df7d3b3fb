# What the settings ask for, as files: tables, figures, and the parts that are merged into them.

# tables of which each body, or each body and regime, makes its part
PARTS = {
    table: each(f"{table}.csv") for table in ("sigma_sweep", "enrichment_accuracy", "sample_peaks", "splits")
} | {
    table: expand("results/data/{body}/{table}.csv", body=BODIES, table=table)
    for table in ("enrichment_timing", "online_cost")
}
TABLES = [*PARTS, "mesh_sizes", "mesh_quality", "fem_cost", "complexity", "claims"]
FIGURES = [
    "mesh_levels",
    "sigma_sweep",
    "complexity",
    "timing_bars",
    "accuracy_vs_time",
    "fem_cost",
] + expand(
    "{figure}_{body}_{regime}",
    figure=["deformed", "error_over_body"],
    body=BODIES,
    regime=REGIMES,
)
# paper 3's experiments, each a table and a figure
SOFT_BODIES = ["integrator_stability", "clusters", "shape_matching_timing", "body_springs"]
# chapter 4 of paper 3: tables, and the two that are drawn
COLLISION = ["collision", "collision_scaling", "collision_claims"]
# paper 2: what is pressed, without how long searches go on; the tables that each method fills; what they fit
SPRING_PHYSICS = {
    key: value for key, value in config["calibration"].items() if key not in ("searches", "floor")
}
SPRING_TABLES = ["spring_fit", "spring_history", "spring_errors"]
SPRING_METHODS = [
    "uniform",
    "van_gelder",
    "lloyd",
    "genetic",
    "cma_es",
    "gradient",
    "gradient_smooth",
    "gradient_all",
]

SPRING_PARTS = {
    table: expand(
        f"results/data/springs/{{force}}/{{method}}/{table}.csv",
        force=["springs", "volume"],
        method=SPRING_METHODS,
    )
    for table in SPRING_TABLES
} | {
    "spring_floor": expand(
        "results/data/springs/floor_{poisson}.csv", poisson=config["calibration"]["floor"]["poissons"]
    )
}


def drawn(*stems):
    """The files of some figures."""
    return [f"results/figures/{stem}.{suffix}" for stem in stems for suffix in ("png", "svg")]


def tabulated(*names):
    """The files of some tables."""
    return [f"results/tables/{name}.csv" for name in names]


# what reproducing a paper means, and what the scenes leave behind
PAPERS = {
    "enrichment": tabulated(*TABLES)
    + drawn(*FIGURES)
    + expand("results/figures/error_over_body_{body}_{regime}.json", body=BODIES, regime=REGIMES),
    "soft_bodies": tabulated(*SOFT_BODIES) + drawn(*SOFT_BODIES),
    "springs": tabulated(*SPRING_PARTS) + drawn("spring_fit", "spring_errors", "spring_floor"),
    "collision": tabulated(*COLLISION) + drawn("collision", "collision_scaling"),
}
CT_RESULTS = (
    tabulated("node_mass", "mesh_quality")
    + drawn("node_mass", *(f"{figure}_{body}" for figure in ("ct_slices", "ct_volume") for body in CTS))
    if CTS
    else []
)
MOTIONS = (
    tabulated("scene_effects", "effects", "energy")
    + drawn("energy", "effects", *(f"motion_{scene}" for scene in SCENES))
    + expand("results/figures/motion_{scene}.{suffix}", scene=SCENES, suffix=["gif", "json"])
    + expand("results/motion/{scene}", scene=SCENES)
    + (tabulated("contacts", "contact_force") if TOUCHING else [])
    + drawn(*(f"contact_force_{scene}" for scene in DRIVEN))
    if SCENES
    else []
)


# what accuracy costs in time: models by family, one job each, and the user's own
OWN_MODELS = {
    name: normpath(CONFIG_FILE.parent / path)
    for name, path in config.get("tradeoff", {}).get("own_models", {}).items()
}
COMPARED = [*(config.get("tradeoff", {}).get("models") or MODELS), *OWN_MODELS]
FAMILIES = families(COMPARED, OWN_MODELS)
TRADEOFF = (
    tabulated("accuracy_vs_time", "advice")
    + drawn("advice", "break_even")
    + expand(
        "results/figures/work_precision_{body}_{regime}.{suffix}",
        body=BODIES,
        regime=REGIMES,
        suffix=["png", "svg"],
    )
    if "tradeoff" in config
    else []
)


# how cost and memory grow: a job a kernel
GROWING = ["fem", "fine_nodes", "samples", "triangles", "particles", "cores"]
SCALING_PARTS = {"scaling": expand("results/data/scaling/{kernel}.csv", kernel=GROWING)}
# situations in which numerics may fail: a job a family
HARD_PARTS = {
    "hard_cases": expand(
        "results/data/hard_cases/{family}.csv", family=config.get("hard_cases", {}).get("families", [])
    )
}
# how wrong models are in motion: a job a scene
DYNAMIC_PARTS = {
    "dynamic_accuracy": expand(
        "results/data/dynamic/{scene}/accuracy.csv", scene=config.get("dynamic", {}).get("durations_s", [])
    )
}
MERGED = PARTS | SPRING_PARTS | SCALING_PARTS | HARD_PARTS | DYNAMIC_PARTS
HARD_CASES = tabulated("hard_cases") + drawn("hard_cases") if "hard_cases" in config else []
DYNAMIC = tabulated("dynamic_accuracy") + drawn("dynamic_accuracy") if "dynamic" in config else []
SCALING = tabulated("scaling") + drawn("scaling") if "scaling" in config else []
# the parts of the report that compare models, those that are asked for
STORY = {
    part: files
    for part, files in {
        "tradeoff": TRADEOFF,
        "dynamic": DYNAMIC,
        "hard_cases": HARD_CASES,
        "scaling": SCALING,
    }.items()
    if files
}
