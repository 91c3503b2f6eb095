"""The sources of what the phases of a mission added, in a run's summary, its tables and its report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import sinssim
from sinssim.exhibits import Sentence, Table
from sinssim.experiments.run.parts.phases import tables
from sinssim.scenario import Scenario


def _mission(**tables: Any) -> Scenario:
    legs = [
        {"type": "stop", "duration_s": 40.0},
        {"type": "straight", "distance_m": 200.0, "speed_mps": 10.0},
        {"type": "stop", "duration_s": 10.0},
    ]
    return Scenario.model_validate(
        {
            "name": "m",
            "drive": {"latitude_deg": 47.0, "longitude_deg": 8.0, "road": "smooth", "legs": legs},
            "imu": {"grade": "laser-navigation", "rate_hz": 20},
            "navigation": {"alignment": {"duration_s": 30.0}},
            **tables,
        }
    )


def test_sources_of_each_phase(tmp_path: Path) -> None:
    run = sinssim.run(_mission(), tmp_path / "run")
    rows = run.summary["phases"]["quaternion"]
    assert [row["phase"] for row in rows] == ["alignment", "standstill", "under way", "standstill"]
    plan = sinssim.budget(run.scenario, times=(30.0,))
    tilt = rows[0]["sources"]["tilt"]
    assert tilt["tilt_sigma_arcsec"] == pytest.approx((plan.sigma()[0, 6:8] ** 2).sum() ** 0.5 * 206264.806, rel=1e-6)
    assert next(iter(tilt["shares"])) == "accel_bias"
    for row in rows:
        for what, found in row["sources"].items():
            if row["phase"] == "alignment" and what == "horizontal":  # the place is known exactly
                assert found == {"horizontal_sigma_m": 0.0, "shares": {}}
                continue
            assert sum(found["shares"].values()) == pytest.approx(1.0, abs=0.1)
    (found,) = (one for one in tables(run.summary["phases"], "console") if "sources" in getattr(one, "title", ""))
    assert isinstance(found, Table)
    assert found.title.startswith("quaternion: ")
    assert found.rows[0][0] == "alignment"
    assert "accel_bias" in str(found.rows[0][3])
    assert "quaternion: sources" in (tmp_path / "run" / "report.html").read_text()


def test_a_run_without_a_budget_says_why(tmp_path: Path) -> None:
    aided = {"aiding": {"land_vehicle": {}}, "filter": {}, "navigation": {}}
    run = sinssim.run(_mission(**aided), tmp_path / "run")
    found = [one.text for one in tables(run.summary["phases"], "console") if isinstance(one, Sentence)]
    assert any(one.startswith("aided: ") and "[aiding.land_vehicle] has no budget" in one for one in found)
    assert "are unknown (no budget)" in (tmp_path / "run" / "report.html").read_text()
