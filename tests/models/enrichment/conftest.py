"""A small database of known deformations."""

from fixtures.known_deformations import *  # noqa: F403
