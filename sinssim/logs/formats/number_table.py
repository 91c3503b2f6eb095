"""Reads text files of numbers in columns quickly: blocks of bytes, parsed by pyarrow; a bad row is named."""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.logs.text.cut_rows import cut_rows
from sinssim.system.memory import machine_memory
from sinssim.system.user_file import open_file

_BLOCK = 1 << 20  # bytes of text at once
_COMMENT_LINE = re.compile(rb"(?m)^[ \t]*[#%][^\n]*\n?")


def head_numbers(head: bytes, delimiter: str | None = None, rows: int = 5) -> Array | None:
    """Return the first rows of a text file of numbers, for recognising its format.

    Args:
        head: the first bytes of the file.
        delimiter: between the numbers; None for blanks and tabs.
        rows: number of rows wanted; a row that the head cuts off is left out.

    Returns:
        (R, k) with R ≤ rows, or None if the rows are not numbers of the same count.
    """
    if b"\0" in head:
        return None
    lines = head.splitlines()
    if len(head) >= 4096 and lines:
        lines = lines[:-1]
    found: list[list[float]] = []
    for line in lines:
        if not line.strip() or line.lstrip()[:1] in (b"#", b"%"):
            continue
        try:
            found.append([float(field) for field in line.split(delimiter.encode() if delimiter else None)])
        except ValueError:
            return None
        if len(found) == rows:
            break
    if len(found) > 2 and len(found[0]) < len(found[1]):  # cut short
        del found[0]
    if not found or any(len(row) != len(found[0]) for row in found):
        return None
    return np.array(found)


def read_numbers(
    path: Path, widths: Collection[int], notes: list[str], *, delimiter: str | None = None, skip: int = 0
) -> Array:
    """Read a text file of numbers.

    Lines that are empty or begin with # or % are left out, and so are a first and a last row that were cut short.

    Args:
        path: the file.
        widths: numbers of columns that it may have.
        notes: a sentence on each row that was cut short is added.
        delimiter: between the columns; None for blanks and tabs.
        skip: lines at the beginning that are left out, for example names of columns.

    Returns:
        (N, k) with k in `widths` and N ≥ 1; "nan" and empty fields are NaN.

    Raises:
        InputError: it cannot be read, does not fit into memory, has no rows, or a row with other columns or anything
            but numbers.
    """
    try:
        if 5 * path.stat().st_size > machine_memory():
            raise InputError(f"{path} does not fit into this machine's memory. Split it into parts.")
        parts: list[list[Array]] = []
        cut = cut_rows(path, delimiter, skip)
        notes += cut.notes
        with open_file(path) as file:
            for _ in range(cut.first or skip):
                file.readline()
            rest = b""
            while block := file.read(min(_BLOCK, cut.end - file.tell())):
                text, newline, rest_of_block = block.rpartition(b"\n")
                if not newline:
                    rest += block
                    if len(rest) > 16 * _BLOCK:
                        raise InputError(f"{path}: a line has over {len(rest)} bytes; this is not text in columns.")
                    continue
                part = _parse(rest + text + newline, delimiter)
                rest = rest_of_block
                if part is not None:
                    parts.append(part)
            if (part := _parse(rest, delimiter)) is not None:
                parts.append(part)
        if len({len(part) for part in parts}) > 1:
            raise ValueError("rows of different length")
        if parts and len(parts[0]) not in widths:
            raise ValueError("unexpected number of columns")
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
    except InputError:
        raise
    except Exception as error:  # pyarrow raises various errors for a row that is not as the others
        raise _bad_row(path, widths, delimiter, skip, error) from error
    if not parts:
        raise InputError(f"{path} holds no rows of numbers.")
    found = np.empty((len(parts[0]), sum(len(part[0]) for part in parts)))  # columns are contiguous
    for i, column in enumerate(found):
        np.concatenate([part[i] for part in parts], out=column)
    return found.T


def _parse(text: bytes, delimiter: str | None) -> list[Array] | None:
    """Return the columns of some whole lines; None if all of them are empty."""
    import pyarrow as pa
    from pyarrow import csv

    if b"\0" in text:
        raise ValueError("zero bytes")
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"#" in text or b"%" in text:
        text = _COMMENT_LINE.sub(b"", text)
    if delimiter is None:
        text = text.replace(b"\t", b" ")
        while b"  " in text:
            text = text.replace(b"  ", b" ")
    if b" \n" in text:
        text = text.replace(b" \n", b"\n")
    text = text.replace(b"\n ", b"\n").strip()
    if not text:
        return None
    sign = (delimiter or " ").encode()
    width = text.partition(b"\n")[0].count(sign) + 1
    names = [str(i) for i in range(width)]
    table: Any = csv.read_csv(
        pa.py_buffer(text),
        read_options=csv.ReadOptions(column_names=names, use_threads=False, block_size=len(text) + 1),
        parse_options=csv.ParseOptions(delimiter=delimiter or " ", quote_char=False),
        convert_options=csv.ConvertOptions(
            column_types=dict.fromkeys(names, pa.float64()), null_values=["", "nan", "NaN", "NAN", "-nan"]
        ),
    )
    return [column.to_numpy() for column in table.columns]


def _bad_row(path: Path, widths: Collection[int], delimiter: str | None, skip: int, error: Exception) -> InputError:
    """Return the error that names the first row which is not as the others."""
    wanted = " or ".join(str(width) for width in sorted(widths))
    between = f"separated by {delimiter!r}" if delimiter else "separated by blanks"
    first = 0
    with open_file(path) as file:
        for number, line in enumerate(file, start=1):
            plain = line.strip()
            if number <= skip or not plain or plain[:1] in (b"#", b"%"):
                continue
            if b"\0" in line:
                return InputError(f"{path}, line {number}: this is not text, it has zero bytes.")
            fields = plain.split(delimiter.encode() if delimiter else None)
            if len(fields) not in widths or (first and len(fields) != first):
                return InputError(
                    f"{path}, line {number}: it has {len(fields)} column{'s' * (len(fields) != 1)}; "
                    f"{first or wanted} numbers {between} are needed."
                )
            first = len(fields)
            for field in fields:
                try:
                    float(field or b"nan")
                except ValueError:
                    word = shortened(repr(field.decode("latin-1")), 60)
                    return InputError(f"{path}, line {number}: {word} is not a number.")
    reason = "".join(c if c.isprintable() else " " for c in str(error)).strip().rstrip(".")
    return InputError(f"{path} cannot be read as columns of numbers: {reason[:200]}.")


def check_times(path: Path, time: Array, what: str = "time") -> None:
    """Refuse times that are not finite.

    Args:
        path: the file.
        time: (N,) s.
        what: name of the column.

    Raises:
        InputError: a time is missing or not finite; the message names the row.
    """
    bad = ~np.isfinite(time)
    if bad.any():
        raise InputError(f"{path}, row {int(np.argmax(bad)) + 1}: the {what} is missing or not finite.")


def check_finite(path: Path, values: Array, what: str) -> None:
    """Refuse values that are not finite.

    Args:
        path: the file.
        values: (N,) or (N, k).
        what: what they are.

    Raises:
        InputError: a value is missing or not finite; the message names the row.
    """
    fine = np.isfinite(values) if values.ndim == 1 else np.isfinite(values).all(axis=1)
    if not fine.all():
        raise InputError(f"{path}, row {int(np.argmin(fine)) + 1}: the {what} is missing or not finite.")
