# How wrong models are in motion, and what that costs: scenes against fine finite elements.


from palpate.benchmark.comparable import compared_scenes, followed
from palpate.studies.dynamic.settings import MAX_HALVINGS, OF_PLACES, tried

# how each scene is followed, and why those are left out in which models cannot be compared
FOLLOWED, LEFT_OUT = config["dynamic"].get("scenes"), {}
if FOLLOWED is None:
    DURATIONS, LEFT_OUT = compared_scenes(settings.scenes, settings.bodies)
    FOLLOWED = dict.fromkeys(DURATIONS, {})
# what a scene does not say for itself
OF_ALL = some("dynamic", "frames", "change_of_peak") | {"max_halvings": MAX_HALVINGS}
FOLLOWED = {name: OF_ALL | {"duration_s": followed(settings.scenes[name])} | own for name, own in FOLLOWED.items()}

BODY_OF = {scene: BODY.format(body=settings.scenes[scene].body) for scene in FOLLOWED}
# each scene as models are compared in it, apart from the values that are tried of their settings
COMPARED = {
    scene: {
        "scene": config["scenes"][scene] | {"name": scene},
        "own": {key: own[key] for key in own if key not in ("settings", "elsewhere", "truth", "held_out")},
    }
    for scene, own in FOLLOWED.items()
}
# the values to try of the settings of each model, those of the scene before those of all
TRIED = {scene: tried(config["dynamic"]["settings"], own.get("settings", {})) for scene, own in FOLLOWED.items()}
# models that are learnt from strokes, and each scene as these are simulated in it, apart from all that others have
STROKED = {
    scene: [model for model in ("path_modes", "region_modes") if model in own.get("models", [])]
    for scene, own in FOLLOWED.items()
}
OF_STROKES = {
    scene: compared
    | {"own": {key: compared["own"][key] for key in ("duration_s", "frames", "level") if key in compared["own"]}}
    for scene, compared in COMPARED.items()
}
# packages from which effects and integrators are imported by the names that a scene gives them
BY_NAME = {
    scene: ["palpate.effects", "palpate.solvers"]
    + (["palpate.models.stroke_motion"] if STROKED[scene] else [])
    + (["palpate.collision.contact"] if settings.scenes[scene].contact else [])
    for scene in FOLLOWED
}

# scenes of which it is found how well their motion is known
TRUE = [scene for scene, own in FOLLOWED.items() if "truth" in own]
# scenes in which something touches, so that it feels a force
FELT = [scene for scene in FOLLOWED if settings.scenes[scene].contact]
# scenes whose push is moved to other places, which bounds are made of
ELSEWHERE = [scene for scene, own in FOLLOWED.items() if "elsewhere" in own]
# scenes whose models are tried on strokes that they were not shown, which bounds are made of, too
HELD_OUT = [scene for scene, own in FOLLOWED.items() if "held_out" in own]
TRIAL = "results/data/dynamic/{scene}"
MOVED = expand(f"{TRIAL}/elsewhere.csv", scene=ELSEWHERE) + expand(f"{TRIAL}/held_out.csv", scene=HELD_OUT)
# the parts of each table that this run makes
MOTIONS = {
    "dynamic_accuracy": expand(f"{TRIAL}/accuracy.csv", scene=FOLLOWED),
    "dynamic_reference": expand(f"{TRIAL}/reference.csv", scene=FOLLOWED),
    "motion_truth": expand(f"{TRIAL}/truth.csv", scene=TRUE),
    "dynamic_force": expand(f"{TRIAL}/force.csv", scene=FELT),
    "motion_places": MOVED,
}
MOTIONS = {table: parts for table, parts in MOTIONS.items() if parts}
DYNAMIC_SHOWN = drawn("dynamic", "dynamic_accuracy", "dynamic_reference", *(["dynamic_force"] if FELT else []))


rule simulate_dynamic_reference:
    input:
        body=lambda wildcards: BODY_OF[wildcards.scene],
    output:
        reference=f"{TRIAL}/reference.h5",
        table=f"{TRIAL}/reference.csv",
        warned=f"{TRIAL}/warned.txt",
    log:
        "results/logs/dynamic/{scene}/simulate_dynamic_reference.log",
    benchmark:
        "results/benchmarks/dynamic/{scene}/simulate_dynamic_reference.tsv"
    params:
        **calls(
            "palpate.studies.dynamic.reference:simulate_dynamic_reference", lambda wildcards: BY_NAME[wildcards.scene]
        ),
        compared=lambda wildcards: COMPARED[wildcards.scene],
    script:
        "../job.py"


rule find_motion_truth:
    input:
        body=lambda wildcards: BODY_OF[wildcards.scene],
    output:
        truth=f"{TRIAL}/truth.h5",
        table=f"{TRIAL}/truth.csv",
        warned=f"{TRIAL}/truth_warned.txt",
    log:
        "results/logs/dynamic/{scene}/find_motion_truth.log",
    benchmark:
        "results/benchmarks/dynamic/{scene}/find_motion_truth.tsv"
    params:
        **calls("palpate.studies.dynamic.reference:find_motion_truth", lambda wildcards: BY_NAME[wildcards.scene]),
        compared=lambda wildcards: COMPARED[wildcards.scene],
        truth=lambda wildcards: FOLLOWED[wildcards.scene]["truth"],
    script:
        "../job.py"


rule simulate_strokes:
    input:
        body=lambda wildcards: BODY_OF[wildcards.scene],
    output:
        strokes=f"{TRIAL}/{{model}}.h5",
    log:
        "results/logs/dynamic/{scene}/simulate_strokes_{model}.log",
    benchmark:
        "results/benchmarks/dynamic/{scene}/simulate_strokes_{model}.tsv"
    wildcard_constraints:
        model="path_modes|region_modes",
    params:
        **calls("palpate.studies.dynamic.strokes:simulate_strokes", "palpate.effects"),
        compared=lambda wildcards: OF_STROKES[wildcards.scene],
        # of random strokes; those of path_modes are beside the path
        region=lambda wildcards: (
            {key: TRIED[wildcards.scene]["region_modes"][key] for key in ("half_width_m", "strokes")}
            | {"seed": config["seed"]}
            if wildcards.model == "region_modes"
            else None
        ),
    script:
        "../job.py"


rule measure_dynamic:
    input:
        body=lambda wildcards: BODY_OF[wildcards.scene],
        reference=f"{TRIAL}/reference.h5",
        truth=lambda wildcards: f"{TRIAL}/truth.h5".format(scene=wildcards.scene) if wildcards.scene in TRUE else [],
        strokes=lambda wildcards: expand(f"{TRIAL}/{{model}}.h5", model=STROKED[wildcards.scene], **wildcards),
        own=list(own_that("move").values()),
    output:
        table=f"{TRIAL}/accuracy.csv",
        force=f"{TRIAL}/force.csv",
    log:
        "results/logs/dynamic/{scene}/measure_dynamic.log",
    benchmark:
        "results/benchmarks/dynamic/{scene}/measure_dynamic.tsv"
    threads: HALF
    params:
        **calls("palpate.studies.dynamic.accuracy:measure_dynamic", lambda wildcards: BY_NAME[wildcards.scene]),
        compared=lambda wildcards: COMPARED[wildcards.scene],
        settings=lambda wildcards: TRIED[wildcards.scene],
        stroked=lambda wildcards: STROKED[wildcards.scene],
        own=own_that("move"),
        seed=config["seed"],
    script:
        "../job.py"


rule measure_elsewhere:
    input:
        body=lambda wildcards: BODY_OF[wildcards.scene],
        truth=lambda wildcards: f"{TRIAL}/truth.h5".format(scene=wildcards.scene) if wildcards.scene in TRUE else [],
    output:
        f"{TRIAL}/elsewhere.csv",
    log:
        "results/logs/dynamic/{scene}/measure_elsewhere.log",
    benchmark:
        "results/benchmarks/dynamic/{scene}/measure_elsewhere.tsv"
    params:
        **calls("palpate.studies.dynamic.elsewhere:measure_elsewhere", lambda wildcards: BY_NAME[wildcards.scene]),
        compared=lambda wildcards: COMPARED[wildcards.scene],
        settings=lambda wildcards: TRIED[wildcards.scene],
        own=lambda wildcards: OF_PLACES | FOLLOWED[wildcards.scene]["elsewhere"],
        seed=config["seed"],
    script:
        "../job.py"


rule measure_held_out:
    input:
        body=lambda wildcards: BODY_OF[wildcards.scene],
        strokes=f"{TRIAL}/region_modes.h5",
    output:
        f"{TRIAL}/held_out.csv",
    log:
        "results/logs/dynamic/{scene}/measure_held_out.log",
    benchmark:
        "results/benchmarks/dynamic/{scene}/measure_held_out.tsv"
    params:
        **calls("palpate.studies.dynamic.elsewhere:measure_held_out", lambda wildcards: BY_NAME[wildcards.scene]),
        compared=lambda wildcards: OF_STROKES[wildcards.scene],
        grid=lambda wildcards: TRIED[wildcards.scene]["region_modes"],
        held_out=lambda wildcards: FOLLOWED[wildcards.scene]["held_out"],
        seed=config["seed"],
    script:
        "../job.py"


rule tabulate_dynamic:
    input:
        **MOTIONS,
    output:
        *map(in_report, tables(*MOTIONS)),
        figures(*DYNAMIC_SHOWN),
        **({"bounds": in_report("results/tables/motion_bounds.csv")} if MOVED else {}),
        warned="results/data/dynamic/left_out.txt",
    log:
        "results/logs/tabulate_dynamic.log",
    params:
        **calls("palpate.studies.dynamic.elsewhere:tabulate_dynamic", draws=DYNAMIC_SHOWN),
        left_out=LEFT_OUT,
    script:
        "../job.py"


rule dynamic:
    input:
        rules.tabulate_dynamic.output,
        # between presses, too, it is the trade-off's, for which motions alone do not wait
        tables("advice") if "tradeoff" not in ADVISED else [],
        warned_of({config["scenes"][scene]["body"] for scene in FOLLOWED}),
        expand(f"{TRIAL}/warned.txt", scene=FOLLOWED),
        expand(f"{TRIAL}/truth_warned.txt", scene=TRUE),
        page="results/report_dynamic.html",
