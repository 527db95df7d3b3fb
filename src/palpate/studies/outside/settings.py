"""Settings of the comparison with published values."""

from palpate.setting_types import Block


class Settings(Block):
    """Values that others published beside those that palpate computes."""
