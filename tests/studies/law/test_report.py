"""Sentences about laws follow from their table."""

from fixtures.material import material, numbers

from palpate.studies.law import report as law


def test_the_headline_says_from_which_depth_on_the_law_matters(law_table):
    said = numbers("law", {"law": law_table})
    cylinder, liver = said["headline"].split(" Liver: ")
    assert liver == (
        "up to a depth of 10 %, another law changes the answer by up to 1 % (neo-Hookean) to 3 % (St. Venant–"
        "Kirchhoff) of the peak. That is more than the error of the truth from the first depth on at the earliest and "
        "from 1 % on at the latest; of quadratic elements on the finest mesh from 1.7 % on at the "
        "earliest and from 5 % on at the latest; of linear elements on the finest mesh at no depth. "
        "At the patch it changes up to 4.5 % (St. Venant–Kirchhoff), where linear elements are wrong by 7.5 %. "
        "ν = 0.49 in the place of 0.3 changes it by 2 %, at any depth."
    )
    assert cylinder.startswith("Cylinder: up to a depth of 10 %, another law changes the answer by up to 1 % (neo-Hook")


def test_what_has_no_truth_is_marked(law_table):
    doubted = law_table.assign(
        believed=law_table["believed"] & law_table["poisson"].ne(0.49),
        own_rmse_of_peak=law_table["own_rmse_of_peak"].where(law_table["poisson"].ne(0.49), 0.016),
    )
    said = numbers("law", {"law": doubted})
    assert said["headline"].endswith("changes it by 2 % (known to 1.6 %), at any depth.")
    assert said["law_own"] == "0.1 %" and said["law_doubted"] == "ν = 0.49 (1.6 %)"
    assert said["law_locking"].endswith("liver: 5 % at ν = 0.3 and 20 % at ν = 0.49 (known to 1.6 %)")
    assert "2 % by ν = 0.49 (known to 1.6 %)" in law.beside(doubted).replace("\u00a0", " ")
    assert numbers("law", {"law": law_table})["law_doubted"] == "none"


def test_leaving_regions_out_is_told(law_table):
    liver = law_table[law_table["body"].eq("liver") & law_table["changed"].isin(["nothing", "poisson"])]
    found = numbers("law", {"law": liver.assign(changed=liver["changed"].replace("poisson", "regions"), poisson=0.3)})
    assert found["headline"] == (
        "Liver: leaving its regions out changes the answer by up to 2 % of the peak, and by up to 3 % at the patch; "
        "linear elements on the finest mesh are wrong by 20 % and 30 %."
    )


def test_captions_are_filled(law_table):
    said = numbers("law", {"law": law_table})
    assert said["law_depths"] == "cylinder: 1 % to 10 %; liver: 1 % to 10 %"
    assert said["law_contacts"] == "cylinder: 1; liver: 1" and said["law_own"] == "0.1 %"
    assert said["law_lost"] == "1 of the cylinder under St. Venant–Kirchhoff"
    assert (
        said["law_locking"]
        == "cylinder: 5 % at ν = 0.3 and 20 % at ν = 0.49; liver: 5 % at ν = 0.3 and 20 % at ν = 0.49"
    )
    kept = law_table[law_table["peak_of_size"].notna()]
    assert numbers("law", {"law": kept})["law_lost"] == "every press has an equilibrium under every law"


def test_presses_without_an_answer_are_listed(law_table):
    [(what, where, how)] = law.failures(material("law", {"law": law_table}))
    assert (what, where) == ("St. Venant–Kirchhoff", "cylinder")
    assert how.replace("\u00a0", " ") == "no answer at a depth of 10 %: no answer on level 1"


def test_the_trade_off_says_what_another_description_changes(law_table):
    said = law.beside(law_table).replace("\u00a0", " ")
    assert "; liver, 10 % deep: 1 % by neo-Hookean, 3 % by St. Venant–Kirchhoff and 2 % by ν = 0.49." in said
    assert "cylinder, 10 % deep: 1 % by neo-Hookean and 2 % by ν = 0.49;" in said
    assert law.beside(law_table[law_table["changed"] == "nothing"]) == ""


def test_the_summary_has_a_row_for_each_body_and_change(law_table):
    shown = law.summary(law_table).replace("\u00a0", " ")
    assert shown.count("<tr>") == 1 + 2 * 4
    assert "from 6.7 % on" in shown and "corotational, ν = 0.3 (as it is)" in shown
