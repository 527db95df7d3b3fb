# The families of models, and the files that they fill.


def modules_of(names):
    """The classes of models, and the modules that prepare them; a user's own model is an input instead."""
    found = [MODELS[name] for name in names if name in MODELS]
    return sorted({f"{type(each).__module__}:{type(each).__name__}" for each in found} | {each.place for each in found})


def grid_of(family):
    """What a family is tried with, and the coarse answers that several share."""
    settings, names = TRADEOFF["settings"], {family, *(family_of(name) for name in FAMILIES[family] if name in MODELS)}
    return {name: settings[name] for name in ["coarse_answers", *sorted(names)] if name in settings}


def splits_of(body, regime):
    """The splits of the contacts of a body that are measured in a regime."""
    return SPLITS if body in IN_DEPTH else SPLITS[:1]


def more_of(wildcards):
    """What models are asked at training contacts too: none where several splits hold out every contact in turn."""
    several = len(splits_of(wildcards.body, wildcards.regime)) > 1
    return {} if several else TRADEOFF["training_contacts_of"]


def family_files(kind, bodies=PRESSED, regimes=REGIMES, splits=None):
    """One file for each body, regime, split and family: its answers (samples), and what they say (settings)."""
    return [
        f"results/data/{body}/{regime}/tradeoff/{split}/{family}_{kind}.csv"
        for body in bodies
        for regime in regimes
        for split in splits or splits_of(body, regime)
        for family in [*FAMILIES, "bounds"]
    ]


def parts_beyond(name):
    """The parts of the table of a block like any_load: of each scene in which it is asked."""
    regimes = getattr(settings.tradeoff, name).regimes or REGIMES
    return [f"results/data/{body}/{regime}/{name}.csv" for body in PRESSED for regime in regimes]


def own_of(models):
    """The files of those of the models that are the user's own."""
    return [OWN_MODELS[model] for model in models if model in OWN_MODELS]


def asked_models(kind):
    """The recipe of each model that a block like any_load asks, and what its settings must have in their names."""
    recipes, asked = {}, TRADEOFF[kind]["models"]
    for family in families(list(asked), OWN_MODELS).values():
        recipes |= family
    return {name: (recipes[name], pattern) for name, pattern in asked.items()}


def answered_scenes():
    """The body and the regime of each scene that engines have answered elsewhere."""
    places = {f"{body}_{regime}": (body, regime) for body in PRESSED for regime in REGIMES}
    return {scene: places[scene] for scene in ANSWERED}


def answered_files():
    """The files of those scenes that answers are judged with."""
    places = answered_scenes().values()
    kinds = {"body": "{0}/body.h5", "database": "{0}/{1}/database.h5"}
    kinds |= {"samples": "{0}/{1}/samples.csv", "truth": "{0}/{1}/truth.h5"}
    return {kind: [f"results/data/{path.format(*place)}" for place in places] for kind, path in kinds.items()}


def estimate_files():
    """One file for each body, regime and split: what errors are estimated from."""
    return [
        f"results/data/{body}/{regime}/tradeoff/{split}/estimates.csv"
        for body in PRESSED
        for regime in REGIMES
        for split in splits_of(body, regime)
    ]


def is_smooth(body):
    """Whether a body has a smooth surface that is known."""
    return settings.bodies[body].kind in ("cylinder", "liver", "kidney", "stomach")


def smooth_scenes():
    """The body and the regime of each scene whose body has one, if what facets change is asked."""
    bodies = filter(is_smooth, PRESSED) if settings.tradeoff.truth.geometry_samples else []
    return [(body, regime) for body in bodies for regime in REGIMES]
