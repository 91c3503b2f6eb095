"""Runs on recordings of our own simulations, whose truth is known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.errors import InputError, RunError
from sinssim.scenario.schema import Scenario
from sinssim.simulation import navigation_stage
from sinssim.simulation.recorded_filter_run import prepare
from tests.logs.drive import (
    ATTITUDE,
    FIXES,
    INCREMENTS,
    RATES,
    REFERENCE,
    drive,
    write_csv,
    write_increments,
    write_rates,
    write_reference,
)
from tests.logs.formats.samples import psins_imu
from tests.recording.shown import still


def scenario(log: dict[str, Any], **tables: Any) -> Scenario:
    return Scenario.model_validate({"name": "recorded", "log": log, "imu": {"grade": "tactical"}, **tables})


def test_an_ideal_recording_navigates_to_the_truth(tmp_path: Path) -> None:
    """Other units, axes and a shifted clock change nothing: the solution closes on the reference as on the truth.

    What is left are the splines through the reference, micrometres and tenths of a microradian at 50 rows a second, and
    the algorithm's own error on the same increments.
    """
    truth = drive(60.0)
    imu = truth.increments(100.0)
    write_increments(tmp_path / "imu.csv", imu)
    write_reference(tmp_path / "ref.csv", truth, 50.0, shift=0.01 + 5.0)
    run = sinssim.run(
        scenario(
            {
                "imu": {"file": str(tmp_path / "imu.csv"), **INCREMENTS},
                "reference": {"file": str(tmp_path / "ref.csv"), "time_offset_s": -5.01, **REFERENCE, **ATTITUDE},
            }
        )
    )
    assert run.truth.prepared is not None
    assert run.truth.prepared.log.reference is not None
    # the run's time 0 is the first stamp, 10 ms after the first edge
    direct = sinssim.navigate(imu, truth.state(0.0))
    solution = run.solutions["quaternion"]
    error = run.errors["quaternion"]
    known = np.isfinite(error.position_ned).all(axis=1)
    assert known.sum() > 5900
    np.testing.assert_allclose(solution.time + 0.01, direct.time, atol=1e-9)
    assert error.horizontal[known].max() < 1e-4
    assert np.abs(error.height[known]).max() < 1e-4
    assert np.nanmax(error.speed) < 1e-4
    assert np.nanmax(error.angle) < 1e-6


def _simulated(**more: Any) -> Scenario:
    return Scenario.model_validate(
        {
            "name": "simulated",
            "seed": 4,
            "great_circle": {
                "latitude_deg": 45.0, "altitude_m": 3000.0, "course_deg": 60.0, "speed_mps": 100.0, "duration_s": 60.0,
            },
            "imu": {"grade": "tactical"},
            "navigation": {"vertical": "free"},
            **more,
        }
    )  # fmt: skip


def _recorded_again(simulated: sinssim.Run, folder: Path, **more: Any) -> sinssim.Run:
    """Write the readings of a simulated run to text, and navigate on them."""
    write_increments(folder / "imu.csv", simulated.sensed.measured)
    write_reference(folder / "ref.csv", simulated.truth.trajectory, 20.0)  # type: ignore[arg-type]
    log: dict[str, Any] = {
        "imu": {"file": str(folder / "imu.csv"), "time_offset_s": 0.0, **INCREMENTS},
        # both count from the beginning of the simulation; the run's time from the first stamp
        "reference": {"file": str(folder / "ref.csv"), **REFERENCE, **ATTITUDE},
    }
    if simulated.aided is not None:
        for readings in simulated.aided.sensed:
            m = readings.measurements
            if m.kind == "gnss-position":
                place = m
            else:
                speed = m
        columns = np.column_stack((place.time, np.degrees(place.value[:, :2]), place.value[:, 2], speed.value))
        write_csv(folder / "gnss.csv", "t_s,lat,lon,h,vn,ve,vd", columns)
        sigma = {"position_sigma_m": place.sigma[0].tolist(), "velocity_sigma_mps": speed.sigma[0].tolist()}
        log["gnss"] = {"file": str(folder / "gnss.csv"), **REFERENCE, **sigma}
    return sinssim.run(scenario(log, **more))


def test_errors_against_the_reference_are_those_of_the_simulated_run(tmp_path: Path) -> None:
    simulated = sinssim.run(_simulated())
    recorded = _recorded_again(simulated, tmp_path)
    own, true = recorded.errors["quaternion"], simulated.errors["quaternion"]
    np.testing.assert_allclose(own.time + 0.01, true.time, atol=1e-9)
    assert true.horizontal[-1] > 1.0
    known = np.isfinite(own.attitude).all(axis=1)
    assert known.sum() > 5800
    np.testing.assert_allclose(own.position_ned[known], true.position_ned[known], atol=2e-5)
    np.testing.assert_allclose(own.velocity_ned[known], true.velocity_ned[known], atol=1e-6)
    np.testing.assert_allclose(own.attitude[known], true.attitude[known], atol=1e-9)


def test_the_filter_does_the_same_on_recorded_as_on_simulated_readings(tmp_path: Path) -> None:
    own_filter = {
        "states": ["gyro bias", "accelerometer bias"],
        "smooth": True,
        "initial_sigma": {
            "position_m": 2.0, "height_m": 2.0, "velocity_mps": 0.1, "tilt_arcmin": 5.0, "heading_arcmin": 20.0,
        },
    }  # fmt: skip
    gnss = {"lever_arm_m": [0.0, 0.0, 0.0]}
    simulated = sinssim.run(_simulated(aiding={"gnss": gnss}, filter=own_filter))
    recorded = _recorded_again(simulated, tmp_path, filter=own_filter)
    assert simulated.aided is not None
    assert recorded.aided is not None
    mine, theirs = recorded.aided.estimate, simulated.aided.estimate
    np.testing.assert_allclose(mine.time + 0.01, theirs.time, atol=1e-9)
    np.testing.assert_allclose(mine.sigma, theirs.sigma, rtol=1e-5, atol=1e-12)
    error, true = recorded.aided.error, simulated.aided.error
    known = np.isfinite(error.position_ned).all(axis=1)
    assert known.sum() > 580
    np.testing.assert_allclose(error.position_ned[known], true.position_ned[known], atol=1e-4)
    np.testing.assert_allclose(error.attitude[known], true.attitude[known], atol=1e-7)
    assert recorded.aided.smoothed_error is not None
    assert simulated.aided.smoothed_error is not None
    smoothed = recorded.aided.smoothed_error
    rows = np.isfinite(smoothed.position_ned).all(axis=1)
    difference = smoothed.position_ned[rows] - simulated.aided.smoothed_error.position_ned[rows]
    assert np.abs(difference).max() < 1e-4
    for mine_one, theirs_one in zip(mine.innovations, theirs.innovations, strict=True):
        np.testing.assert_allclose(mine_one.nis, theirs_one.nis, rtol=1e-3)


def test_a_known_field_compensates_recorded_readings(tmp_path: Path) -> None:
    """Perfect sensors in EGM2008: with the field the recorded run closes; without, it is off by δg t²/2."""
    field = {"gravity": {"model": "egm2008"}}
    simulated = sinssim.run(_simulated(imu={"grade": "ideal"}, **field))
    felt = np.hypot(*simulated.truth.trajectory.disturbance_ned(np.array([30.0]))[0, :2])  # type: ignore[attr-defined]
    assert felt > 1e-4
    for known in (True, False):
        folder = tmp_path / str(known)
        folder.mkdir()
        tables = {**field, "navigation": {"gravity_degree": 120}} if known else {}
        off = _recorded_again(simulated, folder, imu={"grade": "ideal"}, **tables).errors["quaternion"].horizontal
        end = off[np.isfinite(off)][-1]
        if known:
            assert end < 1e-4
        else:
            assert end == pytest.approx(0.5 * felt * 60.0**2, rel=0.1)


def test_the_filter_of_a_log_knows_the_field_as_that_of_a_simulation(tmp_path: Path) -> None:
    own_filter = {
        "states": ["gyro bias", "accelerometer bias"],
        "initial_sigma": {
            "position_m": 2.0, "height_m": 2.0, "velocity_mps": 0.1, "tilt_arcmin": 5.0, "heading_arcmin": 20.0,
        },
    }  # fmt: skip
    known = {"gravity": {"model": "egm2008"}, "navigation": {"gravity_degree": 120, "vertical": "free"}}
    gnss = {"lever_arm_m": [0.0, 0.0, 0.0]}
    himalaya = {
        "latitude_deg": 27.5, "longitude_deg": 86.0, "altitude_m": 9000.0, "course_deg": 60.0, "speed_mps": 200.0,
        "duration_s": 30.0,
    }  # fmt: skip
    simulated = sinssim.run(_simulated(great_circle=himalaya, aiding={"gnss": gnss}, filter=own_filter, **known))
    assert simulated.aided is not None
    off = []
    for tables in (known, {}):
        folder = tmp_path / str(len(off))
        folder.mkdir()
        recorded = _recorded_again(simulated, folder, filter=own_filter, **tables)
        assert recorded.aided is not None
        error, true = recorded.aided.error, simulated.aided.error
        rows = np.isfinite(error.position_ned).all(axis=1)
        assert rows.sum() > 280
        off.append(np.abs(error.position_ned[rows] - true.position_ned[rows]).max())
    assert off[0] < 1e-7  # it is 3e-9 m
    assert off[1] > 1e-3  # normal gravity: most of the disturbance goes into the accelerometers' biases


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        ({"gravity": {"model": "egm2008"}}, "would have no effect: recorded data"),
        (
            {"gravity": {"model": "egm2008", "remainder": {}}, "navigation": {"gravity_degree": 60}},
            r"\[gravity\.remainder\] is a random part of the true field",
        ),
        ({"navigation": {"gravity_degree": 60}}, "gravity_degree = 60 needs the model"),
    ],
)
def test_gravity_of_a_log_that_is_refused(tmp_path: Path, tables: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        scenario({"imu": {"file": str(tmp_path / "imu.csv"), **INCREMENTS}}, **tables)


def _with_fixes(folder: Path, *, reference: bool, seconds: float = 70.0, **more: Any) -> Scenario:
    truth = drive(seconds)
    write_rates(folder / "imu.csv", truth, np.arange(0.0, seconds - 0.01, 0.01))
    write_reference(folder / "gnss.csv", truth, 4.0)
    log: dict[str, Any] = {
        "imu": {"file": str(folder / "imu.csv"), **RATES},
        "gnss": {"file": str(folder / "gnss.csv"), **FIXES},
    }
    if reference:
        log["reference"] = {"file": str(folder / "gnss.csv"), **REFERENCE}
    log |= more.pop("log", {})
    return scenario(log, **{"filter": {"smooth": True}, **more})


def test_the_filter_goes_on_where_the_inertial_solution_diverges(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In an hour, the errors of a phone's unit send the unaided solution over a pole; the fixes hold the aided one."""

    def lost(*of: object) -> None:
        raise RunError("the latitude ran away.")

    monkeypatch.setattr(navigation_stage, "_strapdown", lost)
    run = sinssim.run(_with_fixes(tmp_path, reference=True, seconds=30.0), tmp_path / "run")
    assert run.solutions == {}
    assert run.summary["failures"]["quaternion"]["text"] == "the latitude ran away."
    assert run.aided is not None
    assert np.nanmax(run.aided.error_at(slice(None)).horizontal) < 1.0
    assert (tmp_path / "run" / "report.html").is_file()
    with pytest.raises(RunError, match="the latitude ran away"):
        sinssim.run(_with_fixes(tmp_path, reference=True, seconds=30.0, filter=None), tmp_path / "alone")


def test_outages_are_withheld_and_judged(tmp_path: Path) -> None:
    """Exact readings keep the position over an outage; the withheld fixes tell it without any reference."""
    outages = {"outages": {"at_s": [[30.0, 40.0], [50.0, 60.0]]}}
    found = {}
    for reference in (True, False):
        run = sinssim.run(_with_fixes(tmp_path, reference=reference, log=outages))
        assert run.aided is not None
        (place, _) = run.aided.sensed
        inside = (place.measurements.time > 30.0) & (place.measurements.time <= 40.0)
        assert not inside.any()
        assert len(place.time) - len(place.measurements.time) == 80
        found[reference] = run.summary["outages"]
        assert [one["at_s"] for one in found[reference]["each"]] == pytest.approx([40.0, 60.0])
        assert found[reference]["median"]["horizontal_error_m"] < 0.5
        assert found[reference]["median"]["horizontal_sigma_m"] > found[reference]["median"]["horizontal_error_m"] / 4
    assert found[False]["against"] == "the withheld fixes"
    assert found[True]["each"][0]["horizontal_error_m"] == pytest.approx(
        found[False]["each"][0]["horizontal_error_m"], abs=1e-6
    )


@pytest.mark.slow
def test_passes_with_several_beginnings_are_those_of_single_runs(tmp_path: Path) -> None:
    """The outages of three passes are those of three runs, and the run itself has all satellites."""
    regular = {"length_s": 5.0, "every_s": 20.0}
    single = []
    for first in (22.0, 29.0):
        outages = {"outages": {**regular, "first_s": first}}
        run = sinssim.run(_with_fixes(tmp_path, reference=True, log=outages, filter={}))
        single += run.summary["outages"]["each"]
    pooled = sinssim.run(
        _with_fixes(tmp_path, reference=True, log={"outages": {**regular, "first_s": (22.0, 29.0)}}, filter={}),
        tmp_path / "run",
    )
    found = pooled.summary["outages"]
    assert [one.pop("pass") for one in found["each"]] == [1, 1, 1, 2, 2]
    assert found["each"] == single
    ends = [one["horizontal_error_m"] for one in single]
    assert found["median"]["horizontal_error_m"] == pytest.approx(np.median(ends), rel=1e-12)
    ratio = [one["horizontal_error_m"] / one["horizontal_sigma_m"] for one in single]
    assert found["error_over_sigma"] == pytest.approx(np.sqrt(np.mean(np.square(ratio))), rel=1e-12)
    assert pooled.aided is not None
    assert all(len(one.time) == len(one.measurements) for one in pooled.aided.sensed)  # nothing is withheld
    assert "5 outages of 5 s in 2 passes" in (tmp_path / "run" / "report.html").read_text()


def test_without_a_reference_solutions_are_compared_with_the_smoothed_one(tmp_path: Path) -> None:
    run = sinssim.run(
        _with_fixes(
            tmp_path,
            reference=False,
            seconds=20.0,
            navigation={"algorithms": ["quaternion", "two-quaternions"]},
            filter={"smooth": True, "backward": True},
        ),
        tmp_path / "run",
    )
    assert run.summary["log"]["compared_with"] == "the smoothed solution"
    assert run.summary["filter"]["aided"]["rms_horizontal_error_m"] < 1.0
    assert run.summary["filter"]["smoothed"]["max_horizontal_error_m"] is None  # the distance from itself is no error
    page = (tmp_path / "run" / "report.html").read_text()
    for words in ("Differences of the solutions", "Innovations", "Distance of two-quaternions from quaternion"):
        assert words in page
    assert "nan" not in still(page).split("<pre>")[0].split("</style>")[1].replace("navigation", "")
    streams = {file.stem for file in (tmp_path / "run" / "streams").iterdir()}
    assert {"imu_measured", "nav_aided", "nav_smoothed", "filter", "aiding_gnss_position"} <= streams
    assert {"nav_backward", "error_backward"} <= streams
    assert run.summary["filter"]["backward"]["rms_horizontal_error_m"] < 1.0
    assert "backward" in page
    assert "truth" not in streams
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["status"] == "finished"
    # the scenario as recorded runs again, and to the same numbers
    again = sinssim.run(sinssim.load_scenario(tmp_path / "run" / "scenario.toml"))
    assert again.summary["filter"]["aided"] == summary["filter"]["aided"]


@pytest.mark.slow
def test_one_algorithm_alone_has_nothing_to_be_compared_with(tmp_path: Path) -> None:
    plan = _with_fixes(tmp_path, reference=False, seconds=25.0).model_copy(update={"filter": None})
    run = sinssim.run(plan, tmp_path / "run")
    assert run.summary["log"]["compared_with"] is None
    assert run.summary["algorithms"]["quaternion"]["max_horizontal_error_m"] is None
    assert "There is no reference and only one solution" in (tmp_path / "run" / "report.html").read_text()


def test_a_sensor_can_be_emulated_from_a_whole_reference(tmp_path: Path) -> None:
    truth = drive(40.0)
    write_rates(tmp_path / "imu.csv", truth, np.arange(0.0, 39.5, 0.01))
    write_reference(tmp_path / "ref.csv", truth, 20.0)
    log = {
        "imu": {"file": str(tmp_path / "imu.csv"), **RATES},
        "reference": {"file": str(tmp_path / "ref.csv"), **REFERENCE, **ATTITUDE},
    }
    aiding = {"gnss": {"position_sigma_m": 1.0}}
    run = sinssim.run(scenario(log, aiding=aiding, filter={}))
    assert run.aided is not None
    assert len(run.aided.estimate.innovations[0].time) == 39
    assert run.summary["filter"]["aided"]["rms_horizontal_error_m"] < 2.0
    partial = {**log, "reference": {"file": str(tmp_path / "ref.csv"), **REFERENCE}}
    start = {"start": {"latitude_deg": 40.0, "longitude_deg": 0.0, "height_m": 0.0, "heading_deg": 0.0}}
    with pytest.raises(InputError, match="has no attitude"):
        sinssim.run(scenario(partial | start, aiding=aiding, filter={}))


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"imu": {}}, "give the grade of the IMU that recorded the log"),
        ({"imu": {"grade": "tactical", "rate_hz": 50.0}}, "has 100 samples per second"),
        ({"vibration": [{"coordinate": "down", "rms_mm": 1.0, "low_hz": 10.0}]}, "would add a motion"),
        ({"ensemble": {"runs": 5}}, "a recording is a single run"),
        ({"filter": None, "log": {"outages": {"at_s": [[1.0, 2.0]]}}}, "without a filter, GNSS is not used"),
    ],
)
def test_what_does_not_apply_is_refused(tmp_path: Path, tables: dict[str, Any], message: str) -> None:
    with pytest.raises((InputError, ValueError), match=message):
        sinssim.run(_with_fixes(tmp_path, reference=False, seconds=20.0, **tables))


def test_an_ensemble_a_budget_and_a_flight_name_the_recording(tmp_path: Path) -> None:
    plan = _with_fixes(tmp_path, reference=False, seconds=20.0)
    with pytest.raises(InputError, match="a recording is a single run"):
        sinssim.ensemble(plan)
    with pytest.raises(InputError, match="needs the true motion"):
        sinssim.budget(plan)
    with pytest.raises(InputError, match="no true motion"):
        sinssim.fly(plan)


def test_the_scenario_of_a_run_repeats_it(tmp_path: Path) -> None:
    """The defaults that a run writes out are no start of one's own: with a reference alone, it starts from that."""
    truth = drive(20.0)
    imu = truth.increments(100.0)
    write_increments(tmp_path / "imu.csv", imu)
    write_reference(tmp_path / "ref.csv", truth, 50.0)
    log = {
        "imu": {"file": str(tmp_path / "imu.csv"), **INCREMENTS},
        "reference": {"file": str(tmp_path / "ref.csv"), **REFERENCE, **ATTITUDE},
    }
    first = sinssim.run(scenario(log, recording={"keep": "summary"}), tmp_path / "run")
    again = sinssim.run(sinssim.load_scenario(tmp_path / "run" / "scenario.toml"))
    for name, one in vars(first.solutions["quaternion"]).items():
        if isinstance(one, np.ndarray):
            np.testing.assert_array_equal(getattr(again.solutions["quaternion"], name), one, err_msg=name)


def test_the_scenario_of_a_run_has_the_axes_of_the_file(tmp_path: Path) -> None:
    """A format with axes of its own is read with them again, not with the default that stands in a scenario."""
    file = psins_imu(tmp_path / "x.imu")
    log = {
        "imu": {"file": str(file), "check_scale": False},
        "start": {"latitude_deg": 34.0, "longitude_deg": 108.0, "height_m": 380.0, "heading_deg": 0.0},
    }
    first = prepare(scenario(log))
    assert first.scenario.log is not None
    assert first.scenario.log.imu.axes == ("right", "forward", "up")
    again = prepare(Scenario.model_validate(first.scenario.contents()))
    np.testing.assert_array_equal(again.log.imu.dvel, first.log.imu.dvel)
