# Situations in which numerics may fail, each with what was expected of it beforehand.

HARD_CASES_SHOWN = drawn("hard_cases", "hard_cases")


rule try_hard_cases:
    output:
        "results/data/hard_cases/{family}.csv",
    log:
        "results/logs/hard_cases/{family}.log",
    benchmark:
        "results/benchmarks/hard_cases/{family}.tsv"
    wildcard_constraints:
        family="|".join(config["hard_cases"]["families"]),
    params:
        **calls(
            "palpate.studies.hard_cases.declared:try_hard_cases",
            *("palpate.effects", "palpate.solvers", "palpate.collision"),
        ),
        long=config["hard_cases"]["long"],
    script:
        "../job.py"


rule tabulate_hard_cases:
    input:
        hard_cases=expand(rules.try_hard_cases.output, family=config["hard_cases"]["families"]),
    output:
        in_report("results/tables/hard_cases.csv"),
        figures(*HARD_CASES_SHOWN),
    log:
        "results/logs/tabulate_hard_cases.log",
    localrule: True
    params:
        **calls("palpate.files:merge", draws=HARD_CASES_SHOWN),
    script:
        "../job.py"


rule hard_cases:
    input:
        rules.tabulate_hard_cases.output,
        page="results/report_hard_cases.html",
