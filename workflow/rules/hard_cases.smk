# Situations in which numerics may fail, each with what was expected of it beforehand.

TARGETS["hard_cases"] = merged(
    "hard_cases", expand("results/data/hard_cases/{family}.csv", family=config["hard_cases"]["families"])
) + figures("hard_cases", "hard_cases")


rule try_hard_cases:
    output:
        "results/data/hard_cases/{family}.csv",
    log:
        "results/logs/hard_cases/{family}.log",
    wildcard_constraints:
        family="|".join(config["hard_cases"]["families"]),
    params:
        code=code_of("try_hard_cases", "palpate.effects", "palpate.solvers", "palpate.collision"),
    message:
        "try hard cases of {wildcards.family}"
    script:
        "../scripts/try_hard_cases.py"
