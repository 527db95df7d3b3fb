# Paper 1: the error of each way of enriching a coarse deformation, and what it costs online.

# every method is fitted and tested in each of these: protocol and split
COMPARISONS = [(protocol, split) for protocol in ("paper", "live") for split in ("samples", "contacts")]
# methods whose predictions are kept for pictures
SHOWN = ["unordered_nonnegative_a", "ordered_nonnegative_a", "interpolation", "detail_correction"]
# what the methods choose their widths with
REGRESSION = some("enrichment", "neighbours", "sigma_relative", "folds")
# bodies held otherwise, and what all of these comparisons share
PREMISES = dict(config["enrichment"]["premises"])
CASES = PREMISES.pop("cases")
PREMISE_BODIES = list(dict.fromkeys([*BODIES, *(case["body"] for case in CASES.values())]))
PREMISE_TABLES = ("premises", "premise_bodies", "feature_vectors", "database_memory")

TARGETS["enrichment"] = (
    merged(
        "enrichment",
        sigma_sweep=points("sigma_sweep.csv"),
        enrichment_accuracy=points("enrichment_accuracy.csv"),
        enrichment_timing=expand("results/data/{body}/enrichment_timing.csv", body=BODIES),
        online_cost=expand("results/data/{body}/online_cost.csv", body=BODIES),
    )
    + tabulated("mesh_sizes", "mesh_quality", "sample_peaks", "splits", "fem_cost", *PREMISE_TABLES)
    + settled(
        "palpate.studies.enrichment.jobs:time_complexity",
        "complexity",
        threads=HALF,
        samples=config["enrichment"]["complexity_samples"],
        seed=config["seed"],
    )
    + figures("enrichment", "sigma_sweep", published=True)
    + figures("enrichment", "premises", "feature_vectors", "complexity")
    + figures("enrichment", "timing_bars", "accuracy_vs_online_cost", "fem_cost")
    + drawn("mesh_levels", *expand("deformed_{body}_{regime}", body=BODIES, regime=POINTS))
    + drawn(*expand("error_over_body_{body}_{regime}", body=BODIES, regime=POINTS))
    + expand("results/figures/error_over_body_{body}_{regime}.json", body=BODIES, regime=POINTS)
)
WARNED["enrichment"] += warned_of(BODIES) + points("loads_warned.txt") + ["results/data/premises_warned.txt"]


rule evaluate_methods:
    input:
        database=f"{PRESS}/database.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        samples=f"{PRESS}/samples.csv",
    output:
        sweep=f"{PRESS}/sigma_sweep.csv",
        accuracy=f"{PRESS}/enrichment_accuracy.csv",
        predictions=f"{PRESS}/predictions.h5",
    log:
        "results/logs/{body}/{regime}/evaluate_methods.log",
    params:
        **calls("palpate.studies.enrichment.jobs:evaluate_methods"),
        regression=REGRESSION,
        cases=COMPARISONS,
        shown=SHOWN,
        seed=config["seed"],
    script:
        "../job.py"


rule compare_premises:
    input:
        databases=expand(f"results/data/{{body}}/{POINTS[0]}/database.h5", body=BODIES),
        files=[file for body in PREMISE_BODIES for file in body_files(body)],
    output:
        **dict(zip(PREMISE_TABLES, tabulated(*PREMISE_TABLES))),
        warned="results/data/premises_warned.txt",
    log:
        "results/logs/compare_premises.log",
    params:
        **calls("palpate.studies.enrichment.jobs:compare_premises"),
        sampled=BODIES,
        cases=CASES,
        bodies={name: config["bodies"][name] | body_paths(name) for name in PREMISE_BODIES},
        settings=PREMISES,
        regression=REGRESSION,
        seed=config["seed"],
    script:
        "../job.py"


rule time_methods:
    input:
        body=BODY,
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
        **calls("palpate.studies.enrichment.jobs:time_methods"),
        regression=REGRESSION,
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        repeats=config["timing"]["repeats"],
        published_means=lambda wildcards: read_yaml(published_of("enrichment"))["means"].get(wildcards.body, {}),
    script:
        "../job.py"


rule tabulate_samples:
    input:
        samples=points("samples.csv"),
        fine=[file for body in BODIES for regime in POINTS for file in fine_batches(body, regime)],
    output:
        peaks="results/tables/sample_peaks.csv",
        splits="results/tables/splits.csv",
        cost="results/tables/fem_cost.csv",
    log:
        "results/logs/tabulate_samples.log",
    params:
        **calls("palpate.studies.enrichment.jobs:tabulate_samples"),
    script:
        "../job.py"


rule draw_meshes:
    input:
        bodies=expand(BODY, body=BODIES),
    output:
        drawn("mesh_levels"),
    log:
        "results/logs/draw_meshes.log",
    params:
        **calls("palpate.studies.enrichment.jobs:draw_meshes"),
    script:
        "../job.py"


rule draw_responses:
    input:
        body=BODY,
        database=f"{PRESS}/database.h5",
        predictions=f"{PRESS}/predictions.h5",
    output:
        deformed=drawn("deformed_{body}_{regime}"),
        errors=drawn("error_over_body_{body}_{regime}"),
        turnable="results/figures/error_over_body_{body}_{regime}.json",
    log:
        "results/logs/{body}/{regime}/draw_responses.log",
    params:
        **calls("palpate.studies.enrichment.jobs:draw_responses"),
    script:
        "../job.py"
