"""Settings of the comparison with published values."""

from palpate.setting_types import Block, Whole, key


class Settings(Block):
    """Values that others published beside those that palpate computes."""

    cells: Whole = key("Elements along a side of the coarsest of three meshes, of which each halves the last", 4, ge=4)
