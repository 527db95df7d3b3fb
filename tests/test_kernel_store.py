"""Compiled functions are stored so that processes that compile at a time never get each other's code."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

from numba.core.caching import IndexDataCacheFile

from palpate import kernel_store


class Store(IndexDataCacheFile):
    """A function's versions, as one process knows them; ``behind`` when another has stored some since it looked."""

    behind = False
    save = kernel_store.save

    def _load_index(self):
        behind, self.behind = self.behind, False
        return {} if behind else super()._load_index()


def test_versions_that_two_processes_store_at_a_time_are_never_mixed_up(tmp_path):
    first, second, third = (Store(str(tmp_path), "kernel-1", "stamp") for _ in range(3))
    second.behind = True
    first.save(("float64",), "of reals")
    second.save(("int64",), "of integers")
    assert third.load(("int64",)) == "of integers"
    assert third.load(("float64",)) in (None, "of reals")
    first.save(("float64",), "of reals")
    assert (third.load(("float64",)), third.load(("int64",))) == ("of reals", "of integers")


def test_what_is_stored_at_once_is_found_again(tmp_path):
    keys = range(100)
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda key: Store(str(tmp_path), "kernel-1", "stamp").save(key, f"code of {key}"), keys))
    kept = Store(str(tmp_path), "kernel-1", "stamp")
    assert [kept.load(key) for key in keys] == [f"code of {key}" for key in keys]


def test_of_two_processes_that_want_a_function_one_compiles_it(tmp_path):
    kernel = tmp_path / "kernel.py"
    kernel.write_text("import numba\n\n\n@numba.njit(cache=True)\ndef add(x, y):\n    x[:] = x + y\n")
    os.utime(kernel, (0, 0))
    script = (
        "import kernel, numpy; x = numpy.ones(2); input(print('ready', flush=True) or ''); kernel.add(x, x); "
        "print(sum(kernel.add.stats.cache_misses.values()))"
    )
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "bufsize": 1}
    env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    both = [subprocess.Popen([sys.executable, "-c", script], cwd=tmp_path, env=env, **pipes) for _ in range(2)]
    for process in both:
        assert process.stdout.readline() == "ready\n"
    for process in both:
        process.stdin.write("\n")
    assert sorted(process.communicate()[0] for process in both) == ["0\n", "1\n"]


def test_numba_stores_so_before_it_compiles_anything():
    script = (
        "import numba; from numba.core.caching import IndexDataCacheFile as store; numba.njit(lambda x: x)(1.0); "
        "print(store.save.__module__)"
    )
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert told.stdout.split() == ["palpate.kernel_store"]


def test_what_was_edited_since_the_process_began_is_neither_loaded_nor_stored(tmp_path):
    law = tmp_path / "law.py"
    law.write_text("import numba\n")
    os.utime(law, (0, kernel_store.STARTED_S - 1))
    assert kernel_store.stamp(law)
    kernel_store.stamp.cache_clear()
    os.utime(law, (0, kernel_store.STARTED_S + 1))
    assert kernel_store.stamp(law) is None
    Store(str(tmp_path), "kernel-1", None).save(("float64",), "perhaps old")
    assert [path.name for path in tmp_path.iterdir()] == ["law.py"]
