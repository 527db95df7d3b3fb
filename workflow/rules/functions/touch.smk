# The files of each instrument on each body, and what models are tried with.


def touching(name, **more):
    """One file for each instrument on each body."""
    return [file for body, tool in TOUCHES for file in expand(f"{TOUCHING}/{name}", body=body, tool=tool, **more)]


def module_of_touch(wildcards):
    """The module of a model; a user's own is an input instead."""
    return [TOUCH_MODELS[wildcards.model][0]] if wildcards.model in TOUCH_MODELS else []


def touch_grid(model):
    """What a model is tried with, under its own name, that of springs without a volume, or that of its module."""
    names = {model, model.removesuffix("_volume"), TOUCH_PLACES[model][0].rpartition(".")[2]}
    return {name: block for name, block in TOUCH["settings"].items() if name in names}
