# Models beside bodies that were measured.


include: "functions/measured.smk"


EXPERIMENTS = list(config["measured"]["experiments"])

TARGETS["measured"] = merged(
    "measured", expand("results/data/measured/{experiment}.csv", experiment=EXPERIMENTS)
) + figures("measured", "measured", scenes=EXPERIMENTS)
WARNED += warned_of(dict.fromkeys(entry["body"] for entry in config["measured"]["experiments"].values()))


rule measure_experiment:
    input:
        body=body_of_experiment,
        files=files_of_experiment,
    output:
        "results/data/measured/{experiment}.csv",
    log:
        "results/logs/measured/{experiment}.log",
    wildcard_constraints:
        experiment="|".join(EXPERIMENTS),
    params:
        entry=experiment_entry,
        models=config["measured"]["models"],
        # laws are imported by name
        code=code_of("measure_experiment", "palpate.effects"),
    message:
        "put models beside what was measured: {wildcards.experiment}"
    script:
        "../scripts/measure_experiment.py"
