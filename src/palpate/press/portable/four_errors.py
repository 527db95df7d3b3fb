"""Sentences that join the errors of contact modes: what each is measured against, and what to trust it for."""

FOUR_ERRORS = (
    "Four errors are said of contact modes, each an RMSE over the peak.",
    "Advice has that at prepared contacts, against the truth: trust it to choose a model.",
    "press.csv has that of the file wherever a truth was simulated, against that truth: trust it for what the page "
    "shows.",
    "The file has that between its contacts, up to the hardest press, against contact modes prepared there, which have "
    "the first error themselves: trust it to choose how many contacts to prepare.",
    "An answer has a bound of its own error, which nine in ten keep: trust it for that answer.",
)
"""They stand wherever more than one of these errors is said."""
