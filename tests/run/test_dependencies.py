"""A script's digest follows what its modules do, and its closure holds what it imports while it runs."""

import subprocess
import sys
from pathlib import Path

import pytest

from palpate.run import dependencies

SCRIPTS = Path(__file__).parents[2] / "workflow/scripts"


@pytest.fixture
def script(tmp_path):
    """Write a script, and return its digest."""

    def digest(text: str, *lazily: str) -> str:
        dependencies._facts.cache_clear()
        dependencies.imported.cache_clear()
        path = tmp_path / "script.py"
        path.write_text(text)
        return dependencies.digest(path, *lazily)

    return digest


PLAIN = "from palpate.bodies.box import box\n\n\ndef sides():\n    return box\n"


def test_words_and_layout_do_not_count(script):
    said = PLAIN.replace("    return", '    """Return it."""\n    # the one\n    return')
    assert script(PLAIN) == script(f'"""Boxes."""\n{said}') == script(PLAIN.replace("\n\n\n", "\n"))


@pytest.mark.parametrize(
    "edited",
    [PLAIN.replace("return box", "return box(1)"), PLAIN.replace("bodies.box import box", "bodies import mesh")],
)
def test_what_is_done_counts(script, edited):
    assert script(PLAIN) != script(edited)


def test_modules_named_at_run_time_count(script):
    assert len({script(PLAIN), script(PLAIN, "palpate.effects.gravity"), script(PLAIN, "palpate.effects")}) == 3


def test_closure_follows_imports_in_functions_and_of_packages(tmp_path):
    (tmp_path / "script.py").write_text("def late():\n    from palpate.collision import crossing_pairs\n")
    found = dependencies.closure([tmp_path / "script.py"]) - {tmp_path / "script.py"}
    names = {path.relative_to(dependencies.PACKAGE).as_posix() for path in found}
    assert {"collision/__init__.py", "collision/trees/tree.py", "collision/triangles/predicates.py"} <= names
    assert "job.py" not in names and not any(name.startswith("evaluation") for name in names)


@pytest.mark.parametrize("name", ["simulate_fine", "draw_motion", "tabulate_node_mass"])
def test_the_closure_holds_whatever_is_loaded(name):
    lines = (SCRIPTS / f"{name}.py").read_text().splitlines()
    imports = "\n".join(line for line in lines if line.startswith(("import", "from")))
    ask = 'import sys; print(*(m.__file__ for n, m in sys.modules.items() if n.startswith("palpate.") and m.__file__))'
    done = subprocess.run([sys.executable, "-c", f"{imports}\n{ask}"], capture_output=True, text=True, check=True)
    loaded = {path for path in map(Path, done.stdout.split()) if path.read_text()} - dependencies.WRAPPERS
    assert loaded and loaded <= dependencies.closure([SCRIPTS / f"{name}.py"])
