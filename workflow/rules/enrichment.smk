# Paper 1: the error of each way of enriching a coarse deformation, and what it costs online.

# every method is fitted and tested in each of these: protocol and split
COMPARISONS = [(protocol, split) for protocol in ("paper", "live") for split in ("samples", "contacts")]
# methods whose predictions are kept for pictures
SHOWN = ["unordered_nonnegative_a", "ordered_nonnegative_a", "interpolation", "detail_correction"]
# what the methods choose their widths with
REGRESSION = {key: config["enrichment"][key] for key in ("neighbours", "sigma_relative", "folds")}
# the numbers that the paper published
PAPER = published_of("enrichment")
RESPONSES = expand(
    "{figure}_{body}_{regime}", figure=["deformed", "error_over_body"], body=BODIES, regime=POINTS
)

# bodies held otherwise, and what all of these comparisons share
PREMISES = config["enrichment"]["premises"]["cases"]
PREMISE_BODIES = list(dict.fromkeys([*BODIES, *(case["body"] for case in PREMISES.values())]))
PREMISE_TABLES = ("premises", "premise_bodies", "feature_vectors", "database_memory")

TARGETS["enrichment"] = (
    [
        *(
            file
            for table in ("sigma_sweep", "enrichment_accuracy")
            for file in merged(table, points(f"{table}.csv"))
        ),
        *(
            file
            for table in ("enrichment_timing", "online_cost")
            for file in merged(table, expand("results/data/{body}/{table}.csv", body=BODIES, table=table))
        ),
    ]
    + tabulated("mesh_sizes", "mesh_quality", "sample_peaks", "splits", "fem_cost", "complexity")
    + tabulated(*PREMISE_TABLES)
    + figures("enrichment", "premises", "feature_vectors")
    + figures("enrichment", "sigma_sweep", published=True)
    + figures("enrichment", "complexity", "timing_bars", "accuracy_vs_online_cost", "fem_cost")
    + drawn("mesh_levels", *RESPONSES)
    + expand("results/figures/error_over_body_{body}_{regime}.json", body=BODIES, regime=POINTS)
)
WARNED += warned_of(BODIES) + points("loads_warned.txt") + ["results/data/premises_warned.txt"]


rule sweep_sigma:
    input:
        database="results/data/{body}/{regime}/database.h5",
        samples="results/data/{body}/{regime}/samples.csv",
    output:
        "results/data/{body}/{regime}/sigma_sweep.csv",
    log:
        "results/logs/{body}/{regime}/sweep_sigma.log",
    params:
        regression=REGRESSION,
        cases=COMPARISONS,
        seed=config["seed"],
        code=code_of("sweep_sigma"),
    message:
        "sweep sigma: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/sweep_sigma.py"


rule evaluate_methods:
    input:
        database="results/data/{body}/{regime}/database.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        samples="results/data/{body}/{regime}/samples.csv",
    output:
        accuracy="results/data/{body}/{regime}/enrichment_accuracy.csv",
        predictions="results/data/{body}/{regime}/predictions.h5",
    log:
        "results/logs/{body}/{regime}/evaluate_methods.log",
    params:
        regression=REGRESSION,
        cases=COMPARISONS,
        shown=SHOWN,
        seed=config["seed"],
        code=code_of("evaluate_methods"),
    message:
        "evaluate all methods: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/evaluate_methods.py"


rule compare_premises:
    input:
        databases=expand(f"results/data/{{body}}/{POINTS[0]}/database.h5", body=BODIES),
        files=[file for body in PREMISE_BODIES for file in body_files(body)],
    output:
        **{name: f"results/tables/{name}.csv" for name in PREMISE_TABLES},
        warned="results/data/premises_warned.txt",
    log:
        "results/logs/compare_premises.log",
    params:
        sampled=BODIES,
        cases=PREMISES,
        bodies={name: config["bodies"][name] | body_paths(name) for name in PREMISE_BODIES},
        settings={key: value for key, value in config["enrichment"]["premises"].items() if key != "cases"},
        regression=REGRESSION,
        seed=config["seed"],
        code=code_of("compare_premises"),
    message:
        "compare the features in every premise"
    script:
        "../scripts/compare_premises.py"


rule time_methods:
    input:
        body="results/data/{body}/body.h5",
        loads=f"results/data/{{body}}/{POINTS[0]}/loads.csv",
        database=f"results/data/{{body}}/{POINTS[0]}/database.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, POINTS[0]),
        samples=f"results/data/{{body}}/{POINTS[0]}/samples.csv",
    output:
        timing="results/data/{body}/enrichment_timing.csv",
        cost="results/data/{body}/online_cost.csv",
    log:
        "results/logs/{body}/time_methods.log",
    threads: HALF
    params:
        regression=REGRESSION,
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        repeats=config["timing"]["repeats"],
        published_means=lambda wildcards: read_yaml(PAPER)["means"].get(wildcards.body, {}),
        code=code_of("time_methods"),
    message:
        "time all methods: {wildcards.body}"
    script:
        "../scripts/time_methods.py"


rule time_complexity:
    output:
        "results/tables/complexity.csv",
    log:
        "results/logs/time_complexity.log",
    threads: workflow.cores
    params:
        samples=config["enrichment"]["complexity_samples"],
        seed=config["seed"],
        code=code_of("time_complexity"),
    message:
        "time how the cost grows with features and samples, alone"
    script:
        "../scripts/time_complexity.py"


rule tabulate_samples:
    input:
        samples=points("samples.csv"),
    output:
        peaks="results/tables/sample_peaks.csv",
        splits="results/tables/splits.csv",
    log:
        "results/logs/tabulate_samples.log",
    params:
        code=code_of("tabulate_samples"),
    message:
        "tabulate the samples, and how many are held out"
    script:
        "../scripts/tabulate_samples.py"


rule tabulate_fem_cost:
    input:
        fine=[file for body in BODIES for regime in POINTS for file in fine_batches(body, regime)],
    output:
        "results/tables/fem_cost.csv",
    log:
        "results/logs/tabulate_fem_cost.log",
    params:
        code=code_of("tabulate_fem_cost"),
    message:
        "tabulate what the fine simulations cost"
    script:
        "../scripts/tabulate_fem_cost.py"


rule draw_meshes:
    input:
        bodies=expand("results/data/{body}/body.h5", body=BODIES),
    output:
        drawn("mesh_levels"),
    log:
        "results/logs/draw_meshes.log",
    params:
        code=code_of("draw_meshes"),
    message:
        "draw the meshes"
    script:
        "../scripts/draw_meshes.py"


rule draw_responses:
    input:
        body="results/data/{body}/body.h5",
        database="results/data/{body}/{regime}/database.h5",
        predictions="results/data/{body}/{regime}/predictions.h5",
    output:
        deformed=drawn("deformed_{body}_{regime}"),
        errors=drawn("error_over_body_{body}_{regime}"),
        turnable="results/figures/error_over_body_{body}_{regime}.json",
    log:
        "results/logs/{body}/{regime}/draw_responses.log",
    params:
        code=code_of("draw_responses"),
    message:
        "draw responses and errors: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/draw_responses.py"
