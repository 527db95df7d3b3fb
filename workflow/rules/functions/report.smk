# What a page about some studies is made of.


def page_of(*studies, tables=()):
    """The files that a page about some studies shows, and what its writer is told; ``tables``: those that no study makes."""
    files = {
        "shown": [file for study in studies for file in TARGETS[study]] + tabulated(*tables),
        "templates": templates(*studies),
        "warned": sorted({file for study in studies for file in WARNED[study]}),
        "assets": [relpath(path) for path in sorted((ROOT / "src/palpate/report/assets").iterdir())],
    }
    told = {
        "studies": list(studies),
        "scenes": SCENES if "scenes" in studies else [],
        "cts": CTS if "ct" in studies else [],
        "driven": DRIVEN if "scenes" in studies else [],
        "left_out": [],
        "alone": True,
        "more": [table for study in studies for table in OPTIONAL[study]] + list(tables),
    }
    return files, told
