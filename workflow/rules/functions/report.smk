# What a page about some studies is made of, and what its writer is told.


def shown(*studies):
    """The tables, figures and warnings that the page about some studies is made of: what each study asks for."""
    asked = [getattr(rules, study).input for study in studies]
    return [file for files in asked for file in files if file != files.page]


def told(*studies):
    """What the writer of a page about some studies is told."""
    return {
        "studies": list(studies),
        "scenes": SCENES if "scenes" in studies else [],
        "cts": CTS if "ct" in studies else [],
        "driven": DRIVEN if "scenes" in studies else [],
    }
