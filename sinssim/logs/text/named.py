"""Tables whose columns are named with their units, as text or Parquet: quantities by the dictionary of names, in SI."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.logs.text.columns import Table
from sinssim.logs.text.names import SPELLED, meaning_of, usual_name
from sinssim.logs.text.rows import COMMENTS, split
from sinssim.system.user_file import open_file, user_file

_PARQUET = b"PAR1"
_QUATERNION = ("q_w", "q_x", "q_y", "q_z")
_ANGLES = ("roll", "pitch", "heading")


class _Layout(NamedTuple):
    delimiter: str
    skip_lines: int = 0
    numbered: bool = False
    decimal: str = "."
    rows: dict[str, str] | None = None


def names_of(path: Path, head: bytes) -> tuple[str, list[str]]:
    """Return the delimiter and the names of the columns of a table.

    Args:
        head: its first bytes.

    Returns:
        The delimiter, "" for Parquet; no names if the file is no table.
    """
    if head.startswith(_PARQUET):
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            return "", list(pq.read_schema(user_file(path)).names)
        except (OSError, pa.ArrowException) as error:
            raise InputError(f"{path} cannot be read as Parquet: {error}.") from error
    lines = head.decode("utf-8-sig", "replace").splitlines()
    line = next((line for line in lines if line.strip() and not line.startswith(COMMENTS)), "")
    delimiter = max(",;\t", key=line.count)
    return delimiter, split(line, delimiter) if line else []


class NamedTable:
    """A table with named columns.

    Args:
        path: the file.
        plain: names of further columns that are read, beside those of the dictionary.

    Raises:
        InputError: it cannot be read, has no names, or two columns of one name.

    Attributes:
        names: of all columns.
        used: those that were asked for.
        notes: a sentence on each row that was cut short and is left out.
    """

    def __init__(self, path: Path, plain: Sequence[str] = ()) -> None:
        with open_file(path) as file:
            delimiter, self.names = names_of(path, file.read(1 << 16))
        if not self.names:
            raise InputError(f"{path} is empty.")
        if doubled := [name for name in self.names if self.names.count(name) > 1]:
            raise InputError(f"{path}: the column {shortened(doubled[0])!r} appears twice.")
        wanted = [name for name in self.names if name in plain or meaning_of(name) is not None]
        kind = ".csv" if delimiter else ".parquet"
        self.path, self.used = path, set[str]()
        self.table = Table(path, _Layout(delimiter or ","), wanted, kind, comments=True)
        self.notes = self.table.notes

    @property
    def listed(self) -> str:
        """The names, for a message."""
        return shortened(", ".join(self.names), 300)

    @property
    def unused(self) -> list[str]:
        """Names of columns that were not asked for."""
        return [name for name in self.names if name not in self.used]

    def find(self, quantity: str) -> list[tuple[str, str]]:
        """Return name and unit of the columns of a quantity, "" for a name without a unit."""
        found = ((name, meaning_of(name)) for name in self.names)
        return [(name, meaning[1]) for name, meaning in found if meaning is not None and meaning[0] == quantity]

    def numbers(self, name: str) -> Array:
        """Return a column as it is, NaN for empty fields, (N,)."""
        self.used.add(name)
        return self.table.column(name, gaps=True)

    def column(self, quantity: str) -> Array | None:
        """Return the first column of a quantity, SI, (N,); None without one."""
        named = next(iter(self.find(quantity)), None)
        if named is None:
            return None
        values, size = self.numbers(named[0]), SPELLED.get(named[1], 1.0)
        return values if size == 1.0 else values * size

    def complete(self, quantities: Sequence[str]) -> bool:
        """Return whether the columns of several quantities are there.

        Raises:
            InputError: only some of them are there.
        """
        there = [quantity for quantity in quantities if self.find(quantity)]
        missing = [usual_name(quantity) for quantity in quantities if quantity not in there]
        if there and missing:
            given = " and ".join(self.find(quantity)[0][0] for quantity in there)
            raise InputError(f"{self.path} has {given} but not {' and '.join(missing)}: give all of them, or none.")
        return bool(there)

    def vector(self, quantities: Sequence[str]) -> Array | None:
        """Return the columns of several quantities side by side, SI, (N, k); None if none is there."""
        if not self.complete(quantities):
            return None
        return np.column_stack([column for q in quantities if (column := self.column(q)) is not None])

    def quaternion(self) -> Array | None:
        """Return the columns of a quaternion, scalar first, (N, 4); None without them."""
        return self.vector(_QUATERNION)

    def attitude(self) -> Array | None:
        """Return q_nb of the columns of roll, pitch and heading, (N, 4); None without them."""
        angles = self.vector(_ANGLES)
        return None if angles is None else rotation.quaternion_from_euler(*angles.T)
