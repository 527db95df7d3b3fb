# What moves: each scene simulated, what its effects cost, and how wrong it gets without each of them.


from palpate.scenes import acting_effects

# each scene with the files of its instruments and of the user's effects as they can be opened from here
INSTRUMENTS = {
    scene: [
        tool | ({"file": here(tool["file"])} if "file" in tool else {})
        for tool in entry.get("contact", {}).get("instruments", [])
    ]
    for scene, entry in config["scenes"].items()
}
OWN_EFFECTS = {
    scene: {name: here(path) for name, path in entry["own"].items()} for scene, entry in config["scenes"].items()
}
SIMULATED = {
    scene: entry
    | {"name": scene, "seed": config["seed"], "own": OWN_EFFECTS[scene]}
    | ({"contact": entry["contact"] | {"instruments": INSTRUMENTS[scene]}} if "contact" in entry else {})
    for scene, entry in config["scenes"].items()
}
# scenes in which forces are felt, and those of them in which an instrument, a hook or a thread is moved
TOUCHING = [name for name, scene in settings.scenes.items() if acting_effects.has_forces(scene)]
DRIVEN = [name for name, scene in settings.scenes.items() if acting_effects.has_driven(scene)]
OF_SCENE = "results/data/scenes/{scene}"

SCENE_TABLES = [
    "scene_effects",
    "effects",
    "energy",
    "energy_balance",
    *(["contacts", "contact_force"] if TOUCHING else []),
]
SCENES_SHOWN = drawn("scenes", "energy", "effects") | drawn("scenes", "contact_force", scenes=DRIVEN)


rule simulate_scene:
    input:
        bodies=lambda wildcards: [BODY.format(body=body) for body in settings.scenes[wildcards.scene].bodies],
        own=lambda wildcards: OWN_EFFECTS[wildcards.scene].values(),
        tools=lambda wildcards: [tool["file"] for tool in INSTRUMENTS[wildcards.scene] if "file" in tool],
    output:
        motion=f"{OF_SCENE}/motion.h5",
        decisions=f"{OF_SCENE}/decisions.csv",
        cost=f"{OF_SCENE}/cost.csv",
        left_out=f"{OF_SCENE}/left_out.csv",
        warned=f"{OF_SCENE}/warned.txt",
    log:
        "results/logs/scenes/{scene}/simulate_scene.log",
    benchmark:
        "results/benchmarks/scenes/{scene}/simulate_scene.tsv"
    threads: HALF
    params:
        # the modules of the effects that act in a scene, and of its integrator
        **calls(
            "palpate.studies.scenes.measurements:simulate_scene",
            lambda wildcards: acting_effects.modules(
                settings.scenes[wildcards.scene],
                acting_effects.assumed(
                    settings.scenes[wildcards.scene], settings.bodies[settings.scenes[wildcards.scene].body]
                ),
            ),
        ),
        scene=lambda wildcards: SIMULATED[wildcards.scene],
    script:
        "../job.py"


rule tabulate_scenes:
    input:
        motions=expand(f"{OF_SCENE}/motion.h5", scene=SCENES),
        decisions=expand(f"{OF_SCENE}/decisions.csv", scene=SCENES),
        costs=expand(f"{OF_SCENE}/cost.csv", scene=SCENES),
        errors=expand(f"{OF_SCENE}/left_out.csv", scene=SCENES),
        touching=expand(f"{OF_SCENE}/motion.h5", scene=TOUCHING),
    output:
        figures(*SCENES_SHOWN),
        **dict(zip(SCENE_TABLES, map(in_report, tables(*SCENE_TABLES)))),
    log:
        "results/logs/tabulate_scenes.log",
    params:
        **calls("palpate.studies.scenes.measurements:tabulate_scenes", draws=SCENES_SHOWN),
        integrators={name: scene["integrator"] for name, scene in config["scenes"].items()},
    script:
        "../job.py"


rule draw_motion:
    input:
        motion=f"{OF_SCENE}/motion.h5",
    output:
        stills=figures("motion_{scene}"),
        animation="results/figures/motion_{scene}.gif",
        turnable="results/figures/motion_{scene}.json",
        series=directory("results/motion/{scene}"),
    log:
        "results/logs/scenes/{scene}/draw_motion.log",
    params:
        **calls("palpate.studies.scenes.motion_pictures:draw_motion"),
    script:
        "../job.py"


rule scenes:
    input:
        rules.tabulate_scenes.output,
        expand(rules.draw_motion.output, scene=SCENES),
        warned_of({body for scene in settings.scenes.values() for body in scene.bodies}),
        expand(rules.simulate_scene.output.warned, scene=SCENES),
        page="results/report_scenes.html",
