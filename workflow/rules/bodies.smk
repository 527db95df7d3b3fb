# What is deformed: nested meshes, and their linear response to a unit force at every contact.


include: "functions/bodies.smk"


# settings of a body that say how many samples it gets and what the paper had, not what it is
NOT_OF_THE_BODY = {"magnitudes", "train", "test", "paper_surface"}


# bodies made from a CT, which get pictures and masses of their own
CTS = [name for name, body in config["bodies"].items() if body["kind"] == "ct"]
# bodies whose meshes are tabulated
MEASURED = list(dict.fromkeys(BODIES + (CTS if "ct" in ASKED else [])))


rule make_body:
    input:
        files=lambda wildcards: body_files(wildcards.body),
    output:
        body="results/data/{body}/body.h5",
        warned="results/data/{body}/warned.txt",
    log:
        "results/logs/{body}/make_body.log",
    params:
        entry=lambda wildcards: body_entry(wildcards.body),
        code=code_of("make_body"),
    message:
        "make the body {wildcards.body}"
    script:
        "../scripts/make_body.py"


rule compute_compliance:
    input:
        body="results/data/{body}/body.h5",
    output:
        "results/data/{body}/compliance_{radius}m.h5",
    log:
        "results/logs/{body}/compute_compliance_{radius}m.log",
    params:
        # of a finger's presses; paper 1's forces may act on any node
        contacts=lambda wildcards: config["tradeoff"]["contacts"] if float(wildcards.radius) else None,
        order=lambda wildcards: 2 if float(wildcards.radius) else 1,
        code=code_of("compute_compliance"),
    message:
        "compute the compliance of {wildcards.body}"
    script:
        "../scripts/compute_compliance.py"


rule tabulate_meshes:
    input:
        bodies=expand("results/data/{body}/body.h5", body=MEASURED),
    output:
        sizes="results/tables/mesh_sizes.csv",
        quality="results/tables/mesh_quality.csv",
    log:
        "results/logs/tabulate_meshes.log",
    params:
        paper={name: body.get("paper_surface") for name, body in config["bodies"].items()},
        code=code_of("tabulate_meshes"),
    message:
        "tabulate mesh sizes and quality"
    script:
        "../scripts/tabulate_meshes.py"
