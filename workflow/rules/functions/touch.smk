# The files of each instrument on each body, and what models are tried with.


def touching(name, **more):
    """One file for each instrument on each body."""
    return [file for body, tool in TOUCHES for file in expand(f"{TOUCHING}/{name}", body=body, tool=tool, **more)]


def module_of_touch(wildcards):
    """The module of a model; a user's own is an input instead."""
    return [TOUCH_MODELS[wildcards.model][0]] if wildcards.model in TOUCH_MODELS else []


def touch_grid(model):
    """What a model is tried with; nothing for a user's own."""
    key = TRIED_AS.get(model, model)
    return {key: TOUCH["settings"][key]} if key in TOUCH["settings"] else {}
