# Paper 2's chain for organs: masses from CT, springs fitted to some presses and tested at other contacts.

ORGANS = config["organ_springs"]["bodies"] or CTS
ORGAN_TABLES = {
    table: f"results/data/{{body}}/{table}.csv" for table in ("organ_springs", "organ_history", "mass_motion")
}

TARGETS["organ_springs"] = merged(
    "organ_springs", **{table: expand(file, body=ORGANS) for table, file in ORGAN_TABLES.items()}
) + figures("organ_springs", "organ_springs")
WARNED["organ_springs"] += warned_of(ORGANS)


rule fit_organ_springs:
    input:
        body=BODY,
    output:
        **ORGAN_TABLES,
    log:
        "results/logs/{body}/fit_organ_springs.log",
    # its times are reported
    threads: HALF
    params:
        **calls("palpate.studies.organ_springs.organ_fit:fit_organ_springs"),
        settings=config["organ_springs"],
        seed=config["seed"],
    script:
        "../job.py"
