# Paper 2's chain for organs: masses from CT, springs fitted to some presses and tested at other contacts.

ORGANS = config["organ_springs"]["bodies"] or CTS
ORGAN_TABLES = ["organ_springs", "organ_history", "mass_motion"]

TARGETS["organ_springs"] = [
    file
    for table in ORGAN_TABLES
    for file in merged(table, expand(f"results/data/{{body}}/{table}.csv", body=ORGANS))
] + figures("organ_springs", "organ_springs")
WARNED += warned_of(ORGANS)


rule fit_organ_springs:
    input:
        body="results/data/{body}/body.h5",
    output:
        [f"results/data/{{body}}/{table}.csv" for table in ORGAN_TABLES],
    log:
        "results/logs/{body}/fit_organ_springs.log",
    # its times are reported
    threads: HALF
    params:
        settings=config["organ_springs"],
        seed=config["seed"],
        code=code_of("fit_organ_springs"),
    message:
        "fit the springs of {wildcards.body}"
    script:
        "../scripts/fit_organ_springs.py"
