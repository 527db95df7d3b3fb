# A page on which a reader presses bodies: models in files of their own, what they are worth, and the page's section.


include: "functions/press.smk"


from palpate.studies.press.settings import pressed_here, radius_of

PRESSED_HERE = pressed_here(config)

TARGETS["press"] = merged("press", expand("results/data/{body}/press/press.csv", body=PRESSED_HERE)) + expand(
    ["results/figures/press_{body}.html", "results/figures/press_{body}.section"], body=PRESSED_HERE
)
WARNED += warned_of(PRESSED_HERE)


rule export_model:
    input:
        body="results/data/{body}/body.h5",
    output:
        model="results/data/{body}/press/contact_modes.palpate",
        coarse="results/data/{body}/press/coarse.bin",
    log:
        "results/logs/{body}/export_model.log",
    params:
        settings={key: config["press"][key] for key in ("contacts", "modes", "thinned")},
        grid={"contact_modes": defaults("tradeoff")["settings"]["contact_modes"]},
        radius_m=lambda wildcards: radius_of(config, wildcards.body),
        seed=config["seed"],
        tolerance=config["solver"]["tolerance"],
        code=code_of("export_model", "palpate.models.contact_modes"),
    message:
        "prepare the model that answers presses in the page: {wildcards.body}"
    script:
        "../scripts/export_model.py"


rule write_press:
    input:
        body="results/data/{body}/body.h5",
        model="results/data/{body}/press/contact_modes.palpate",
        coarse="results/data/{body}/press/coarse.bin",
        truths=lambda wildcards: known_of(wildcards.body, "truth.h5"),
        loads=lambda wildcards: known_of(wildcards.body, "loads.csv"),
        assets=[relpath(path) for path in sorted((ROOT / "src/palpate/report/press/assets").iterdir())],
        runtime=relpath(ROOT / "src/palpate/portable/runtimes/palpate.js"),
    output:
        table="results/data/{body}/press/press.csv",
        section="results/figures/press_{body}.section",
        page="results/figures/press_{body}.html",
    log:
        "results/logs/{body}/write_press.log",
    params:
        contacts=config["press"]["contacts"],
        samples=config["press"]["samples"],
        code=code_of("write_press"),
    message:
        "make the page on which {wildcards.body} is pressed: results/figures/press_{wildcards.body}.html"
    script:
        "../scripts/write_press.py"
