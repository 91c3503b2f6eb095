"""What a run as a whole says: whether its flight was cached, the sources of its phases, the instants of its outages."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.data import ImuData
from sinssim.earth.ellipsoids import WGS84
from sinssim.experiments.run import run_execution
from sinssim.experiments.run.parts import phases
from sinssim.scenario import Scenario
from sinssim.simulation import navigation_stage
from sinssim.simulation.truth_and_sensors import Stages
from tests.recording.test_motion_streams import rows


@pytest.mark.parametrize(
    ("fractions", "flown", "cached"), [((0.2, 0.9, 1.0), True, False), ((1.0,), True, True), ((1.0,), False, None)]
)
def test_a_cached_flight_is_there_at_once(
    monkeypatch: pytest.MonkeyPatch, fractions: tuple[float, ...], flown: bool, cached: bool | None
) -> None:
    told: list[tuple[str, float]] = []

    trajectory = SimpleNamespace(events=())

    def fly(scenario: Any, flying: Any, meanwhile: Any) -> Any:
        for fraction in fractions:
            flying(fraction)
        return trajectory

    monkeypatch.setattr("sinssim.scenario.true_motion.fly", fly)
    by_truth = SimpleNamespace(guidance=SimpleNamespace(source="truth"))
    scenario: Any = SimpleNamespace(flight=by_truth if flown else None, recording=None)
    execution = run_execution.Execution(scenario, None, Stages(lambda stage, fraction: told.append((stage, fraction))))
    assert execution._fly() == (trajectory, None)
    assert execution._found == {"flight_cached": cached}
    assert told == [("flight", 0.0), *(("flight", f) for f in fractions), ("flight", 1.0)]


def test_the_sources_of_a_phase_are_those_of_its_solution(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The budget without the filter belongs to the algorithm, that with it to the aided solution."""
    budgets = {"inertial": "none of the algorithm", "filter": "none of the filter"}
    monkeypatch.setattr(phases, "budgets_of_phases", lambda run, phases: budgets)
    monkeypatch.setattr(run_execution, "first_sections", lambda run, kinds: None)
    monkeypatch.setattr(run_execution, "run_exhibits", lambda run, summary, drawn: "exhibits")
    monkeypatch.setattr(run_execution, "page_of", lambda exhibits: "page")
    legs = [{"type": "stop", "duration_s": 12.0}, {"type": "straight", "distance_m": 60.0, "speed_mps": 8.0}]
    drive = {"latitude_deg": 47.0, "longitude_deg": 8.0, "road": "smooth", "legs": legs}
    scenario = Scenario.model_validate(
        {"name": "m", "drive": drive, "imu": {"grade": "laser-navigation", "rate_hz": 20}, "aiding": {"gnss": {}},
         "filter": {}, "recording": {"keep": "report"}}
    )  # fmt: skip
    run = run_execution.run(scenario, tmp_path / "run")
    found = {name: {row["no_sources"] for row in rows} for name, rows in run.summary["phases"].items()}
    assert found == {"quaternion": {"none of the algorithm"}, "aided": {"none of the filter"}}
    for rows_of in run.summary["phases"].values():
        assert [row["phase"] for row in rows_of] == ["standstill", "under way"]
        assert (rows_of[0]["from_s"], rows_of[0]["to_s"]) == (0.0, 12.0)
        assert rows_of[1]["to_s"] == run.summary["end_s"] == run.truth.time[-1]
    assert (run.summary["start_s"], run.summary["flight_cached"], run.summary["rate_hz"]) == (0.0, None, 20.0)


def test_a_run_on_recorded_sensors(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two outages are four events; a GPS second has its fraction; the rest is what the log says of itself."""
    seen: dict[str, Any] = {}
    time = np.array([7.0, 7.5, 8.5])
    imu = ImuData(time, rows(1.0, 3, 2), rows(2.0, 3, 2))
    own = Scenario.model_validate(
        {"name": "x", "parked": {"latitude_deg": 50.0, "duration_s": 5.0}, "imu": {"grade": "ideal"}}
    )
    log = SimpleNamespace(
        imu=imu,
        outages=((7.25, 7.75), (8.0, 8.25)),
        reference=None,
        notes=("A note.",),
        rates={},
        zero=SimpleNamespace(seconds=1_300_000_000, fraction=0.1234567),
    )
    prepared = SimpleNamespace(
        scenario=own, log=log, moved=None, start=SimpleNamespace(state="first", words="It starts.")
    )
    monkeypatch.setattr("sinssim.simulation.recorded_filter_run.prepare", lambda scenario: prepared)

    def solve(scenario: Any, truth: Any, imu: Any, attitude: Any, height: Any, errors: Any) -> Any:
        seen.update(truth=truth, imu=imu, errors=errors)
        return {}, {}

    monkeypatch.setattr(navigation_stage, "solve", solve)
    logged = SimpleNamespace(
        **{name: getattr(own, name) for name in type(own).model_fields if name != "log"}, log="log"
    )
    monkeypatch.setattr(run_execution, "about", lambda scenario, clock, status: {})
    run = run_execution.Execution(logged, None, Stages(lambda stage, fraction: None)).run()  # type: ignore[arg-type]
    motion = seen["truth"]
    assert seen["imu"] is imu
    assert seen["errors"] is None
    assert (motion.first, motion.ellipsoid) == ("first", WGS84)
    assert [(event.time, event.text) for event in motion.events] == [
        (7.25, "GNSS withheld"),
        (7.75, "GNSS available again"),
        (8.0, "GNSS withheld"),
        (8.25, "GNSS available again"),
    ]
    assert (run.summary["start_s"], run.summary["end_s"], run.summary["flagged_samples"]) == (7.0, 8.5, {})
    assert run.summary["log"] == {
        "reference_file": None, "compared_with": None, "knows": [], "notes": ["A note.", "It starts."],
        "time_0_gps_s": 1_300_000_000.123457,
    }  # fmt: skip
    assert run.summary["algorithms"]["quaternion"]["final_horizontal_error_m"] is None
