# palpate: for this scene, how wrong is each way of simulating it, and what does a better answer cost in time?
# `make` builds the environment and runs this file; so does `snakemake -c2` inside the environment.


if not workflow.config_settings.configfiles:

    configfile: "config.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/bodies.smk"


# a study without a block in the settings adds no rule
for study in ASKED:

    include: f"workflow/rules/{study}.smk"


include: "workflow/rules/report.smk"


rule all:
    default_target: True
    input:
        "results/report.html",
