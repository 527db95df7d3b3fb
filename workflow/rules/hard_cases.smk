# Situations in which numerics may fail, each with what was expected of it beforehand.

HARD = "results/data/hard_cases/{family}.csv"
TARGETS["hard_cases"] = merged("hard_cases", hard_cases=expand(HARD, family=config["hard_cases"]["families"]))
TARGETS["hard_cases"] += figures("hard_cases", "hard_cases")


rule try_hard_cases:
    output:
        HARD,
    log:
        "results/logs/hard_cases/{family}.log",
    wildcard_constraints:
        family="|".join(config["hard_cases"]["families"]),
    params:
        **calls(
            "palpate.studies.hard_cases.declared:try_hard_cases",
            ["palpate.effects", "palpate.solvers", "palpate.collision"],
        ),
        long=config["hard_cases"]["long"],
    script:
        "../job.py"
