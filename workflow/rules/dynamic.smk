# How wrong models are in motion, and what that costs: scenes against fine finite elements.


include: "functions/dynamic.smk"


from palpate.scenes.dynamic_check import followed, trials

# how each scene is followed, and why those are left out in which models cannot be compared
FOLLOWED, LEFT_OUT = config["dynamic"].get("scenes"), {}
if FOLLOWED is None:
    DURATIONS, LEFT_OUT = trials(config["scenes"], config["bodies"])
    FOLLOWED = dict.fromkeys(DURATIONS, {})
# what a scene does not say for itself
OF_ALL = {key: config["dynamic"][key] for key in ("frames", "change_of_peak", "max_halvings")}
FOLLOWED = {
    name: OF_ALL | {"duration_s": followed(config["scenes"][name])} | own for name, own in FOLLOWED.items()
}

# scenes whose push is moved to other places, which bounds are made of
ELSEWHERE = [scene for scene, own in FOLLOWED.items() if "elsewhere" in own]
OPTIONAL += ["motion_bounds"] if ELSEWHERE else []

TARGETS["dynamic"] = (
    merged("dynamic_accuracy", expand("results/data/dynamic/{scene}/accuracy.csv", scene=FOLLOWED))
    + merged("dynamic_reference", expand("results/data/dynamic/{scene}/reference.csv", scene=FOLLOWED))
    + tabulated("advice", *(["motion_bounds"] if ELSEWHERE else []))
    + figures("dynamic", "dynamic_accuracy", "dynamic_reference")
)
WARNED += warned_of({config["scenes"][scene]["body"] for scene in FOLLOWED})
WARNED += expand("results/data/dynamic/{scene}/warned.txt", scene=FOLLOWED)
WARNED += ["results/data/dynamic/left_out.txt"] if LEFT_OUT else []


rule leave_out_scenes:
    output:
        "results/data/dynamic/left_out.txt",
    log:
        "results/logs/dynamic/leave_out_scenes.log",
    params:
        reasons=LEFT_OUT,
        code=code_of("leave_out_scenes"),
    message:
        "name the scenes in which models are not compared"
    script:
        "../scripts/leave_out_scenes.py"


rule simulate_dynamic_reference:
    input:
        body=body_of_trial,
    output:
        reference="results/data/dynamic/{scene}/reference.npz",
        table="results/data/dynamic/{scene}/reference.csv",
        warned="results/data/dynamic/{scene}/warned.txt",
    log:
        "results/logs/dynamic/{scene}/simulate_dynamic_reference.log",
    params:
        trial=trial_of,
        code=lambda wildcards: code_of("simulate_dynamic_reference", *by_name(wildcards)),
    message:
        "halve the steps of fine finite elements until that changes nothing: {wildcards.scene}"
    script:
        "../scripts/simulate_dynamic_reference.py"


rule measure_dynamic:
    input:
        body=body_of_trial,
        reference="results/data/dynamic/{scene}/reference.npz",
    output:
        "results/data/dynamic/{scene}/accuracy.csv",
    log:
        "results/logs/dynamic/{scene}/measure_dynamic.log",
    threads: HALF
    params:
        trial=trial_of,
        settings=settings_of_trial,
        code=lambda wildcards: code_of("measure_dynamic", *by_name(wildcards)),
    message:
        "measure models in motion: {wildcards.scene}"
    script:
        "../scripts/measure_dynamic.py"


if ELSEWHERE:

    rule measure_elsewhere:
        input:
            body=body_of_trial,
        output:
            "results/data/dynamic/{scene}/elsewhere.csv",
        log:
            "results/logs/dynamic/{scene}/measure_elsewhere.log",
        params:
            trial=trial_of,
            settings=settings_of_trial,
            own=lambda wildcards: FOLLOWED[wildcards.scene]["elsewhere"],
            seed=config["seed"],
            code=lambda wildcards: code_of("measure_elsewhere", *by_name(wildcards)),
        message:
            "push at other places: {wildcards.scene}"
        script:
            "../scripts/measure_elsewhere.py"

    rule tabulate_motion_bounds:
        input:
            expand("results/data/dynamic/{scene}/elsewhere.csv", scene=ELSEWHERE),
        output:
            "results/tables/motion_bounds.csv",
        log:
            "results/logs/tabulate_motion_bounds.log",
        params:
            code=code_of("tabulate_motion_bounds"),
        message:
            "bound the errors of motions elsewhere"
        script:
            "../scripts/tabulate_motion_bounds.py"
