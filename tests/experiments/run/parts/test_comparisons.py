"""What a run is compared with, in numbers and in words: a platform, a redundant set, a block at rest, outages."""

from __future__ import annotations

from math import nan, pi, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim import earth
from sinssim.data import ImuData
from sinssim.experiments.run.parts.imu_mounting import OnPlatform, Rotation, platform_numbers, rotation_numbers
from sinssim.experiments.run.parts.judged_outages import outage_numbers
from sinssim.experiments.run.parts.judged_outages import sentences as outage_sentence
from sinssim.experiments.run.parts.motion_source import best_solution, compared_words
from sinssim.experiments.run.parts.redundancy import redundancy_numbers, window_names
from sinssim.experiments.run.parts.redundancy import sentences as redundancy_sentences
from sinssim.experiments.run.run_result import Part
from sinssim.logs.recorded_streams import FixStream
from sinssim.sensors.fault_detection import Alarm, Monitored
from sinssim.sensors.sensor_set_readings import PlatformErrors
from sinssim.simulation.recorded_filter_run import outage_errors, straight_line_error
from sinssim.strapdown.navigation_error import NavError
from tests.recording.test_summary import ERROR, NUMBERS

DEG, SECOND = pi / 180.0, pi / 648_000.0


def entry(final: float | None, most: float | None) -> dict[str, Any]:
    return {"final_horizontal_error_m": final, "max_horizontal_error_m": most, "rms_horizontal_error_m": 99.0}


def told(kind: type[Part], numbers: Any, algorithms: Any) -> list[str]:
    """Return the sentences of a part with some entry."""
    run: Any = None
    found: list[Any] = list(kind(run, entry=numbers).brief(algorithms))
    return [one.text for one in found]


def test_a_platform_in_numbers() -> None:
    """The vehicle turns at 3, 0.13 and 0.26 deg/s for 1, 2 and 4 s; below 10 deg/min it does not count as turning."""
    time = np.array([3.0, 4.0, 6.0, 10.0])
    angle = np.array([[2.0, -1.0, 2.0], [0.0, 0.26, 0.0], [1.04, 0.0, 0.0]]) * DEG
    commanded = np.array([[3.0, 4.0, 12.0], [6.0, 8.0, 0.0], [0.0, 1.0, 2.0]]) * SECOND  # 13 deg/h at most
    errors = PlatformErrors(np.array([20.0, -30.0, 40.0]) * 1e-6, np.array([7.0, 8.0, -9.0]) * SECOND, 0.0)
    apart = ERROR.position_ned + np.array([[3.0, 4.0, 9.0], [6.0, 8.0, 9.0], [5.0, 12.0, 9.0], [-0.3, 0.4, 9.0]])
    without = NavError(ERROR.time, ERROR.position_ned, ERROR.velocity_ned, ERROR.attitude)
    strapdown = NavError(np.arange(5.0), np.vstack([apart, [[1e3, 1e3, 1e3]]]), np.zeros((5, 3)), np.zeros((5, 3)))
    cause = SimpleNamespace(
        position={"gyro drift": np.array([[9.0, 9.0], [3.0, -4.0]]), "start": np.array([[9.0, 9.0], [-5.0, 12.0]])},
        apart=lambda simulated: 0.25 if simulated is ERROR else None,
    )
    ideal = ImuData(time, angle, np.zeros((3, 3)))
    solution = SimpleNamespace(commanded=commanded)
    found = platform_numbers(solution, errors, ideal, ("euler", strapdown), without, cause, ERROR)
    assert found.pop("torquer_scale_ppm") == pytest.approx([20.0, -30.0, 40.0])
    assert found.pop("pickoff_arcsec") == pytest.approx([7.0, 8.0, -9.0])
    beside = found.pop("strapdown")
    assert beside.pop("without_errors_of_turns") == pytest.approx(NUMBERS)
    assert beside == {
        "algorithm": "euler", "final_distance_m": pytest.approx(0.5), "max_distance_m": pytest.approx(13.0),
    }  # fmt: skip
    assert found.pop("final_horizontal_error_by_cause_m") == pytest.approx({"gyro_drift": 5.0, "start": 13.0})
    assert found == {
        "max_commanded_rate_deg_h": pytest.approx(13.0), "max_rate_of_the_vehicle_deg_s": pytest.approx(3.0),
        "turned_deg": pytest.approx(3.0 + 1.04), "largest_difference_from_error_equations_m": 0.25,
    }  # fmt: skip
    assert "strapdown" not in platform_numbers(solution, errors, ideal, None, None, cause, ERROR)


def test_a_platform_in_words() -> None:
    numbers = {
        "max_commanded_rate_deg_h": 13.24, "max_rate_of_the_vehicle_deg_s": 3.456, "turned_deg": 4.0449,
        "strapdown": {"algorithm": "euler", "without_errors_of_turns": entry(5.0, 6.0), "final_distance_m": 7.0,
                      "max_distance_m": 8.0},
    }  # fmt: skip
    own = {"platform": entry(1.0, 2.0), "euler": entry(3.0, 4.0)}
    assert told(OnPlatform, numbers, own) == [
        "The platform was turned by its gyros at up to 13.2 deg/h; in the strapdown system, they measured up to 3.46 "
        "deg/s, and 4.045° in turns.",
        "Horizontal error of the same sensors on the platform: 1.000 m at the end, 2.000 m at most; strapdown (euler): "
        "3.000 m at the end, 4.000 m at most.",
        "Scale factor, misalignment and non-linearity of the gyros, which act on the sensed rate, changed the "
        "strapdown solution by 7.000 m at the end, 8.000 m at most; without them its error is 5.000 m at the end, "
        "6.000 m at most.",
    ]
    still = {**numbers, "max_commanded_rate_deg_h": 0.0}
    assert told(OnPlatform, still, own)[0].startswith("The platform was not turned in inertial space; in the")
    assert len(told(OnPlatform, numbers, {"platform": entry(None, 2.0), "euler": entry(3.0, 4.0)})) == 1
    assert len(told(OnPlatform, numbers, {"euler": entry(3.0, 4.0)})) == 1


def test_a_redundant_set_in_numbers() -> None:
    """Six sensors along the edges of a cube twice: HᵀH = 2 I, so that the trace of its inverse is 3/2 = 9/6."""
    axes = np.vstack([np.eye(3), np.eye(3)])
    section = SimpleNamespace(
        axes=axes, mode="isolate", false_alarm_probability=1e-4, missed_detection_probability=0.02
    )
    used = np.ones((3, 6), dtype=bool)
    used[2, [1, 4]] = False
    alarm = Alarm(7.0, np.float64(2.5), 31.0, 17.0, 8.0, 9.0, 5)
    smallest = np.arange(1.0, 13.0).reshape(2, 6)
    statistic = np.array([[1.0, np.nan, 3.0], [np.nan, np.nan, 5.0]])
    windows = np.array([0.5, 2.5])
    gyro = Monitored("gyro", windows, statistic, np.zeros(3), smallest * DEG / 3600.0, (alarm,), used)
    accel = Monitored("accel", windows, statistic[:1], np.zeros(3), smallest * 9.80665e-6, (), used[:2])
    found = redundancy_numbers(section, (gyro, accel), ERROR)
    assert found.pop("without_monitoring") == pytest.approx(NUMBERS)
    assert found.pop("gyro") == {
        "windows_s": [0.5, 2.5], "tests": 3, "false_alarms_expected_at_most": pytest.approx(3e-4),
        "smallest_fault_deg_h": [pytest.approx(row) for row in smallest.tolist()],
        "alarms": [{"detected_s": 7.0, "window_s": 2.5, "statistic": 31.0, "threshold": 17.0, "last_s": 8.0,
                    "excluded_s": 9.0, "sensor": 5}],
        "used_at_end": [1, 3, 4, 6],
    }  # fmt: skip
    assert found.pop("accel") == {
        "windows_s": [0.5, 2.5], "tests": 2, "false_alarms_expected_at_most": pytest.approx(2e-4),
        "smallest_fault_ug": [pytest.approx(row) for row in smallest.tolist()], "alarms": [],
        "used_at_end": [1, 2, 3, 4, 5, 6],
    }  # fmt: skip
    assert found == {
        "monitoring": "isolate", "sensors": 6, "trace_of_covariance": pytest.approx(1.5), "least_trace": 1.5,
        "false_alarm_probability": 1e-4, "missed_detection_probability": 0.02,
    }  # fmt: skip
    assert list(redundancy_numbers(section, (), None)) == [
        "monitoring",
        "sensors",
        "trace_of_covariance",
        "least_trace",
    ]


def test_a_redundant_set_in_words() -> None:
    """The first window is one sample; the errors of the set come first, those without monitoring second."""

    def alarm(window: float, last: float, excluded: float | None, sensor: int | None) -> dict[str, Any]:
        return {"detected_s": 7.25, "window_s": window, "last_s": last, "excluded_s": excluded, "sensor": sensor}

    gyro = {"windows_s": [0.5, 2.5], "alarms": [alarm(0.5, 8.0, 7.25, 5), alarm(2.5, 8.5, 9.75, 3)]}
    accel = {"windows_s": [0.5, 2.5], "alarms": [alarm(2.5, 8.5, None, None)]}
    numbers = {"monitoring": "isolate", "gyro": gyro, "accel": accel, "without_monitoring": entry(3.0, 4.0)}
    said = list(redundancy_sentences(numbers, {"euler": entry(1.0, 2.0), "poisson": entry(7.0, 8.0)}))
    assert said == [
        "A fault of gyro 5 was detected at 7.25 s by a single sample; the sensor was isolated and excluded at once.",
        "A fault of gyro 3 was detected at 7.25 s by sums over 2.5 s; the sensor was isolated and excluded at 9.75 s.",
        "A fault of the accelerometers was detected at 7.25 s by sums over 2.5 s, but the faulty sensor could not be "
        "identified; the last test over the threshold was at 8.5 s.",
        "Horizontal error of euler with monitoring: 1.000 m at the end, 2.000 m at most; without monitoring: 3.000 m "
        "at the end, 4.000 m at most.",
    ]
    only = {"monitoring": "detect", "gyro": {**gyro, "alarms": []}, "accel": accel}
    (detected,) = redundancy_sentences(only, {})
    assert detected.startswith("A fault of the accelerometers was detected at 7.25 s by sums over 2.5 s; the last")
    quiet = {"monitoring": "detect", "gyro": {"alarms": []}, "accel": {"alarms": []}}
    assert list(redundancy_sentences(quiet, {})) == ["The monitoring of the redundant set found no fault."]
    none = "The sensors of the redundant set are not monitored: all of them are always used."
    assert list(redundancy_sentences({"monitoring": "none"}, {})) == [none]
    assert window_names(np.array([0.01, 1.0, 12.5])) == ["sample", "1 s", "12.5 s"]


def test_a_rotating_block() -> None:
    assert rotation_numbers(ERROR)["without_rotation"] == pytest.approx(NUMBERS)
    assert all(map(np.isnan, rotation_numbers(None)["without_rotation"].values()))
    numbers = {"euler": entry(1.0, 2.0), "poisson": entry(7.0, 8.0)}
    words = (
        "The IMU rotates in the vehicle. The horizontal error reaches 2.000 m. With the same sensor errors and without "
        "the rotation it reaches 4.000 m."
    )
    rotation = {"without_rotation": entry(3.0, 4.0)}
    assert told(Rotation, rotation, numbers) == [words]
    assert told(Rotation, {"without_rotation": entry(None, None)}, numbers) == []
    assert told(Rotation, rotation, {}) == []


def outages() -> list[dict[str, Any]]:
    """Return the outages from 5 to 8 s and from 8 to 9 s of a filter whose last position is not known, and one
    without any position."""
    position = ERROR.position_ned.copy()
    position[1] = nan
    error = NavError(ERROR.time, position, ERROR.velocity_ned, ERROR.attitude)
    time = np.array([5.0, 5.5, 7.0, 8.0, 8.5])
    smoothed = NavError(
        time, np.outer([90.0, 3.0, 4.0, 2.0, np.nan], [0.6, -0.8, 5.0]), np.zeros((5, 3)), np.zeros((5, 3))
    )
    sigma = np.outer([1.0, 2.0, 3.0, 4.0], [3.0, 4.0, 12.0])
    spans = [(5.0, 8.0), (5.5, 7.5), (8.0, 9.0)]
    return outage_errors(SimpleNamespace(sigma=sigma), error, smoothed, spans)


def test_outages_in_numbers() -> None:
    first, second = outages()
    assert first == {
        "from_s": 5.0, "to_s": 8.0, "at_s": 8.0, "horizontal_error_m": 17.0, "height_error_m": -1.0,
        "velocity_error_mps": 3.0, "horizontal_sigma_m": 15.0, "smoothed_max_horizontal_error_m": pytest.approx(4.0),
    }  # fmt: skip
    known = {key: value for key, value in second.items() if not key.startswith("smoothed")}
    assert known == {
        "from_s": 8.0, "to_s": 9.0, "at_s": 9.0, "horizontal_error_m": pytest.approx(1.0), "height_error_m": -4.0,
        "velocity_error_mps": 9.0, "horizontal_sigma_m": 20.0,
    }  # fmt: skip
    assert np.isnan(second["smoothed_max_horizontal_error_m"])
    found = outage_numbers([first, second])
    assert found["each"] == [first, second]
    assert found["median"] == pytest.approx(
        {"horizontal_error_m": 9.0, "height_error_m": 2.5, "velocity_error_mps": 6.0, "horizontal_sigma_m": 17.5,
         "smoothed_max_horizontal_error_m": 4.0}
    )  # fmt: skip
    assert found["p90"] == pytest.approx(  # nine tenths of the way from the smaller to the larger
        {"horizontal_error_m": 15.4, "height_error_m": 3.7, "velocity_error_mps": 8.4, "horizontal_sigma_m": 19.5,
         "smoothed_max_horizontal_error_m": 4.0}
    )  # fmt: skip
    assert found["error_over_sigma"] == pytest.approx(sqrt(((17.0 / 15.0) ** 2 + (1.0 / 20.0) ** 2) / 2.0))
    assert np.isnan(outage_numbers([])["error_over_sigma"])


def test_outages_in_words() -> None:
    each = [{"from_s": 10.0, "to_s": 40.0}, {"from_s": 60.0, "to_s": 90.0, "pass": 2}]
    numbers = {
        "each": each, "median": {"horizontal_error_m": 3.456, "smoothed_max_horizontal_error_m": 1.5},
        "p90": {"horizontal_error_m": 7.891, "smoothed_max_horizontal_error_m": 2.5}, "error_over_sigma": 0.815,
    }  # fmt: skip
    assert list(outage_sentence(numbers)) == [
        "2 outages of 30 s in 2 passes: horizontal error at the end 3.46 m (median), 7.89 m (90 %); smoothed, at most "
        "1.50 m and 2.50 m within the outage. The errors at the end are 0.815 of their 1σ (rms)."
    ]
    plain = {**numbers, "each": [{"from_s": 10.0, "to_s": 40.0}], "median": {"horizontal_error_m": 3.456}}
    words = "1 outage of 30 s: horizontal error at the end 3.46 m (median), 7.89 m (90 %)."
    assert list(outage_sentence(plain)) == [words]
    alone = {**plain, "median": {"horizontal_error_m": 3.456, "straight_line_horizontal_error_m": 3.4}}
    assert list(outage_sentence(alone))[1:] == [
        "In outages the navigation is worse than the fixes alone: a straight line through the fixes of the last 2 s is "
        "3.40 m off at the end (median)."
    ]
    alone["median"]["straight_line_horizontal_error_m"] = 3.5
    assert list(outage_sentence(alone))[1].startswith("In outages the navigation is better than the fixes alone:")
    uneven = {**plain, "each": [each[0], {"from_s": 60.0, "to_s": 95.0}]}
    assert next(outage_sentence(uneven)).startswith("2 outages: horizontal")
    none = "No outage could be evaluated: the reference is not known in any of them."
    assert list(outage_sentence({"each": []})) == [none]


def test_the_straight_line_through_the_last_fixes() -> None:
    """A tenth of a metre a second to the north and 0.3 to the east, but for 4 m north and 3 m west at 12 s."""
    time = np.arange(16.0)
    r1, r2 = earth.radii(0.5)
    north, east = 0.1 * time, 0.3 * time
    north[12] += 4.0
    east[12] -= 3.0
    fixes = FixStream(
        time, 0.5 + north / r1, (np.pi + east / (r2 * np.cos(0.5)) + np.pi) % (2 * np.pi) - np.pi, 0 * time
    )
    assert straight_line_error(fixes, 8.0, 12.0) == pytest.approx(5.0, rel=1e-5)
    assert straight_line_error(fixes, 8.0, 11.0) == pytest.approx(0.0, abs=1e-5)
    assert np.isnan(straight_line_error(fixes, 0.0, 4.0))
    slow = FixStream(fixes.time[::4], fixes.latitude[::4], fixes.longitude[::4], fixes.height[::4])
    assert straight_line_error(slow, 8.0, 12.0) == pytest.approx(5.0, rel=1e-5)  # every 4 s: the last two of them


def test_what_a_log_is_compared_with() -> None:
    def words(against: str | None, file: str | None, *knows: str) -> str:
        return compared_words({"compared_with": against, "knows": knows, "reference_file": file})

    whole = "Errors are differences from the reference r"
    assert words("r", "f", "position", "velocity", "attitude") == f"{whole}."
    assert words("r", "f", "position", "velocity") == f"{whole}; it has no attitude."
    assert words("r", "f", "position") == f"{whole}; it has no velocity and no attitude."
    assert words(None, None) == "There is no reference and only one solution, so the errors are unknown."
    other = "There is no reference: differences from aided are shown, which is not the truth."
    assert words("aided", None, "position") == other


def test_the_best_solution() -> None:
    def best(rows: int, smoothed: object, divergence: object) -> tuple[str, Any]:
        estimate = SimpleNamespace(time=np.zeros(rows), smoothed=smoothed, divergence=divergence, solution="a")
        aided: Any = SimpleNamespace(estimate=estimate)
        return best_solution(run, aided)

    run: Any = SimpleNamespace(solutions={"euler": "e", "poisson": "p"})
    smooth = SimpleNamespace(solution="s")
    assert best(2, smooth, None) == ("smoothed", "s")
    assert best(2, smooth, "diverged") == ("aided", "a")
    assert best(2, None, None) == ("aided", "a")
    assert best(1, smooth, None) == ("euler", "e")
    assert best_solution(run, None) == ("euler", "e")
