# Models beside bodies that were measured.


from palpate.bodies.material import LAWS


include: "functions/measured.smk"


EXPERIMENTS = list(config["measured"]["experiments"])

TARGETS["measured"] = merged(
    "measured", expand("results/data/measured/{experiment}.csv", experiment=EXPERIMENTS)
) + figures("measured", "measured", scenes=EXPERIMENTS)
WARNED += warned_of(dict.fromkeys(entry["body"] for entry in config["measured"]["experiments"].values()))
WARNED += expand("results/data/measured/{experiment}_warned.txt", experiment=EXPERIMENTS)


rule measure_experiment:
    input:
        body=body_of_experiment,
        files=files_of_experiment,
        own=own_laws_of_measured(),
    output:
        table="results/data/measured/{experiment}.csv",
        warned="results/data/measured/{experiment}_warned.txt",
    log:
        "results/logs/measured/{experiment}.log",
    wildcard_constraints:
        experiment="|".join(EXPERIMENTS),
    params:
        entry=experiment_entry,
        models=models_of_measured(),
        # laws are imported by name
        code=code_of("measure_experiment", "palpate.effects"),
    message:
        "put models beside what was measured: {wildcards.experiment}"
    script:
        "../scripts/measure_experiment.py"
