"""A judge of the slab's test samples."""

from fixtures.judged_slab import *  # noqa: F403
