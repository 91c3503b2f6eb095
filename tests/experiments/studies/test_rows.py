"""A row of a study from one navigation, the rate of the level frame, and what stands beside the errors."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.errors import RunError
from sinssim.experiments.studies import study_schema
from sinssim.experiments.studies.algorithm_comparison import _navigated, _Truth
from sinssim.experiments.studies.attitude_claims import _frame_rate
from sinssim.experiments.studies.attitude_cost import AttitudeCost
from sinssim.experiments.studies.step_cost import Cost, Operations
from sinssim.experiments.studies.study_exhibits import StudyMedia
from sinssim.experiments.studies.study_results import Case, StudyResult
from sinssim.experiments.studies.study_schema import Study
from sinssim.strapdown import measured_attitude
from sinssim.units import ARCSEC

PART = {"title": "p", "rates_hz": [10.0], "vertical": "truth",
        "motions": [{"name": "still", "parked": {"latitude_deg": 50.0, "duration_s": 2.0}}]}  # fmt: skip
CASE = Case("p", "still", "rate-gyros", "ideal", "euler", "level", "normal", "exact", 10.0, (), "")


def navigated(monkeypatch: pytest.MonkeyPatch, change: Any) -> Any:
    """Navigate the case with a change of the solution."""
    result = StudyResult(Study.model_validate({"name": "s", "parts": [PART]}), media=StudyMedia())
    part = result.study.parts[0]
    result.costs["euler", "level", ()] = Cost("euler", "level", 70.0, Operations(1.0, 2.0, 3.0, 4.0, 0.5))
    result.attitude_costs = [
        AttitudeCost(
            "euler", by_functions, ns, Operations(2.0, adds, 0.0, 0.0, 0.0), Operations(0.0, 0.0, 0.0, 0.0, 0.0)
        )
        for by_functions, ns, adds in ((False, 30.0, 9.0), (True, 50.0, 90.0))
    ]
    trajectory = study_schema.trajectory_of(part.motions[0])
    imu = trajectory.increments(10.0)
    plain = measured_attitude.navigate_set
    monkeypatch.setattr(measured_attitude, "navigate_set", lambda *given, **options: change(plain(*given, **options)))
    readings: Any = SimpleNamespace(imu=imu, attitude=None)
    return _navigated(CASE, readings, part, _Truth(trajectory, imu.time), result)


def test_what_stands_beside_the_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two passages with damages of 2″ and 5″; 20 samples in 2 s; costs of navigation and attitude."""
    events = tuple(
        SimpleNamespace(time=1.0, damage=size * ARCSEC, text=text) for size, text in ((5.0, "a."), (2.0, "b."))
    )
    defect = np.linspace(0.0, 3e-9, 21)[::-1]
    row, growth, further = navigated(monkeypatch, lambda found: replace(found, events=events, defect=defect))
    assert (row.status, row.message, row.passages) == ("done", "a. b.", 2)
    assert row.max_damage_arcsec == pytest.approx(5.0)
    assert row.max_defect == pytest.approx(3e-9)
    assert (row.samples, row.duration_s) == (20, pytest.approx(2.0))
    assert (row.ns_per_step, row.operations_per_step) == (70.0, 22.0)
    assert (row.attitude_ns_per_step, row.attitude_operations_per_step) == (30.0, 11.0)
    assert row.case == CASE
    assert growth.time[[0, -1]].tolist() == [0.0, pytest.approx(2.0)]
    assert further == []


def test_errors_of_a_solution_that_is_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """North by an angle that grows to 3e-6 rad, 19.1 m at 50°; yawed by 7″, a rotation about down."""

    def off(found: Any) -> Any:
        half = 0.5 * 7.0 * ARCSEC
        q = np.tile([math.cos(half), 0.0, 0.0, math.sin(half)], (21, 1))
        return replace(found, latitude=found.latitude + np.linspace(0.0, 3e-6, 21), q_nb=q)

    row, growth, _ = navigated(monkeypatch, off)
    e2, sine = 0.00669438, math.sin(math.radians(50.0))
    metres = 3e-6 * 6378137.0 * (1.0 - e2) / (1.0 - e2 * sine**2) ** 1.5
    assert row.final_horizontal_error_m == pytest.approx(metres, rel=1e-5)
    assert row.max_horizontal_error_m == pytest.approx(metres, rel=1e-5)
    assert row.rms_horizontal_error_m == pytest.approx(metres * math.sqrt(41.0 / 120.0), rel=1e-5)  # Σk²/21 of k/20
    assert row.max_attitude_error_arcsec == pytest.approx(7.0, rel=1e-4)
    assert growth.horizontal[-1] == pytest.approx(metres, rel=1e-5)
    assert growth.attitude[-1] == pytest.approx(7.0, rel=1e-4)
    # Σ t a/Σ t² of a constant: 7 · (Σk/Σk²)/0.1 s = 7 · 3/41 · 10 ″/s
    assert row.attitude_drift_arcsec_h == pytest.approx(7.0 * 30.0 / 41.0 * 3600.0, rel=1e-4)


def test_an_engine_that_fails_is_a_result(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(found: Any) -> Any:
        raise RunError("it cannot pass the pole.")

    row, growth, further = navigated(monkeypatch, fails)
    assert (row.status, row.message, growth, further) == ("failed", "it cannot pass the pole.", None, [])
    assert (row.samples, row.ns_per_step) == (20, 70.0)
    assert math.isnan(row.max_horizontal_error_m)


def test_the_rate_of_the_local_level() -> None:
    """Ω cos B + v_E/(N + h), −v_N/(M + h), −Ω sin B − v_E tan B/(N + h) at 40° S, 9 km, 30 m/s north, 200 m/s east."""
    latitude, height = math.radians(-40.0), 9000.0
    state = SimpleNamespace(latitude=np.array([latitude]), height=np.array([height]),
                            velocity_ned=np.array([[30.0, 200.0, -7.0]]))  # fmt: skip
    trajectory: Any = SimpleNamespace(ellipsoid=ELLIPSOIDS["wgs84"], state=lambda time: state)
    e2 = 0.00669437999014
    w = math.sqrt(1.0 - e2 * math.sin(latitude) ** 2)
    east, north = 6378137.0 / w + height, 6378137.0 * (1.0 - e2) / w**3 + height
    omega = 7.292115e-5
    wanted = [omega * math.cos(latitude) + 200.0 / east, -30.0 / north,
              -omega * math.sin(latitude) - 200.0 * math.tan(latitude) / east]  # fmt: skip
    assert _frame_rate(trajectory, np.zeros(1))[0] == pytest.approx(wanted, rel=1e-10)
