"""The pages are true: links lead somewhere, paths and modules exist, README is short and its Python runs."""

import re
import subprocess
from pathlib import Path
from urllib.parse import unquote

import pytest
import yaml

import palpate as pp
from palpate.effects.effect import HOOKS, members

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), ROOT / "results/README.md"])
WRITTEN = [page for page in PAGES if page != ROOT / "docs/results.md"]
"""Pages that are not generated."""
RUNTIMES = {"palpate.c", "palpate.h"}
"""Files of an example, which look like modules."""
PATH = re.compile(r"(?<![\w/.(-])(?:src/palpate|tests|workflow|examples|docs|profiles)/[\w./*<>-]*[\w/*]")
"""A path of the repository in the text."""


def text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def prose(path: Path) -> str:
    """Return a page without its code."""
    return re.sub(r"```.*?```|`[^`]*`", "", text(path), flags=re.DOTALL)


def test_readme_is_short():
    assert len(text(ROOT / "README.md").splitlines()) <= 120
    assert len(text(ROOT / "README.md").split()) <= 1000


@pytest.mark.slow
def test_the_python_of_readme_runs_and_its_numbers_are_right(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    first, more = re.findall(r"^```python\n(.*?)^```$", text(ROOT / "README.md"), flags=re.MULTILINE | re.DOTALL)
    found = {}
    exec(compile(first, "README.md", "exec"), found)
    assert capsys.readouterr().out == "6.0 mm, error of linear elements 2.3%\n"
    halved = pp.FEM(order=1, level=2).answer(found["liver"], found["press"])
    assert halved.peak_m < found["quadratic"].peak_m  # a finer mesh is more compliant
    left = halved.error(found["quadratic"])
    assert 2.0 < found["linear"].error(found["quadratic"]) / left < 4.0  # an order between 1 and 2
    exec(compile(more, "README.md", "exec"), found)
    assert {"press.png", "drop.gif", "precision.png"} <= {path.name for path in tmp_path.iterdir()}
    assert found["motion"].force("floor")[-1, 2] == pytest.approx(9.80665, rel=1e-3)
    assert list(found["found"].summary["error [%]"]) == sorted(found["found"].summary["error [%]"], reverse=True)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\(([^)\s]+)\)", prose(page))
    inside = [unquote(link) for link in links if not link.startswith(("http://", "https://"))]
    for link in inside:
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        assert target.exists(), link
        if anchor:
            headings = re.findall(r"^#+ (.+)$", text(target), flags=re.MULTILINE)
            assert anchor in {re.sub(r"[^a-z0-9 _-]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: str(page.relative_to(ROOT)))
def test_paths_exist(page):
    own = [path for path in PATH.findall(text(page)) if "<" not in path and "toy" not in path]
    assert [path for path in own if not list(ROOT.glob(path.rstrip("/")))] == []


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: str(page.relative_to(ROOT)))
def test_modules_in_the_text_can_be_found(page):
    missing = []
    for name in re.findall(r"\bpalpate(?:\.[a-z_]+)+", text(page)):
        place = ROOT / "src" / name.replace(".", "/")
        if "toy" in name or name in RUNTIMES or place.exists() or place.with_suffix(".py").exists():
            continue
        module, _, member = name.rpartition(".")  # perhaps the name of something in a module
        file = (ROOT / "src" / module.replace(".", "/")).with_suffix(".py")
        if not (file.is_file() and re.search(rf"^(def|class) {member}\b|^{member}\b", text(file), flags=re.MULTILINE)):
            missing.append(name)
    assert missing == []


def test_the_guide_to_an_effect_shows_its_file():
    assert text(ROOT / "examples/wind.py") in text(ROOT / "docs/add-an-effect.md")


def test_the_guide_to_an_effect_has_every_hook():
    page = text(ROOT / "docs/add-an-effect.md")
    names = {name for hook in HOOKS for name in members(hook)}
    assert [name for name in sorted(names) if not re.search(rf"`{name}\b", page)] == []


def test_results_cite_a_commit_of_this_repository():
    commits = re.findall(r"of commit ([0-9a-f]{7,})", text(ROOT / "docs/results.md"))
    assert commits
    git = ["git", "-C", str(ROOT)]
    whole = subprocess.run([*git, "rev-parse", "--is-shallow-repository"], capture_output=True, text=True)
    if whole.stdout.strip() != "false":
        pytest.skip("this is not a whole git repository, so its history cannot be searched")
    for commit in commits:
        assert subprocess.run([*git, "cat-file", "-e", f"{commit}^{{commit}}"]).returncode == 0, commit


def test_the_version_is_the_same_everywhere():
    import tomllib

    version = tomllib.loads(text(ROOT / "pyproject.toml"))["project"]["version"]
    assert yaml.safe_load(text(ROOT / "CITATION.cff"))["version"] == version
    assert f"[{version}]" in text(ROOT / "CHANGELOG.md")
