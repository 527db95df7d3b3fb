# What is made from a CT: its pictures, and the masses of its nodes.


rule tabulate_node_mass:
    input:
        files=[file for body in CTS for file in body_files(body)],
        code=sources("bodies", "evaluation/node_mass"),
    output:
        "results/tables/node_mass.csv",
    log:
        "results/logs/tabulate_node_mass.log",
    params:
        entries={body: body_entry(body) for body in CTS},
        settings=config["node_mass"],
    message:
        "weigh the nodes of bodies from CT"
    script:
        "../scripts/tabulate_node_mass.py"


rule draw_node_mass:
    input:
        table="results/tables/node_mass.csv",
        code=PICTURES,
    output:
        drawn("node_mass"),
    log:
        "results/logs/draw_node_mass.log",
    message:
        "draw masses over resolution"
    script:
        "../scripts/draw_node_mass.py"


rule draw_ct:
    input:
        body="results/data/{body}/body.h5",
        files=lambda wildcards: body_files(wildcards.body),
        code=PICTURES + sources("bodies"),
    output:
        slices=drawn("ct_slices_{body}"),
        volume=drawn("ct_volume_{body}"),
    log:
        "results/logs/{body}/draw_ct.log",
    params:
        entry=lambda wildcards: body_entry(wildcards.body),
    message:
        "draw the CT of {wildcards.body}"
    script:
        "../scripts/draw_ct.py"
