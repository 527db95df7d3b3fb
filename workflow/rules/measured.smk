# Models beside bodies that were measured.


from palpate.bodies.material import kind_of


include: "functions/measured.smk"


EXPERIMENTS = list(settings.measured.experiments)
OF_EXPERIMENT = "results/data/measured/{experiment}"
# tissue that was pressed, and the tables that follow from it
PRESSED_TISSUE = list(settings.measured.presses)
OF_PRESSES = "results/data/measured/presses/{presses}"
ABOUT_PRESSES = ["presses", "press_predictions", "press_curves"]
ABOUT_RELAXATION = [f"relaxation{part}" for part in ("", "_curves", "_errors", "_presses", "_trends")]

# the parts of each table that this run makes: tables of what no entry asks for would be empty
ASKED_OF_PRESSES = [*(ABOUT_PRESSES if asking("elastic") else []), *(ABOUT_RELAXATION if asking("relaxation") else [])]
MEASURED_PARTS = {name: expand(f"{OF_PRESSES}/{name}.csv", presses=PRESSED_TISSUE) for name in ASKED_OF_PRESSES}
if EXPERIMENTS:
    MEASURED_PARTS["measured"] = expand(f"{OF_EXPERIMENT}.csv", experiment=EXPERIMENTS)
MEASURED_SHOWN = (
    (drawn("measured", "measured", scenes=EXPERIMENTS) if EXPERIMENTS else {})
    | (drawn("measured", "presses", scenes=asking("elastic")) if asking("elastic") else {})
    | (drawn("measured", "relaxation", scenes=asking("relaxation")) if asking("relaxation") else {})
)


rule measure_experiment:
    input:
        body=body_of_experiment,
        files=files_of_experiment,
        own=own_laws_of_measured(),
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
        entry=experiment_entry,
        models=models_of_measured(),
    script:
        "../job.py"


rule identify_presses:
    input:
        files=files_of_presses,
        body=body_of_presses,
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
        entry=presses_entry,
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
