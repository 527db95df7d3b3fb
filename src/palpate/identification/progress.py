"""How the progress of a long computation is reported to whoever waits for it."""

from collections.abc import Callable, Iterable, Sequence

Follow = Callable[[str, Sequence], Iterable]
"""A function of what is done, in words, and a sequence: it returns the sequence, and reports how far it has come."""


def unfollowed(what: str, sequence: Sequence) -> Iterable:
    """Return ``sequence`` and report nothing."""
    return sequence
