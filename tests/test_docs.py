"""The pages are true: links lead somewhere, paths exist, README is short, and the glossary has every word in use."""

import ast
import re
import subprocess
from pathlib import Path
from pkgutil import iter_modules
from urllib.parse import unquote

import pytest
import yaml

from palpate import studies as evaluation
from palpate.effects.effect import HOOKS, members
from palpate.report.declared import CLAIMS
from palpate.report.declared import tables as declared

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), ROOT / "results/README.md"])
WRITTEN = [page for page in PAGES if page != ROOT / "docs/results.md"]
"""Pages that are not generated."""
COMMON = set((ROOT / "tests/common_words.txt").read_text(encoding="utf-8").split())
"""Words of everyday and of school mechanics, which need no explanation."""
RUNTIMES = {"palpate.c", "palpate.h"}
"""Files of an example, which look like modules."""
UNITS = {"m", "m3", "s", "s2", "ms", "kg", "n", "pa", "hu", "j", "mb", "kb", "deg", "1"}
PATH = re.compile(r"(?<![\w/.(-])(?:src/palpate|tests|workflow|examples|docs|profiles)/[\w./*<>-]*[\w/*]")
STUMBLES = re.compile(
    r"\b(ours|knobs?|tells?|told|slower than life|against life|dear|might be|is none|but for|on a par|betters|whoever|"
    r"plays? in|as wrong as|(?<!here )(?:is|are) no [a-z]+(?! longer))\b"
)
"""Expressions that engineers who read English as a second language stumbled over."""


def text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def prose(path: Path) -> str:
    """Return a page without its code."""
    return re.sub(r"```.*?```|`[^`]*`", "", text(path), flags=re.DOTALL)


def forms(word: str) -> set[str]:
    """Return a word and what may be its singular."""
    return {word, word.removesuffix("s"), word.removesuffix("es"), re.sub("ies$", "y", word), re.sub("a$", "on", word)}


def words(name: str) -> set[str]:
    return set(re.findall(r"[a-z]+[0-9]*|[0-9]+", name.lower()))


def keys(schema: object):
    """Yield every key that the settings may have."""
    if isinstance(schema, dict):
        for name, inner in schema.items():
            if name == "properties" and isinstance(inner, dict):
                yield from inner
            yield from keys(inner)
    elif isinstance(schema, list):
        for inner in schema:
            yield from keys(inner)


def columns():
    """Yield every column that studies declare."""
    for module in iter_modules(evaluation.__path__):
        if module.ispkg:
            for table in declared(module.name).values():
                yield from table.columns
    yield from CLAIMS.columns


def terms() -> list[str]:
    """Return the terms of the glossary: the first column of its tables."""
    return re.findall(r"^\| \*\*(.+?)\*\* \|", text(ROOT / "docs/glossary.md"), flags=re.MULTILINE)


@pytest.fixture(scope="module")
def names() -> set[str]:
    """Return every key of the settings and every column of a table."""
    schemas = [yaml.safe_load(text(path)) for path in (ROOT / "workflow/schemas").rglob("*.yaml")]
    return {*columns(), *(key for schema in schemas for key in keys(schema))}


def test_every_word_in_use_is_in_the_glossary(names):
    known = COMMON | UNITS | {form for term in terms() for word in words(term) for form in forms(word)}
    unknown = {name: [word for word in words(name) if not forms(word) & known] for name in sorted(names)}
    assert {name: found for name, found in unknown.items() if found} == {}, "add the words to docs/glossary.md"


def test_the_list_of_common_words_is_short(names):
    used = {form for name in names for word in words(name) for form in forms(word)}
    assert sorted(COMMON - used) == []


def test_no_term_is_explained_twice():
    found = [word.strip() for term in terms() for word in term.lower().split(",")]
    assert sorted(found) == sorted(set(found))


def test_readme_is_short():
    assert len(text(ROOT / "README.md").splitlines()) <= 120
    assert len(text(ROOT / "README.md").split()) <= 1000


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
    named = re.findall(
        r"(?<![\w/.(-])(?:src/palpate|tests|workflow|examples|docs|profiles)/[\w./*<>-]*[\w/*]", text(page)
    )
    own = [path for path in named if "<" not in path and "toy" not in path]
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


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: str(page.relative_to(ROOT)))
def test_prose_is_plain(page):
    assert STUMBLES.findall(prose(page)) == []


def test_the_guide_to_a_study_shows_the_files_that_are_tested():
    tree = ast.parse(text(ROOT / "tests/workflow/test_reruns.py"))
    values = [line.value for line in tree.body if isinstance(line, ast.Assign) and line.targets[0].id == "TOY"]
    page = text(ROOT / "docs/add-a-study.md")
    for name, content in ast.literal_eval(values[0]).items():
        assert name.endswith("__init__.py") or (name in page and content.strip("\n") in page), name


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
