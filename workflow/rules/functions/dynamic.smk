# Scenes to compare models by.

from palpate.studies.dynamic.settings import tried


def scene_named(wildcards):
    """A scene with its name."""
    return config["scenes"][wildcards.scene] | {"name": wildcards.scene}


def compared_of(wildcards):
    """A scene as a scene to compare models by, apart from the values that are tried of their settings."""
    own = {
        key: value
        for key, value in FOLLOWED[wildcards.scene].items()
        if key not in ("settings", "elsewhere", "truth", "held_out")
    }
    return {"scene": scene_named(wildcards), "own": own}


def body_of_compared(wildcards):
    return f"results/data/{settings.scenes[wildcards.scene].body}/body.h5"


def settings_of_compared(wildcards):
    """The values to try of the settings of each model, those of the scene before those of all."""
    return tried(config["dynamic"]["settings"], FOLLOWED[wildcards.scene].get("settings", {}))


def by_name(wildcards):
    """The packages from which effects and integrators are imported by the names that a scene gives them."""
    touching = settings.scenes[wildcards.scene].contact is not None
    return [
        "palpate.effects",
        "palpate.solvers",
        *(["palpate.models.stroke_motion"] if stroked(wildcards.scene) else []),
        *(["palpate.collision.contact"] if touching else []),
    ]


def truth_of_compared(wildcards):
    """How well the motion of a scene is known, if that is asked."""
    return f"results/data/dynamic/{wildcards.scene}/truth.h5" if "truth" in FOLLOWED[wildcards.scene] else []


def stroked(scene):
    """The models of a scene that are learnt from strokes."""
    return [model for model in ("path_modes", "region_modes") if model in FOLLOWED[scene].get("models", [])]


def strokes_of_compared(wildcards):
    """The strokes that models of a scene are learnt from, one file a model."""
    return [f"{TRIAL}/{model}.h5".format(scene=wildcards.scene) for model in stroked(wildcards.scene)]


def shown_of(wildcards):
    """A scene as strokes are simulated in it, apart from all that other models have."""
    own = FOLLOWED[wildcards.scene]
    kept = {key: own[key] for key in ("duration_s", "frames", "level") if key in own}
    return {"scene": scene_named(wildcards), "own": kept}


def region_of(wildcards):
    """The region of random strokes; None for those beside the path."""
    if wildcards.model == "path_modes":
        return None
    grid = settings_of_compared(wildcards)["region_modes"]
    return {key: grid[key] for key in ("half_width_m", "strokes")} | {"seed": config["seed"]}
