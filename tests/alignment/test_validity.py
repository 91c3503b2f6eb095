"""Second-order terms against draws through eq. (1), and the study as a whole."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

from sinssim.alignment import Attitude, InstrumentErrors, error_statistics, ideal_readings
from sinssim.alignment.determination import solve
from sinssim.alignment.validity import second_order
from sinssim.earth_models import OMEGA_IE
from sinssim.units import DEG_H, UG

STUDY = Path(__file__).parents[2] / "scenarios" / "ground_study.py"


@pytest.mark.parametrize("latitude", [50.0, 80.0])
def test_the_mean_of_the_latitude_shifts_as_the_second_order_says(latitude):
    sigmas = InstrumentErrors(gyro_bias=0.3 * DEG_H, accel_bias=500 * UG)
    attitude, phi, draws = Attitude(0.4, 0.1, 0.3), np.radians(latitude), 1_000_000
    rng = np.random.default_rng(1)
    drawn = InstrumentErrors(*(np.asarray(s) * rng.standard_normal((draws, 3)) for s in vars(sigmas).values()))
    found, _, _ = solve(*drawn.apply(*ideal_readings(*attitude, phi)))
    theory = second_order(attitude, phi, sigmas)
    sigma = error_statistics(attitude, phi, None, sigmas).sigma
    assert (found.latitude - phi).mean() / sigma.latitude == pytest.approx(
        theory.mean.latitude, abs=4 / np.sqrt(draws) + 2 * theory.spread.latitude**3
    )
    assert not theory.linear(draws)


def test_second_order_of_the_heading_of_a_level_vehicle_in_closed_form():
    """K = atan(ω_E'/ω_N'): with errors e, n of the horizontal rates over U cosφ, ΔK = -e + e n + ..."""
    sigmas = InstrumentErrors(gyro_bias=0.01 * DEG_H)
    theory = second_order(Attitude(0.7, 0.0, 0.0), np.radians(50.0), sigmas)
    epsilon = 0.01 * DEG_H / (OMEGA_IE * np.cos(np.radians(50.0)))
    assert theory.spread.heading == pytest.approx(epsilon, rel=1e-5)  # σ(e n)/σ(e)
    assert theory.mean.heading == pytest.approx(0.0, abs=1e-8)


def test_where_it_is_linear():
    laser = InstrumentErrors(0.01 * DEG_H, 1e-5, 50 * UG, 5e-5)
    latitude = np.radians([0.0, 50.0, 89.9])
    np.testing.assert_array_equal(
        second_order(Attitude(0.7, 0.0, 0.0), latitude, laser).linear(1_000_000), [True, True, False]
    )


def test_the_ground_study_runs_and_agrees_where_it_is_linear(tmp_path, monkeypatch, capsys):
    arguments = ["-o", str(tmp_path), "--draws", "20000", "--runs", "60", "--swaying", "4"]
    monkeypatch.setattr(sys, "argv", ["ground_study.py", *arguments])
    runpy.run_path(str(STUDY), run_name="__main__")
    summary = json.loads((tmp_path / "summary.json").read_text())
    scores = [row["largest_score"] for row in summary["monte_carlo"] if row["linear"]]
    assert len(scores) > 8
    assert max(scores) < 4.5  # of more than a hundred
    assert summary["disturbed_base"]["ratio_to_quiet_base"] < 2.5
    for name in ("heading_map", "budget", "session_length", "validity_latitude", "validity_pitch", "disturbed_base"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
        assert (tmp_path / f"{name}.svg").stat().st_size > 10_000
    assert (tmp_path / "recording.rrd").stat().st_size > 10_000
