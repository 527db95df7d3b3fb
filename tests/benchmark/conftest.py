"""A small database of known deformations."""

from fixtures.judged_slab import *  # noqa: F403
from fixtures.known_deformations import *  # noqa: F403
