# One page with everything that was found.


rule write_report:
    input:
        [PAPERS[paper] for paper in config["papers"]],
        captions=sorted(relpath(caption) for caption in CAPTIONS.glob("*.rst")),
        paper=PAPER,
        code=sources("figures"),
    output:
        "results/report.html",
    log:
        "results/logs/write_report.log",
    message:
        "write the report"
    script:
        "../scripts/write_report.py"
