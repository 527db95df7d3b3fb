"""What the machine refused or lacks is said in one sentence."""

import errno
import os
import re
import resource
import subprocess
import sys
from importlib import metadata

import h5py
import numpy as np
import pytest

from palpate.errors import InputError
from palpate.files import read_hdf5, write_whole
from palpate.run import system_faults
from palpate.run.leftovers import remove_leftovers
from palpate.run.system_faults import of_error, of_exit

FULL = "no space is left on the disk of results; free some and type make to go on."


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), FULL),
        (OSError("Can't write data (file write failed: time = Sun, errno = 28, error message = 'No space"), FULL),
        (RuntimeError("Can't decrement id ref count (file write failed: errno = 122)"), FULL),
        (PermissionError(13, "Permission denied", "results/a.h5"), "results/a.h5 cannot be written to; change who"),
        (OSError(30, "Read-only file system", "results/a.h5"), "results/a.h5 cannot be written to; change who"),
        (MemoryError("Unable to allocate 3 TiB"), "more memory was asked for than there is; close other"),
        (RuntimeError("std::bad_alloc"), "more memory was asked for than there is; close other"),
        (ImportError("libgmsh.so: failed to map segment from shared object"), "more memory was asked for"),
        (ModuleNotFoundError("No module named 'h5py'"), "the environment is damaged (No module named 'h5py'); type"),
        (ZeroDivisionError("oh"), ""),
        (FileNotFoundError(2, "No such file or directory", "a.h5"), ""),
    ],
)
def test_what_the_machine_refuses_is_told_from_a_fault(error, said):
    found = of_error(error, "results")
    assert found.startswith(said) and bool(found) == bool(said)


def test_how_a_process_ended_says_why(tmp_path):
    assert "ended from outside (signal 9), most likely for lack of memory" in of_exit(137, tmp_path)
    assert of_exit(-9, tmp_path) == of_exit(137, tmp_path)
    assert "broke off with signal 11; type make to try again" in of_exit(139, tmp_path)
    assert "ended with exit code 1 before it could say why" in of_exit(1, tmp_path)


def test_hdf5_on_a_full_disk_ends_in_one_sentence_and_leaves_nothing(tmp_path):
    """A limit on the size of files is what a full disk is to HDF5: its errors, in the job's own process."""
    program = """
import h5py, numpy, sys
from palpate.files import write_whole
from palpate.run.job import job
with job("a.log"):
    with write_whole("a.h5") as part, h5py.File(part, "w") as file:
        file["x"] = numpy.zeros(10**6)
"""
    limits = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (10**5, 10**5))  # noqa: E731
    environment = os.environ | {"PALPATE_RUN": str(os.getpid())}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, preexec_fn=limits, env=environment, capture_output=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (1, b"", b"")
    sentences = [line for line in (tmp_path / "a.log").read_text().splitlines() if line.startswith("error: ")]
    assert sentences == ["error: no space is left on the disk of .; free some and type make to go on."]
    assert [path.name for path in tmp_path.iterdir()] == ["a.log"]


def test_a_damaged_file_is_named(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=np.arange(1000.0), fletcher32=True)
        chunk = file["x"].id.get_chunk_info(0)
    whole = path.read_bytes()
    for damaged in (whole[:2000], b"", whole[: chunk.byte_offset] + b"\1" + whole[chunk.byte_offset + 1 :]):
        path.write_bytes(damaged)
        with (
            pytest.raises(InputError, match=r"a\.h5 is damaged \(.*\); delete it and type make\.$"),
            read_hdf5(path) as file,
        ):
            file["x"][:]


def test_only_what_dead_processes_left_is_removed(tmp_path):
    dead = subprocess.Popen(["true"])
    dead.wait()
    for name in (f".a.part{dead.pid}.h5", f".b.part{os.getpid()}.h5", ".c.partial.h5", "d.part1.h5"):
        (tmp_path / name).write_text("half")
    old = tmp_path / ".e.part1.h5"  # the first process is younger than the file
    old.write_text("half")
    os.utime(old, (1, 1))
    with write_whole(tmp_path / "f.h5") as part:
        part.write_text("half")
        assert sorted(path.name for path in remove_leftovers(tmp_path)) == [f".a.part{dead.pid}.h5", ".e.part1.h5"]
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {f".b.part{os.getpid()}.h5", ".c.partial.h5", "d.part1.h5", "f.h5"}


def test_missing_packages_are_named(monkeypatch):
    system_faults.check_environment()

    def version(name: str) -> str:
        if name in ("h5py", "gmsh"):
            raise metadata.PackageNotFoundError(name)
        return "1.0"

    monkeypatch.setattr(system_faults, "version", version)
    said = "the environment lacks gmsh, h5py; type make distclean, and then make, which builds it anew."
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        system_faults.check_environment()
