"""What several processes compile at once is kept whole."""

from concurrent.futures import ThreadPoolExecutor

from numba.core.caching import IndexDataCacheFile


def test_what_is_kept_at_once_is_found_again(tmp_path):
    keys = range(100)

    def keep(key: int) -> None:
        IndexDataCacheFile(str(tmp_path), "kernel", "stamp").save(key, f"code of {key}")

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(keep, keys))
    kept = IndexDataCacheFile(str(tmp_path), "kernel", "stamp")
    assert [kept.load(key) for key in keys] == [f"code of {key}" for key in keys]
