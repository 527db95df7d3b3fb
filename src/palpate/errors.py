"""The two ways in which palpate says no."""


class InputError(ValueError):
    """Something the user gave cannot be used; the message names file, field and remedy in one sentence."""


class NotConverged(RuntimeError):
    """A solver did not reach its tolerance.

    ``history`` holds the relative residual after each iteration, oldest first.
    """

    def __init__(self, message: str, history: list[float]):
        super().__init__(message)
        self.history = history
