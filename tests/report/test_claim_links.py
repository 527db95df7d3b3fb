"""A claim's rows are those whose change changes it, and no others; README's numbers name their rows."""

import numpy as np
import pandas as pd
import pytest

from palpate.report.claim_links import AS_WRITTEN, Link, gather_links, links, selected
from palpate.report.claims import Claim, not_testable, verdict
from palpate.report.declared import CLAIM_LINKS

TIMES = pd.DataFrame(
    {
        "body": np.repeat(["liver", "cylinder", "slab"], 4),
        "method": ["fast", "slow", "fast", "slow"] * 3,
        "run": [1, 1, 2, 2] * 3,
        "seconds": [1.01, 2.03, 1.13, 2.31, 3.17, 1.97, 3.37, 1.53, 0.71, 0.47, 0.53, 0.61],
    }
)
OUTCOMES = pd.DataFrame({"case": ["flat", "flat", "deep"], "outcome": ["stable", "wrong", "stable"]})


def judge(tables):
    """Two claims on one body each, one on a ratio over all, one on texts, one on no number, and one that stops."""
    times = tables["times"]
    for body, rows in times[times["body"] != "slab"].groupby("body", sort=False):
        mean = rows.groupby("method")["seconds"].mean()
        ours = f"{mean['fast']:.2g} against {mean['slow']:.2g} s"
        yield Claim(1, "4", f"fast is faster ({body})", "", "", ours, verdict(mean["fast"] < mean["slow"]))
    first = times[times["run"] == 1]
    share = first["seconds"].iloc[0] / first["seconds"].sum()
    yield Claim(1, "5", "the first takes a share", "", "", f"{share:.2f}", verdict(share > 0))
    flat = tables["outcomes"].query("case == 'flat'")
    stable = (flat["outcome"] == "stable").sum()
    yield Claim(1, "6", "flat cases are stable", "", "", f"{stable} of {len(flat)}", verdict(stable == len(flat)))
    yield Claim(1, "7", "it is improved", "", "", "", not_testable("it does not say how"))


@pytest.fixture(scope="module")
def found():
    return dict(links(judge, {"times": TIMES, "outcomes": OUTCOMES}))


def test_claims_are_those_that_are_judged(found):
    assert list(found) == list(judge({"times": TIMES, "outcomes": OUTCOMES}))


def test_each_claim_is_linked_to_its_rows(found):
    assert list(found.values()) == [
        [Link("times", "body in ['liver']", 4)],
        [Link("times", "body in ['cylinder']", 4)],
        [Link("times", "run in [1]", 6)],
        [Link("outcomes", "case in ['flat']", 2)],
        [],
    ]


def test_rows_that_are_not_linked_may_have_any_numbers_and_those_that_are_may_not(found):
    """Row by row, by brute force."""
    for claim, rows in found.items():
        for link in (link for link in rows if link.table == "times"):
            linked = selected(TIMES, link.where)
            for row in range(len(TIMES)):
                other = TIMES.assign(seconds=TIMES["seconds"].where(np.arange(len(TIMES)) != row, 9.9))
                same = claim in set(judge({"times": other, "outcomes": OUTCOMES}))
                assert same != linked[row]


def test_the_links_of_real_claims_suffice(spring_results):
    """What is left out of the links may be multiplied by three, and the claim stands as it is."""
    from palpate.studies.springs.claims import presses

    names = ("spring_errors", "spring_fit")
    tables = {name: spring_results[name] for name in names}
    for claim, rows in links(presses, tables):
        changed = {}
        for name, table in tables.items():
            kept = np.zeros(len(table), dtype=bool)
            for link in rows:
                kept |= selected(table, link.where) if link.table == name else False
            real = [column for column in table if table[column].dtype == float and table[column].nunique() > 8]
            changed[name] = table.assign(**{c: table[c].where(kept, 3.0 * table[c]) for c in real})
        assert claim in set(presses(changed))


def test_readme_is_linked_where_the_run_has_its_rows(monkeypatch):
    monkeypatch.setattr("palpate.report.claim_links.judge_of", lambda place: judge)
    entries = [
        {"says": "in 1.0 s", "table": "times", "of": "seconds", "take": ["min"], "where": "body == 'liver'"},
        {"says": "2.2 to 2.3 s", "table": "times", "of": "seconds", "take": ["min", "max"], "where": "body == 'liver'"},
        {"says": "in 5 s", "table": "times", "of": "seconds", "take": ["only"]},
        {"says": "of 3 cases", "table": "nowhere", "of": "case", "take": ["count"]},
        {"says": "in 7 s", "table": "times", "of": "seconds", "take": ["min"], "where": "body == 'spleen'"},
    ]
    table = gather_links({"anywhere": ("times", "outcomes")}, {"times": TIMES, "outcomes": OUTCOMES}, entries)
    assert list(table) == CLAIM_LINKS.columns
    assert table["kind"].tolist() == ["paper 1"] * 5 + ["README"] * 3
    assert table["rows"].tolist()[:5] == [4, 4, 6, 2, 0]
    readme = table[table["kind"] == "README"]
    assert readme["verdict"].tolist() == [AS_WRITTEN, "differs: 2.2", AS_WRITTEN] and set(readme["rows"]) == {4}
