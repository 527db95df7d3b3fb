"""The judged slab."""

from fixtures.judged_slab import *  # noqa: F403
