# Models beside bodies that were measured.


from palpate.bodies.material import kind_of

# entries with files as they can be opened from here: what was measured, laws of the models beside it, and what was pressed
EXPERIMENTS = {
    name: entry
    | {"cases": {key: case | {"files": [here(file) for file in case["files"]]} for key, case in entry["cases"].items()}}
    for name, entry in config["measured"]["experiments"].items()
}
LAWS = [law if kind_of(law) else here(law) for law in settings.measured.models.fem_p2.laws]
PRESSED_TISSUE = {
    name: entry | {"files": [here(file) for file in entry["files"]]}
    for name, entry in config["measured"]["presses"].items()
}
# presses of which elastic moduli are found, and those of which relaxation is
ELASTIC, RELAXING = (
    [name for name, entry in PRESSED_TISSUE.items() if what in entry["ask"]] for what in ("elastic", "relaxation")
)
OF_EXPERIMENT = "results/data/measured/{experiment}"
OF_PRESSES = "results/data/measured/presses/{presses}"
ABOUT_PRESSES = ["presses", "press_predictions", "press_curves"]
ABOUT_RELAXATION = [f"relaxation{part}" for part in ("", "_curves", "_errors", "_presses", "_trends")]

# the parts of each table that this run makes: tables of what no entry asks for would be empty
ASKED_OF_PRESSES = [*(ABOUT_PRESSES if ELASTIC else []), *(ABOUT_RELAXATION if RELAXING else [])]
MEASURED_PARTS = {name: expand(f"{OF_PRESSES}/{name}.csv", presses=PRESSED_TISSUE) for name in ASKED_OF_PRESSES}
if EXPERIMENTS:
    MEASURED_PARTS["measured"] = expand(f"{OF_EXPERIMENT}.csv", experiment=EXPERIMENTS)
MEASURED_SHOWN = (
    (drawn("measured", "measured", scenes=EXPERIMENTS) if EXPERIMENTS else {})
    | (drawn("measured", "presses", scenes=ELASTIC) if ELASTIC else {})
    | (drawn("measured", "relaxation", scenes=RELAXING) if RELAXING else {})
)


rule measure_experiment:
    input:
        body=lambda wildcards: BODY.format(body=EXPERIMENTS[wildcards.experiment]["body"]),
        files=lambda wildcards: [
            file for case in EXPERIMENTS[wildcards.experiment]["cases"].values() for file in case["files"]
        ],
        own=[law for law in LAWS if not kind_of(law)],
    output:
        table=f"{OF_EXPERIMENT}.csv",
        warned=f"{OF_EXPERIMENT}_warned.txt",
    log:
        "results/logs/measured/{experiment}.log",
    wildcard_constraints:
        experiment="|".join(EXPERIMENTS) or "nothing",
    # laws are imported by name, so every effect's code counts
    params:
        **calls("palpate.studies.measured.measure:measure_experiment", "palpate.effects"),
        entry=lambda wildcards: EXPERIMENTS[wildcards.experiment],
        models=config["measured"]["models"] | {"fem_p2": config["measured"]["models"]["fem_p2"] | {"laws": LAWS}},
    script:
        "../job.py"


rule identify_presses:
    input:
        files=lambda wildcards: PRESSED_TISSUE[wildcards.presses]["files"],
        body=lambda wildcards: [
            BODY.format(body=body) for body in [PRESSED_TISSUE[wildcards.presses].get("body")] if body
        ],
    output:
        **{name: f"{OF_PRESSES}/{name}.csv" for name in ABOUT_PRESSES + ABOUT_RELAXATION},
        warned=f"{OF_PRESSES}/warned.txt",
    log:
        "results/logs/measured/presses/{presses}.log",
    wildcard_constraints:
        presses="|".join(PRESSED_TISSUE) or "nothing",
    # curves of a law that stiffens are computed on all cores
    threads: lambda wildcards: HALF if settings.measured.presses[wildcards.presses].laws == ["neo_hookean"] else workflow.cores
    params:
        **calls("palpate.studies.measured.pressed:identify_presses", "palpate.effects"),
        entry=lambda wildcards: PRESSED_TISSUE[wildcards.presses],
        seed=config["seed"],
    script:
        "../job.py"


rule tabulate_measured:
    input:
        **MEASURED_PARTS,
    output:
        *map(in_report, tables(*MEASURED_PARTS)),
        figures(*MEASURED_SHOWN),
    log:
        "results/logs/tabulate_measured.log",
    localrule: True
    params:
        **calls("palpate.files:merge", draws=MEASURED_SHOWN),
    script:
        "../job.py"


rule measured:
    input:
        rules.tabulate_measured.output,
        warned_of(dict.fromkeys(entry.body for entry in settings.measured.experiments.values())),
        expand(f"{OF_EXPERIMENT}_warned.txt", experiment=EXPERIMENTS),
        expand(f"{OF_PRESSES}/warned.txt", presses=PRESSED_TISSUE),
        page="results/report_measured.html",
