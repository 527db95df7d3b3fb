"""Register where each model of touches lives. Names only: a module is imported when its model is measured.

Those of an engine have the names that ``models.model_registry`` gives it, which says whether it is installed.
"""

# module, and what of it the model is: both functions get these as keywords
MODELS: dict[str, tuple[str, dict]] = {
    "fem": ("palpate.models.touch.fem", {}),
    "modes": ("palpate.models.touch.modes", {}),
    "linear": ("palpate.models.touch.linear", {}),
    "xpbd": ("palpate.models.touch.relaxed", {"method": "xpbd"}),
    "vertex_block_descent": ("palpate.models.touch.relaxed", {"method": "vertex_block_descent"}),
    "projective_dynamics": ("palpate.models.touch.relaxed", {"method": "projective_dynamics"}),
    "springs": ("palpate.models.touch.springs", {"volume": False}),
    "springs_volume": ("palpate.models.touch.springs", {"volume": True}),
    "shape_matching": ("palpate.models.touch.shape_matching", {}),
    "mujoco": ("palpate.models.touch.mujoco_flex", {}),
}
"""Modules with ``settings(case)`` and ``online(case, setting)``, as ``TouchSolver`` says, by the models' names."""
