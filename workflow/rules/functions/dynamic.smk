# Scenes to compare models by.

from palpate.scenes.acting_effects import has_contact


def compared_of(wildcards):
    """A scene as a scene to compare models by, apart from the values that are tried of their settings."""
    own = {
        key: value for key, value in FOLLOWED[wildcards.scene].items() if key not in ("settings", "elsewhere", "truth")
    }
    return {
        "name": wildcards.scene,
        "entry": config["scenes"][wildcards.scene],
        "own": own,
        "share": config["dynamic"]["training_share"],
    }


def body_of_compared(wildcards):
    return f"results/data/{config['scenes'][wildcards.scene]['body']}/body.h5"


def settings_of_compared(wildcards):
    """The values to try of each model's settings, those of the scene before those of all."""
    own = FOLLOWED[wildcards.scene].get("settings", {})
    return {name: grid | own.get(name, {}) for name, grid in config["dynamic"]["settings"].items()}


def by_name(wildcards):
    """The packages from which effects and integrators are imported by the names that a scene gives them."""
    touching = has_contact(config["scenes"][wildcards.scene])
    return [
        "palpate.effects",
        "palpate.solvers",
        *(["palpate.collision.contact"] if touching else []),
    ]


def truth_of_compared(wildcards):
    """The truth of a scene, if it has one."""
    return f"results/data/dynamic/{wildcards.scene}/truth.npz" if wildcards.scene in TRUE else []
