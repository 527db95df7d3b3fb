# One page with everything that was found.


rule write_report:
    input:
        [PAPERS[paper] for paper in config["papers"]],
        CT_RESULTS,
        MOTIONS,
        captions=sorted(relpath(caption) for caption in CAPTIONS.glob("*.rst")),
        paper=PAPER,
        thesis=relpath(CAPTIONS / "soft_bodies.yaml"),
        springs=relpath(CAPTIONS / "springs.yaml"),
        code=PICTURES,
    output:
        "results/report.html",
    log:
        "results/logs/write_report.log",
    params:
        papers=config["papers"],
        scenes=SCENES,
        cts=CTS,
        driven=DRIVEN,
    message:
        "write the report"
    script:
        "../scripts/write_report.py"
