# What moves: each scene simulated, what its effects cost, and how wrong it gets without each of them.


include: "functions/scenes.smk"


from palpate.scenes import acting_effects

# scenes in which forces are felt, and those of them in which an instrument, a hook or a thread is moved
TOUCHING = [name for name, scene in settings.scenes.items() if acting_effects.has_forces(scene)]
DRIVEN = [name for name, scene in settings.scenes.items() if acting_effects.has_driven(scene)]
OF_SCENE = "results/data/scenes/{scene}"

SCENES_SHOWN = drawn("scenes", "energy", "effects") | drawn("scenes", "contact_force", scenes=DRIVEN)


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
    benchmark:
        "results/benchmarks/scenes/{scene}/simulate_scene.tsv"
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
        decisions=in_report("results/tables/scene_effects.csv"),
        effects=in_report("results/tables/effects.csv"),
        energy=in_report("results/tables/energy.csv"),
        balance=in_report("results/tables/energy_balance.csv"),
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
        contacts=in_report("results/tables/contacts.csv"),
        force=in_report("results/tables/contact_force.csv"),
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


rule draw_scenes:
    input:
        read_by(SCENES_SHOWN),
    output:
        figures(*SCENES_SHOWN),
    log:
        "results/logs/draw_scenes.log",
    localrule: True
    params:
        **draws(SCENES_SHOWN),
    script:
        "../job.py"


rule scenes:
    input:
        rules.tabulate_scenes.output,
        rules.tabulate_contacts.output if TOUCHING else [],
        rules.draw_scenes.output,
        expand(rules.draw_motion.output, scene=SCENES),
        warned_of({body for scene in settings.scenes.values() for body in scene.bodies}),
        expand(rules.simulate_scene.output.warned, scene=SCENES),
        page="results/report_scenes.html",
