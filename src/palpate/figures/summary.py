"""Every number that a caption or a headline of the report names."""

import pandas as pd

from palpate.figures import (
    summary_collision,
    summary_ct,
    summary_dynamic,
    summary_enrichment,
    summary_hard_cases,
    summary_omissions,
    summary_scaling,
    summary_scenes,
    summary_soft_bodies,
    summary_springs,
    summary_tradeoff,
    summary_verdicts,
)


def numbers(
    all_tables: dict[str, pd.DataFrame], published: dict[str, dict], parts: list[str], scenes: list[str]
) -> dict[str, str]:
    """Placeholder → text, for the ``parts`` of the report that are asked for; needs the tables of those only.

    published : the papers' own numbers, paper.yaml and soft_bodies.yaml, by part
    """
    of = {
        "ct": lambda: summary_ct.numbers(all_tables),
        "scenes": lambda: summary_scenes.numbers(all_tables, scenes),
        "soft_bodies": lambda: summary_soft_bodies.numbers(all_tables, published["soft_bodies"]),
        "collision": lambda: summary_collision.numbers(all_tables, published["collision"]),
        "springs": lambda: summary_springs.numbers(all_tables, published["springs"]),
        "enrichment": lambda: summary_enrichment.numbers(all_tables, published["enrichment"]),
        "tradeoff": lambda: summary_tradeoff.numbers(all_tables),
        "dynamic": lambda: summary_dynamic.numbers(all_tables),
        "verdicts": lambda: summary_verdicts.numbers(all_tables, published),
        "hard_cases": lambda: summary_hard_cases.numbers(all_tables),
        "scaling": lambda: summary_scaling.numbers(all_tables),
        "omissions": lambda: summary_omissions.numbers(all_tables),
    }
    return {name: text for part in parts if part in of for name, text in of[part]().items()}
