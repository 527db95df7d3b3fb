"""The numbers that the headline about failures names."""

import pandas as pd

from palpate.report.failures import failures


def numbers(all_tables: dict[str, pd.DataFrame]) -> dict[str, str]:
    """The placeholders of this part, as text."""
    counts = failures(all_tables)["comparison"].value_counts(sort=False)
    told = "; ".join(f"{name}: {count}" for name, count in counts.items())
    return {"headline_omissions": f"What failed is listed and not dropped ({told or 'nothing did'})."}
