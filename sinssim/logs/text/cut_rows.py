"""Finds a first or a last row of a text file that was cut short: the logger began or ended within a row."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from sinssim.system.user_file import open_file

_TAIL = 1 << 16  # bytes at the end of a file, which hold its last rows
_PART = re.compile(rb"[-+0-9.eE:/TZ]*")
"""Part of a number or a date."""
_LONGEST = 1 << 20  # bytes of a line; a longer one is no row


@dataclass(frozen=True)
class CutRows:
    """The rows of a file that were cut short.

    Attributes:
        end: length of the file without a cut last row, bytes.
        first: line of a cut first row, from 1; None if it is whole.
        last: line of a cut last row, from 1; None if it is whole.
        notes: a sentence on each.
    """

    end: int
    first: int | None = None
    last: int | None = None
    notes: tuple[str, ...] = ()

    def without(self, data: bytes) -> bytes:
        """Return the contents of the file without these rows."""
        whole = data[: self.end]
        if self.first is None:
            return whole
        lines = whole.split(b"\n", self.first)
        del lines[self.first - 1]
        return b"\n".join(lines)


def cut_row(name: str, line: int, place: Literal["first", "last"], fields: int, width: int) -> str:
    """Return the sentence on a row that was cut short.

    Args:
        name: of the file.
        line: its number, from 1.
        place: where the row is.
        fields: number of its fields.
        width: number of fields of a whole row.
    """
    return f"{name}, line {line}: the {place} row was cut short ({fields} of {width} fields) and is left out."


def cut_rows(path: Path, delimiter: str | None, skip: int, width: int | None = None) -> CutRows:
    """Find the first and the last row of a text file if they were cut short.

    A cut row has fewer fields than the row beside it, or ends within a number without the end of a line. A remark in
    words after the last row is left out like a cut row.

    Args:
        path: the file; empty lines and those that begin with # or % are no rows.
        delimiter: between the fields; None for blanks.
        skip: lines before the rows.
        width: number of fields of a row, if names of columns give it.

    Returns:
        The rows; none if the neighbour of a short row is not whole.
    """
    sign = None if delimiter is None else delimiter.encode()
    with open_file(path) as file:
        begin: list[tuple[int, list[bytes]]] = []
        for number in range(1, skip + 1000):
            line = file.readline(_LONGEST)
            if not line or len(begin) == 3:
                break
            if number > skip and (fields := _fields(line, sign)):
                begin.append((number, fields))
        size = file.seek(0, 2)
        file.seek(max(size - _TAIL, 0))
        end = file.read().splitlines(keepends=True)[-20:]
    if len(begin) < 3:
        return CutRows(size)
    width = width or len(begin[1][1])
    first, notes = None, []
    whole = len(begin[1][1]) == len(begin[2][1]) == width
    if whole and width - len(begin[0][1]) > 0 and _alike(begin[0][1][::-1], begin[1][1][::-1]):
        first = begin[0][0]
        notes.append(cut_row(path.name, first, "first", len(begin[0][1]), width))
    rows = [(k, fields) for k, line in enumerate(end) if (fields := _fields(line, sign))]
    if len(rows) < 2 or len(rows[-2][1]) != width:
        return CutRows(size, first, None, tuple(notes))
    k, fields = rows[-1]
    remark = len(fields) < width and not any(map(_is_number, fields)) and any(map(_is_number, rows[-2][1]))
    if not remark and not _alike(fields, rows[-2][1]):
        return CutRows(size, first, None, tuple(notes))
    whole = end[k].endswith((b"\n", b"\r")) or not _is_number(rows[-2][1][-1]) or _is_number(fields[-1])
    if len(fields) > width or (len(fields) == width and whole):
        return CutRows(size, first, None, tuple(notes))
    kept = size - sum(map(len, end[k:]))
    last = _lines(path, kept) + 1
    said = f"{path.name}, line {last}: the last line is no row of numbers and is left out."
    notes.append(said if remark else cut_row(path.name, last, "last", len(fields), width))
    return CutRows(kept, first, last, tuple(notes))


def _fields(line: bytes, sign: bytes | None) -> list[bytes]:
    """Return the fields of a row; none for an empty line, a comment, or one with quotation marks."""
    plain = line.strip()
    return [] if not plain or plain[:1] in (b"#", b"%") or b'"' in plain else plain.split(sign)


def _alike(some: list[bytes], row: list[bytes]) -> bool:
    """Return whether fields are numbers where those of a whole row are; of the last one, a part may be left."""
    *whole, part = some
    alike = all(_is_number(one) == _is_number(other) for one, other in zip(whole, row, strict=False))
    return alike and _PART.fullmatch(part) is not None


def _is_number(field: bytes) -> bool:
    try:
        float(field.replace(b",", b"."))
    except ValueError:
        return False
    return True


def _lines(path: Path, end: int) -> int:
    """Return the number of lines within the first bytes of a file."""
    count = 0
    with open_file(path) as file:
        while end > 0 and (block := file.read(min(end, 1 << 20))):
            count, end = count + block.count(b"\n"), end - len(block)
    return count
