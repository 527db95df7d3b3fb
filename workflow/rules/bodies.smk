# What is deformed and what it is asked: nested meshes, their linear response to a unit force at every contact; loads, the
# fine and coarse responses to each, and both in one database.

# bodies whose meshes are tabulated
MEASURED = list(dict.fromkeys(BODIES + (CTS if "ct" in ASKED else [])))


rule make_body:
    input:
        files=lambda wildcards: body_files(wildcards.body),
    output:
        body=BODY,
        warned="results/data/{body}/warned.txt",
        taken="results/data/{body}/taken.txt",
    log:
        "results/logs/{body}/make_body.log",
    benchmark:
        "results/benchmarks/{body}/make_body.tsv"
    priority: 1  # most of a run waits for it
    params:
        **calls("palpate.studies.common_jobs:make_body"),
        entry=lambda wildcards: body_entry(wildcards.body),
    script:
        "../job.py"


rule compute_compliance:
    input:
        body=BODY,
    output:
        "results/data/{body}/compliance_{radius}m.h5",
    log:
        "results/logs/{body}/compute_compliance_{radius}m.log",
    benchmark:
        "results/benchmarks/{body}/compute_compliance_{radius}m.tsv"
    priority: 1  # most of a run waits for it
    params:
        **calls("palpate.studies.common_jobs:compute_compliance"),
        # of a finger's presses; paper 1's forces may act on any node
        contacts=lambda wildcards: config["tradeoff"]["contacts"] if float(wildcards.radius) else None,
        order=lambda wildcards: 2 if float(wildcards.radius) else 1,
        seed=config["seed"],
    script:
        "../job.py"


rule tabulate_meshes:
    input:
        bodies=expand(BODY, body=MEASURED),
    output:
        sizes=in_report("results/tables/mesh_sizes.csv"),
        quality=in_report("results/tables/mesh_quality.csv"),
    log:
        "results/logs/tabulate_meshes.log",
    params:
        **calls("palpate.studies.common_jobs:tabulate_meshes"),
        paper={name: getattr(body, "paper_surface", None) for name, body in settings.bodies.items()},
    script:
        "../job.py"


rule choose_loads:
    input:
        body=BODY,
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
    output:
        loads=f"{PRESS}/loads.csv",
        warned=f"{PRESS}/loads_warned.txt",
    log:
        "results/logs/{body}/{regime}/choose_loads.log",
    wildcard_constraints:
        regime="|".join(POINTS) or "nothing",
    params:
        **calls("palpate.studies.enrichment.samples:choose_loads"),
        magnitudes=lambda wildcards: settings.bodies[wildcards.body].magnitudes,
        peak_of_size=lambda wildcards: config["enrichment"]["regimes"][wildcards.regime]["peak_of_size"],
        radius_m=0.0,
        samples=lambda wildcards: count(wildcards.body, wildcards.regime),
        seed=config["seed"],
    script:
        "../job.py"


rule choose_presses:
    input:
        body=BODY,
    output:
        loads=f"{PRESS}/loads.csv",
        warned=f"{PRESS}/loads_warned.txt",
    log:
        "results/logs/{body}/{regime}/choose_presses.log",
    benchmark:
        "results/benchmarks/{body}/{regime}/choose_presses.tsv"
    wildcard_constraints:
        regime="|".join(REGIMES) or "nothing",
    priority: 1  # most of a run waits for it
    params:
        **calls("palpate.benchmark.presses:choose_presses"),
        contacts_count=config.get("tradeoff", {}).get("contacts"),
        presses=config.get("tradeoff", {}).get("presses"),
        regime=lambda wildcards: config["regimes"][wildcards.regime],
        radius_m=lambda wildcards: radius(wildcards.body, wildcards.regime),
        seed=config["seed"],
    script:
        "../job.py"


rule simulate_fine:
    input:
        body=BODY,
        loads=f"{PRESS}/loads.csv",
    output:
        f"{PRESS}/fine_{{batch}}.h5",
    log:
        "results/logs/{body}/{regime}/simulate_fine_{batch}.log",
    benchmark:
        "results/benchmarks/{body}/{regime}/simulate_fine_{batch}.tsv"
    priority: 1  # most of a run waits for it
    params:
        **calls("palpate.benchmark.static_responses:press_batch"),
        samples_per_job=config["solver"]["samples_per_job"],
        # paper 1 has linear elements
        order=lambda wildcards: 1 if wildcards.regime in POINTS else 2,
        tolerance=config["solver"]["reference_tolerance"],
    script:
        "../job.py"


rule assemble_database:
    input:
        body=BODY,
        loads=f"{PRESS}/loads.csv",
        fine=lambda wildcards: fine_batches(wildcards.body, wildcards.regime),
    output:
        database=f"{PRESS}/database.h5",
        samples=f"{PRESS}/samples.csv",
    log:
        "results/logs/{body}/{regime}/assemble_database.log",
    priority: 1  # most of a run waits for it
    params:
        **calls("palpate.benchmark.static_responses:assemble_database"),
        tolerance=config["solver"]["tolerance"],
        settings=lambda wildcards: {
            "seed": config["seed"],
            "body": body_entry(wildcards.body),
            "loads": loads_entry(wildcards.body, wildcards.regime),
            "solver": config["solver"],
        },
        # how many samples train and test paper 1's methods; contacts under a finger are dealt into five folds
        split=lambda wildcards: split(wildcards.body, wildcards.regime),
        seed=config["seed"],
    script:
        "../job.py"
