"""The block under a ball."""

from fixtures.touched_block import *  # noqa: F403
