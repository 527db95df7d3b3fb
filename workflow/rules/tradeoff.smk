# What accuracy costs in time: every model over its settings, on samples whose contacts it never saw.


from palpate.models.model_registry import MODELS, families, family_of

TRADEOFF = config["tradeoff"]
# models by family, one job each, and the user's own
COMPARED = [*(TRADEOFF["models"] or MODELS), *OWN_MODELS]
FAMILIES = families(COMPARED, OWN_MODELS)
STATIC = [f"{body}_{regime}" for body in PRESSED for regime in REGIMES]
SPLITS = TRADEOFF["splits"]
# bodies that get all splits
IN_DEPTH = TRADEOFF["in_depth"] or PRESSED
CHECKED = TRADEOFF["truth"]["check_samples"]


include: "functions/tradeoff.smk"


# loads that models were not prepared for, and presses that they were not made for
BEYOND = {name: parts_beyond(name) for name in ("any_load", "beyond_design") if TRADEOFF[name]}
# what engines have answered elsewhere
ANSWERED = {
    scene: [normpath(CONFIG_FILE.parent / path) for path in paths] for scene, paths in TRADEOFF["answers"].items()
}
TRADEOFF_SHOWN = (
    drawn("tradeoff", "advice", "break_even", "truth", "error_bounds")
    | drawn("tradeoff", "work_precision", "best_models", scenes=STATIC)
    | (drawn("tradeoff", "limit_points") if TRADEOFF["limit_points"] else {})
    | (drawn("tradeoff", "any_load") if TRADEOFF["any_load"] else {})
    | drawn("tradeoff", "answers", scenes=list(ANSWERED))
)

# what every model is judged by, and with what
JUDGED = {
    "body": BODY,
    "database": f"{PRESS}/database.h5",
    "compliance": lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
    "samples": f"{PRESS}/samples.csv",
    "truth": f"{PRESS}/truth.h5",
}
JUDGED_WITH = {
    "options": TRADEOFF["regression"] | {"seed": config["seed"]},
    "tolerance": config["solver"]["tolerance"],
    "radius_m": lambda wildcards: radius(wildcards.body, wildcards.regime),
}
TIMED = {"repeats": config["timing"]["repeats"], "budget_s": TRADEOFF["budget_s"]}


rule simulate_truth:
    input:
        body=BODY,
        loads=f"{PRESS}/loads.csv",
        samples=f"{PRESS}/samples.csv",
    output:
        truth=f"{PRESS}/truth.h5",
        check=f"{PRESS}/truth_check.csv",
        warned=f"{PRESS}/truth_warned.txt",
    log:
        "results/logs/{body}/{regime}/simulate_truth.log",
    benchmark:
        "results/benchmarks/{body}/{regime}/simulate_truth.tsv"
    priority: 1  # most of a run waits for it
    params:
        **calls("palpate.studies.tradeoff.jobs:simulate_truth"),
        splits=lambda wildcards: splits_of(wildcards.body, wildcards.regime),
        more=lambda wildcards: bool(more_of(wildcards)),
        check_samples=CHECKED,
    script:
        "../job.py"


rule measure_models:
    input:
        **JUDGED,
        own=lambda wildcards: own_of([wildcards.family]),
    output:
        samples=f"{PRESS}/tradeoff/{{split}}/{{family}}_samples.csv",
        settings=f"{PRESS}/tradeoff/{{split}}/{{family}}_settings.csv",
    log:
        "results/logs/{body}/{regime}/measure_models_{family}_{split}.log",
    benchmark:
        "results/benchmarks/{body}/{regime}/measure_models_{family}_{split}.tsv"
    wildcard_constraints:
        family="|".join(FAMILIES),
    priority: 1  # most of a run waits for it
    threads: HALF
    params:
        **JUDGED_WITH,
        **TIMED,
        **calls(
            "palpate.studies.tradeoff.jobs:measure_models", lambda wildcards: modules_of(FAMILIES[wildcards.family])
        ),
        models=lambda wildcards: FAMILIES[wildcards.family],
        grid=lambda wildcards: grid_of(wildcards.family),
        more_of=lambda wildcards: more_of(wildcards),
    script:
        "../job.py"


rule measure_bounds:
    input:
        **JUDGED,
    output:
        samples=f"{PRESS}/tradeoff/{{split}}/bounds_samples.csv",
        settings=f"{PRESS}/tradeoff/{{split}}/bounds_settings.csv",
        estimates=f"{PRESS}/tradeoff/{{split}}/estimates.csv",
    log:
        "results/logs/{body}/{regime}/measure_bounds_{split}.log",
    benchmark:
        "results/benchmarks/{body}/{regime}/measure_bounds_{split}.tsv"
    params:
        **JUDGED_WITH,
        **calls("palpate.studies.tradeoff.jobs:measure_bounds"),
        more=lambda wildcards: bool(more_of(wildcards)),
    script:
        "../job.py"


rule measure_facets:
    input:
        body=BODY,
        loads=f"{PRESS}/loads.csv",
        truth=f"{PRESS}/truth.h5",
    output:
        geometry=f"{PRESS}/geometry.csv",
    log:
        "results/logs/{body}/{regime}/measure_facets.log",
    params:
        **calls("palpate.studies.tradeoff.jobs:measure_facets"),
        samples=TRADEOFF["truth"]["geometry_samples"],
        entry=lambda wildcards: config["bodies"][wildcards.body],
    script:
        "../job.py"


rule tabulate_tradeoff:
    input:
        settings=family_files("settings"),
        errors=family_files("samples"),
        estimates=estimate_files(),
        truths=presses("truth.h5"),
        checks=presses("truth_check.csv") if CHECKED else [],
        geometry=[f"results/data/{body}/{regime}/geometry.csv" for body, regime in smooth_scenes()],
    output:
        table=in_report("results/tables/accuracy_vs_time.csv"),
        bounds=in_report("results/tables/error_bounds.csv"),
        truth=in_report("results/tables/truth.csv"),
    log:
        "results/logs/tabulate_tradeoff.log",
    params:
        **calls("palpate.studies.tradeoff.jobs:tabulate_tradeoff"),
        scenes=STATIC,
        smooth=[f"{body}_{regime}" for body, regime in smooth_scenes()],
    script:
        "../job.py"


rule measure_other_loads:
    input:
        **JUDGED,
        own=lambda wildcards: own_of(TRADEOFF[wildcards.kind]["models"]),
    output:
        f"{PRESS}/{{kind}}.csv",
    log:
        "results/logs/{body}/{regime}/measure_{kind}.log",
    benchmark:
        "results/benchmarks/{body}/{regime}/measure_{kind}.tsv"
    wildcard_constraints:
        kind="any_load|beyond_design",
    threads: HALF
    params:
        **JUDGED_WITH,
        **TIMED,
        **calls(
            "palpate.studies.tradeoff.jobs:measure_other_loads",
            lambda wildcards: modules_of(TRADEOFF[wildcards.kind]["models"]),
        ),
        models=lambda wildcards: asked_models(wildcards.kind),
        samples=lambda wildcards: TRADEOFF[wildcards.kind]["samples"],
        split=SPLITS[0],
        grid=TRADEOFF["settings"],
        reference=config["solver"]["reference_tolerance"],
    script:
        "../job.py"


rule tabulate_answers:
    input:
        **answered_files(),
        table="results/tables/accuracy_vs_time.csv",
        answers=[path for paths in ANSWERED.values() for path in paths],
    output:
        table=in_report("results/tables/answers.csv"),
        warned="results/data/answers_warned.txt",
    log:
        "results/logs/tabulate_answers.log",
    params:
        **calls("palpate.studies.tradeoff.jobs:tabulate_answers"),
        scenes={scene: (place[1], radius(*place), ANSWERED[scene]) for scene, place in answered_scenes().items()},
        split=SPLITS[0],
    script:
        "../job.py"


rule tabulate_limit_points:
    input:
        body=lambda wildcards: f"results/data/{TRADEOFF['limit_points']['body']}/body.h5",
    output:
        in_report("results/tables/limit_points.csv"),
    log:
        "results/logs/tabulate_limit_points.log",
    benchmark:
        "results/benchmarks/tabulate_limit_points.tsv"
    params:
        **calls("palpate.studies.tradeoff.jobs:tabulate_limit_points"),
        contacts=lambda wildcards: TRADEOFF["limit_points"]["contacts"],
    script:
        "../job.py"


rule draw_tradeoff:
    input:
        read_by(TRADEOFF_SHOWN, *BEYOND),
        **BEYOND,
    output:
        *map(in_report, tables(*BEYOND)),
        figures(*TRADEOFF_SHOWN),
    log:
        "results/logs/draw_tradeoff.log",
    localrule: True
    params:
        **calls("palpate.files:merge", draws=TRADEOFF_SHOWN),
    script:
        "../job.py"


rule tradeoff:
    input:
        rules.tabulate_tradeoff.output,
        tables("advice"),
        rules.tabulate_limit_points.output if TRADEOFF["limit_points"] else [],
        rules.tabulate_answers.output if ANSWERED else [],
        rules.draw_tradeoff.output,
        warned_of(PRESSED),
        presses("loads_warned.txt"),
        presses("truth_warned.txt"),
        page="results/report_tradeoff.html",
