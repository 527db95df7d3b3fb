"""A job's digest follows what its function and its modules do, and its closure holds what it imports while it runs."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from palpate.run import dependencies


@pytest.fixture
def script(tmp_path, monkeypatch):
    """Write a module, and return the digest of its function ``sides``."""
    path, usual = tmp_path / "script.py", dependencies.files_of
    monkeypatch.setattr(dependencies, "files_of", lambda name: [path] if name == "script" else usual(name))

    def digest(text: str, *lazily: str) -> str:
        dependencies._facts.cache_clear()
        dependencies._parsed.cache_clear()
        path.write_text(text)
        return dependencies.digest("script:sides", *lazily)

    return digest


PLAIN = "from palpate.bodies.simple_shapes import box\n\n\ndef sides():\n    return box\n"


def test_words_and_layout_do_not_count(script):
    said = PLAIN.replace("    return", '    """Return it."""\n    # the one\n    return')
    assert script(PLAIN) == script(f'"""Boxes."""\n{said}') == script(PLAIN.replace("\n\n\n", "\n"))


@pytest.mark.parametrize(
    "edited",
    [
        PLAIN.replace("return box", "return box(1)"),
        PLAIN.replace("bodies.simple_shapes import box", "bodies import mesh"),
    ],
)
def test_what_is_done_counts(script, edited):
    assert script(PLAIN) != script(edited)


def test_the_rest_of_the_module_does_not_count_and_what_the_function_names_does(script):
    more = "from palpate.bodies.organs import liver\n" + PLAIN + "\n\ndef other():\n    return liver\n"
    assert script(more) == script(PLAIN)
    counted = "SIDE = 1\n" + PLAIN.replace("return box", "return box(SIDE)")
    assert script(counted) != script(counted.replace("SIDE = 1", "SIDE = 2"))
    helped = PLAIN.replace("return box", "return helper()") + "\n\ndef helper():\n    return 1\n"
    assert script(helped) != script(helped.replace("return 1", "return 2"))
    assert script(helped) != script(helped.replace("return 1", "return box"))


def test_modules_named_at_run_time_count(script):
    assert len({script(PLAIN), script(PLAIN, "palpate.effects.gravity"), script(PLAIN, "palpate.effects")}) == 3


def test_closure_follows_imports_in_functions_and_of_packages(tmp_path):
    (tmp_path / "script.py").write_text("def late():\n    from palpate.collision import crossing_pairs\n")
    found = dependencies.closure([tmp_path / "script.py"]) - {tmp_path / "script.py"}
    names = {path.relative_to(dependencies.PACKAGE).as_posix() for path in found}
    assert {"collision/__init__.py", "collision/trees/tree.py", "collision/triangles/predicates.py"} <= names
    assert "job.py" not in names and not any(name.startswith("evaluation") for name in names)


def test_classes_of_settings_that_count_for_no_digest_do_nothing():
    for path in dependencies.WRAPPERS:
        if path.name == "settings.py":
            classes = [node for node in ast.parse(path.read_bytes()).body if isinstance(node, ast.ClassDef)]
            assert not [node for each in classes for node in ast.walk(each) if isinstance(node, ast.FunctionDef)], path


CALLS = [
    ("palpate.benchmark.static_responses", "press_batch"),
    ("palpate.studies.scenes.motion_pictures", "draw_motion"),
    ("palpate.studies.ct.node_mass", "tabulate_node_mass"),
]


@pytest.mark.parametrize(("module", "name"), CALLS)
def test_the_closure_holds_whatever_is_loaded(module, name):
    part = dependencies.needed(dependencies._parsed(dependencies.files_of(module)[0]), name)
    imports = [node for node in ast.walk(part) if isinstance(node, ast.Import | ast.ImportFrom)]
    ask = 'import sys; print(*(m.__file__ for n, m in sys.modules.items() if n.startswith("palpate.") and m.__file__))'
    code = "\n".join([*map(ast.unparse, imports), ask])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {path for path in map(Path, done.stdout.split()) if path.read_text()} - dependencies.WRAPPERS
    assert loaded and loaded <= dependencies.closure(dependencies.modules_of(dependencies.imports(part)))
