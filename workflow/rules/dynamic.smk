# How wrong models are in motion, and what that costs: scenes against fine finite elements.


include: "functions/dynamic.smk"


TARGETS["dynamic"] = merged(
    "dynamic_accuracy",
    expand("results/data/dynamic/{scene}/accuracy.csv", scene=config["dynamic"]["durations_s"]),
) + figures("dynamic", "dynamic_accuracy")
# effects and integrators are imported by the names that a scene gives them
BY_NAME = ["palpate.effects", "palpate.solvers"]


rule simulate_dynamic_reference:
    input:
        body=body_of_trial,
    output:
        "results/data/dynamic/{scene}/reference.npz",
    log:
        "results/logs/dynamic/{scene}/simulate_dynamic_reference.log",
    params:
        trial=trial_of,
        change_of_peak=config["dynamic"]["change_of_peak"],
        training_share=config["dynamic"]["training_share"],
        max_halvings=config["dynamic"]["max_halvings"],
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
