# Values that others published beside those that palpate computes.

OUTSIDE_SHOWN = drawn("outside", "outside")


rule compare_with_published:
    input:
        published=published_of("outside"),
        displacements=relpath(ROOT / "src/palpate/studies/outside/hanging_bar.csv"),
    output:
        in_report("results/tables/outside.csv"),
        figures(*OUTSIDE_SHOWN),
    log:
        "results/logs/compare_with_published.log",
    benchmark:
        "results/benchmarks/compare_with_published.tsv"
    params:
        **calls(
            "palpate.studies.outside.compare:compare_with_published",
            *("palpate.effects.laws", "palpate.studies.outside.isochoric_neo_hookean"),
            draws=OUTSIDE_SHOWN,
        ),
    script:
        "../job.py"


rule outside:
    input:
        rules.compare_with_published.output,
        page="results/report_outside.html",
