# What a page about some studies is made of, and what its writer is told.


def shown(*studies):
    """The tables, figures and warnings that the page about some studies is made of: what each study asks for."""
    asked = [getattr(rules, study).input for study in studies]
    return [file for files in asked for file in files if file != files.page]


def reported(wildcards):
    """The studies that a page is about."""
    return [wildcards.of.removeprefix("_")] if wildcards.of else RUN


def told(wildcards):
    """What the writer of a page is told."""
    studies = reported(wildcards)
    alone = {"alone": True} if wildcards.of else {"left_out": [study for study in ASKED if study not in RUN]}
    return alone | {
        "studies": studies,
        "scenes": SCENES if "scenes" in studies else [],
        "cts": CTS if "ct" in studies else [],
        "driven": DRIVEN if "scenes" in studies else [],
    }


def numbered(wildcards):
    """The modules that compute numbers for the templates of a page."""
    places = {study: ROOT / f"src/palpate/studies/{study}/report.py" for study in reported(wildcards)}
    return [f"palpate.studies.{study}.report" for study, place in places.items() if place.is_file()]
