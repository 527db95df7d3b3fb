# What moves: each scene simulated, what its effects cost, and how wrong it gets without each of them.


include: "functions/scenes.smk"


from palpate.scenes.acting_effects import assumed, has_contact, has_moving_instrument, modules
from palpate.scenes.scene import bodies_in

SCENES = list(config["scenes"])
# scenes in which contact acts, and those of them in which an instrument is moved
TOUCHING = [name for name, scene in config["scenes"].items() if has_contact(scene)]
DRIVEN = [name for name, scene in config["scenes"].items() if has_moving_instrument(scene)]

TARGETS["scenes"] = (
    tabulated("scene_effects", "effects", "energy", "energy_balance")
    + figures("scenes", "energy", "effects")
    + drawn(*(f"motion_{scene}" for scene in SCENES))
    + expand("results/figures/motion_{scene}.{suffix}", scene=SCENES, suffix=["gif", "json"])
    + expand("results/motion/{scene}", scene=SCENES)
    + (tabulated("contacts", "contact_force") if TOUCHING else [])
    + figures("scenes", "contact_force", scenes=DRIVEN)
)
WARNED += warned_of({body for scene in config["scenes"].values() for body in bodies_in(scene)})
WARNED += expand("results/data/scenes/{scene}/warned.txt", scene=SCENES)


rule simulate_scene:
    input:
        bodies=bodies_of,
        own=lambda wildcards: own_effects(wildcards).values(),
        tools=tool_files,
    output:
        motion="results/data/scenes/{scene}/motion.h5",
        decisions="results/data/scenes/{scene}/decisions.csv",
        warned="results/data/scenes/{scene}/warned.txt",
    log:
        "results/logs/scenes/{scene}/simulate_scene.log",
    params:
        scene=scene,
        code=lambda wildcards: code_of("simulate_scene", *called_by(wildcards.scene)),
    message:
        "simulate the scene {wildcards.scene}"
    script:
        "../scripts/simulate_scene.py"


rule leave_out_effects:
    input:
        bodies=bodies_of,
        own=lambda wildcards: own_effects(wildcards).values(),
        tools=tool_files,
        motion="results/data/scenes/{scene}/motion.h5",
    output:
        "results/data/scenes/{scene}/left_out.csv",
    log:
        "results/logs/scenes/{scene}/leave_out_effects.log",
    params:
        scene=scene,
        code=lambda wildcards: code_of("leave_out_effects", *called_by(wildcards.scene)),
    message:
        "simulate {wildcards.scene} without each of its effects"
    script:
        "../scripts/leave_out_effects.py"


rule time_effects:
    input:
        bodies=bodies_of,
        own=lambda wildcards: own_effects(wildcards).values(),
        tools=tool_files,
    output:
        "results/data/scenes/{scene}/cost.csv",
    log:
        "results/logs/scenes/{scene}/time_effects.log",
    threads: HALF
    params:
        scene=scene,
        code=lambda wildcards: code_of("time_effects", *called_by(wildcards.scene)),
    message:
        "time the effects of {wildcards.scene}"
    script:
        "../scripts/time_effects.py"


rule tabulate_scenes:
    input:
        motions=expand("results/data/scenes/{scene}/motion.h5", scene=SCENES),
        decisions=expand("results/data/scenes/{scene}/decisions.csv", scene=SCENES),
        costs=expand("results/data/scenes/{scene}/cost.csv", scene=SCENES),
        errors=expand("results/data/scenes/{scene}/left_out.csv", scene=SCENES),
    output:
        decisions="results/tables/scene_effects.csv",
        effects="results/tables/effects.csv",
        energy="results/tables/energy.csv",
        balance="results/tables/energy_balance.csv",
    log:
        "results/logs/tabulate_scenes.log",
    params:
        integrators={name: scene["integrator"] for name, scene in config["scenes"].items()},
        code=code_of("tabulate_scenes"),
    message:
        "tabulate the scenes"
    script:
        "../scripts/tabulate_scenes.py"


rule write_series:
    input:
        motion="results/data/scenes/{scene}/motion.h5",
    output:
        directory("results/motion/{scene}"),
    log:
        "results/logs/scenes/{scene}/write_series.log",
    params:
        code=code_of("write_series"),
    message:
        "write the motion of {wildcards.scene} for ParaView"
    script:
        "../scripts/write_series.py"


rule draw_motion:
    input:
        motion="results/data/scenes/{scene}/motion.h5",
    output:
        stills=drawn("motion_{scene}"),
        animation="results/figures/motion_{scene}.gif",
        turnable="results/figures/motion_{scene}.json",
    log:
        "results/logs/scenes/{scene}/draw_motion.log",
    params:
        code=code_of("draw_motion"),
    message:
        "draw the motion of {wildcards.scene}"
    script:
        "../scripts/draw_motion.py"


rule tabulate_contacts:
    input:
        motions=expand("results/data/scenes/{scene}/motion.h5", scene=TOUCHING),
    output:
        contacts="results/tables/contacts.csv",
        force="results/tables/contact_force.csv",
    log:
        "results/logs/tabulate_contacts.log",
    params:
        code=code_of("tabulate_contacts"),
    message:
        "tabulate what touches"
    script:
        "../scripts/tabulate_contacts.py"
