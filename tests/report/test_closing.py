"""Claims of all papers, and what failed, stand at the end; what is not included is what the registry lacks."""

import pandas as pd
from fixtures.material import material

from palpate.report import closing
from palpate.report.claims import CONFIRMED, REFUTED, Claim


def rows(**changed):
    claims = [Claim(1, "4", "it is fast", premise, "1 s", "ordered_nonnegative_a: 2 s", CONFIRMED) for premise in "ab"]
    claims.append(Claim(2, "3", "it is exact", "c", "", "", REFUTED))
    table = pd.DataFrame(claims).assign(study=["enrichment", "enrichment", "springs"])
    return table.assign(**changed)


def test_claims_are_counted_and_united():
    report = material("collision", {"claims": rows()})
    found = closing.verdicts(report)
    assert (found["tests"], found["claims"], found["verdicts"]) == (3, 2, "2 confirmed, 1 refuted")
    assert found["united"][["tests", "verdict"]].to_numpy().tolist() == [[2, "confirmed"], [1, "refuted"]]
    mixed = closing.united(rows(verdict=[CONFIRMED, REFUTED, REFUTED]))
    assert mixed["verdict"].tolist()[0] == "confirmed (1), refuted (1)"
    assert closing.verdicts(material("collision", {})) == {}


def test_a_part_shows_the_claims_of_its_own_study():
    report = material("collision", {"claims": rows(study="collision")})
    ((key, _, text),) = closing.own_claims(report, "collision")
    assert key == "collision_claims" and text.count("<tr>") == 4
    assert closing.own_claims(report, "springs") == []
