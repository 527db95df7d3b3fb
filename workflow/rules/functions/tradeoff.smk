# The families of models, and the files that they fill.


def modules_of(family):
    """The modules of palpate that the models of a family live in; a user's own model is an input instead."""
    places = {recipe["place"] for recipe in FAMILIES[family].values()}
    return sorted(place for place in places if not place.endswith(".py"))


def family_files(kind):
    """One file for each body, regime and family: what its models answered (samples), and what that says (settings)."""
    return [path for family in [*FAMILIES, "reference"] for path in each(f"tradeoff/{family}_{kind}.csv")]
