"""What is said of the numbers of three channels as such: whole findings, with the numbers written down here."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.analyses.inspection.stream_findings import Finding, channel_findings, doubt, wrong
from sinssim.data import Array
from sinssim.units import DEG, G0

_COUNT = 400


def _steps(quantum: float, rms: float, seed: int) -> Array:
    """Return noise in steps of a resolution."""
    return np.asarray(quantum * np.rint(np.random.default_rng(seed).normal(0.0, rms, _COUNT)))


def _channels() -> Array:
    """Return three channels with resolutions of 0.03, 0.04 and 0.05 °/s."""
    return np.column_stack([DEG * _steps(q, rms, k) for k, (q, rms) in enumerate(((0.03, 5), (0.04, 6), (0.05, 7)))])


def _others(values: Array, subject: str = "gyros", unit: str = "°/s", scale: float = DEG) -> list[Finding]:
    """Return the findings beside the resolution."""
    return [f for f in channel_findings(subject, values, unit, scale) if not f.text.startswith("Resolution")]


def test_the_resolution_is_the_least_step() -> None:
    (found,) = channel_findings("gyros", _channels(), "°/s", DEG)
    assert (found.subject, found.grade, found.fix) == ("gyros", "fact", "")
    assert found.text == "Resolution of x, y, z: 0.03, 0.04, 0.05 °/s."
    assert list(found.numbers) == ["resolution_si"]
    assert found.numbers["resolution_si"] == pytest.approx([0.03 * DEG, 0.04 * DEG, 0.05 * DEG], rel=1e-9)
    fine = np.random.default_rng(1).normal(size=(_COUNT, 3))
    assert channel_findings("gyros", np.column_stack([_channels()[:, :2], fine[:, 2]]), "°/s", DEG) == []


def test_rows_without_numbers() -> None:
    values = _channels()
    values[[7, 8, 30], [1, 2, 0]] = np.nan, np.inf, -np.inf
    assert channel_findings("gyros", values, "°/s", DEG)[0] == wrong(
        "gyros",
        "3 rows of the gyros have missing or infinite numbers, first row 8.",
        "Remove these rows or repair them.",
        rows=3,
    )


def test_a_channel_that_never_changes() -> None:
    values = _channels() / DEG * G0
    values[:, 1] = -0.75 * G0
    assert _others(values, "accelerometers", "g", G0) == [
        wrong(
            "accelerometers",
            "The y channel of the accelerometers never changes (-0.75 g).",
            "The column is wrong, or the sensor is dead.",
        )
    ]


@pytest.mark.parametrize(("length", "found"), [(25, True), (20, True), (19, False)])
def test_a_frozen_channel(length: int, found: bool) -> None:
    """20 equal numbers of a noise of five steps are no chance."""
    values = _channels()
    values[100 : 100 + length, 0] = 0.09 * DEG
    values[[99, 100 + length], 0] = 0.12 * DEG
    frozen = doubt(
        "gyros",
        f"The x channel of the gyros gives the same number {length} times in a row, from row 101.",
        "The sensor or the logger froze there: treat it as a gap.",
        channel="x",
        frozen=length,
    )
    assert _others(values) == [frozen] * found


def test_a_logger_that_freezes_is_told_once() -> None:
    values = _channels()
    values[100:125] = 0.09 * DEG
    values[[99, 125]] = 0.12 * DEG
    (frozen,) = _others(values)
    assert frozen.text == "The channels of the gyros give the same numbers 25 times in a row, from row 101."


@pytest.mark.parametrize(("sign", "word"), [(1.0, "largest"), (-1.0, "least")])
def test_a_channel_at_the_end_of_its_range(sign: float, word: str) -> None:
    """Four samples in a row and a fifth one alone are at the extreme, far beyond the noise of 0.35 °/s."""
    values = _channels()
    values[[60, 210, 211, 212, 213], 2] = sign * 12.5 * DEG
    assert _others(values) == [
        doubt(
            "gyros",
            f"The z channel of the gyros stays at its {word} value, {sign * 12.5:g} °/s, for 4 samples from row 211; 5 "
            "samples have this value.",
            "The sensor is saturated there; its range is too small, or the value marks missing samples.",
            channel="z",
            saturated=5,
        )
    ]
    values[[210, 213], 2] = 0.0  # two in a row may be a peak
    assert _others(values) == []
