"""What each stream holds: its name, its times, and every column with its values, from numbers that are chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.data import Array, ImuData, NavSolution, NavState, blocks
from sinssim.recording import streams
from sinssim.recording.streams import Stream
from sinssim.sensors.fault_detection import Monitored
from sinssim.sensors.sensor_set_readings import Readings
from sinssim.strapdown.navigation_error import NavError
from sinssim.truth.sampling import Channel
from sinssim.truth.true_gravity_disturbance import GravityValues

TIME = np.array([3.0, 3.5, 4.5])


def rows(first: float, width: int, count: int = 3) -> Array:
    """Return numbers that all differ: 5.01, 5.02, … in the first row, 6.01, 6.02, … in the second one."""
    return first + np.arange(count)[:, None] + 0.01 * np.arange(1, width + 1)


def columns(stream: Stream, **rows_at: slice) -> dict[str, list[Any]]:
    """Return the times and the columns of a stream by name."""
    part = rows_at.get("rows", slice(0, len(stream.time)))
    found = {"time_s": stream.time.tolist()}
    for vector in stream.vectors:
        values = np.asarray(vector.values[part])
        assert values.shape[1] == len(vector.columns), vector.name
        found |= {name: values[:, k].tolist() for k, name in enumerate(vector.columns)}
    return found


def named(names: str, values: Array) -> dict[str, list[float]]:
    return {name: values[:, k].tolist() for k, name in enumerate(names.split())}


LATITUDE, LONGITUDE, HEIGHT = np.array([0.3, 0.4, 0.6]), np.array([-1.1, -1.3, -1.6]), np.array([70.0, 80.0, 95.0])
VELOCITY, Q = rows(20.0, 3), rows(30.0, 4)
STATE = {
    "time_s": TIME.tolist(), "latitude_rad": [0.3, 0.4, 0.6], "longitude_rad": [-1.1, -1.3, -1.6],
    "height_m": [70.0, 80.0, 95.0], **named("velocity_n_mps velocity_e_mps velocity_d_mps", VELOCITY),
    **named("q_nb_w q_nb_x q_nb_y q_nb_z", Q),
}  # fmt: skip
GROUPS = ["position", "velocity", "attitude"]
ERROR = NavError(TIME, rows(1.0, 3), rows(5.0, 3), rows(9.0, 3))
ERRORS = {
    "time_s": TIME.tolist(), **named("position_n_m position_e_m position_d_m", rows(1.0, 3)),
    **named("velocity_n_mps velocity_e_mps velocity_d_mps", rows(5.0, 3)),
    **named("phi_n_rad phi_e_rad phi_d_rad", rows(9.0, 3)),
}  # fmt: skip


def groups(stream: Stream) -> list[str]:
    return [vector.name for vector in stream.vectors]


def test_motion_of_truth_and_solution() -> None:
    truth = streams.truth_stream(TIME, NavState(LATITUDE, LONGITUDE, HEIGHT, VELOCITY, Q))
    assert (truth.name, groups(truth), columns(truth)) == ("truth", GROUPS, STATE)
    assert list(columns(truth)) == list(STATE)  # their order is that of the file
    defect = np.array([1e-16, 3e-16, 7e-16])
    nav = streams.nav_stream(
        "poisson", NavSolution(TIME, LATITUDE, LONGITUDE, HEIGHT, VELOCITY, Q, defect, "something else")
    )
    assert (nav.name, groups(nav)) == ("nav_poisson", [*GROUPS, "defect"])
    assert columns(nav) == {**STATE, "defect": defect.tolist()}
    assert nav.vectors[0].values[1:3].tolist() == [[0.4, -1.3, 80.0], [0.6, -1.6, 95.0]]


def test_a_reference_with_and_without_velocity_attitude_and_sigma() -> None:
    sigma = rows(2.0, 3)
    whole = SimpleNamespace(
        time=TIME, latitude=LATITUDE, longitude=LONGITUDE, height=HEIGHT, velocity_ned=VELOCITY, q_nb=Q,
        position_sigma=sigma,
    )  # fmt: skip
    found = streams.reference_stream(whole)
    assert (found.name, groups(found)) == ("reference", [*GROUPS, "sigma"])
    assert columns(found) == {**STATE, **named("sigma_north_m sigma_east_m sigma_down_m", sigma)}
    bare = SimpleNamespace(**{**vars(whole), "velocity_ned": None, "q_nb": None, "position_sigma": None})
    place = columns(streams.reference_stream(bare))
    assert list(place) == list(STATE)
    for name, values in place.items():
        if name.startswith(("velocity", "q_nb")):
            assert len(values) == 3
            assert np.isnan(values).all()
        else:
            assert values == STATE[name]


def test_increments_have_the_time_of_the_end_of_their_interval() -> None:
    dtheta, dvel, flags = rows(1.0, 3, 2), rows(5.0, 3, 2), np.array([[0, 1, 2, 3, 4, 5], [6, 7, 0, 1, 0, 4]], np.uint8)
    whole = streams.imu_stream("measured", ImuData(TIME, dtheta, dvel, flags))
    assert (whole.name, groups(whole)) == ("imu_measured", ["dtheta", "dvel", "flags"])
    velocity = named("dvel_x_mps dvel_y_mps dvel_z_mps", dvel)
    expected = {
        "time_s": [3.5, 4.5], **named("dtheta_x_rad dtheta_y_rad dtheta_z_rad", dtheta), **velocity,
        "flags_gyro_x": [0, 6], "flags_gyro_y": [1, 7], "flags_gyro_z": [2, 0], "flags_accel_x": [3, 1],
        "flags_accel_y": [4, 0], "flags_accel_z": [5, 4],
    }  # fmt: skip
    assert columns(whole) == expected
    assert list(columns(whole)) == list(expected)
    assert whole.vectors[2].values[1:2].dtype == np.float64
    bare = streams.imu_stream("ideal", ImuData(TIME, dtheta, dvel), with_angles=False)
    assert (bare.name, columns(bare)) == ("imu_ideal", {"time_s": [3.5, 4.5], **velocity})


def test_six_accelerometers_and_an_attitude_sensor() -> None:
    imu = ImuData(TIME, rows(1.0, 3, 2), rows(2.0, 3, 2))
    six, attitude = streams.set_streams("ideal", Readings(imu, Q, rows(4.0, 6, 2)))
    assert six.name == "accelerometers_ideal"
    names = "dvel_1_mps dvel_2_mps dvel_3_mps dvel_4_mps dvel_5_mps dvel_6_mps"
    assert columns(six) == {"time_s": [3.5, 4.5], **named(names, rows(4.0, 6, 2))}
    assert attitude.name == "attitude_ideal"
    assert columns(attitude) == {"time_s": TIME.tolist(), **named("q_ib_w q_ib_x q_ib_y q_ib_z", Q)}


def test_a_redundant_set_and_its_tests() -> None:
    """Four gyros and four accelerometers; the flags of the gyros come first. Windows of one sample, 2.5 s and 40 s."""
    flags = np.arange(1, 17, dtype=np.uint8).reshape(2, 8)
    single = SimpleNamespace(dtheta=rows(1.0, 4, 2), dvel=rows(4.0, 4, 2), flags=flags)
    statistic = np.array([[1.5, 2.5], [3.5, 4.5], [5.5, 6.5]])
    used = np.array([[True, True, False, True], [True, False, False, True]])
    monitored = Monitored(
        "accel", np.array([0.5, 2.5, 40.0]), statistic, np.array([11.0, 12.0]), np.zeros((3, 4)), (), used
    )
    imu = ImuData(TIME, rows(7.0, 3, 2), rows(8.0, 3, 2))
    gyros, accelerometers, tests = streams.set_streams("measured", Readings(imu, single=single, monitored=(monitored,)))
    ends = {"time_s": [3.5, 4.5]}
    assert gyros.name == "gyros_measured"
    assert columns(gyros) == {
        **ends, **named("dtheta_1_rad dtheta_2_rad dtheta_3_rad dtheta_4_rad", rows(1.0, 4, 2)),
        "flags_gyro_1": [1, 9], "flags_gyro_2": [2, 10], "flags_gyro_3": [3, 11], "flags_gyro_4": [4, 12],
    }  # fmt: skip
    assert accelerometers.name == "accelerometers_measured"
    assert columns(accelerometers) == {
        **ends, **named("dvel_1_mps dvel_2_mps dvel_3_mps dvel_4_mps", rows(4.0, 4, 2)),
        "flags_accel_1": [5, 13], "flags_accel_2": [6, 14], "flags_accel_3": [7, 15], "flags_accel_4": [8, 16],
    }  # fmt: skip
    assert (tests.name, groups(tests)) == ("redundancy", ["accel_statistic", "accel_threshold", "accel_used"])
    assert columns(tests) == {
        **ends, "accel_statistic_sample": [1.5, 2.5], "accel_statistic_2.5s": [3.5, 4.5],
        "accel_statistic_40s": [5.5, 6.5], "accel_threshold": [11.0, 12.0],
        "accel_used_1": [1, 1], "accel_used_2": [1, 0], "accel_used_3": [0, 0], "accel_used_4": [1, 1],
    }  # fmt: skip


def test_errors_of_a_solution() -> None:
    found = streams.error_stream("euler", ERROR.at, TIME)
    assert (found.name, groups(found), columns(found)) == ("error_euler", GROUPS, ERRORS)
    assert list(columns(found)) == list(ERRORS)
    assert found.vectors[1].values[1:2].tolist() == [[6.01, 6.02, 6.03]]


def test_a_turning_block_and_a_platform() -> None:
    edges = np.array([3.0, 4.0, 6.0])
    encoders = SimpleNamespace(
        edges=edges,
        turns=SimpleNamespace(angles=lambda t: np.column_stack((0.2 * t, 0.5 * t))),
        angles=lambda t: np.column_stack((0.3 * t, 0.7 * t)),
    )
    found = streams.rotation_stream(encoders)
    assert (found.name, groups(found)) == ("rotation", ["angle", "encoder"])
    assert columns(found) == {
        "time_s": [3.0, 4.0, 6.0],
        "outer_angle_rad": (0.2 * edges).tolist(), "inner_angle_rad": (0.5 * edges).tolist(),
        "outer_encoder_rad": (0.3 * edges).tolist(), "inner_encoder_rad": (0.7 * edges).tolist(),
    }  # fmt: skip
    platform = SimpleNamespace(
        time=TIME, commanded=rows(1.0, 3, 2), drift=rows(3.0, 3, 2), readings=rows(5.0, 3, 2), gimbals=rows(7.0, 3),
        q_ip=rows(11.0, 4),
    )  # fmt: skip
    found = streams.platform_stream(platform)
    assert (found.name, groups(found)) == ("platform", ["commanded", "drift", "dvel", "gimbals", "attitude"])
    assert columns(found) == {
        "time_s": [3.5, 4.5],
        **named("commanded_x_radps commanded_y_radps commanded_z_radps", rows(1.0, 3, 2)),
        **named("drift_x_radps drift_y_radps drift_z_radps", rows(3.0, 3, 2)),
        **named("dvel_x_mps dvel_y_mps dvel_z_mps", rows(5.0, 3, 2)),
        **named("gimbal_roll_rad gimbal_pitch_rad gimbal_azimuth_rad", rows(8.0, 3, 2)),
        **named("q_ip_w q_ip_x q_ip_y q_ip_z", rows(12.0, 4, 2)),
    }


def test_channels_over_the_same_times_share_a_stream() -> None:
    own, wind = np.array([2.0, 5.0]), rows(6.0, 3, 2)
    found = streams.channel_streams(
        {
            "airspeed_mps": Channel(own, np.array([41.0, 43.0]), "m/s"),
            "fuel": Channel(np.array([1.0, 9.0]), np.array([8.0, 7.0]), "kg/s"),
            "wind": Channel(own.copy(), wind, "m/s"),
            "climb": Channel(own, np.array([0.5, 0.7]), "m/s²"),
            "turn": Channel(own, np.array([0.2, 0.3]), "rad/s"),
            "bank": Channel(own, np.array([12.0, 13.0]), "deg/s"),
            "slope": Channel(own, np.array([14.0, 15.0]), "°"),
            "throttle": Channel(own, np.array([55.0, 65.0]), "%"),
        }
    )
    assert [stream.name for stream in found] == ["flight", "flight_2"]
    assert groups(found[0]) == ["airspeed_mps", "wind", "climb", "turn", "bank", "slope", "throttle"]
    assert columns(found[0]) == {
        "time_s": [2.0, 5.0], "airspeed_mps": [41.0, 43.0], **named("wind_mps_0 wind_mps_1 wind_mps_2", wind),
        "climb_mps2": [0.5, 0.7], "turn_radps": [0.2, 0.3], "bank_degps": [12.0, 13.0], "slope_deg": [14.0, 15.0],
        "throttle_percent": [55.0, 65.0],
    }  # fmt: skip
    assert columns(found[1]) == {"time_s": [1.0, 9.0], "fuel_kg_p_s": [8.0, 7.0]}


def test_the_true_gravity_field() -> None:
    """Deflections of 3″ and −7″ are π/216 000 and −7π/648 000 rad; 1 mGal is 1e-5 m/s²."""
    second = np.pi / 648_000.0
    values = GravityValues(
        time=TIME,
        xi=np.array([3.0, 4.0, 5.0]) * second,
        eta=np.array([-7.0, -8.0, -9.0]) * second,
        disturbance=np.array([2e-4, 3e-4, 5e-4]),
        anomaly=np.array([-1e-4, -4e-4, -6e-4]),
        undulation=np.array([44.0, 45.0, 47.0]),
        altitude_msl=np.array([26.0, 35.0, 48.0]),
    )
    found = streams.gravity_stream(values)
    assert (found.name, groups(found)) == ("gravity", ["deflection", "anomaly", "geoid"])
    expected = {
        "time_s": TIME.tolist(), "xi_arcsec": [3.0, 4.0, 5.0], "eta_arcsec": [-7.0, -8.0, -9.0],
        "disturbance_mgal": [20.0, 30.0, 50.0], "anomaly_mgal": [-10.0, -40.0, -60.0],
        "undulation_m": [44.0, 45.0, 47.0], "altitude_msl_m": [26.0, 35.0, 48.0],
    }  # fmt: skip
    shown = columns(found)
    assert list(shown) == list(expected)
    for name, wanted in expected.items():
        assert shown[name] == pytest.approx(wanted, rel=1e-14), name


def test_rows_come_in_blocks() -> None:
    assert list(blocks(0)) == [slice(0, 0)]
    assert list(blocks(40_000)) == [slice(0, 16384), slice(16384, 32768), slice(32768, 40_000)]
