"""The page holds everything, and needs nothing from outside."""

import base64
import re
import zlib
from pathlib import Path

import pytest

from palpate.errors import InputError
from palpate.report import page as report
from palpate.report.material import TABLES

CAPTIONS = Path(__file__).parents[2] / "workflow" / "report"


PAPERS = ["soft_bodies", "springs", "collision", "enrichment"]


def written(folder, papers=PAPERS, scenes=None, cts=None, captions=CAPTIONS):
    """The page about what is asked for, all scenes if not said otherwise."""
    out = folder.path / "report.html"
    scenes, cts = (folder.scenes if scenes is None else scenes), (folder.cts if cts is None else cts)
    report.write(folder.path, captions, out, papers, scenes, cts)
    return out.read_text(encoding="utf-8")


def told(page):
    """The page without its style sheet and its script."""
    return page.split("</style>")[1].split("<script>")[0]


@pytest.fixture
def page(results_folder):
    return written(results_folder)


def test_holds_every_figure(page, results_folder):
    embedded = [base64.b64decode(d).decode() for d in re.findall(r'src="data:[^,]+,([^"]+)"', page)]
    for name in (name for part in results_folder.figures.values() for name in part):
        assert f'<figure id="{name}">' in page
        assert any(f"<!-- {name} -->" in picture for picture in embedded)
    views = re.findall(r'<figure class="turn" id="turn_([a-z_]+)".*?"name": "([a-z_]+)"', page, re.DOTALL)
    assert len(views) == len(results_folder.scenes) + 4  # of error_over_body
    assert all(figure == data for figure, data in views)


@pytest.mark.parametrize(
    ("papers", "scenes", "cts", "parts"),
    [
        ([], ["sag"], [], {"scenes"}),
        ([], [], ["abdomen"], {"ct"}),
        (["soft_bodies"], [], [], {"soft_bodies"}),
        (["springs"], [], [], {"springs"}),
        (["collision"], [], [], {"collision"}),
        (["enrichment"], [], [], {"enrichment"}),
        (["enrichment", "soft_bodies"], ["press"], [], {"scenes", "soft_bodies", "enrichment"}),
        ([], [], [], set()),
    ],
)
def test_shows_what_is_asked_for_and_reads_nothing_else(results_folder, papers, scenes, cts, parts):
    for part, names in TABLES.items():
        if part not in parts:  # what an earlier run left behind must not matter, whatever it is
            for name in names:
                (results_folder.path / "tables" / f"{name}.csv").write_text("stale,table\n")
            for name in results_folder.figures.get(part, ()):
                (results_folder.path / "figures" / f"{name}.svg").unlink()
    text = written(results_folder, papers, scenes, cts)
    for part, figures in results_folder.figures.items():
        assert (f'<section id="{part}">' in text) == (part in parts)
        assert any(f'<figure id="{name}">' in text for name in figures) == (part in parts)
    assert [s for s in results_folder.scenes if f'id="scene_{s}"' in text] == scenes
    assert text.count('class="finding"') == len(parts) + 2 * bool(papers)  # claims, and what failed
    assert ('<section id="verdicts">' in text) == ('<section id="omissions">' in text) == bool(papers)
    assert not re.search(r"\{[a-z_]+\}", told(text))


def test_is_a_story_from_the_question_to_what_failed(page):
    parts = [part for part in report.PARTS if f'<section id="{part}">' in page]
    assert parts == re.findall(r'<section id="([a-z_]+)">\n<h2>', page)
    assert page.index(report.QUESTION) < page.index(f'<section id="{parts[0]}">')
    first, *_, last = parts
    assert (first, last) == ("scenes", "omissions")
    assert parts.index("scenes") < parts.index("verdicts") < parts.index("enrichment")


def test_what_failed_is_listed(page):
    failed = page[page.index('id="failures_section"') :]
    assert failed.count("<td>POD + RBF</td>") == 8  # see conftest: on one body, in 2 regimes, 2 protocols, 2 splits
    assert "7 crossing pairs missed, 3 made up" in failed
    assert "enrichment: 8; collision: 1" in page.split("</header>")[0]


def test_scenes_tell_each_decision_and_cost(page):
    text = page.replace("\u00a0", " ")
    press = text[text.index('id="scene_press"') : text.index('id="scene_sag"')]
    assert "<td>springs</td><td>yes</td><td>the scene describes it</td>" in press
    assert re.search(r"<tr class=paper>\s*<td>gravity</td><td>no</td><td>no acceleration is given</td>", press)
    assert "750 µs" in press and "75 %" in press and "9.81" not in press


def test_a_scene_without_rows_is_named(results_folder):
    with pytest.raises(InputError, match="has no rows of the scene drape"):
        written(results_folder, scenes=["drape"])


def test_masses_from_ct_are_told(page):
    text = page.replace("\u00a0", " ")
    assert "masses within 2 % of the voxels" in text and "0.1 % from 6000 elements on" in text
    assert "1.13 to 1.15 kg" in text and "-9 % to -1 %" in text
    assert "1070.0 mL, smallest dihedral angle 9.5°" in text.split("</header>")[0]


def test_a_body_from_ct_without_rows_is_named(results_folder):
    with pytest.raises(InputError, match=r"node_mass\.csv has no rows of the body brain"):
        written(results_folder, cts=["brain"])


def test_an_unknown_part_is_named(results_folder):
    with pytest.raises(InputError, match="no part alchemy; choose from"):
        written(results_folder, papers=["alchemy"])


def test_shows_the_papers_numbers_beside_ours(page):
    text = page.replace("\u00a0", " ")
    for title in ("table 4 of the paper", "Table 3 of the paper", "Nodes, triangles", "Samples to train"):
        assert title in text
    assert "49.3 s" in text and "500 ms" in text  # fine FEM, the paper's mean and ours
    assert "0.90 [0.80, 1.00]" in text
    assert "building w costs O(r k)" in text
    for name in ("sigma_sweep", "enrichment_accuracy", "online_cost", "fem_cost", "complexity"):
        assert f'href="tables/{name}.csv"' in page


def test_asks_nothing_of_the_network(page):
    targets = re.findall(r'(?:src|href)\s*=\s*["\']?([^"\'\s>]+)', page)
    assert targets
    assert not [t for t in targets if re.match(r"(https?:)?//", t)]
    assert not re.search(r"@import|url\(|<link|<script[^>]+src|fetch\(|XMLHttpRequest|import ", page)
    assert "default-src 'none'" in page  # and a browser would not let it


def test_headlines_come_from_the_tables(page):
    header = page.split("</header>")[0]
    # conftest: ours is the last of 20 methods, interpolation the 13th, the paper's the sixth
    for share in (0.4 / 20, 0.4 / 13, 0.4 / 6):
        assert f"{100 * share:.2g}\u00a0%" in header
    assert "press: 1\u00a0ms a step; sag: 5\u00a0ms a step" in header
    assert "1.6\u00a0ms a step on one core (the thesis: 20\u00a0ms)" in header


def test_every_placeholder_is_filled_and_every_caption_used(page):
    assert not re.search(r"\{[a-z_]+\}", told(page))
    modules = [path.read_text() for path in Path(report.__file__).parent.glob("*.py")]
    source = "\n".join(modules).replace('f"introduction_{part}"', " ".join(f'"introduction_{p}"' for p in report.PARTS))
    for caption in CAPTIONS.glob("*.rst"):
        assert re.search(rf"""["']{caption.stem}["']""", source)


def test_a_long_table_is_packed_whole(page, results):
    packed = re.search(r'data-caption="sigma_sweep.csv" data-packed="([^"]+)"', page).group(1)
    names, kinds, *rows = zlib.decompress(base64.b64decode(packed)).decode().split("\n")
    sweep = results["sigma_sweep"]
    assert len(rows) == len(sweep) > 300
    assert names.split("\t") == [column.replace("_", " ") for column in sweep]
    assert kinds.split("\t") == [""] * 6 + ["number"] * 4
    assert rows[0].split("\t")[:6] == sweep.iloc[0, :6].tolist()


def test_two_runs_are_the_same_bytes(page, results_folder):
    assert written(results_folder) == page


@pytest.mark.parametrize("name", [n for part in (*PAPERS, "scenes", "ct") for n in TABLES[part]])
def test_a_missing_table_is_named(results_folder, name):
    (results_folder.path / "tables" / f"{name}.csv").unlink()
    with pytest.raises(InputError, match=rf"{name}\.csv is missing"):
        written(results_folder)
    assert not (results_folder.path / "report.html").exists()


@pytest.mark.parametrize("name", ["sigma_sweep.svg", "motion_sag.json", "clusters.png"])
def test_a_missing_figure_is_named(results_folder, name):
    (results_folder.path / "figures" / name).unlink()
    with pytest.raises(InputError, match=rf"{re.escape(name)} is missing"):
        written(results_folder)


def test_a_caption_that_asks_for_an_unknown_number_is_named(results_folder, tmp_path):
    captions = tmp_path / "captions"
    captions.mkdir()
    for path in CAPTIONS.iterdir():
        (captions / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    (captions / "claims.rst").write_text("{colour_of_the_sky}")
    with pytest.raises(InputError, match=r"claims\.rst: there is no number called 'colour_of_the_sky'"):
        written(results_folder, captions=captions)
