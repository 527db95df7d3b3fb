# One page about what was found, as a story, and one about each study alone.


include: "functions/report.smk"


rule write_report:
    input:
        shown=lambda wildcards: shown(*reported(wildcards)) + (tables("claims") if JUDGES and not wildcards.of else []),
        templates=lambda wildcards: templates(*reported(wildcards)),
    output:
        "results/report{of}.html",
        "results/report{of}.md",
    log:
        "results/logs/write_report{of}.log",
    benchmark:
        "results/benchmarks/write_report{of}.tsv"
    # of all studies that are run, or of one alone
    wildcard_constraints:
        of="|".join(["", *(f"_{study}" for study in ASKED)]),
    params:
        **calls(
            "palpate.studies.common_jobs:write_report",
            numbered,
        ),
        told=told,
    script:
        "../job.py"
