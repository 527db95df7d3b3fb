"""What can be asked for, and the nearest name to what was."""

from difflib import get_close_matches
from pathlib import PurePath

_asked: list[str] = []
_studies: list[str] = []
_files: list[str] = []


def offer(asked: list[str], studies: list[str], files: list[str]) -> None:
    """Say what can be asked for: the studies in the settings, all studies, and the files that can be made."""
    _asked[:], _studies[:], _files[:] = asked, studies, files


def goals() -> list[str]:
    """Return the names of rules that make nothing, but ask for others."""
    return ["all", *_studies]


def explain(target: str) -> str:
    """Return one sentence about a target that nothing makes, with the nearest name."""
    if target in _studies:
        return f"{target} is not asked for in the settings; add its block, {target}:, to them."
    names = {short(file): file for file in _files}
    wanted = short(target)
    stem = wanted.rpartition("/")[2]
    near = [name for name in names if name.rpartition("/")[2] == stem]
    stems = {name.rpartition("/")[2]: name for name in names}
    near = near or [stems.get(name, name) for name in get_close_matches(stem, [*_asked, *stems], n=1, cutoff=0.7)]
    near = near or get_close_matches(wanted, list(names), n=1, cutoff=0.8)
    if near:
        return f"nothing makes {wanted}; did you mean {' or '.join(near[:3])}?"
    return f"nothing makes {wanted}; ask for one of {', '.join(_asked)}, or for a file, such as results/report.html."


def short(file: str) -> str:
    """Return a file's name as ``make`` takes it: figures/errors for results/figures/errors.png."""
    path = PurePath(file)
    if path.parts[:2] in (("results", "figures"), ("results", "tables")) and len(path.parts) == 3:
        return f"{path.parts[1]}/{path.stem}"
    return file
