# Paper 1: the error of each way of enriching a coarse deformation, and what it costs online.
# Before them come make_body, choose_loads, simulate_fine and assemble_database (bodies.smk): meshes, fine
# responses, and with the coarse ones at the same loads a database, whose samples are split into training and test.

# every method is fitted and tested in each of these: protocol and split
COMPARISONS = [(protocol, split) for protocol in ("paper", "live") for split in ("samples", "contacts")]
# methods whose predictions are kept for pictures
SHOWN = ["unordered_nonnegative_a", "ordered_nonnegative_a", "interpolation", "detail_correction"]
# what the methods choose their widths with
REGRESSION = some("enrichment", "neighbours", "sigma_relative", "folds")
# bodies held otherwise, and what all of these comparisons share
PREMISE_BODIES = list(dict.fromkeys([*BODIES, *(case.body for case in settings.enrichment.premises.cases.values())]))
PREMISE_TABLES = ("premises", "premise_bodies", "feature_vectors", "database_memory")
ENRICHMENT_TABLES = ["sigma_sweep", "enrichment_accuracy", "enrichment_timing", "online_cost"]
SAMPLE_TABLES = ["sample_peaks", "splits", "fem_cost"]
ENRICHMENT_SHOWN = (
    drawn("enrichment", "sigma_sweep", published=published_of("enrichment"))
    | drawn("enrichment", "premises", "feature_vectors", "complexity")
    | drawn("enrichment", "timing_bars", "accuracy_vs_online_cost", "fem_cost")
)


rule sweep_sigma:
    input:
        database=f"{PRESS}/database.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        samples=f"{PRESS}/samples.csv",
    output:
        sweep=f"{PRESS}/sigma_sweep.csv",
        accuracy=f"{PRESS}/enrichment_accuracy.csv",
        predictions=f"{PRESS}/predictions.h5",
    log:
        "results/logs/{body}/{regime}/sweep_sigma.log",
    benchmark:
        "results/benchmarks/{body}/{regime}/sweep_sigma.tsv"
    params:
        **calls("palpate.studies.enrichment.jobs:sweep_sigma"),
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
        **dict(zip(PREMISE_TABLES, map(in_report, tables(*PREMISE_TABLES)))),
        warned="results/data/premises_warned.txt",
    log:
        "results/logs/compare_premises.log",
    benchmark:
        "results/benchmarks/compare_premises.tsv"
    params:
        **calls("palpate.studies.enrichment.premises:compare_premises"),
        sampled=BODIES,
        bodies={name: plain(settings.bodies[name].seen_from(CONFIG_FILE.parent)) for name in PREMISE_BODIES},
        settings=config["enrichment"]["premises"],
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
    benchmark:
        "results/benchmarks/{body}/time_methods.tsv"
    threads: HALF
    params:
        **calls("palpate.studies.enrichment.timing:time_methods"),
        regression=REGRESSION,
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        repeats=config["timing"]["repeats"],
        published_means=lambda wildcards: read_yaml(published_of("enrichment"))["means"].get(wildcards.body, {}),
    script:
        "../job.py"


rule time_complexity:
    output:
        in_report("results/tables/complexity.csv"),
    log:
        "results/logs/time_complexity.log",
    benchmark:
        "results/benchmarks/time_complexity.tsv"
    threads: HALF
    params:
        **calls("palpate.studies.enrichment.timing:time_complexity"),
        samples=config["enrichment"]["complexity_samples"],
        seed=config["seed"],
    script:
        "../job.py"


rule tabulate_enrichment:
    input:
        read_by(ENRICHMENT_SHOWN, *ENRICHMENT_TABLES, *SAMPLE_TABLES),
        sigma_sweep=points("sigma_sweep.csv"),
        enrichment_accuracy=points("enrichment_accuracy.csv"),
        enrichment_timing=expand(rules.time_methods.output.timing, body=BODIES),
        online_cost=expand(rules.time_methods.output.cost, body=BODIES),
        bodies=expand(BODY, body=BODIES),
        samples=points("samples.csv"),
        fine=[file for body in BODIES for regime in POINTS for file in fine_batches(body, regime)],
    output:
        *map(in_report, tables(*ENRICHMENT_TABLES)),
        figures(*ENRICHMENT_SHOWN),
        **dict(zip(SAMPLE_TABLES, map(in_report, tables(*SAMPLE_TABLES)))),
        meshes=figures("mesh_levels"),
    log:
        "results/logs/tabulate_enrichment.log",
    params:
        **calls("palpate.studies.enrichment.jobs:tabulate_enrichment", draws=ENRICHMENT_SHOWN),
    script:
        "../job.py"


rule draw_responses:
    input:
        body=BODY,
        database=f"{PRESS}/database.h5",
        predictions=f"{PRESS}/predictions.h5",
    output:
        deformed=figures("deformed_{body}_{regime}"),
        errors=figures("error_over_body_{body}_{regime}"),
        turnable="results/figures/error_over_body_{body}_{regime}.json",
    log:
        "results/logs/{body}/{regime}/draw_responses.log",
    params:
        **calls("palpate.studies.enrichment.jobs:draw_responses"),
    script:
        "../job.py"


rule enrichment:
    input:
        tables("mesh_sizes", "mesh_quality"),
        rules.tabulate_enrichment.output,
        rules.compare_premises.output,
        rules.time_complexity.output,
        expand(rules.draw_responses.output, body=BODIES, regime=POINTS),
        warned_of(BODIES),
        points("loads_warned.txt"),
        page="results/report_enrichment.html",
