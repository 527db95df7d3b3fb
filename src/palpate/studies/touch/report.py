"""The part of the report on touches."""

TITLE = "What a hand feels"


def numbers(report):
    """Return what the template names."""
    return {}
