# One page about what was found, as a story, and one about each study alone.


include: "functions/report.smk"


rule write_report:
    input:
        shown=shown(*RUN) + (tables("claims") if JUDGES else []),
        templates=templates(*RUN),
    output:
        "results/report.html",
        "results/report.md",
    log:
        "results/logs/write_report.log",
    benchmark:
        "results/benchmarks/write_report.tsv"
    params:
        **calls("palpate.studies.common_jobs:write_report", *(f"palpate.studies.{study}.report" for study in RUN)),
        told=told(*RUN) | {"left_out": [study for study in ASKED if study not in RUN]},
    script:
        "../job.py"


rule write_page:
    input:
        shown=lambda wildcards: shown(wildcards.study),
        templates=lambda wildcards: templates(wildcards.study),
    output:
        "results/report_{study}.html",
        "results/report_{study}.md",
    log:
        "results/logs/write_page_{study}.log",
    wildcard_constraints:
        study="|".join(ASKED),
    params:
        **calls(
            "palpate.studies.common_jobs:write_report", lambda wildcards: [f"palpate.studies.{wildcards.study}.report"]
        ),
        told=lambda wildcards: told(wildcards.study) | {"alone": True},
    script:
        "../job.py"
