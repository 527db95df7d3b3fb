# palpate: for this scene, how wrong is each way of simulating it, and what does a better answer cost in time?
# `make` builds the environment and runs this file; so does `snakemake -c2` inside the environment.

if not workflow.overwrite_configfiles:

    configfile: "config.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/bodies.smk"
include: "workflow/rules/simulation.smk"
include: "workflow/rules/database.smk"
include: "workflow/rules/enrichment.smk"
include: "workflow/rules/evaluation.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/report.smk"


# one target a paper, and the report of those that the config names
rule all:
    default_target: True
    input:
        "results/report.html",


rule enrichment:
    input:
        PAPERS["enrichment"],


onstart:
    hold_folder()


onerror:
    print(failures(), file=sys.stderr)
