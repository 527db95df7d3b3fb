# What is deformed: nested meshes, and their linear response to a unit force at every contact.


rule make_body:
    input:
        files=lambda wildcards: body_files(wildcards.body),
        code=sources("bodies"),
    output:
        "results/data/{body}/body.h5",
    log:
        "results/logs/{body}/make_body.log",
    params:
        entry=lambda wildcards: body_entry(wildcards.body),
    message:
        "make the body {wildcards.body}"
    script:
        "../scripts/make_body.py"


rule compute_compliance:
    input:
        body="results/data/{body}/body.h5",
        code=sources("bodies", "effects", "solvers"),
    output:
        "results/data/{body}/compliance_{radius}m.h5",
    log:
        "results/logs/{body}/compute_compliance_{radius}m.log",
    message:
        "compute the compliance of {wildcards.body}"
    script:
        "../scripts/compute_compliance.py"


rule tabulate_meshes:
    input:
        bodies=expand("results/data/{body}/body.h5", body=MEASURED),
        code=sources("bodies"),
    output:
        sizes="results/tables/mesh_sizes.csv",
        quality="results/tables/mesh_quality.csv",
    log:
        "results/logs/tabulate_meshes.log",
    params:
        paper={name: body.get("paper_surface") for name, body in config["bodies"].items()},
    message:
        "tabulate mesh sizes and quality"
    script:
        "../scripts/tabulate_meshes.py"
