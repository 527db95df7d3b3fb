# One page about what was found, as a story.


rule write_report:
    input:
        *(TARGETS[study] for study in ASKED),
        claims=CLAIMS,
        templates=templates(*ASKED),
        warned=sorted(set(WARNED)),
        assets=[relpath(path) for path in sorted((ROOT / "src/palpate/report/assets").iterdir())],
    output:
        "results/report.html",
        "results/report.md",
    log:
        "results/logs/write_report.log",
    params:
        **calls("palpate.studies.common_jobs:write_report", [f"palpate.studies.{study}.report" for study in ASKED]),
        studies=ASKED,
        scenes=list(config.get("scenes", {})),
        cts=CTS if "ct" in ASKED else [],
        more=OPTIONAL,
        driven=DRIVEN if "scenes" in ASKED else [],
    script:
        "../job.py"
