# The entries of measured bodies, and the files that they name.


def experiment_entry(wildcards):
    """What was measured, with files as they can be opened from here."""
    entry = config["measured"]["experiments"][wildcards.experiment]
    cases = {
        name: case | {"files": [normpath(CONFIG_FILE.parent / file) for file in case["files"]]}
        for name, case in entry["cases"].items()
    }
    return entry | {"cases": cases}


def files_of_experiment(wildcards):
    return [file for case in experiment_entry(wildcards)["cases"].values() for file in case["files"]]


def body_of_experiment(wildcards):
    return f"results/data/{config['measured']['experiments'][wildcards.experiment]['body']}/body.h5"
