# Lips of a cut that hooks pull apart: what models make of it, and how soon after the blade's move, against a truth.

CUTS = config["cut"]["cuts"]
CUTTING = "results/data/{body}/cut/{scene}"
CUT_SHOWN = drawn("cut", "cut_precision", "cut_opening", scenes=list(CUTS))
CUT_TABLES = {
    table: [f"results/data/{cut.body}/cut/{scene}/{table}.csv" for scene, cut in settings.cut.cuts.items()]
    for table in ("cut_truth", "cut", "cut_opening")
}


rule find_cut_truth:
    input:
        body=BODY,
    output:
        truth=f"{CUTTING}/truth.h5",
        table=f"{CUTTING}/cut_truth.csv",
    log:
        "results/logs/{body}/{scene}/find_cut_truth.log",
    benchmark:
        "results/benchmarks/{body}/{scene}/find_cut_truth.tsv"
    params:
        **calls("palpate.studies.cut.measure:find_cut_truth"),
        entry=lambda wildcards: CUTS[wildcards.scene],
    script:
        "../job.py"


rule measure_cut:
    input:
        body=BODY,
        truth=rules.find_cut_truth.output.truth,
    output:
        cut=f"{CUTTING}/cut.csv",
        opening=f"{CUTTING}/cut_opening.csv",
    log:
        "results/logs/{body}/{scene}/measure_cut.log",
    benchmark:
        "results/benchmarks/{body}/{scene}/measure_cut.tsv"
    threads: HALF
    params:
        **calls("palpate.studies.cut.measure:measure_cut"),
        **some("cut", "budget_s"),
        entry=lambda wildcards: CUTS[wildcards.scene],
        repeats=config["timing"]["repeats"],
    script:
        "../job.py"


rule tabulate_cut:
    input:
        **CUT_TABLES,
    output:
        *map(in_report, tables(*CUT_TABLES)),
        figures(*CUT_SHOWN),
    log:
        "results/logs/tabulate_cut.log",
    localrule: True
    params:
        **calls("palpate.files:merge", draws=CUT_SHOWN),
    script:
        "../job.py"


rule cut:
    input:
        rules.tabulate_cut.output,
        warned_of({cut.body for cut in settings.cut.cuts.values()}),
        page="results/report_cut.html",
