"""Join words to sentences, without a look at a figure: the page of a press needs them, too."""


def spaced(name: str) -> str:
    """Return the name of a scene, a body or an effect without underscores."""
    return name.replace("_", " ")


def listed(parts: list[str]) -> str:
    """Join phrases as a sentence does: "a, b and c"."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def capital(sentence: str) -> str:
    """Begin a sentence with a capital letter."""
    return sentence[:1].upper() + sentence[1:]
