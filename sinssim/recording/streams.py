"""The vocabulary of streams: a table over time whose columns carry their units, written in blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

from sinssim.data import Array

BLOCK = 16384
"""Rows that are written together, so that no copy is as long as a run."""


class Rows(Protocol):
    """Rows of a vector: an array, or an object that computes any block of them."""

    def __getitem__(self, rows: slice, /) -> Array: ...


class Computed:
    """Rows of a vector that are computed when they are written.

    Args:
        rows: returns a block of them, (R, k).
    """

    def __init__(self, rows: Callable[[slice], Array]) -> None:
        self._rows = rows

    def __getitem__(self, rows: slice, /) -> Array:
        return self._rows(rows)


@dataclass(frozen=True)
class Vector:
    """A group of related columns of a stream.

    Attributes:
        name: short name.
        columns: name of each column, ending in its unit.
        values: (N, len(columns)).
    """

    name: str
    columns: tuple[str, ...]
    values: Rows


@dataclass(frozen=True)
class Stream:
    """A table over time: one Parquet file, and one entity per vector in the recording.

    Attributes:
        name: name of the file and of the entities' parent.
        time: (N,) s.
        vectors: the columns.
    """

    name: str
    time: Array
    vectors: tuple[Vector, ...]


def blocks(count: int) -> Iterator[slice]:
    """Yield rows in blocks, as they are written; of no rows one empty block."""
    for start in range(0, max(count, 1), BLOCK):
        yield slice(start, min(start + BLOCK, count))
