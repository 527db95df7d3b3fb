# What accuracy costs in time: every model over its settings, on samples whose contacts it never saw.


from palpate.models.model_registry import MODELS, absent, families

# models by family, one job each, and the user's own
OWN_MODELS = {
    name: normpath(CONFIG_FILE.parent / path) for name, path in config["tradeoff"]["own_models"].items()
}
# engines that are not installed are left out, and cost nothing
COMPARED = [*(config["tradeoff"]["models"] or [name for name in MODELS if name not in absent()]), *OWN_MODELS]
FAMILIES = families(COMPARED, OWN_MODELS)
STATIC = [f"{body}_{regime}" for body in PRESSED for regime in REGIMES]
SPLITS = config["tradeoff"]["splits"]
# bodies that get all splits, and fingers of all radii
IN_DEPTH = config["tradeoff"]["in_depth"] or PRESSED
CHECKED = config["tradeoff"]["truth"]["check_samples"]
# loads that models were not prepared for, and presses that they were not made for
ANY_LOAD, BEYOND = config["tradeoff"]["any_load"], config["tradeoff"]["beyond_design"]


include: "functions/tradeoff.smk"


TARGETS["tradeoff"] = (
    tabulated("accuracy_vs_time", "advice", "truth", "error_bounds")
    + figures("tradeoff", "advice", "break_even", "truth", "error_bounds")
    + figures("tradeoff", "work_precision", "best_models", scenes=STATIC)
)
WARNED += warned_of(PRESSED) + presses("loads_warned.txt") + presses("truth_warned.txt")
if config["tradeoff"]["limit_points"]:
    OPTIONAL += ["limit_points"]
    TARGETS["tradeoff"] += figures("tradeoff", "limit_points")
if ANY_LOAD:
    OPTIONAL += ["any_load"]
    TARGETS["tradeoff"] += figures("tradeoff", "any_load")
    merged(
        "any_load", [f"results/data/{body}/{regime}/any_load.csv" for body, regime in asked_scenes(ANY_LOAD)]
    )
if BEYOND:
    OPTIONAL += ["beyond_design"]
    merged(
        "beyond_design",
        [f"results/data/{body}/{regime}/beyond_design.csv" for body, regime in asked_scenes(BEYOND)],
    )
if FINGERS:
    OPTIONAL += ["advice_by_radius"]
    TARGETS["tradeoff"] += figures("tradeoff", "advice_flips")
if len(SPLITS) > 1:
    OPTIONAL += ["advice_agreement"]
TARGETS["tradeoff"] += tabulated(*OPTIONAL)


rule simulate_truth:
    input:
        body="results/data/{body}/body.h5",
        loads="results/data/{body}/{regime}/loads.csv",
        samples="results/data/{body}/{regime}/samples.csv",
    output:
        truth="results/data/{body}/{regime}/truth.h5",
        warned="results/data/{body}/{regime}/truth_warned.txt",
    log:
        "results/logs/{body}/{regime}/simulate_truth.log",
    params:
        radius_m=lambda wildcards: radius(wildcards.body, wildcards.regime),
        splits=lambda wildcards: splits_of(wildcards.body, wildcards.regime),
        more=lambda wildcards: bool(more_of(wildcards)),
        tolerance=config["tradeoff"]["truth"]["tolerance"],
        code=code_of("simulate_truth"),
    message:
        "simulate the truth: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/simulate_truth.py"


rule measure_models:
    input:
        body="results/data/{body}/body.h5",
        database="results/data/{body}/{regime}/database.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        samples="results/data/{body}/{regime}/samples.csv",
        truth="results/data/{body}/{regime}/truth.h5",
        own=lambda wildcards: [OWN_MODELS[wildcards.family]] if wildcards.family in OWN_MODELS else [],
    output:
        samples="results/data/{body}/{regime}/tradeoff/{split}/{family}_samples.csv",
        settings="results/data/{body}/{regime}/tradeoff/{split}/{family}_settings.csv",
    log:
        "results/logs/{body}/{regime}/measure_models_{family}_{split}.log",
    wildcard_constraints:
        family="|".join(FAMILIES),
        split=r"\d",
    threads: HALF
    params:
        models=lambda wildcards: FAMILIES[wildcards.family],
        settings=lambda wildcards: grid_of(wildcards.family),
        regression=config["tradeoff"]["regression"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        radius_m=lambda wildcards: radius(wildcards.body, wildcards.regime),
        repeats=config["timing"]["repeats"],
        budget_s=config["tradeoff"]["budget_s"],
        more_of=lambda wildcards: more_of(wildcards),
        code=lambda wildcards: code_of("measure_models", *modules_of(wildcards.family)),
    message:
        "measure the models of {wildcards.family}: {wildcards.body}, {wildcards.regime}, split {wildcards.split}"
    script:
        "../scripts/measure_models.py"


rule measure_bounds:
    input:
        body="results/data/{body}/body.h5",
        database="results/data/{body}/{regime}/database.h5",
        samples="results/data/{body}/{regime}/samples.csv",
        truth="results/data/{body}/{regime}/truth.h5",
    output:
        samples="results/data/{body}/{regime}/tradeoff/{split}/bounds_samples.csv",
        settings="results/data/{body}/{regime}/tradeoff/{split}/bounds_settings.csv",
    log:
        "results/logs/{body}/{regime}/measure_bounds_{split}.log",
    wildcard_constraints:
        split=r"\d",
    params:
        regression=config["tradeoff"]["regression"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        radius_m=lambda wildcards: radius(wildcards.body, wildcards.regime),
        code=code_of("measure_bounds"),
    message:
        "measure the truth itself, and the answer zero: {wildcards.body}, {wildcards.regime}, split {wildcards.split}"
    script:
        "../scripts/measure_bounds.py"


rule estimate_errors:
    input:
        body="results/data/{body}/body.h5",
        database="results/data/{body}/{regime}/database.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        samples="results/data/{body}/{regime}/samples.csv",
        truth="results/data/{body}/{regime}/truth.h5",
    output:
        "results/data/{body}/{regime}/tradeoff/{split}/estimates.csv",
    log:
        "results/logs/{body}/{regime}/estimate_errors_{split}.log",
    wildcard_constraints:
        split=r"\d",
    params:
        models=config["tradeoff"]["residual_of"],
        more=lambda wildcards: bool(more_of(wildcards)),
        regression=config["tradeoff"]["regression"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        radius_m=lambda wildcards: radius(wildcards.body, wildcards.regime),
        code=code_of("estimate_errors"),
    message:
        "estimate the errors of answers: {wildcards.body}, {wildcards.regime}, split {wildcards.split}"
    script:
        "../scripts/estimate_errors.py"


rule check_truth:
    input:
        body="results/data/{body}/body.h5",
        loads="results/data/{body}/{regime}/loads.csv",
        truth="results/data/{body}/{regime}/truth.h5",
    output:
        "results/data/{body}/{regime}/truth_check.csv",
    log:
        "results/logs/{body}/{regime}/check_truth.log",
    params:
        samples=CHECKED,
        code=code_of("check_truth"),
    message:
        "find the truth of {params.samples} samples with linear elements, too: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/check_truth.py"


rule measure_geometry:
    input:
        body="results/data/{body}/body.h5",
        loads="results/data/{body}/{regime}/loads.csv",
        truth="results/data/{body}/{regime}/truth.h5",
    output:
        "results/data/{body}/{regime}/geometry.csv",
    log:
        "results/logs/{body}/{regime}/measure_geometry.log",
    params:
        samples=config["tradeoff"]["truth"]["geometry_samples"],
        entry=lambda wildcards: config["bodies"][wildcards.body],
        code=code_of("measure_geometry"),
    message:
        "measure what facets change, on {params.samples} samples: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/measure_geometry.py"


rule tabulate_truth:
    input:
        truths=presses("truth.h5"),
        checks=presses("truth_check.csv") if CHECKED else [],
        geometry=[f"results/data/{body}/{regime}/geometry.csv" for body, regime in smooth_scenes()],
    output:
        "results/tables/truth.csv",
    log:
        "results/logs/tabulate_truth.log",
    params:
        scenes=STATIC,
        smooth=[f"{body}_{regime}" for body, regime in smooth_scenes()],
        code=code_of("tabulate_truth"),
    message:
        "tabulate how exactly the truth is known"
    script:
        "../scripts/tabulate_truth.py"


rule tabulate_tradeoff:
    input:
        settings=family_files("settings"),
    output:
        "results/tables/accuracy_vs_time.csv",
    log:
        "results/logs/tabulate_tradeoff.log",
    params:
        code=code_of("tabulate_tradeoff"),
    message:
        "tabulate what accuracy costs in time"
    script:
        "../scripts/tabulate_tradeoff.py"


rule tabulate_error_bounds:
    input:
        table="results/tables/accuracy_vs_time.csv",
        errors=family_files("samples"),
        estimates=estimate_files(),
    output:
        "results/tables/error_bounds.csv",
    log:
        "results/logs/tabulate_error_bounds.log",
    params:
        code=code_of("tabulate_error_bounds"),
    message:
        "tabulate how wrong a single answer may be"
    script:
        "../scripts/tabulate_error_bounds.py"


rule tabulate_advice_agreement:
    input:
        "results/tables/advice.csv",
    output:
        "results/tables/advice_agreement.csv",
    log:
        "results/logs/tabulate_advice_agreement.log",
    params:
        scenes={f"{body}_{regime}": (body, regime) for body in IN_DEPTH for regime in REGIMES},
        code=code_of("tabulate_advice_agreement"),
    message:
        "tabulate in how many splits the advice is the same"
    script:
        "../scripts/tabulate_advice_agreement.py"


rule tabulate_advice_by_radius:
    input:
        settings=finger_files("settings"),
        errors=finger_files("samples"),
    output:
        "results/tables/advice_by_radius.csv",
    log:
        "results/logs/tabulate_advice_by_radius.log",
    params:
        radii={f"{body}_{regime}": (body, radius(body, regime)) for body, regime in finger_scenes()},
        limits=config["tradeoff"]["advice"],
        code=code_of("tabulate_advice_by_radius"),
    message:
        "tabulate the advice for fingers of other radii"
    script:
        "../scripts/tabulate_advice_by_radius.py"


rule measure_any_load:
    input:
        body="results/data/{body}/body.h5",
        database="results/data/{body}/{regime}/database.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        samples="results/data/{body}/{regime}/samples.csv",
        truth="results/data/{body}/{regime}/truth.h5",
        own=[file for name, file in OWN_MODELS.items() if name in (ANY_LOAD or {"models": {}})["models"]],
    output:
        "results/data/{body}/{regime}/any_load.csv",
    log:
        "results/logs/{body}/{regime}/measure_any_load.log",
    threads: HALF
    params:
        models=asked_models(ANY_LOAD),
        samples=lambda wildcards: ANY_LOAD["samples"],
        split=SPLITS[0],
        grid=config["tradeoff"]["settings"],
        regression=config["tradeoff"]["regression"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        reference=config["solver"]["reference_tolerance"],
        radius_m=lambda wildcards: radius(wildcards.body, wildcards.regime),
        repeats=config["timing"]["repeats"],
        budget_s=config["tradeoff"]["budget_s"],
        code=lambda wildcards: code_of("measure_any_load", *asked_modules(ANY_LOAD)),
    message:
        "ask models for loads that they were not prepared for: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/measure_any_load.py"


rule measure_beyond_design:
    input:
        body="results/data/{body}/body.h5",
        database="results/data/{body}/{regime}/database.h5",
        compliance=lambda wildcards: compliance_of(wildcards.body, wildcards.regime),
        samples="results/data/{body}/{regime}/samples.csv",
        truth="results/data/{body}/{regime}/truth.h5",
        own=[file for name, file in OWN_MODELS.items() if name in (BEYOND or {"models": {}})["models"]],
    output:
        "results/data/{body}/{regime}/beyond_design.csv",
    log:
        "results/logs/{body}/{regime}/measure_beyond_design.log",
    threads: HALF
    params:
        models=asked_models(BEYOND),
        samples=lambda wildcards: BEYOND["samples"],
        split=SPLITS[0],
        grid=config["tradeoff"]["settings"],
        regression=config["tradeoff"]["regression"],
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        radius_m=lambda wildcards: radius(wildcards.body, wildcards.regime),
        code=lambda wildcards: code_of("measure_beyond_design", *asked_modules(BEYOND)),
    message:
        "press harder than models were made for: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/measure_beyond_design.py"


rule tabulate_limit_points:
    input:
        body=lambda wildcards: f"results/data/{config['tradeoff']['limit_points']['body']}/body.h5",
    output:
        "results/tables/limit_points.csv",
    log:
        "results/logs/tabulate_limit_points.log",
    params:
        radius_m=lambda wildcards: config["tradeoff"]["limit_points"]["radius_m"],
        contacts=lambda wildcards: config["tradeoff"]["limit_points"]["contacts"],
        code=code_of("tabulate_limit_points"),
    message:
        "press harder and harder, until the material's law gives way"
    script:
        "../scripts/tabulate_limit_points.py"
