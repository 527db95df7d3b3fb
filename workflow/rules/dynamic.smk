# How wrong models are in motion, and what that costs: scenes against fine finite elements.

COMPOSED = sources(
    "bodies",
    "effects",
    "solvers",
    "scenes",
    "enrichment",
    "calibration",
    "models",
    "evaluation/dynamic_trial",
)


rule simulate_dynamic_reference:
    input:
        body=body_of_trial,
        code=COMPOSED + sources("evaluation/dynamic_reference"),
    output:
        "results/data/dynamic/{scene}/reference.npz",
    log:
        "results/logs/dynamic/{scene}/simulate_dynamic_reference.log",
    params:
        trial=trial_of,
        change=config["dynamic"]["change_of_peak"],
    message:
        "halve the steps of fine finite elements until that changes nothing: {wildcards.scene}"
    script:
        "../scripts/simulate_dynamic_reference.py"


rule measure_dynamic:
    input:
        body=body_of_trial,
        reference="results/data/dynamic/{scene}/reference.npz",
        code=COMPOSED
        + sources(
            "evaluation/accuracy",
            "evaluation/dynamic",
            "evaluation/dynamic_fit",
            "evaluation/dynamic_reference",
        ),
    output:
        "results/data/dynamic/{scene}/accuracy.csv",
    log:
        "results/logs/dynamic/{scene}/measure_dynamic.log",
    threads: HALF
    params:
        trial=trial_of,
    message:
        "measure models in motion: {wildcards.scene}"
    script:
        "../scripts/measure_dynamic.py"


rule draw_dynamic:
    input:
        "results/tables/dynamic_accuracy.csv",
        code=PICTURES,
    output:
        drawn("dynamic_accuracy"),
    log:
        "results/logs/draw_dynamic.log",
    message:
        "draw how wrong models are in motion"
    script:
        "../scripts/draw_dynamic.py"
