"""Register where each model of touches lives. Names only: a module is imported when its model is measured."""

# module, and what of it the model is: both functions get these as keywords
MODELS: dict[str, tuple[str, dict]] = {
    "fem": ("palpate.models.touch.fem", {}),
}
"""Modules with ``settings(case)`` and ``online(case, setting)``, as ``TouchSolver`` says, by the models' names."""
