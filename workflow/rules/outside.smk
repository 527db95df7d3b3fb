# Values that others published beside those that palpate computes.


rule compare_with_published:
    input:
        published=published_of("outside"),
        displacements=relpath(ROOT / "src/palpate/studies/outside/hanging_bar.csv"),
    output:
        in_report("results/tables/outside.csv"),
    log:
        "results/logs/compare_with_published.log",
    benchmark:
        "results/benchmarks/compare_with_published.tsv"
    params:
        **calls(
            "palpate.studies.outside.jobs:compare_with_published",
            *("palpate.effects.laws", "palpate.studies.outside.isochoric_neo_hookean"),
        ),
        cells=config["outside"]["cells"],
    script:
        "../job.py"


rule draw_outside:
    input:
        rules.compare_with_published.output,
    output:
        figures("outside"),
    log:
        "results/logs/draw_outside.log",
    localrule: True
    params:
        **draws(drawn("outside", "outside")),
    script:
        "../job.py"


rule outside:
    input:
        rules.compare_with_published.output,
        rules.draw_outside.output,
        page="results/report_outside.html",
