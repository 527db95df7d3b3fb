"""How a long computation spreads its parts over threads, and reports to whoever waits for it."""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple, TypeVar

Part = TypeVar("Part")
Found = TypeVar("Found")


class Progress(NamedTuple):
    """What follows a computation.

    follow : from what is done, in words, and a sequence to that sequence; it reports how far that has come
    spread_out : ``map``, or that of a pool of threads
    """

    follow: Callable[[str, Sequence], Iterable] = lambda what, sequence: sequence
    spread_out: Callable[..., Iterable] = map

    def each(self, what: str, function: Callable[[Part], Found], parts: Sequence[Part]) -> list[Found]:
        """Return the values of ``function`` of all parts, in their order."""
        return [value for _, value in zip(self.follow(what, parts), self.spread_out(function, parts), strict=True)]


UNFOLLOWED = Progress()
