"""Docstrings are in plain English: those of functions begin with a verb, and none begins with a question word."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
VERBS = set(
    """
    Accept Accumulate Add Advance Advise Align Allocate Allow Append Apply Approximate Ask Assemble Assert Assign Average
    Begin Blend Bound Bracket Build Calibrate Call Check Choose Clear Clip Close Collapse Collect Color Combine Compare
    Complete Compose Compute Concatenate Continue Convert Copy Count Create Cross Cut Damp Declare Decode Decompose Deform
    Delete Derive Describe Detect Differentiate Displace Distribute Divide Do Draw Drop Embed Encode End Enlarge Estimate
    Evaluate Exclude Expand Explain Extract Extrapolate Factorise Fetch Fill Filter Find Finish Fit Flatten Fold Follow
    Format Gather Generate Get Give Group Grow Guard Guess Handle Hold Ignore Include Initialise Insert Integrate
    Interpolate Intersect Invert Iterate Join Keep Label Lay Leave Limit Linearise List Load Locate Log Look Lower Make
    Map Mark Mask Match Measure Merge Minimise Mirror Move Multiply Name Nest Normalise Number Offset Open Order Orient
    Pack Pad Parse Perturb Pick Place Plan Plot Precompute Predict Prepare Press Print Project Prolong Propagate Provide
    Prune Push Put Raise Rank Read Rearrange Record Recover Reduce Refine Refit Reflect Refuse Register Relax Release
    Remesh Remove Rename Render Reorder Repeat Replace Report Require Resample Reset Resolve Restore Restrict Return Round
    Rotate Run Sample Save Scale Search Segment Select Separate Set Shift Show Simulate Skip Smooth Snap Solve Sort Split
    Spread Start Step Stop Store Stretch Subdivide Subsample Subtract Sum Swap Sweep Symmetrise Tabulate Take Tally Test
    Tile Time Trace Transform Transpose Traverse Triangulate Trim Try Turn Unpack Update Use Validate View Visit Wait
    Walk Warn Weigh Weight Wrap Write Yield
    Change Decide Import
    """.split()
)
"""The verbs that docstrings begin with so far; add yours."""

QUESTIONS = {"What", "Which", "Where", "Whether", "How", "Why", "When", "Who", "Whose"}


def docstrings(path: Path) -> Iterator[tuple[str, ast.AST, str]]:
    """Yield the place, the node and the first word of each docstring in a module."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and (text := ast.get_docstring(node)):
            name = getattr(node, "name", "module")
            yield f"{path.relative_to(ROOT)}:{name}", node, text.split()[0].rstrip(":,.;")


def is_property(node: ast.AST) -> bool:
    """Return whether a function is a property, which is named like a thing."""
    names = [getattr(item, "id", getattr(item, "attr", "")) for item in getattr(node, "decorator_list", [])]
    return any(name in {"property", "cached_property", "setter", "fixture"} for name in names)


@pytest.mark.parametrize("package", sorted(path.name for path in (ROOT / "src/palpate").iterdir()))
def test_docstrings_begin_with_a_verb(package):
    place = ROOT / "src/palpate" / package
    wrong = []
    for path in sorted(place.rglob("*.py")) if place.is_dir() else [place] * (place.suffix == ".py"):
        for name, node, word in docstrings(path):
            action = isinstance(node, ast.FunctionDef) and not is_property(node)
            if word in QUESTIONS or (action and word not in VERBS):
                wrong.append(f"{name}: {word}")
    assert wrong == []
