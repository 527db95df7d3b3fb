# One page about what was found, as a story, and one about each study alone.


include: "functions/report.smk"


REPORT, TOLD = page_of(*RUN, tables=["claims"] if JUDGES else [])
TOLD |= {"left_out": [study for study in ASKED if study not in RUN], "alone": False}
PAGES = {study: page_of(study) for study in ASKED}


rule write_report:
    input:
        **REPORT,
    output:
        "results/report.html",
        "results/report.md",
    log:
        "results/logs/write_report.log",
    params:
        **calls("palpate.studies.common_jobs:write_report", [f"palpate.studies.{study}.report" for study in RUN]),
        warned=REPORT["warned"],
        told=TOLD,
    script:
        "../job.py"


rule write_page:
    input:
        lambda wildcards: [file for files in PAGES[wildcards.study][0].values() for file in files],
    output:
        "results/report_{study}.html",
        "results/report_{study}.md",
    log:
        "results/logs/write_page_{study}.log",
    wildcard_constraints:
        study="|".join(PAGES),
    params:
        **calls(
            "palpate.studies.common_jobs:write_report",
            lambda wildcards: [f"palpate.studies.{wildcards.study}.report"],
        ),
        warned=lambda wildcards: PAGES[wildcards.study][0]["warned"],
        told=lambda wildcards: PAGES[wildcards.study][1],
    script:
        "../job.py"
