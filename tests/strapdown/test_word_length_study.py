"""The study of the computer's errors as a user runs it: the closed forms of rounding and cutting off are met."""

from __future__ import annotations

import csv
import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.rotation.quaternions import multiply_k
from tests.slow import slow

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def study(folder: Path, monkeypatch: pytest.MonkeyPatch, *options: str) -> dict[str, list[dict[str, str]]]:
    """Run the study and return its tables."""
    monkeypatch.setattr(sys, "argv", ["word_length.py", "-o", str(folder), *options])
    monkeypatch.syspath_prepend(str(SCENARIOS))
    runpy.run_path(str(SCENARIOS / "word_length.py"), run_name="__main__")
    tables = {}
    for name in ("errors", "single_precision", "words"):
        with (folder / f"{name}.csv").open(encoding="utf-8") as file:
            tables[name] = list(csv.DictReader(file))
    return tables


def check(tables: dict[str, list[dict[str, str]]]) -> None:
    """Random walks within 4 standard errors of the closed forms, drifts within 4 of those of their first minute."""
    seconds = float(tables["errors"][0]["time_s"])
    for row in tables["errors"]:
        axes, steps = (2 if row["variable"] in ("velocity", "position") else 3), 60.0 * float(row["rate_hz"])
        # changes from step to step exceed δ from 36 bits on for the position, from 24 bits on for the others; a matrix
        # whose defect is below 1e-9 is not made orthogonal before its quaternion is taken, which shows at 40 bits
        least, most = (36 if row["variable"] == "position" else 24), (36 if row["variable"] == "poisson" else 40)
        if not least <= int(row["bits"]) <= most:
            continue
        apart = float(row["walk"]) / float(row["walk_theory"]) - 1.0
        assert abs(apart) < 4.0 / np.sqrt(2.0 * axes * seconds), row
        # a mean error of δ/2 with a spread of δ/√12, over the steps of a minute; the angles of vibration besides
        assert float(row["drift_apart"]) < float(row["drift_theory"]) * (4.0 / np.sqrt(3.0 * steps) + 0.01), row
        assert float(row["position_m"]) < 4.0 * float(row["position_sigma_m"]), row
        assert float(row["cut_position_m"]) < 1.1 * float(row["cut_position_at_most_m"]), row
    for row in tables["single_precision"]:
        if theory := row["walk_theory_deg_sqrt_h"]:
            assert float(row["walk_deg_sqrt_h"]) == pytest.approx(float(theory), rel=0.1)
        assert float(row["drift_deg_h"]) < 1.0


# six kernels, each of which takes seconds to compile, two of them for an algorithm
@pytest.mark.parametrize("algorithms", slow((("quaternion",),), (("quaternion", "poisson", "euler"),)))
def test_quick_study(
    algorithms: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(str(SCENARIOS))
    from support import word_errors

    for name in word_errors.ALGORITHMS.keys() - algorithms:
        monkeypatch.delitem(word_errors.ALGORITHMS, name)
        monkeypatch.delitem(word_errors.FACTORS, name)
    # drawing takes a third of the time
    monkeypatch.setattr("sinssim.recording.figures.save", lambda figure, path: None)
    tables = study(tmp_path, monkeypatch, "--quick")
    check(tables)
    # 1 % of 2161 m by hand: 0.0024 deg/√h at 24 bits cause 523 m, and 2⁵ times less is 16 m
    by_grade = {(row["grade"], row["rate_hz"], row["words"]): row for row in tables["words"]}
    assert by_grade["laser-standard", "100.0", "rounded"]["quaternion"] == "29"
    assert by_grade["laser-standard", "400.0", "rounded"]["quaternion"] == "30"  # √4: one bit more
    assert "arcsec rms" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.rendered
def test_whole_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tables = study(tmp_path, monkeypatch)
    check(tables)
    for suffix in ("png", "svg"):
        assert (tmp_path / f"word_length.{suffix}").stat().st_size > 10_000


def test_single_precision_is_that_of_the_hardware(monkeypatch: pytest.MonkeyPatch) -> None:
    # NumPy computes products and sums of float32 in float32
    monkeypatch.syspath_prepend(str(SCENARIOS))
    from support.words import single

    a, b = np.random.default_rng(1).standard_normal((2, 1000, 4)).astype(np.float32)
    (a0, a1, a2, a3), (b0, b1, b2, b3) = a.T, b.T
    expected: Any = (
        a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3, a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2,
        a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1, a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0,
    )  # fmt: skip
    found = [single(multiply_k)(*map(float, p), *map(float, q)) for p, q in zip(a, b, strict=True)]
    assert np.array_equal(np.array(found), np.stack(expected, axis=1).astype(float))
    assert not np.array_equal(
        np.array([multiply_k(*map(float, p), *map(float, q)) for p, q in zip(a, b, strict=True)]), found
    )
