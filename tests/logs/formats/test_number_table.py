"""Tables of numbers: exact doubles, every kind of blank, and rows that are named when they are wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs import numeric_columns as number_table
from sinssim.logs.numeric_columns import read_numbers


def test_exact_and_in_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    values = rng.standard_normal((3000, 4)) * 10.0 ** rng.integers(-300, 300, (3000, 4))
    lines = [
        ("  " if k % 3 else "\t") + "   ".join(map(repr, row)) + " " * (k % 2) for k, row in enumerate(values.tolist())
    ]
    path = tmp_path / "a.txt"
    path.write_bytes(b"% a comment\n\n" + "\r\n".join(lines).encode())
    monkeypatch.setattr(number_table, "_BLOCK", 1000)
    assert np.array_equal(read_numbers(path, (4,), []), values)


def test_missing_values_and_names(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time,x\n1,2\n2,\n3,nan\n")
    found = read_numbers(path, (2,), [], delimiter=",", skip=1)
    assert np.array_equal(found, [[1, 2], [2, np.nan], [3, np.nan]], equal_nan=True)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"1 2 3\n4 5\n", "line 2: it has 2 fields; 3 separated by blanks"),
        (b"1 2 3\n# comment\n4 x 6\n", r"line 3: 'x' is not a number"),
        (b"1 2\n", "line 1: it has 2 fields; 3 separated by blanks"),
        (b"", "holds no rows"),
        (b"% only a comment\n", "holds no rows"),
        (b"1 2 3\n\0\0\0\0", "zero bytes"),
        (b"\xff\xfe1 2 3\n", "is not a number"),
    ],
)
def test_what_is_wrong(tmp_path: Path, text: bytes, said: str) -> None:
    path = tmp_path / "bad.txt"
    path.write_bytes(text)
    with pytest.raises(InputError, match=said) as caught:
        read_numbers(path, (3,), [])
    assert "bad.txt" in str(caught.value)
