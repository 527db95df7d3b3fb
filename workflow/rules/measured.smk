# Models beside bodies that were measured.


from palpate.bodies.material import kind_of


include: "functions/measured.smk"


EXPERIMENTS = list(config["measured"]["experiments"])
OF_EXPERIMENT = "results/data/measured/{experiment}"

TARGETS["measured"] = merged(measured=expand(f"{OF_EXPERIMENT}.csv", experiment=EXPERIMENTS))
TARGETS["measured"] += figures("measured", "measured", scenes=EXPERIMENTS)
WARNED += warned_of(dict.fromkeys(entry["body"] for entry in config["measured"]["experiments"].values()))
WARNED += expand(f"{OF_EXPERIMENT}_warned.txt", experiment=EXPERIMENTS)


rule measure_experiment:
    input:
        body=body_of_experiment,
        files=files_of_experiment,
        own=own_laws_of_measured(),
    output:
        table=f"{OF_EXPERIMENT}.csv",
        warned=f"{OF_EXPERIMENT}_warned.txt",
    log:
        "results/logs/measured/{experiment}.log",
    wildcard_constraints:
        experiment="|".join(EXPERIMENTS),
    # laws are imported by name, so every effect's code counts
    params:
        **calls("palpate.studies.measured.measure:measure_experiment", ["palpate.effects"]),
        entry=experiment_entry,
        models=models_of_measured(),
    script:
        "../job.py"
