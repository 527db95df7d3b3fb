"""Every number that a caption or a headline of the report names."""

import pandas as pd

from palpate.report.parts import (
    claims_table_numbers,
    collision_numbers,
    ct_numbers,
    dynamic_numbers,
    enrichment_numbers,
    hard_cases_numbers,
    omissions_numbers,
    scaling_numbers,
    scenes_numbers,
    shape_matching_numbers,
    springs_numbers,
    tradeoff_numbers,
)


def numbers(
    all_tables: dict[str, pd.DataFrame], published: dict[str, dict], parts: list[str], scenes: list[str]
) -> dict[str, str]:
    """Placeholder → text, for the ``parts`` of the report that are asked for; needs the tables of those only.

    published : the papers' own numbers, paper.yaml and soft_bodies.yaml, by part
    """
    of = {
        "ct": lambda: ct_numbers.numbers(all_tables),
        "scenes": lambda: scenes_numbers.numbers(all_tables, scenes),
        "soft_bodies": lambda: shape_matching_numbers.numbers(all_tables, published["soft_bodies"]),
        "collision": lambda: collision_numbers.numbers(all_tables, published["collision"]),
        "springs": lambda: springs_numbers.numbers(all_tables, published["springs"]),
        "enrichment": lambda: enrichment_numbers.numbers(all_tables, published["enrichment"]),
        "tradeoff": lambda: tradeoff_numbers.numbers(all_tables),
        "dynamic": lambda: dynamic_numbers.numbers(all_tables),
        "verdicts": lambda: claims_table_numbers.numbers(all_tables, published),
        "hard_cases": lambda: hard_cases_numbers.numbers(all_tables),
        "scaling": lambda: scaling_numbers.numbers(all_tables),
        "omissions": lambda: omissions_numbers.numbers(all_tables),
    }
    return {name: text for part in parts if part in of for name, text in of[part]().items()}
