# What moves: each scene simulated, what its effects cost, and how wrong it gets without each of them.


include: "functions/scenes.smk"


from palpate.scenes import acting_effects
from palpate.scenes.scene import bodies_in

SCENES = list(config["scenes"])
# scenes in which forces are felt, and those of them in which an instrument, a hook or a thread is moved
TOUCHING = [name for name, scene in config["scenes"].items() if acting_effects.has_forces(scene)]
DRIVEN = [name for name, scene in config["scenes"].items() if acting_effects.has_driven(scene)]
OF_SCENE = "results/data/scenes/{scene}"

TARGETS["scenes"] = (
    tabulated("scene_effects", "effects", "energy", "energy_balance")
    + figures("scenes", "energy", "effects")
    + drawn(*(f"motion_{scene}" for scene in SCENES))
    + expand("results/figures/motion_{scene}.{suffix}", scene=SCENES, suffix=["gif", "json"])
    + expand("results/motion/{scene}", scene=SCENES)
    + (tabulated("contacts", "contact_force") if TOUCHING else [])
    + (figures("scenes", "contact_force", scenes=DRIVEN) if DRIVEN else [])
)
WARNED["scenes"] += warned_of({body for scene in config["scenes"].values() for body in bodies_in(scene)})
WARNED["scenes"] += expand(f"{OF_SCENE}/warned.txt", scene=SCENES)


rule simulate_scene:
    input:
        bodies=bodies_of,
        own=lambda wildcards: own_effects(wildcards).values(),
        tools=tool_files,
    output:
        motion=f"{OF_SCENE}/motion.h5",
        decisions=f"{OF_SCENE}/decisions.csv",
        cost=f"{OF_SCENE}/cost.csv",
        left_out=f"{OF_SCENE}/left_out.csv",
        warned=f"{OF_SCENE}/warned.txt",
    log:
        "results/logs/scenes/{scene}/simulate_scene.log",
    threads: HALF
    params:
        **calls("palpate.studies.scenes.measurements:simulate_scene", called_by),
        scene=scene,
    script:
        "../job.py"


rule tabulate_scenes:
    input:
        motions=expand(f"{OF_SCENE}/motion.h5", scene=SCENES),
        decisions=expand(f"{OF_SCENE}/decisions.csv", scene=SCENES),
        costs=expand(f"{OF_SCENE}/cost.csv", scene=SCENES),
        errors=expand(f"{OF_SCENE}/left_out.csv", scene=SCENES),
    output:
        decisions="results/tables/scene_effects.csv",
        effects="results/tables/effects.csv",
        energy="results/tables/energy.csv",
        balance="results/tables/energy_balance.csv",
    log:
        "results/logs/tabulate_scenes.log",
    params:
        **calls("palpate.studies.scenes.measurements:tabulate_scenes"),
        integrators={name: scene["integrator"] for name, scene in config["scenes"].items()},
    script:
        "../job.py"


rule tabulate_contacts:
    input:
        motions=expand(f"{OF_SCENE}/motion.h5", scene=TOUCHING),
    output:
        contacts="results/tables/contacts.csv",
        force="results/tables/contact_force.csv",
    log:
        "results/logs/tabulate_contacts.log",
    params:
        **calls("palpate.studies.scenes.contact_force:tabulate_contacts"),
    script:
        "../job.py"


rule draw_motion:
    input:
        motion=f"{OF_SCENE}/motion.h5",
    output:
        stills=drawn("motion_{scene}"),
        animation="results/figures/motion_{scene}.gif",
        turnable="results/figures/motion_{scene}.json",
        series=directory("results/motion/{scene}"),
    log:
        "results/logs/scenes/{scene}/draw_motion.log",
    params:
        **calls("palpate.studies.scenes.motion_pictures:draw_motion"),
    script:
        "../job.py"
