# Situations in which numerics may fail, each with what was expected of it beforehand.


rule try_hard_cases:
    input:
        code=sources(
            "bodies",
            "effects",
            "solvers",
            "collision",
            "scenes",
            "enrichment",
            "evaluation/collision_truth",
            "evaluation/hard_cases",
        ),
    output:
        "results/data/hard_cases/{family}.csv",
    log:
        "results/logs/hard_cases/{family}.log",
    message:
        "try hard cases of {wildcards.family}"
    script:
        "../scripts/try_hard_cases.py"


rule draw_hard_cases:
    input:
        "results/tables/hard_cases.csv",
        code=PICTURES,
    output:
        drawn("hard_cases"),
    log:
        "results/logs/draw_hard_cases.log",
    message:
        "draw what became of hard cases"
    script:
        "../scripts/draw_hard_cases.py"
