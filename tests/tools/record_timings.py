"""Write the seconds of src/palpate/run/timings.csv anew, from the logs of a run of config.yaml on a quiet machine.

python tests/tools/record_timings.py results/logs

Run it on the machine of that run, whose speed is recorded, too. A row's seconds are the mean over the jobs of its rule
and wildcard, on bodies of its tetrahedra; memory, which no log has, stays as it is, and so do rows that no job was of.
"""

import sys
from pathlib import Path

import pandas as pd

from palpate.files import read_yaml
from palpate.run.estimate import RECORDED, SPEED_TEST, Job, last_seconds, sizes, speed_test


def seconds_of(logs: Path) -> dict[Path, float]:
    """Return what each job took [s], by its log."""
    found = {}
    for log in logs.rglob("*.log"):
        rule = "fit_springs" if "fit_springs" in log.name else ""  # of those with all cores, core seconds count
        if (took := last_seconds(Job(rule, {}, 1, str(log)))) is not None:
            found[log.relative_to(logs)] = took
    return found


def main(logs: Path) -> None:
    """Assign each log to the row with the longest rule and, of those, a wildcard that its path has; write the means."""
    counts = {"tetrahedra": "Int64", "presses": "Int64"}
    table = pd.read_csv(RECORDED, dtype=counts, keep_default_na=True).fillna({"of": ""})
    bodies = sizes(read_yaml(Path("config.yaml"))["bodies"], logs.parent / "data")
    found: dict[int, list[float]] = {}
    for log, took in seconds_of(logs).items():
        name, size = log.stem, bodies.get(log.parts[0])
        fits = table[[name.startswith(rule) for rule in table["rule"]]]
        fits = fits[[of == "" or f"_{of}" in name or of in log.parts for of in fits["of"]]]
        if fits.empty:
            continue
        best = max(fits.index, key=lambda i: (len(fits.at[i, "rule"]), len(fits.at[i, "of"])))
        wanted = table.at[best, "tetrahedra"]
        if pd.isna(wanted) or wanted == size:
            found.setdefault(best, []).append(took)
    for row, times in found.items():
        table.at[row, "seconds"] = float(f"{sum(times) / len(times):.2g}")
    table.loc[table["rule"] == SPEED_TEST[0], "seconds"] = float(f"{speed_test():.2g}")
    for name in ("seconds", "growth"):
        table[name] = [f"{each:g}" if pd.notna(each) else "" for each in table[name]]
    table.to_csv(RECORDED, index=False)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
