# How wrong models are in motion, and what that costs: scenes against fine finite elements.


include: "functions/dynamic.smk"


from palpate.scenes.dynamic_check import trials

# how long each scene is followed, and why those are left out in which models cannot be compared
DURATIONS, LEFT_OUT = trials(config["scenes"], config["bodies"])
if "durations_s" in config["dynamic"]:
    DURATIONS, LEFT_OUT = config["dynamic"]["durations_s"], {}

TARGETS["dynamic"] = (
    merged("dynamic_accuracy", expand("results/data/dynamic/{scene}/accuracy.csv", scene=DURATIONS))
    + tabulated("advice")
    + figures("dynamic", "dynamic_accuracy")
)
WARNED += warned_of({config["scenes"][scene]["body"] for scene in DURATIONS})
WARNED += expand("results/data/dynamic/{scene}/warned.txt", scene=DURATIONS)
WARNED += ["results/data/dynamic/left_out.txt"] if LEFT_OUT else []
# effects and integrators are imported by the names that a scene gives them
BY_NAME = ["palpate.effects", "palpate.solvers"]


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
        warned="results/data/dynamic/{scene}/warned.txt",
    log:
        "results/logs/dynamic/{scene}/simulate_dynamic_reference.log",
    params:
        trial=trial_of,
        change_of_peak=config["dynamic"]["change_of_peak"],
        training_share=config["dynamic"]["training_share"],
        max_halvings=config["dynamic"]["max_halvings"],
        # a duration that nobody has given may be halved so often
        shorter=0 if "durations_s" in config["dynamic"] else 3,
        code=code_of("simulate_dynamic_reference", *BY_NAME),
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
        settings=config["dynamic"]["settings"],
        code=code_of("measure_dynamic", *BY_NAME),
    message:
        "measure models in motion: {wildcards.scene}"
    script:
        "../scripts/measure_dynamic.py"
