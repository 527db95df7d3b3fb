"""Result folders that stand in for those of a finished run."""

from fixtures.results import *  # noqa: F403
from fixtures.studies import *  # noqa: F403
from fixtures.trade_off import *  # noqa: F403
