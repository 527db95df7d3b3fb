"""Settings of the hard cases."""

from typing import Literal

from palpate.setting_types import Block, Some, Switch, key


class Settings(Block):
    """Situations in which numerics may fail, each tried with every model that it applies to."""

    families: Some[Literal["enrichment", "fem", "dynamics", "contact", "organ", "cuts"]] = key(
        "Which of them", ["enrichment", "fem", "dynamics", "contact", "organ", "cuts"]
    )
    long: Switch = key("Whether cases that take long are tried, too", True)
