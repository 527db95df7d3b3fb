# What is made from a CT: its pictures, and the masses of its nodes.

TARGETS["ct"] = (
    tabulated("node_mass", "mesh_quality")
    + figures("ct", "node_mass")
    + drawn(*(f"{figure}_{body}" for figure in ("ct_slices", "ct_volume") for body in CTS))
)
WARNED += warned_of(CTS)


rule tabulate_node_mass:
    input:
        files=[file for body in CTS for file in body_files(body)],
    output:
        "results/tables/node_mass.csv",
    log:
        "results/logs/tabulate_node_mass.log",
    params:
        entries={body: body_entry(body) for body in CTS},
        settings=config["ct"],
        code=code_of("tabulate_node_mass"),
    message:
        "weigh the nodes of bodies from CT"
    script:
        "../scripts/tabulate_node_mass.py"


rule draw_ct:
    input:
        body="results/data/{body}/body.h5",
        files=lambda wildcards: body_files(wildcards.body),
    output:
        slices=drawn("ct_slices_{body}"),
        volume=drawn("ct_volume_{body}"),
    log:
        "results/logs/{body}/draw_ct.log",
    params:
        entry=lambda wildcards: body_entry(wildcards.body),
        code=code_of("draw_ct"),
    message:
        "draw the CT of {wildcards.body}"
    script:
        "../scripts/draw_ct.py"
