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
    return f"results/data/{settings.measured.experiments[wildcards.experiment].body}/body.h5"


def own_laws_of_measured():
    """The files of the user's own laws, as they can be opened from here."""
    return [law for law in models_of_measured()["fem_p2"]["laws"] if not kind_of(law)]


def models_of_measured():
    """The models that are put beside what was measured, with laws as they can be opened from here."""
    models = config["measured"]["models"]
    laws = [law if kind_of(law) else normpath(CONFIG_FILE.parent / law) for law in models["fem_p2"]["laws"]]
    return models | {"fem_p2": models["fem_p2"] | {"laws": laws}}


def presses_entry(wildcards):
    """What was pressed, with files as they can be opened from here."""
    entry = config["measured"]["presses"][wildcards.presses]
    files = [normpath(CONFIG_FILE.parent / file) for file in entry["files"]]
    return entry | {"files": files}


def files_of_presses(wildcards):
    return presses_entry(wildcards)["files"]


def body_of_presses(wildcards):
    body = settings.measured.presses[wildcards.presses].body
    return [f"results/data/{body}/body.h5"] if body else []


def asking(what):
    """The entries of presses that ask for that."""
    return [name for name, entry in settings.measured.presses.items() if what in entry.ask]
