# palpate: for this scene, how wrong is each way of simulating it, and what does a better answer cost in time?
# `make` builds the environment and runs this file; so does `snakemake -c2` inside the environment.


include: "workflow/rules/common.smk"
include: "workflow/rules/bodies.smk"
include: "workflow/rules/samples.smk"


# a study without a block in the settings adds no rule
for study in ASKED:

    include: f"workflow/rules/{study}.smk"


include: "workflow/rules/tables.smk"
include: "workflow/rules/example.smk"
include: "workflow/rules/report.smk"


rule all:
    default_target: True
    input:
        "results/report.html",


# what make tidy keeps
rule everything:
    input:
        "results/report.html",
        [TARGETS[study] for study in ASKED],
        expand("results/report_{study}.html", study=ASKED),


# a study by itself has a page of its own
for study in ASKED:

    rule:
        name:
            study
        input:
            TARGETS[study],
            f"results/report_{study}.html",


offer(ASKED, STUDIES, files_to_ask_for())


logger.addFilter(announce_once)


onstart:
    hold_folder()
    interrupt.listen(has_jobs=workflow.local_exec)
    interrupt.tidy_up()
    # or snakemake looks for jobs to start once a second for each that has ever ended; no option turns that off
    workflow.scheduler.job_rate_limiter = None
    if workflow.local_exec:
        start_job_server(PYTHON, JOBS["PALPATE_JOBS"], JOBS)
    announce()


onsuccess:
    conclude()


onerror:
    conclude()
