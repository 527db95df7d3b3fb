# What the choice of the law changes, beside what the mesh does: the same presses under each law.


from palpate.bodies.material import kind_of
from palpate.studies.law.settings import changes_of, compared_bodies

COMPARED_BODIES = compared_bodies(settings)
# of palpate's own by name, of the user's by file
COMPARED_LAWS = {name: name if kind_of(name) else here(name) for name in settings.law.laws}
LAW_SHOWN = drawn("law", "law")


rule compare_laws:
    input:
        body=BODY,
        own=[path for name, path in COMPARED_LAWS.items() if not kind_of(name)],
    output:
        table="results/data/{body}/law.csv",
        warned="results/data/{body}/law_warned.txt",
    log:
        "results/logs/{body}/compare_laws.log",
    benchmark:
        "results/benchmarks/{body}/compare_laws.tsv"
    params:
        **calls("palpate.studies.law.compare_laws:press_under_laws", "palpate.effects.laws"),
        laws=lambda wildcards: [COMPARED_LAWS[name] for name in changes_of(settings, wildcards.body).laws],
        poissons=lambda wildcards: changes_of(settings, wildcards.body).poissons,
        contacts=lambda wildcards: changes_of(settings, wildcards.body).contacts,
        depths=config["law"]["depths"],
        radius_m=lambda wildcards: settings.law.radius_on(wildcards.body),
    script:
        "../job.py"


rule tabulate_law:
    input:
        law=expand(rules.compare_laws.output.table, body=COMPARED_BODIES),
    output:
        in_report("results/tables/law.csv"),
        figures(*LAW_SHOWN),
    log:
        "results/logs/tabulate_law.log",
    localrule: True
    params:
        **calls("palpate.files:merge", draws=LAW_SHOWN),
    script:
        "../job.py"


rule law:
    input:
        rules.tabulate_law.output,
        warned_of(COMPARED_BODIES),
        expand(rules.compare_laws.output.warned, body=COMPARED_BODIES),
        page="results/report_law.html",
