# Whether a finger feels the regions of bodies, and how deep in a slab a ball may lie to be felt.

PALPATED = settings.palpation.bodies or [
    name for name, body in settings.bodies.items() if getattr(body, "regions", None)
]
PALPATION_SHOWN = drawn("palpation", "palpation", "palpation_limits")


rule measure_palpation:
    input:
        body=BODY,
    output:
        "results/data/{body}/palpation.csv",
    log:
        "results/logs/{body}/measure_palpation.log",
    benchmark:
        "results/benchmarks/{body}/measure_palpation.tsv"
    params:
        **calls("palpate.studies.palpation.palpation:measure_palpation"),
        settings=some("palpation", "radius_m", "places", "pressures_of_young"),
    script:
        "../job.py"


rule measure_palpation_limits:
    output:
        in_report("results/tables/palpation_limits.csv"),
    log:
        "results/logs/measure_palpation_limits.log",
    benchmark:
        "results/benchmarks/measure_palpation_limits.tsv"
    params:
        **calls("palpate.studies.palpation.palpation:measure_palpation_limits"),
        settings=some("palpation", "covers_m", "contrasts", "radius_m"),
    script:
        "../job.py"


rule tabulate_palpation:
    input:
        rules.measure_palpation_limits.output,
        palpation=expand(rules.measure_palpation.output, body=PALPATED),
    output:
        in_report("results/tables/palpation.csv"),
        figures(*PALPATION_SHOWN),
    log:
        "results/logs/tabulate_palpation.log",
    localrule: True
    params:
        **calls("palpate.files:merge", draws=PALPATION_SHOWN),
    script:
        "../job.py"


rule palpation:
    input:
        rules.tabulate_palpation.output,
        rules.measure_palpation_limits.output,
        warned_of(PALPATED),
        page="results/report_palpation.html",
