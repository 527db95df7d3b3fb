# What is made from a CT or an MRI: pictures, the masses of a CT's nodes, and the steps from scan to mask and picture.

# an MRI does not show how dense tissue is
WEIGHED = [body for body in CTS if config["bodies"][body]["modality"] == "ct"]
IMAGING = ("mask_interpolation", "surface_normals", "tissue_classes", "segmented_scans", "compositing")

TARGETS["ct"] = (
    tabulated("mesh_quality", *IMAGING)
    + (tabulated("node_mass") + figures("ct", "node_mass") if WEIGHED else [])
    + drawn(*(f"{figure}_{body}" for figure in ("ct_slices", "ct_volume") for body in CTS), "ct_imaging")
)
OPTIONAL["ct"] += ["node_mass"] if "ct" in ASKED and WEIGHED else []
WARNED["ct"] += warned_of(CTS)


rule tabulate_node_mass:
    input:
        files=[file for body in WEIGHED for file in body_files(body)],
    output:
        "results/tables/node_mass.csv",
    log:
        "results/logs/tabulate_node_mass.log",
    params:
        **calls("palpate.studies.ct.node_mass:tabulate_node_mass"),
        entries={body: body_entry(body) for body in WEIGHED},
        sizes=config["ct"]["surface_nodes"],
    script:
        "../job.py"


rule draw_scan:
    input:
        body=BODY,
        files=lambda wildcards: body_files(wildcards.body),
    output:
        slices=drawn("ct_slices_{body}"),
        volume=drawn("ct_volume_{body}"),
    log:
        "results/logs/{body}/draw_scan.log",
    params:
        **calls("palpate.studies.ct.figures:draw_ct"),
        entry=lambda wildcards: body_entry(wildcards.body),
    script:
        "../job.py"


rule measure_imaging:
    input:
        files=[file for body in CTS for file in body_files(body)],
    output:
        **dict(zip(IMAGING, tabulated(*IMAGING))),
        figure=drawn("ct_imaging"),
    log:
        "results/logs/measure_imaging.log",
    threads: HALF
    params:
        **calls("palpate.studies.ct.figures:measure_imaging"),
        entries={body: body_entry(body) for body in CTS},
        settings=config["ct"]["imaging"],
    script:
        "../job.py"
