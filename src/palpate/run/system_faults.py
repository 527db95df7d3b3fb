"""Say in one sentence what the machine refused or lacks: disk, memory, permission, a package."""

import errno
import os
import re
import shutil
import signal
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from palpate.errors import InputError

FULL_MB = 1
"""A disk with less left is full: what did not fit has been deleted, or waits in memory."""
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_REFUSED = {errno.EACCES, errno.EPERM, errno.EROFS}
_NO_MEMORY = (signal.SIGKILL, signal.SIGABRT)
"""How a process ends whose memory the kernel or the C++ library refuses."""


def of_error(error: BaseException, folder: Path | str = ".") -> str:
    """Return the sentence for an exception that came from the machine; empty if it came from elsewhere.

    folder : where the job was writing
    """
    if isinstance(error, MemoryError):
        return _memory("more memory was asked for than there is")
    number = f"[Errno {error.errno}] " if isinstance(error, OSError) and error.errno else ""
    if sentence := of_text(f"{number}{error}", folder):
        return sentence
    if isinstance(error, ImportError):
        return f"the environment is damaged ({error}); type make distclean, and then make."
    return ""


def of_text(text: str, folder: Path | str = ".") -> str:
    """Return the same for the text of an exception, such as ``[Errno 13] Permission denied: 'results'``.

    Trap: HDF5 reports a full disk as an error of its own, in some places without the number.
    """
    numbers = {int(number) for number in re.findall(r"[Ee]rrno[ =]+(\d+)", text)}
    named = re.search(r"\[Errno \d+\][^'\n]*'([^'\n]+)'", text)
    place = named[1] if named else str(folder)
    if numbers & _FULL or "No space left on device" in text or "file write failed" in text:
        return _full(place)
    if numbers & _REFUSED:
        return _refused(place)
    if errno.ENOMEM in numbers or re.search("MemoryError|bad_alloc|failed to map segment|Cannot allocate memory", text):
        return _memory("more memory was asked for than there is")
    return ""


def of_exit(status: int, folder: Path | str = ".") -> str:
    """Return the sentence for a process that ended without one of its own, by its exit ``status``.

    status : as of a shell, so 128 and the number of the signal that ended the process
    """
    number = -status if status < 0 else status - 128
    if _free_mb(folder) < FULL_MB:
        return _full(str(folder))
    if not os.access(folder, os.W_OK):
        return _refused(str(folder))
    if number in _NO_MEMORY:
        return _memory(f"its process was ended from outside (signal {number}), most likely for lack of memory")
    if number > 0:
        return f"its process broke off with signal {number}; type make to try again, and report it if it comes again."
    return (
        f"its process ended with exit code {status} before it could say why; the lines above may, and make distclean "
        "and make build the environment anew."
    )


def _full(place: str) -> str:
    return f"no space is left on the disk of {place}; free some and type make to go on."


def _refused(place: str) -> str:
    return f"{place} cannot be written to; change who may write there, or work in a folder of your own."


def _memory(why: str) -> str:
    return f"{why}; close other programs, run fewer jobs at once (snakemake -c1), or give the body fewer nodes."


def _free_mb(place: Path | str) -> float:
    folder = Path(place).absolute()
    while not folder.exists():
        folder = folder.parent
    return shutil.disk_usage(folder).free / 1e6


def check_environment() -> None:
    """Raise InputError naming the packages that palpate needs and that are not installed."""
    if not _installed("palpate"):  # but found by its path
        return
    missing = []
    for wanted in requires("palpate") or []:
        name = re.split(r"[<>=; \[]", wanted)[0]
        if "extra ==" not in wanted and not _installed(name):
            missing.append(name)
    if missing:
        raise InputError(
            f"the environment lacks {', '.join(missing)}; type make distclean, and then make, which builds it anew."
        )


def _installed(name: str) -> bool:
    try:
        return bool(version(name))
    except PackageNotFoundError:
        return False
