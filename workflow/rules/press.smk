# A page on which a reader presses bodies: models in files of their own, what they are worth, and the page's section.

PRESSED_HERE = pressed_bodies(settings, "press")
# regimes in which the trade-off presses a body by the same finger, and knows the truth
KNOWN = {
    body: [regime for regime in REGIMES if radius(body, regime) == settings.press.radius_on(body)]
    for body in set(PRESSED_HERE) & set(PRESSED)
}
EXPORTED = "results/data/{body}/press"


rule export_model:
    input:
        body=BODY,
    output:
        model=f"{EXPORTED}/contact_modes.palpate",
    log:
        "results/logs/{body}/export_model.log",
    benchmark:
        "results/benchmarks/{body}/export_model.tsv"
    params:
        **calls("palpate.studies.press.measure:export_model", "palpate.models.contact_modes.contact_modes"),
        settings=some("press", "contacts", "modes", "thinned", "instruments", "places"),
        radius_m=lambda wildcards: settings.press.radius_on(wildcards.body),
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
    script:
        "../job.py"


rule write_press:
    input:
        body=BODY,
        model=f"{EXPORTED}/contact_modes.palpate",
        truths=lambda wildcards: expand(f"{PRESS}/truth.h5", body=wildcards.body, regime=KNOWN.get(wildcards.body, [])),
        loads=lambda wildcards: expand(f"{PRESS}/loads.csv", body=wildcards.body, regime=KNOWN.get(wildcards.body, [])),
        assets=[
            relpath(path)
            for path in (
                *sorted((ROOT / "src/palpate/press/page/assets").iterdir()),
                ROOT / "src/palpate/report/assets/program.js",
            )
        ],
        runtime=relpath(ROOT / "src/palpate/press/portable/runtimes/palpate.js"),
    output:
        table=f"{EXPORTED}/press.csv",
        section="results/figures/press_{body}.section",
        page="results/figures/press_{body}.html",
    log:
        "results/logs/{body}/write_press.log",
    benchmark:
        "results/benchmarks/{body}/write_press.tsv"
    params:
        **some("press", "contacts", "samples"),
        **calls("palpate.studies.press.measure:write_press"),
        radius_m=lambda wildcards: settings.press.radius_on(wildcards.body),
    script:
        "../job.py"


rule tabulate_press:
    input:
        press=expand(rules.write_press.output.table, body=PRESSED_HERE),
    output:
        in_report("results/tables/press.csv"),
    log:
        "results/logs/tabulate_press.log",
    localrule: True
    params:
        **calls("palpate.files:merge"),
    script:
        "../job.py"


rule press:
    input:
        rules.tabulate_press.output,
        expand([rules.write_press.output.page, rules.write_press.output.section], body=PRESSED_HERE),
        warned_of(PRESSED_HERE),
        page="results/report_press.html",
