# The files of samples, and how many a body gets: of paper 1's forces on nodes, or pressed under a finger.


def count(body, regime):
    """How many samples a body gets in a regime."""
    if regime in POINTS:
        return settings.bodies[body].train + settings.bodies[body].test
    return settings.tradeoff.contacts * len(settings.tradeoff.presses)


def split(body, regime):
    """How many samples train and test paper 1's methods; nothing for presses, whose contacts are dealt into folds."""
    return [settings.bodies[body].train, settings.bodies[body].test] if regime in POINTS else []


def order(regime):
    """The order of the elements of fine responses: paper 1 has linear ones."""
    return 1 if regime in POINTS else 2


def radius(body, regime):
    """The radius of the disc that is pressed, 0 for a single node."""
    return 0.0 if regime in POINTS else settings.regimes[regime].radius_on(body)


def loads_entry(body, regime):
    """What the loads of a body follow from."""
    if regime in POINTS:
        return config["enrichment"]["regimes"][regime] | {"magnitudes": settings.bodies[body].magnitudes}
    return config["regimes"][regime] | {key: config["tradeoff"][key] for key in ("contacts", "presses")}


def fine_batches(body, regime):
    jobs = -(-count(body, regime) // settings.solver.samples_per_job)
    return [f"results/data/{body}/{regime}/fine_{batch}.h5" for batch in range(jobs)]


def compliance_of(body, regime):
    """A body's compliance depends on the regime only through the radius of the press."""
    return f"results/data/{body}/compliance_{radius(body, regime)}m.h5"


def points(pattern):
    """One file for each body and regime of paper 1."""
    return expand(f"results/data/{{body}}/{{regime}}/{pattern}", body=BODIES, regime=POINTS)


def presses(pattern):
    """One file for each body and regime of the trade-off."""
    return expand(f"results/data/{{body}}/{{regime}}/{pattern}", body=PRESSED, regime=REGIMES)
