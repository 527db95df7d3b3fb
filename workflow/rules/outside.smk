# Values that others published beside those that palpate computes.

TARGETS["outside"] = tabulated("outside") + figures("outside", "outside")


rule compare_with_published:
    input:
        published=published_of("outside"),
        displacements=relpath(ROOT / "src/palpate/studies/outside/hanging_bar.csv"),
    output:
        tabulated("outside"),
    log:
        "results/logs/compare_with_published.log",
    params:
        **calls(
            "palpate.studies.outside.jobs:compare_with_published",
            ["palpate.effects.laws", "palpate.studies.outside.isochoric_neo_hookean"],
        ),
        cells=config["outside"]["cells"],
    script:
        "../job.py"
