"""The pages are true: links lead somewhere, paths exist, README is short, and the glossary has every word in use."""

import re
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import pytest
import yaml

from palpate import evaluation
from palpate.evaluation.table import declared

ROOT = Path(__file__).parents[1]
PAGES = sorted(
    path
    for path in (*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *ROOT.glob("results/README.md"))
    if path.is_file()
)
COMMON = set(
    """
    all allow allowed at axis called case center change claim complexity count d1 d2 d3 d4 d5 density depth distance
    division duration edge element even file fine coarse middle frame from high low h half height if image in instrument
    iteration job key kind kinetic kg left length life limit linear mass material max mean measure measured median
    member memory message min moved moves name node object of operation other out over overlap own pair paper particle
    path per plane point radius rate ratio raw reason relative repeat rest scale search second seed self share side size
    space spacing sphere start stable stability stated step stop substep surface tetrahedron thickness threshold time
    timing to tool total trade tradeoff training triangle unit unstable up used value velocity volume why work x y z
    acceleration advice collision dynamic effect force gradient growth hold hard scaling solver stiffness strain
    blow sqrt membership search release relaxation matching correction displacement k r solve tests 1
    """.split()
)
"""Words of everyday and of school mechanics, which need no explanation."""
UNITS = set("m m2 m3 mm s s2 ms kg g n pa hu j mb kb deg hz 1".split())


def text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


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
                yield from table.columns.split()


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
