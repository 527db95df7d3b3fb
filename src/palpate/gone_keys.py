"""Keys of settings that are gone, and what to write instead; the next release drops this."""

from fnmatch import fnmatchcase

GONE = {
    "scenes.*.effects": (
        "a scene's effects are its blocks; remove the list and the blocks that it does not name, write {} for what "
        "it names without a block, as rayleigh: {}, and held: false if it does not name held (auto also chose damping, "
        "which is rayleigh, of springs kelvin and of shape_matching velocity_damping; bending of sheets, body_springs "
        "of surfaces, and volume of springs with a Poisson's ratio above 1/4)"
    ),
    "cut.truth": "edges are as long as half of the cut's width, and half of that at its front; remove it",
    "dynamic.training_share": "it is one half; remove it, or describe a training of the scene",
    "dynamic.budgets_ms": "they are 1, 8 and 16.7 ms, and palpate advise takes any other; remove it",
    "dynamic.speeds": "they are 1 and 20, and palpate advise takes any other; remove it",
    "dynamic.scenes.*.truth.part": "it is 0.05; remove it",
    "measured.models.releases.creep.step_s": "it is 0.01 s; remove it",
    "organ_springs.radius_m": "it is 0.02 m; remove it",
    "organ_springs.peak_of_size": "it is 0.05; remove it",
    "organ_springs.damping_ratio": "it is 0.1; remove it",
    "outside.cells": "there are 4; remove it",
    "tradeoff.finger_radii_m": "a finger of another radius is a regime of its own; remove it",
    "tradeoff.own_models": "write it at the top level, own_models, as touches and motions are asked of it, too",
    "tradeoff.limit_points.radius_m": "it is 0.012 m; remove it",
    "tradeoff.settings.fem_local": "palpate knows what to try; remove it",
    "tradeoff.settings.detail_correction": "a quarter, half and all of the samples are tried; remove it",
    "tradeoff.settings.linear_residual": "a quarter, half and all of the samples are tried; remove it",
    "tradeoff.settings.ridge": "a quarter, half and all of the samples are tried; remove it",
    "tradeoff.settings.warped_compliance": "none, half and all of the samples are tried; remove it",
    "tradeoff.settings.mass_spring.iterations": "seven numbers are tried; remove it",
    "palpation.ball_radius_m": "it is 0.01 m; remove it",
    "palpation.pressure_of_young": "it is 0.1; remove it",
    "tradeoff.residual_of": "it is done of fem_p1 and fem_p2; remove it",
    "*.settings.mujoco*": "engines answer the questions of palpate ask (docs/engines.md); remove it",
    "*.settings.newton_vbd": "engines answer the questions of palpate ask (docs/engines.md); remove it",
    "tradeoff.settings.cascade": "models are asked by themselves, and have bounds of their own; remove it",
    "tradeoff.settings.fast_fem.frame_iterations": "there are 2 and 4; remove it",
    "tradeoff.settings.fem.*warm_iterations": "there is one; remove it",
    "tradeoff.settings.mass_spring.middle_samples": "there are 20; remove it",
    "tradeoff.settings.shape_matching": "palpate knows what to try; remove it",
}
"""By the place of a key, with * for a name: why it is gone, and what to write instead."""


def gone(place: str) -> str:
    """Return what to write instead of the key at a place such as scenes.mine.effects; empty if it never was one."""
    return next((instead for pattern, instead in GONE.items() if fnmatchcase(place, pattern)), "")
