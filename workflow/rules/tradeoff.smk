# What accuracy costs in time: every model over its settings, on samples whose contacts it never saw.


from palpate.models.model_registry import MODELS, families, family_of

TRADEOFF = config["tradeoff"]
# models by family, one job each, and the user's own; what fills files, the truth's own errors too
FAMILIES = families([*(TRADEOFF["models"] or MODELS), *OWN_MODELS], OWN_MODELS)
MEASURED_FAMILIES = [*FAMILIES, "bounds"]
# the class of each model and the module that prepares it, of the user's own none, as their files are inputs
MODULES = {name: [f"{type(model).__module__}:{type(model).__name__}", model.place] for name, model in MODELS.items()}
MODULES |= dict.fromkeys(OWN_MODELS, [])
# what a job needs to load each model
RECIPES = {}
for family in families([*MODELS, *OWN_MODELS], OWN_MODELS).values():
    RECIPES |= family
# what each family is tried with, and the coarse answers that several share
GRIDS = {
    family: {"coarse_answers", family, *(family_of(name) for name in models if name in MODELS)}
    for family, models in FAMILIES.items()
}
# the splits of the contacts of each body that are measured, and the folders of these
SPLITS = {body: TRADEOFF["splits"] for body in TRADEOFF["in_depth"] or PRESSED}
SPLITS |= {body: TRADEOFF["splits"][:1] for body in PRESSED if body not in SPLITS}
IN_SPLITS = [
    f"results/data/{body}/{regime}/tradeoff/{split}" for body in PRESSED for regime in REGIMES for split in SPLITS[body]
]
# what models are asked at training contacts too: none where several splits hold out every contact in turn
MORE_OF = {body: {} if len(splits) > 1 else TRADEOFF["training_contacts_of"] for body, splits in SPLITS.items()}
# the body and the regime of each scene; of those whose body has a smooth surface that is known, if facets are measured
STATIC = {f"{body}_{regime}": (body, regime) for body in PRESSED for regime in REGIMES}
SMOOTH = {
    scene: place
    for scene, place in STATIC.items()
    if TRADEOFF["truth"]["geometry_samples"]
    and settings.bodies[place[0]].kind in ("cylinder", "liver", "kidney", "stomach")
}
CHECKED = TRADEOFF["truth"]["check_samples"]
# loads that models were not prepared for, and presses that they were not made for
BEYOND = {
    name: expand(f"{PRESS}/{name}.csv", body=PRESSED, regime=TRADEOFF[name]["regimes"] or REGIMES)
    for name in ("any_load", "beyond_design")
    if TRADEOFF[name]
}
# what engines have answered elsewhere
ANSWERED = {scene: [here(path) for path in paths] for scene, paths in TRADEOFF["answers"].items()}
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
        splits=lambda wildcards: SPLITS[wildcards.body],
        more=lambda wildcards: bool(MORE_OF[wildcards.body]),
        check_samples=CHECKED,
    script:
        "../job.py"


rule measure_models:
    input:
        **JUDGED,
        own=lambda wildcards: OWN_MODELS.get(wildcards.family, []),
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
            "palpate.studies.tradeoff.jobs:measure_models",
            lambda wildcards: sorted({module for name in FAMILIES[wildcards.family] for module in MODULES[name]}),
        ),
        models=lambda wildcards: FAMILIES[wildcards.family],
        grid=lambda wildcards: {
            key: tried for key, tried in TRADEOFF["settings"].items() if key in GRIDS[wildcards.family]
        },
        more_of=lambda wildcards: MORE_OF[wildcards.body],
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
        more=lambda wildcards: bool(MORE_OF[wildcards.body]),
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
        settings=expand("{folder}/{family}_settings.csv", folder=IN_SPLITS, family=MEASURED_FAMILIES),
        errors=expand("{folder}/{family}_samples.csv", folder=IN_SPLITS, family=MEASURED_FAMILIES),
        estimates=expand("{folder}/estimates.csv", folder=IN_SPLITS),
        truths=presses("truth.h5"),
        checks=presses("truth_check.csv") if CHECKED else [],
        geometry=[f"results/data/{body}/{regime}/geometry.csv" for body, regime in SMOOTH.values()],
    output:
        table=in_report("results/tables/accuracy_vs_time.csv"),
        bounds=in_report("results/tables/error_bounds.csv"),
        truth=in_report("results/tables/truth.csv"),
    log:
        "results/logs/tabulate_tradeoff.log",
    params:
        **calls("palpate.studies.tradeoff.jobs:tabulate_tradeoff"),
        scenes=list(STATIC),
        smooth=list(SMOOTH),
    script:
        "../job.py"


rule measure_other_loads:
    input:
        **JUDGED,
        own=lambda wildcards: [OWN_MODELS[name] for name in TRADEOFF[wildcards.kind]["models"] if name in OWN_MODELS],
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
            lambda wildcards: sorted(
                {module for name in TRADEOFF[wildcards.kind]["models"] for module in MODULES[name]}
            ),
        ),
        models=lambda wildcards: {
            name: (RECIPES[name], pattern) for name, pattern in TRADEOFF[wildcards.kind]["models"].items()
        },
        samples=lambda wildcards: TRADEOFF[wildcards.kind]["samples"],
        split=TRADEOFF["splits"][0],
        grid=TRADEOFF["settings"],
        reference=config["solver"]["reference_tolerance"],
    script:
        "../job.py"


rule tabulate_answers:
    input:
        **{
            name: [JUDGED[name].format(body=STATIC[scene][0], regime=STATIC[scene][1]) for scene in ANSWERED]
            for name in ("body", "database", "samples", "truth")
        },
        table="results/tables/accuracy_vs_time.csv",
        answers=[path for paths in ANSWERED.values() for path in paths],
    output:
        table=in_report("results/tables/answers.csv"),
        warned="results/data/answers_warned.txt",
    log:
        "results/logs/tabulate_answers.log",
    params:
        **calls("palpate.studies.tradeoff.jobs:tabulate_answers"),
        scenes={scene: (STATIC[scene][1], radius(*STATIC[scene]), paths) for scene, paths in ANSWERED.items()},
        split=TRADEOFF["splits"][0],
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
        **calls("palpate.studies.tradeoff.truth_table:limit_points"),
        radius_m=0.012,  # of a fingertip
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
