"""The ground study: second-order terms against draws through eq. (1), and the study as a whole."""

from __future__ import annotations

import importlib
import json
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

from sinssim.alignment import Attitude, InstrumentErrors, error_statistics, ideal_readings
from sinssim.alignment.determination import solve
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.units import DEG_H, UG
from tests.slow import slow

STUDY = Path(__file__).parents[3] / "scenarios" / "ground_study.py"


@pytest.fixture(autouse=True)
def beside_the_script(monkeypatch):
    """Import the parts of the study as the script does, from its own folder."""
    monkeypatch.syspath_prepend(str(STUDY.parent))


def second_order(*arguments):
    """Return the second-order terms of eq. (1)."""
    return importlib.import_module("support.second_order").second_order(*arguments)


@pytest.mark.parametrize("latitude", [80.0, *slow(50.0)])
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


def study(folder, monkeypatch, **options):
    """Run the study as a user does and return its summary."""
    arguments = [text for name, value in options.items() for text in (f"--{name}", str(value))]
    monkeypatch.setattr(sys, "argv", ["ground_study.py", "-o", str(folder), *arguments])
    runpy.run_path(str(STUDY), run_name="__main__")
    return json.loads((folder / "summary.json").read_text())


def check_scores(summary, cases):
    """Means and standard deviations lie within four standard errors wherever the theory is called linear."""
    rows = [row for row in summary["monte_carlo"] if row["linear"]]
    assert len(rows) >= cases
    assert max(row["largest_score"] for row in rows) < 4.0
    assert {"laser-navigation", "laser-standard"} <= {row["grade"] for row in rows}


@pytest.mark.slow
def test_the_ground_study_agrees_where_it_is_linear(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sinssim.recording.figures.save", lambda figure, path: None)  # drawing takes most of the time
    fine = np.geomspace
    monkeypatch.setattr(np, "geomspace", lambda low, high, n: fine(low, high, n // 3))  # maps of a tenth of the points
    summary = study(tmp_path, monkeypatch, draws=20_000, runs=60, swaying=2)
    check_scores(summary, 9)
    assert (tmp_path / "recording.rrd").stat().st_size > 10_000
    assert "| laser-standard | level, 50° | yes | 3.562 |" in (tmp_path / "summary.md").read_text()


@pytest.mark.slow
@pytest.mark.rendered
def test_the_whole_ground_study(tmp_path, monkeypatch, capsys):
    summary = study(tmp_path, monkeypatch)  # a million draws, 3000 sessions, 200 on a swaying base
    check_scores(summary, 7)  # fewer: a million draws show smaller departures
    assert not all(row["linear"] for row in summary["monte_carlo"])
    for row in summary["end_to_end"]:
        for name, theory in row["sigma_theory_arcmin"].items():
            assert row["sigma_found_arcmin"][name] == pytest.approx(theory, rel=4 / np.sqrt(2 * 3000))
        assert row["heading_from_bias_found_arcmin"] == pytest.approx(row["heading_from_bias_theory_arcmin"], rel=0.05)
    level = summary["end_to_end"][0]
    assert level["heading_from_bias_theory_arcmin"] == pytest.approx(3.6, abs=0.05)
    assert summary["disturbed_base"]["ratio_to_quiet_base"] < 2.0
    for name in ("heading_map", "budget", "session_length", "validity_latitude", "validity_pitch", "disturbed_base"):
        for suffix in ("png", "svg"):
            assert (tmp_path / f"{name}.{suffix}").stat().st_size > 10_000
