"""Writes columns as text, every double with the digits that give it back."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array


def write_columns(
    path: Path,
    columns: Sequence[NDArray[Any] | Sequence[str]],
    *,
    header: str = "",
    delimiter: str = " ",
) -> None:
    """Write columns of numbers or words.

    Args:
        columns: (N,) each.
        header: lines above, each with its end of line.

    Raises:
        OSError: the file cannot be written.
    """
    import pyarrow as pa
    from pyarrow import csv

    names = [str(i) for i in range(len(columns))]
    table = pa.table({name: pa.array(np.ascontiguousarray(c) if isinstance(c, np.ndarray) else c)
                      for name, c in zip(names, columns, strict=True)})  # fmt: skip
    with path.open("wb") as file:
        file.write(header.encode())
        options = csv.WriteOptions(include_header=False, delimiter=delimiter, quoting_style="none")
        csv.write_csv(table, file, options)


def rounded(time: Array, digits: int = 9) -> Array:
    """Return times without the last digits, which sums of times leave: 345618.01, not 345618.00999999995.

    Args:
        time: (N,) s.

    Returns:
        (N,) s.
    """
    return np.round(time, digits)


def columns_of(*parts: Array) -> list[Array]:
    """Return columns of arrays.

    Args:
        parts: (N,) or (N, k) each.

    Returns:
        (N,) each.
    """
    return [column for part in parts for column in (part[:, np.newaxis] if part.ndim == 1 else part).T]
