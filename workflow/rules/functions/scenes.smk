# What scenes are made from, and the code that they call for.


def own_effects(wildcards):
    """The files of effects that a scene brings along, by name; given relative to the folder of the config file."""
    own = config["scenes"][wildcards.scene]["own"]
    return {name: normpath(CONFIG_FILE.parent / path) for name, path in own.items()}


def own_file(tool):
    """An instrument of ``contact`` whose file, if it has one, can be opened as it is."""
    return tool | {"file": normpath(CONFIG_FILE.parent / tool["file"])} if "file" in tool else tool


def tool_files(wildcards):
    """The files of a scene's instruments."""
    tools = config["scenes"][wildcards.scene].get("contact", {}).get("instruments", [])
    return [own_file(tool)["file"] for tool in tools if "file" in tool]


def bodies_of(wildcards):
    """The files of all bodies of a scene, its own first."""
    return [f"results/data/{body}/body.h5" for body in settings.scenes[wildcards.scene].bodies]


def scene(wildcards):
    """What a scene is made from."""
    named = {"name": wildcards.scene, "seed": config["seed"], "own": own_effects(wildcards)}
    entry = config["scenes"][wildcards.scene] | named
    if "contact" in entry:
        tools = [own_file(tool) for tool in entry["contact"]["instruments"]]
        entry |= {"contact": entry["contact"] | {"instruments": tools}}
    return entry


def called_by(wildcards):
    """The modules of the effects that act in a scene, and of its integrator."""
    asked = settings.scenes[wildcards.scene]
    return acting_effects.modules(asked, acting_effects.assumed(asked, settings.bodies[asked.body]))
