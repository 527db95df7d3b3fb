"""How whoever waits for a fit is told how far it has come."""

from collections.abc import Callable, Iterable, Sequence

Follow = Callable[[str, Sequence], Iterable]
"""From what is done, in words, and a sequence: the same sequence, of which it tells how far it has come."""


def unfollowed(what: str, sequence: Sequence) -> Iterable:
    """Tell nothing."""
    return sequence
