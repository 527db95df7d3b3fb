# What is deformed: nested meshes, and their linear response to a unit force at every contact.


include: "functions/bodies.smk"


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
