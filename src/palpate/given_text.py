"""Reading of text that users bring, in whatever encoding; jobs that read it run again when this module changes."""

import codecs
import csv
import io
import re
from pathlib import Path

from palpate.errors import InputError


def without_mark(data: bytes) -> bytes:
    """Return the content of a file without a mark of its byte order (BOM), text in UTF-8."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        data = data.decode("utf-16").encode()
    return data.removeprefix(codecs.BOM_UTF8)


def read_cells(path: Path | str) -> tuple[list[str], list[list[str]], list[int], str]:
    """Read the header, the cells of each row and its line in a user's CSV file, and what separates them, in words.

    The separator is that of tabs, semicolons and commas that the header has most of. Text is UTF-8, UTF-16 with its
    mark, or Latin-1; rows may end in separators. InputError for what is no table.
    """
    try:
        raw = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path} is no table ({error.strerror}); give a CSV file.") from error
    try:
        text = without_mark(raw).decode()
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    if "\0" in text:
        raise InputError(f"{path} is no table of text; give a CSV file.")
    text = re.sub(r"\Asep=.\r?\n", "\n", text)  # as spreadsheets write it
    head = text.lstrip().partition("\n")[0]
    separator, words = max({"\t": "tabs", ";": "semicolons", ",": "commas"}.items(), key=lambda one: head.count(one[0]))
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, skipinitialspace=True)
    try:
        filled = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        raise InputError(f"{path} is no table ({error}); give a CSV file.") from error
    if len(filled) < 2:
        raise InputError(f"{path} has no rows; give some below its header.")
    (_, header), *rows = filled
    while not header[-1]:
        header.pop()
    for line, row in rows:
        if any(row[len(header) :]):
            raise InputError(
                f"{path}, row {line}: it has {len(row)} cells, and the header {len(header)}; where decimals have "
                "commas, separate cells by semicolons or tabs."
            )
    cells = [[*row, *[""] * len(header)][: len(header)] for _, row in rows]
    return header, cells, [line for line, _ in rows], words
