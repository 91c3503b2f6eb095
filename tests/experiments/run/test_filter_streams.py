"""The streams of a filter, from an estimate whose numbers are chosen: names, times and every column."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.data import Measurements, NavSolution
from sinssim.estimation.filter_result import Innovations, Reasons
from sinssim.estimation.state_model import Block, ErrorModel
from sinssim.experiments.run.run_streams import filter_streams, state_columns
from sinssim.strapdown.navigation_error import NavError
from tests.recording.test_motion_streams import columns, named, rows

TIME = np.array([5.0, 6.0, 8.0])


def motion(first: float, name: str) -> NavSolution:
    place = rows(first, 3)
    return NavSolution(TIME, *place.T, rows(first + 10.0, 3), rows(first + 20.0, 4), rows(first + 30.0, 1)[:, 0], name)


def error(first: float) -> NavError:
    return NavError(TIME, rows(first, 3), rows(first + 10.0, 3), rows(first + 20.0, 3))


def nav(s: NavSolution) -> dict[str, list[float]]:
    return {
        "time_s": s.time.tolist(), "latitude_rad": s.latitude.tolist(), "longitude_rad": s.longitude.tolist(),
        "height_m": s.height.tolist(), **named("velocity_n_mps velocity_e_mps velocity_d_mps", s.velocity_ned),
        **named("q_nb_w q_nb_x q_nb_y q_nb_z", s.q_nb), "defect": s.defect.tolist(),
    }  # fmt: skip


def errors(e: NavError) -> dict[str, list[float]]:
    return {
        "time_s": e.time.tolist(), **named("position_n_m position_e_m position_d_m", e.position_ned),
        **named("velocity_n_mps velocity_e_mps velocity_d_mps", e.velocity_ned),
        **named("phi_n_rad phi_e_rad phi_d_rad", e.attitude),
    }  # fmt: skip


BLOCKS = (
    Block("position", (1.0, 2.0, 3.0)), Block("velocity", (0.1, 0.2, 0.3)), Block("attitude", (1e-3, 2e-3, 3e-3)),
    Block("gyro bias", (1e-6, 2e-6, 3e-6)), Block("gnss time offset", 0.02), Block("baro scale", 0.01),
)  # fmt: skip
MODEL = ErrorModel(BLOCKS, 1e-5, 1e-4)


def aided(known: bool = True, **parts: object) -> SimpleNamespace:
    """Return an estimate of a barometer's run: its three readings at 4, 5 and 8 s, the first before the filter."""
    baro = Measurements(
        "baro-height", np.array([4.0, 5.0, 8.0]), np.array([4.5, 5.25, 9.0]), rows(70.0, 1), rows(1.0, 1), name="b-o"
    )
    other = Measurements("airspeed", np.array([7.0]), np.array([7.5]), np.array([[33.0]]), np.array([[2.0]]))
    innovations = Innovations(
        "b-o", "baro-height", np.array([5.0, 8.0]), np.array([[0.7], [-9.0]]), np.array([[4.0], [9.0]]),
        np.array([0.1225, 9.0]), np.array([True, False]), Reasons(2, {1: "no"}), 6.6,
    )  # fmt: skip
    estimate = SimpleNamespace(
        time=TIME, solution=motion(1.0, "x"), model=MODEL, sigma=rows(0.0, 14), smoothed=None, backward=None,
        innovations=(innovations,),
        parameters={"gyro bias": rows(50.0, 3), "gnss time offset": rows(60.0, 1), "baro scale": rows(65.0, 1)},
    )  # fmt: skip
    estimate.__dict__.update(parts)
    true = {"gyro bias": rows(90.0, 3), "gnss time offset": rows(91.0, 1), "baro scale": rows(92.0, 1)}
    return SimpleNamespace(
        estimate=estimate, error_at=error(2.0).at, smoothed_error=error(3.0), backward_error=error(4.0),
        true_parameters_known=known, block_error=lambda name, part: true[name][part],
        sensed=(SimpleNamespace(measurements=baro), SimpleNamespace(measurements=other)),
    )  # fmt: skip


def test_the_solutions_of_a_filter() -> None:
    smoothed, backward = motion(200.0, "s"), motion(300.0, "b")
    found = filter_streams(
        aided(smoothed=SimpleNamespace(solution=smoothed), backward=SimpleNamespace(solution=backward))
    )
    held = {stream.name: columns(stream) for stream in found}
    assert list(held) == ["nav_aided", "error_aided", "filter", "nav_smoothed", "error_smoothed", "nav_backward",
                          "error_backward", "aiding_b_o", "aiding_airspeed"]  # fmt: skip
    for name, solution, first in (
        ("aided", motion(1.0, "x"), 2.0),
        ("smoothed", smoothed, 3.0),
        ("backward", backward, 4.0),
    ):
        assert held[f"nav_{name}"] == nav(solution), name
        assert held[f"error_{name}"] == errors(error(first)), name


def test_estimates_their_errors_and_their_sigma() -> None:
    (states,) = (stream for stream in filter_streams(aided()) if stream.name == "filter")
    sigma = rows(0.0, 14)
    names = [
        "position_n_m", "position_e_m", "position_d_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps",
        "phi_n_rad", "phi_e_rad", "phi_d_rad", "gyro_bias_x_radps", "gyro_bias_y_radps", "gyro_bias_z_radps",
        "gnss_time_offset_s", "baro_scale",
    ]  # fmt: skip
    expected = {"time_s": [5.0, 6.0, 8.0]}
    for block, first, last in (("position", 0, 3), ("velocity", 3, 6), ("attitude", 6, 9), ("gyro", 9, 12),
                               ("offset", 12, 13), ("scale", 13, 14)):  # fmt: skip
        own, true, value = " ".join(names[first:last]), None, None
        if block in ("gyro", "offset", "scale"):
            value, true = {"gyro": (50.0, 90.0), "offset": (60.0, 91.0), "scale": (65.0, 92.0)}[block]
            expected |= named(own, rows(value, last - first))
            expected |= named(" ".join(f"error_{n}" for n in names[first:last]), rows(true, last - first))
        expected |= named(" ".join(f"sigma_{n}" for n in names[first:last]), sigma[:, first:last])
    found = columns(states)
    assert list(found) == list(expected)
    assert found == expected
    assert [v.name for v in states.vectors][3:6] == ["gyro_bias", "error_gyro_bias", "sigma_gyro_bias"]
    (recorded,) = (stream for stream in filter_streams(aided(known=False)) if stream.name == "filter")
    assert list(columns(recorded)) == [name for name in expected if not name.startswith("error_")]


def test_every_reading_and_the_decision_on_it() -> None:
    """A reading before the filter's start has no innovation and is not accepted; σ of an innovation is √S."""
    *_, baro, airspeed = filter_streams(aided())
    found = columns(baro)
    expected = {
        "time_s": [4.0, 5.0, 8.0], "height_m": [70.01, 71.01, 72.01], "sigma_m": [1.01, 2.01, 3.01],
        "arrival_s": [4.5, 5.25, 9.0], "innovation_m": [np.nan, 0.7, -9.0], "innovation_sigma_m": [np.nan, 2.0, 3.0],
        "nis": [np.nan, 0.1225, 9.0], "accepted": [0.0, 1.0, 0.0],
    }  # fmt: skip
    assert list(found) == list(expected)
    for name, wanted in expected.items():
        assert found[name] == pytest.approx(wanted, rel=1e-15, nan_ok=True), name
    assert [v.name for v in baro.vectors] == ["reading", "sigma", "arrival", "innovation", "innovation_sigma", "gate"]
    assert columns(baro, rows=slice(2, 3))["nis"] == [9.0]
    assert columns(baro, rows=slice(0, 1))["accepted"] == [0.0]
    assert columns(airspeed) == {"time_s": [7.0], "airspeed_mps": [33.0], "sigma_mps": [2.0], "arrival_s": [7.5]}


KINDS = {"gnss-position": "gnss-position", "gnss-velocity": "gnss-velocity", "b-o": "baro-height",
         "compass": "heading", "wheels": "speed", "air": "airspeed", "land-vehicle": "land-velocity",
         "rest": "zero-rate", "star-tracker": "attitude"}  # fmt: skip


@pytest.mark.parametrize(
    ("block", "size", "expected"),
    [
        ("attitude", 3, "phi_n_rad phi_e_rad phi_d_rad"),
        ("accelerometer bias", 3, "accelerometer_bias_x_mps2 accelerometer_bias_y_mps2 accelerometer_bias_z_mps2"),
        ("gyro scale", 3, "gyro_scale_x gyro_scale_y gyro_scale_z"),
        ("gyro misalignment", 6, " ".join(f"gyro_misalignment_{a}_rad" for a in ("xy", "xz", "yx", "yz", "zx", "zy"))),
        ("gnss lever arm", 3, "gnss_lever_arm_x_m gnss_lever_arm_y_m gnss_lever_arm_z_m"),
        ("gnss-position bias", 3, "gnss_position_bias_n_m gnss_position_bias_e_m gnss_position_bias_d_m"),
        ("gnss-velocity delay", 1, "gnss_velocity_delay_s"),
        ("b-o bias", 1, "b_o_bias_m"),
        ("b-o scale", 1, "b_o_scale"),
        ("compass deviation", 2, "compass_deviation_sin_rad compass_deviation_cos_rad"),
        ("air wind", 2, "air_wind_n_mps air_wind_e_mps"),
        ("star-tracker bias", 3, "star_tracker_bias_x_rad star_tracker_bias_y_rad star_tracker_bias_z_rad"),
        ("rest bias", 3, "rest_bias_x_radps rest_bias_y_radps rest_bias_z_radps"),
        ("land-vehicle mounting", 2, "land_vehicle_mounting_pitch_rad land_vehicle_mounting_yaw_rad"),
        ("land-vehicle lever arm", 3,
         "land_vehicle_lever_arm_forward_m land_vehicle_lever_arm_right_m land_vehicle_lever_arm_down_m"),
        ("land-vehicle slip", 1, "land_vehicle_slip_rad_per_mps2"),
    ],
)  # fmt: skip
def test_names_of_states(block: str, size: int, expected: str) -> None:
    assert state_columns(Block(block, np.ones(size)), KINDS) == tuple(expected.split())
