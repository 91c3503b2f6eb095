"""Attitude at hundreds of degrees per second, against the series of a step; the shipped study decides every claim."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sinssim.experiments.studies import study_schema
from sinssim.experiments.studies.algorithm_comparison import compare
from sinssim.experiments.studies.study_schema import Study
from sinssim.experiments.study import load_study

pytestmark = pytest.mark.usefixtures("hardly_counted")

VERDICTS = {
    "velocity-rate": "confirmed", "attitude-rate": "partly", "cheapest": "confirmed",
    "trigonometric-matrix": "confirmed", "orthogonality": "partly", "euler-heading": "confirmed",
    "euler-limit": "refuted", "simplified-radii": "partly", "latitude-rate": "confirmed",
    "accelerometer-term": "confirmed", "gyro-term": "confirmed", "computer-errors": "confirmed", "gyro-free": "partly",
    "gravity-series": "confirmed",
}  # fmt: skip
"""Of the study chapter_claims."""

TABLE = {
    "type": "rotation-table", "latitude_deg": 50.0,
    "steps": [{"type": "turn", "axis": [1.0, 0.0, 0.0], "angle_deg": 3600.0, "rate_deg_s": 300.0}],
}  # fmt: skip


def test_low_order_on_a_table_at_300_deg_s():
    """(8.19) takes a step of the second order: it turns by φ³/24 too much. Over the motion that is h²/24 ∫ω³ dt.

    The next term, −φ⁵/320, is 0.075 φ² of this one: at 3° a step 2e-4.
    """
    part = {"title": "p", "algorithms": ("two-quaternions", "rotation-vector-2"), "rates_hz": (100.0, 200.0),
            "motions": ({"name": "table", "motion": TABLE},)}  # fmt: skip
    found = compare(Study.model_validate({"name": "s", "parts": (part,)}))
    trajectory = study_schema.trajectory_of(found.study.parts[0].motions[0])
    time = np.linspace(trajectory.start, trajectory.end, 100_001)
    omega = np.linalg.norm(trajectory.rates(time)[0], axis=1)
    for row in found.rows:
        expected = math.degrees(np.trapezoid(omega**3, time) / (24.0 * row.rate_hz**2)) * 3600.0
        if row.algorithm == "two-quaternions":
            assert row.final_attitude_error_arcsec == pytest.approx(expected, rel=2e-3)
        else:
            assert row.max_attitude_error_arcsec < 1e-3
    assert expected == pytest.approx(358.0, abs=1.0)  # arcsec at 200 Hz


@pytest.mark.slow
def test_the_shipped_study_decides_every_claim():
    """The verdicts, and the tables in docs/comparing.md."""
    found = {verdict.claim: verdict for verdict in compare(load_study("chapter_claims")).verdicts}
    assert {claim: verdict.verdict for claim, verdict in found.items()} == VERDICTS
    rates = found["attitude-rate"]
    assert rates.judged == ("refuted", "refuted", "confirmed", "partly", "partly")
    motion = ("airliner", "turbulence", "vibration", "fast roll", "table, 300 deg/s")
    assert [rates.numbers[f"{name}: high order, Hz"] for name in motion] == [10.0, 10.0, 80.0, 20.0, 20.0]
    causal = [rates.numbers[f"{name}: high order without later samples, Hz"] for name in motion]
    assert causal == [10.0, 10.0, 80.0, 40.0, 20.0]
    assert [rates.numbers.get(f"{name}: low order, Hz") for name in motion] == [10.0, 40.0, 400.0, None, None]
    assert found["velocity-rate"].numbers["20 Hz, part of the sensors' error"] == pytest.approx(0.053, abs=0.001)
    # M = a(1−e²) at the equator to 6384 km at 45°: 1100 km/h is 9.90 to 9.95 deg/h
    assert 9.85 < found["latitude-rate"].numbers["latitude rate, deg/h"] < 9.96
    power = found["gyro-free"].numbers
    first = "parked for five hours, accelerometers-40-pg, arms of 1m, power of time"
    assert power[f"{first} below 1000 s"] == pytest.approx(4.0, abs=0.1)
    assert power[f"{first} beyond a Schuler period"] == pytest.approx(2.0, abs=0.2)
