# One page with everything that was found.


rule write_report:
    input:
        [PAPERS[paper] for paper in config["papers"]],
        MOTIONS,
        captions=sorted(relpath(caption) for caption in CAPTIONS.glob("*.rst")),
        paper=PAPER,
        thesis=relpath(CAPTIONS / "soft_bodies.yaml"),
        code=PICTURES,
    output:
        "results/report.html",
    log:
        "results/logs/write_report.log",
    params:
        papers=config["papers"],
        scenes=SCENES,
    message:
        "write the report"
    script:
        "../scripts/write_report.py"
