"""Every rule lists the modules that its script runs, so that none can be edited unnoticed."""

import ast
import json
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src/palpate"
HELPERS = {PACKAGE / name for name in ("job.py", "files.py", "errors.py", "__init__.py")}
"""What wraps the work; no result depends on it."""


def imported(path: Path) -> Iterator[Path]:
    """The palpate modules that a file imports, anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        for name in names:
            module = (ROOT / "src" / name.replace(".", "/")).with_suffix(".py")
            if name.startswith("palpate.") and module.is_file():
                yield module


def closure(path: Path) -> set[Path]:
    """Everything that a file imports from palpate, directly or not."""
    found, waiting = set(), [path]
    while waiting:
        fresh = set(imported(waiting.pop())) - found
        found |= fresh
        waiting += fresh
    return found


def test_every_rule_lists_what_it_runs(finished):
    unlisted = {}
    for output in (path for path in (finished / "results").rglob("*") if path.is_file()):
        if output.suffix == ".log" or output.name.startswith("."):
            continue
        made = json.loads(output.read_text())
        runs = closure(ROOT / f"workflow/scripts/{made['rule']}.py") - HELPERS
        if missing := runs - {ROOT / path for path in made["code"]}:
            unlisted[made["rule"]] = sorted(str(path.relative_to(PACKAGE)) for path in missing)
    assert unlisted == {}


def test_scenes_in_which_something_can_touch_list_collision_and_no_others_do(finished, smoke):
    listed = {
        path.parent.name: any("palpate/collision/" in code for code in json.loads(path.read_text())["code"])
        for name in ("motion.h5", "left_out.csv", "cost.csv")
        for path in (finished / "results/data/scenes").rglob(name)
    }
    touching = {name for name, scene in smoke["scenes"].items() if "contact" in scene}
    assert listed == {name: name in touching for name in smoke["scenes"]} and 0 < len(touching) < len(listed)
