# Scenes as trials of models.


def trial_of(wildcards):
    """A scene as a trial of models."""
    return {
        "name": wildcards.scene,
        "entry": config["scenes"][wildcards.scene],
        "duration_s": DURATIONS[wildcards.scene],
        "frames": config["dynamic"]["frames"],
    }


def body_of_trial(wildcards):
    return f"results/data/{config['scenes'][wildcards.scene]['body']}/body.h5"
