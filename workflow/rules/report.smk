# One page that tells what was found, as a story.


rule write_report:
    input:
        [PAPERS[paper] for paper in config["papers"]],
        CT_RESULTS,
        MOTIONS,
        *STORY.values(),
        captions=sorted(relpath(caption) for caption in CAPTIONS.glob("*.rst")),
        paper=PAPER,
        thesis=relpath(CAPTIONS / "soft_bodies.yaml"),
        springs=relpath(CAPTIONS / "springs.yaml"),
        models=relpath(CAPTIONS / "models.yaml"),
        code=PICTURES + ASSETS,
    output:
        "results/report.html",
    log:
        "results/logs/write_report.log",
    params:
        parts=[*STORY, *config["papers"]],
        scenes=SCENES,
        cts=CTS,
        driven=DRIVEN,
    message:
        "write the report"
    script:
        "../scripts/write_report.py"
