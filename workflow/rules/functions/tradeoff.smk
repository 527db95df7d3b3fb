# The families of models, and the files that they fill.


def modules_of(family):
    """The modules of palpate that the models of a family live in; a user's own model is an input instead."""
    places = {recipe["place"] for recipe in FAMILIES[family].values()}
    return sorted(place for place in places if not place.endswith(".py"))


def grid_of(family):
    """What a family is tried with, and the coarse answers that several share."""
    settings = config["tradeoff"]["settings"]
    return {"coarse_answers": settings["coarse_answers"], family: settings.get(family, {})}


def family_files(kind, regimes=REGIMES, splits=SPLITS):
    """One file for each body, regime, split and family: its answers (samples), and what they say (settings)."""
    return expand(
        "results/data/{body}/{regime}/tradeoff/{split}/{family}_{kind}.csv",
        body=PRESSED,
        regime=regimes,
        split=splits,
        family=[*FAMILIES, "bounds"],
        kind=kind,
    )
