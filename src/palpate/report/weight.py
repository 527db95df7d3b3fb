"""Say of a page that is too large what of it is largest."""

from collections.abc import Mapping, Sequence

from palpate.report.template import Section

MOST_MB = 20.0
"""A page of this size goes into a mail, and is opened within a second or two."""


def too_heavy(page: str, parts: Mapping[str, Sequence[Section]]) -> str | None:
    """Return a sentence on ``page`` if it has more than 20 MB, naming the largest of its sections; else None."""
    if (whole := _megabytes(page)) <= MOST_MB:
        return None
    sizes = [(_megabytes(content), title) for sections in parts.values() for _, title, content in sections]
    named = ", ".join(f"{title} ({size:.1f} MB)" for size, title in sorted(sizes, reverse=True)[:3])
    return f"This page has {whole:.0f} MB, more than {MOST_MB:.0f} MB; its largest sections are {named}."


def _megabytes(text: str) -> float:
    return len(text.encode()) / 1e6
