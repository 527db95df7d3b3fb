# What moves: each scene simulated, what its effects cost, and how wrong it gets without each of them.


rule simulate_scene:
    input:
        bodies=bodies_of,
        own=lambda wildcards: own_effects(wildcards).values(),
        tools=tool_files,
        code=moving,
    output:
        motion="results/data/scenes/{scene}/motion.h5",
        decisions="results/data/scenes/{scene}/decisions.csv",
    log:
        "results/logs/scenes/{scene}/simulate_scene.log",
    params:
        scene=scene,
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
        code=lambda wildcards: moving(wildcards) + sources("evaluation/effect_cost"),
    output:
        "results/data/scenes/{scene}/left_out.csv",
    log:
        "results/logs/scenes/{scene}/leave_out_effects.log",
    params:
        scene=scene,
    message:
        "simulate {wildcards.scene} without each of its effects"
    script:
        "../scripts/leave_out_effects.py"


rule time_effects:
    input:
        bodies=bodies_of,
        own=lambda wildcards: own_effects(wildcards).values(),
        tools=tool_files,
        code=lambda wildcards: moving(wildcards) + sources("evaluation/effect_cost"),
    output:
        "results/data/scenes/{scene}/cost.csv",
    log:
        "results/logs/scenes/{scene}/time_effects.log",
    threads: HALF
    params:
        scene=scene,
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
        code=sources("scenes/motion"),
    output:
        decisions="results/tables/scene_effects.csv",
        effects="results/tables/effects.csv",
        energy="results/tables/energy.csv",
    log:
        "results/logs/tabulate_scenes.log",
    message:
        "tabulate the scenes"
    script:
        "../scripts/tabulate_scenes.py"


rule write_series:
    input:
        motion="results/data/scenes/{scene}/motion.h5",
        code=sources("scenes/motion", "scenes/series"),
    output:
        directory("results/motion/{scene}"),
    log:
        "results/logs/scenes/{scene}/write_series.log",
    message:
        "write the motion of {wildcards.scene} for ParaView"
    script:
        "../scripts/write_series.py"


rule draw_motion:
    input:
        motion="results/data/scenes/{scene}/motion.h5",
        code=PICTURES,
    output:
        stills=drawn("motion_{scene}"),
        animation="results/figures/motion_{scene}.gif",
        turnable="results/figures/motion_{scene}.json",
    log:
        "results/logs/scenes/{scene}/draw_motion.log",
    message:
        "draw the motion of {wildcards.scene}"
    script:
        "../scripts/draw_motion.py"


rule draw_scenes:
    input:
        energy="results/tables/energy.csv",
        effects="results/tables/effects.csv",
        code=PICTURES,
    output:
        energy=drawn("energy"),
        effects=drawn("effects"),
    log:
        "results/logs/draw_scenes.log",
    message:
        "draw energies and costs of the scenes"
    script:
        "../scripts/draw_scenes.py"
