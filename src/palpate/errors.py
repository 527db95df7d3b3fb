"""How palpate says no."""


class InputError(ValueError):
    """Something the user gave cannot be used; the message names file, field and remedy in one sentence."""


class NotConverged(RuntimeError):
    """A solver did not reach its tolerance.

    ``history`` holds the relative residual after each iteration, oldest first.
    """

    def __init__(self, message: str, history: list[float]):
        super().__init__(message)
        self.history = history


def stranger(names: list[str], known: list[str]) -> str:
    """The first of ``names`` that is not ``known``, and what to write instead; nothing if there is none."""
    for name in names:
        if name not in known:
            return f"{name}, which is unknown; {remedy(name, known, 'choose among')}"
    return ""


def remedy(name: str, known: list[str], otherwise: str) -> str:
    """What to write instead of ``name``: what of ``known`` is like it, or after the words ``otherwise`` all of them."""
    from difflib import get_close_matches

    near = get_close_matches(name, known, n=1)
    return f"did you mean {near[0]}?" if near else f"{otherwise} {', '.join(known)}."
