"""A diagnosis shows what it tries."""

from __future__ import annotations

import pytest

import sinssim
from tests.scenario.test_unknown_gravity import parked

LOUD = parked(
    imu={"grade": "laser-navigation", "rate_hz": 2.0},
    parked={"latitude_deg": 46.5, "longitude_deg": 7.5, "heading_deg": 40.0, "duration_s": 130.0},
    filter={"alignment_s": 30.0, "measurement_noise_factor": 0.2, "diagnose": True},
)
"""A filter that assumes a fifth of the noise of its readings."""


def searched() -> tuple[list[tuple[str, float]], dict]:
    told: list[tuple[str, float]] = []
    result = sinssim.run(LOUD, progress=lambda text, fraction: told.append((text, fraction)))
    work = [(text, part) for text, part in told if text.startswith("filter: ")]
    return work, result.summary["filter"]["diagnosis"]


def test_a_search_shows_its_work() -> None:
    work, whole = searched()
    texts, parts = zip(*work, strict=True)
    assert texts[:3] == ("filter: the filter itself", "filter: all errors at once", "filter: explanations")
    assert {"filter: σ of zero-velocity", "filter: inertial noise", "filter: done"} <= set(texts)
    assert list(parts) == sorted(parts)
    assert parts[-1] == 1.0
    assert whole["cause"] == "zero-velocity"
    assert whole["sensors"]["zero-velocity"]["sigma_factor"] == pytest.approx(5.0, rel=0.15)  # 300 numbers: σ 4.1 %
    assert 3 <= whole["runs"] <= 14
    assert 0.0 < whole["seconds"] < 600.0
    assert f"The search took {whole['runs']} runs" in whole["what_to_try"][-1]
