# How cost and memory of each component grow, up to millions of elements.

GROWING = ["fem", "fine_nodes", "samples", "triangles", "particles", "cores"]
GROWN = "results/data/scaling/{component}.csv"
SCALING_SHOWN = drawn("scaling", "scaling")


rule measure_scaling:
    output:
        GROWN,
    log:
        "results/logs/scaling/measure_scaling_{component}.log",
    wildcard_constraints:
        component="|".join(GROWING),
    # processor time needs no machine to itself, but a clock does
    threads: lambda wildcards: workflow.cores if wildcards.component == "cores" else 1
    resources:
        mem_mb=8000,
    params:
        **calls("palpate.studies.scaling.measure_scaling:measure_scaling", "palpate.effects", "palpate.solvers"),
        sizes=lambda wildcards: getattr(settings.scaling, wildcards.component, None),
    script:
        "../job.py"


rule tabulate_scaling:
    input:
        scaling=expand(rules.measure_scaling.output, component=GROWING),
    output:
        in_report("results/tables/scaling.csv"),
        figures(*SCALING_SHOWN),
    log:
        "results/logs/tabulate_scaling.log",
    localrule: True
    params:
        **calls("palpate.files:merge", draws=SCALING_SHOWN),
    script:
        "../job.py"


rule scaling:
    input:
        rules.tabulate_scaling.output,
        page="results/report_scaling.html",
