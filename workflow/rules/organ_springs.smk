# Paper 2's chain for organs: masses from CT, springs fitted to some presses and tested at other contacts.

ORGANS = settings.organ_springs.bodies or CTS
ORGAN_TABLES = {
    table: f"results/data/{{body}}/{table}.csv" for table in ("organ_springs", "organ_history", "mass_motion")
}
ORGAN_SPRINGS_SHOWN = drawn("organ_springs", "organ_springs")


rule fit_organ_springs:
    input:
        body=BODY,
    output:
        **ORGAN_TABLES,
    log:
        "results/logs/{body}/fit_organ_springs.log",
    benchmark:
        "results/benchmarks/{body}/fit_organ_springs.tsv"
    # its times are reported
    threads: HALF
    params:
        **calls("palpate.studies.organ_springs.organ_fit:fit_organ_springs"),
        settings=config["organ_springs"],
        seed=config["seed"],
    script:
        "../job.py"


rule tabulate_organ_springs:
    input:
        **{table: expand(file, body=ORGANS) for table, file in ORGAN_TABLES.items()},
    output:
        *map(in_report, tables(*ORGAN_TABLES)),
        figures(*ORGAN_SPRINGS_SHOWN),
    log:
        "results/logs/tabulate_organ_springs.log",
    localrule: True
    params:
        **calls("palpate.files:merge", draws=ORGAN_SPRINGS_SHOWN),
    script:
        "../job.py"


rule organ_springs:
    input:
        rules.tabulate_organ_springs.output,
        warned_of(ORGANS),
        page="results/report_organ_springs.html",
