"""A report that is too large says so, and what of it is largest."""

from palpate.report import weight


def test_the_largest_sections_are_named():
    parts = {"a": [("one", "One", "x" * 12_000_000), ("two", "Two", "x" * 9_000_000)], "b": [("one", "One", "é")]}
    page = "".join(content for sections in parts.values() for *_, content in sections)
    said = weight.too_heavy(page, parts)
    assert "has 21 MB, more than 20 MB" in said and said.index("One (12.0 MB), Two (9.0 MB)")
    assert weight.too_heavy(page[:20_000_000], parts) is None
