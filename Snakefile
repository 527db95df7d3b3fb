# palpate: for this scene, how wrong is each way of simulating it, and what does a better answer cost in time?
# `make` builds the environment and runs this file; so does `snakemake -c2` inside the environment.

if not workflow.overwrite_configfiles:

    configfile: "config.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/asked.smk"
include: "workflow/rules/bodies.smk"
include: "workflow/rules/tables.smk"


# what nobody asks for adds no rule
if "enrichment" in config["papers"] or TRADEOFF:

    include: "workflow/rules/simulation.smk"
    include: "workflow/rules/database.smk"


if "enrichment" in config["papers"]:

    include: "workflow/rules/enrichment.smk"
    include: "workflow/rules/evaluation.smk"
    include: "workflow/rules/figures.smk"


if TRADEOFF:

    include: "workflow/rules/tradeoff.smk"
    include: "workflow/rules/advice.smk"


if DYNAMIC:

    include: "workflow/rules/dynamic.smk"


if SCALING:

    include: "workflow/rules/scaling.smk"


if HARD_CASES:

    include: "workflow/rules/hard_cases.smk"


if "soft_bodies" in config["papers"]:

    include: "workflow/rules/soft_bodies.smk"


if "springs" in config["papers"]:

    include: "workflow/rules/springs.smk"


if "collision" in config["papers"]:

    include: "workflow/rules/collision.smk"


if CTS:

    include: "workflow/rules/ct.smk"


if SCENES:

    include: "workflow/rules/scenes.smk"


if TOUCHING:

    include: "workflow/rules/contact.smk"


include: "workflow/rules/example.smk"
include: "workflow/rules/report.smk"


# one target a paper, one for the scenes, and the report of what the config names
rule all:
    default_target: True
    input:
        "results/report.html",


for paper in config["papers"]:

    rule:
        name:
            paper
        input:
            PAPERS[paper],


rule tradeoff:
    input:
        TRADEOFF,


rule dynamic:
    input:
        DYNAMIC,


rule scaling:
    input:
        SCALING,


rule hard_cases:
    input:
        HARD_CASES,


rule scenes:
    input:
        MOTIONS,


rule cts:
    input:
        CT_RESULTS,


onstart:
    hold_folder()
    stay_idle()


onerror:
    print(failures(), file=sys.stderr)
