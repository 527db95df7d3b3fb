# What the page on which bodies are pressed is made of.


def known_of(body, file):
    """A file of each regime in which the trade-off presses a body by the same finger, and knows the truth."""
    same = [regime for regime in REGIMES if radius(body, regime) == settings.press.radius_on(body)]
    return expand("results/data/{body}/{regime}/{file}", body=body, regime=same if body in PRESSED else [], file=file)
