"""The numbers that the headline about the papers' claims names."""

import pandas as pd

from palpate.report.paper_claims import CONFIRMED, REFUTED, verdicts


def numbers(all_tables: dict[str, pd.DataFrame], published: dict[str, dict]) -> dict[str, str]:
    """The placeholders of this part, as text."""
    found = verdicts(all_tables, published)
    counts = found["verdict"].value_counts()
    others = ", ".join(f"{n} {verdict}" for verdict, n in counts.items() if verdict not in (CONFIRMED, REFUTED))
    told = f"{counts.get(CONFIRMED, 0)} confirmed, {counts.get(REFUTED, 0)} refuted"
    return {"headline_verdicts": f"Of {len(found)} claims, {told}{', ' if others else ''}{others}."}
