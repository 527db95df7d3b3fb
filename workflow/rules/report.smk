# One page about what was found, as a story, and one about each study alone.


def page_of(*studies, tables=()):
    """The files that a page about some studies shows, and what its writer is told; ``tables``: those that no study makes."""
    files = {
        "shown": [file for study in studies for file in TARGETS[study]] + tabulated(*tables),
        "templates": templates(*studies),
        "warned": sorted({file for study in studies for file in WARNED[study]}),
        "assets": [relpath(path) for path in sorted((ROOT / "src/palpate/report/assets").iterdir())],
    }
    told = {
        "studies": list(studies),
        "scenes": SCENES if "scenes" in studies else [],
        "cts": CTS if "ct" in studies else [],
        "driven": DRIVEN if "scenes" in studies else [],
        "more": [table for study in studies for table in OPTIONAL[study]] + list(tables),
    }
    return files, told


REPORT, TOLD = page_of(*RUN, tables=["claims"] if JUDGES else [])
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
