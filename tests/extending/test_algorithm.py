"""The page that adds an attitude algorithm: its code is run, its error is that of theory, its files are counted."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.extending.pages import Copy, read_page

STEP = """
from sinssim.strapdown.attitude.cayley import cayley_k
print(*cayley_k.py_func(0.0, 0.2, 0.0))
"""


@pytest.mark.slow
def test_page(tmp_path: Path) -> None:
    page = read_page("algorithm")
    copy = Copy(tmp_path)
    copy.apply(page)
    assert copy.touched == ["sinssim/strapdown/attitude/__init__.py", "sinssim/strapdown/attitude/cayley.py"]
    lines = copy.run(page.snippets[0] + STEP).splitlines()
    errors = []
    for line, frame in zip(lines[:2], ("level", "wander"), strict=True):
        name, error, defect = line.split()
        assert name == frame
        assert float(defect) < 1e-13  # it keeps the norm
        errors.append(float(error))
    assert 1e-7 < errors[0] < 1e-3  # the quaternion's exact step has none of it
    assert errors[1] == pytest.approx(errors[0], rel=1e-3)
    # the step itself turns by 4 atan(φ/4) = φ − φ³/48 + φ⁵/1280
    import math

    q = list(map(float, lines[2].split()))
    assert math.hypot(*q) == pytest.approx(1.0, abs=1e-15)
    assert 2.0 * math.atan2(q[2], q[0]) == pytest.approx(0.2 - 0.2**3 / 48.0 + 0.2**5 / 1280.0, abs=1e-8)
    assert "cayley" in copy.command("list", "algorithms")
