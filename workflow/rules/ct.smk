# What is made from a CT or an MRI: pictures, the masses of a CT's nodes, and the steps from scan to mask and picture.

# an MRI does not show how dense tissue is
WEIGHED = [body for body in CTS if settings.bodies[body].modality == "ct"]
IMAGING = ["mask_interpolation", "surface_normals", "tissue_classes", "segmented_scans", "compositing"]
MASS_SHOWN = drawn("ct", "node_mass")


rule tabulate_node_mass:
    input:
        files=[file for body in WEIGHED for file in body_files(body)],
    output:
        in_report("results/tables/node_mass.csv"),
        figures(*MASS_SHOWN),
    log:
        "results/logs/tabulate_node_mass.log",
    params:
        **calls("palpate.studies.ct.node_mass:tabulate_node_mass", draws=MASS_SHOWN),
        entries={body: body_entry(body) for body in WEIGHED},
        sizes=config["ct"]["surface_nodes"],
    script:
        "../job.py"


rule draw_scan:
    input:
        body=BODY,
        files=lambda wildcards: body_files(wildcards.body),
    output:
        slices=figures("ct_slices_{body}"),
        volume=figures("ct_volume_{body}"),
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
        **dict(zip(IMAGING, map(in_report, tables(*IMAGING)))),
        figure=figures("ct_imaging"),
    log:
        "results/logs/measure_imaging.log",
    benchmark:
        "results/benchmarks/measure_imaging.tsv"
    threads: HALF
    params:
        **calls("palpate.studies.ct.figures:measure_imaging"),
        entries={body: body_entry(body) for body in CTS},
        settings=config["ct"]["imaging"],
    script:
        "../job.py"


rule ct:
    input:
        tables("mesh_quality"),
        rules.measure_imaging.output,
        expand(rules.draw_scan.output, body=CTS),
        rules.tabulate_node_mass.output if WEIGHED else [],
        warned_of(CTS),
        page="results/report_ct.html",
