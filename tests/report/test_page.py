"""The page holds everything, and needs nothing from outside."""

import base64
import re
import zlib

import pytest

from palpate.errors import InputError
from palpate.report import page as report
from palpate.report.declared import tables as declared

STUDIES = ["scenes", "ct", "enrichment", "springs", "shape_matching", "collision"]
PAPERS = {"enrichment", "springs", "shape_matching", "collision"}
TABLES = {study: [name for name, table in declared(study).items() if table.always] for study in STUDIES}


def written(folder, studies=STUDIES, scenes=None, cts=None, out=None):
    """The page about what is asked for, all scenes if not said otherwise."""
    out = out or folder.path / "report.html"
    scenes, cts = (folder.scenes if scenes is None else scenes), (folder.cts if cts is None else cts)
    more = ["claims"] if PAPERS & set(studies) else []
    more += ["node_mass"] if "ct" in studies else []
    more += ["maxwell_creep"] if "shape_matching" in studies else []
    report.write(folder.path, out, studies, scenes, cts, more=more)
    return out.read_text(encoding="utf-8")


def shown(page):
    """The page without its style sheet and its script."""
    return page.split("</style>")[1].split("<script>")[0]


@pytest.fixture(scope="module")
def page(whole_folder, tmp_path_factory):
    return written(whole_folder, out=tmp_path_factory.mktemp("page") / "report.html")


def test_holds_every_figure(page, whole_folder):
    embedded = [base64.b64decode(d).decode() for d in re.findall(r'src="data:[^,]+,([^"]+)"', page)]
    for name in (name for part in whole_folder.figures.values() for name in part):
        assert f'<figure id="figure_{name}">' in page
        assert any(f"<!-- {name} -->" in picture for picture in embedded)
    views = re.findall(r'<figure class="turn" id="turn_([a-z_]+)".*?"name": "([a-z_]+)"', page, re.DOTALL)
    assert len(views) == len(whole_folder.scenes) + 4  # of error_over_body
    assert all(figure == data for figure, data in views)


@pytest.mark.parametrize(
    ("studies", "scenes", "cts"),
    [
        (["scenes"], ["sag"], []),
        (["ct"], [], ["abdomen"]),
        (["scenes", "shape_matching", "enrichment"], ["press"], []),
        ([], [], []),
    ],
)
def test_shows_what_is_asked_for_and_reads_nothing_else(results_folder, studies, scenes, cts):
    for study, names in TABLES.items():
        if study not in studies:  # what an earlier run left behind must not matter, whatever it is
            for name in names:
                (results_folder.path / "tables" / f"{name}.csv").write_text("stale,table\n")
            for name in results_folder.figures.get(study, ()):
                (results_folder.path / "figures" / f"{name}.svg").unlink()
    text = written(results_folder, studies, scenes, cts)
    for study, figures in results_folder.figures.items():
        assert (f'<section id="{study}">' in text) == (study in studies)
        assert any(f'<figure id="figure_{name}">' in text for name in figures) == (study in studies)
    assert [s for s in results_folder.scenes if f'id="figure_motion_{s}"' in text] == scenes
    papers = PAPERS & set(studies)
    assert ('<section id="verdicts">' in text) == bool(papers)
    assert ('<section id="limits">' in text) == bool(studies)
    assert text.count('class="finding"') == len(studies) + bool(papers) + bool(studies)
    assert not re.search(r"\{[a-z_]+\}", shown(text))


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"scenes": ["drape"]}, "has no rows of the scene drape"),
        ({"cts": ["brain"]}, r"mesh_quality\.csv .* body brain"),
    ],
)
def test_a_scene_or_a_body_from_ct_without_rows_is_named(results_folder, asked, said):
    with pytest.raises(InputError, match=said):
        written(results_folder, **asked)


def test_is_one_file(page):
    targets = re.findall(r'(?:src|href|srcset)\s*=\s*["\']?([^"\'\s>]+)', page)
    assert targets
    assert [target for target in targets if not target.startswith(("#", "data:"))] == []
    assert not re.search(r"@import|url\(|<link|<script[^>]+src|fetch\(|XMLHttpRequest|import ", page)
    assert "default-src 'none'" in page  # and a browser would not let it


def test_every_link_leads_somewhere(page):
    ids = re.findall(r'id="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'href="#([^"]+)"', page)) <= set(ids)


def test_a_long_table_is_packed_whole(page, results):
    packed = re.search(r'data-caption="sigma_sweep.csv" data-packed="([^"]+)"', page).group(1)
    names, kinds, *rows = zlib.decompress(base64.b64decode(packed)).decode().split("\n")
    sweep = results["sigma_sweep"]
    assert len(rows) == len(sweep) > 300
    assert names.split("\t") == [column.replace("_", " ") for column in sweep]
    assert kinds.split("\t") == [""] * 6 + ["number"] * 4
    assert rows[0].split("\t")[:6] == sweep.iloc[0, :6].tolist()


def test_two_runs_are_the_same_bytes(page, whole_folder, tmp_path):
    assert written(whole_folder, out=tmp_path / "report.html") == page


@pytest.mark.parametrize("name", ["energy", "sigma_sweep"])
def test_a_missing_table_is_named(results_folder, name):
    (results_folder.path / "tables" / f"{name}.csv").unlink()
    with pytest.raises(InputError, match=rf"{name}\.csv is missing"):
        written(results_folder)
    assert not (results_folder.path / "report.html").exists()


@pytest.mark.parametrize("name", ["sigma_sweep.svg", "motion_sag.json"])
def test_a_missing_figure_is_named(results_folder, name):
    (results_folder.path / "figures" / name).unlink()
    with pytest.raises(InputError, match=rf"{re.escape(name)} is missing"):
        written(results_folder)
