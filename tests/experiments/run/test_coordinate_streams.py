"""Streams in further coordinates: which a run records, and what is in them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from sinssim import data, earth, rotation
from sinssim.data import Array, NavSolution
from sinssim.errors import InputError
from sinssim.experiments.run.run_execution import run
from sinssim.experiments.run.run_streams import CoordinateStreams
from sinssim.recording.streams import Stream
from sinssim.scenario import Scenario
from sinssim.strapdown.frames.route_pole import route_pole
from sinssim.strapdown.motion_coordinates import conditional, earth_fixed, inertial, level_axes


def flight(frame: str, **output: Any) -> Scenario:
    """Twenty seconds along a great circle, on sensors without errors."""
    return Scenario.model_validate(
        {
            "name": "flight",
            "great_circle": {
                "latitude_deg": 60.0, "longitude_deg": 10.0, "altitude_m": 9000.0, "course_deg": 70.0,
                "speed_mps": 230.0, "duration_s": 20.0,
            },
            "imu": {"grade": "ideal", "rate_hz": 10.0},
            "navigation": {"frame": frame, "algorithms": ["quaternion"]},
            "output": output,
        }
    )  # fmt: skip


def columns(folder: Path, name: str) -> Array:
    table = pq.read_table(folder / "streams" / f"{name}.parquet")
    return np.column_stack([table[column].to_numpy() for column in table.column_names])


def recorded(folder: Path) -> set[str]:
    usual = ("truth", "imu_", "nav_", "error_", "events")
    return {path.stem for path in (folder / "streams").iterdir() if not path.stem.startswith(usual)}


@pytest.mark.parametrize(
    ("frame", "expected"),
    [
        ("level", set()),
        ("inertial", {"inertial_truth", "inertial_quaternion"}),
        ("wander", {"frame_quaternion"}),
        ("transverse", {"frame_quaternion", "conditional_truth", "conditional_quaternion"}),
    ],
)
def test_a_frame_records_its_own_coordinates(tmp_path: Path, frame: str, expected: set[str]) -> None:
    run(flight(frame), tmp_path / "run")
    assert recorded(tmp_path / "run") == expected


def test_every_kind_holds_the_motion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(data, "BLOCK", 64)  # several blocks
    kinds = ["earth-fixed", "inertial", "frame", "conditional", "pz-90.11", "krasovsky-1940"]
    folder = tmp_path / "run"
    result = run(flight("transverse", coordinates=kinds, angles="-180..180"), folder)
    names = {kind.replace("-", "_").replace(".", "_") for kind in kinds}
    both = {f"{name}_{of}" for name in (*names, "angles") for of in ("truth", "quaternion")}
    assert recorded(folder) == both - {"frame_truth"}
    assert {"earth-fixed", "frame"} <= set(result.scenario.coordinates)
    s = result.solutions["quaternion"]
    fixed, free, axes = earth_fixed(s), inertial(s, s.time), level_axes(s)
    there = conditional(s, route_pole(None, s.latitude[0], s.longitude[0], result.truth.state.velocity_ned[0]))
    own = np.column_stack((axes.azimuth, axes.velocity, axes.heading))
    turned = np.column_stack((there.axes.azimuth, there.axes.velocity, there.axes.heading))
    expected = {
        "earth_fixed": np.hstack(fixed),
        "inertial": np.hstack(free),
        "frame": own,
        "conditional": np.column_stack((there.latitude, there.longitude, turned)),
        "angles": np.column_stack(
            (*rotation.euler_from_quaternion(s.q_nb)[:2], rotation.euler_from_quaternion(s.q_nb)[2])
        ),
    }
    for name, values in expected.items():
        found = columns(folder, f"{name}_quaternion")
        np.testing.assert_array_equal(found[:, 0], s.time)
        np.testing.assert_allclose(found[:, 1:], values, rtol=1e-15, atol=1e-15, err_msg=name)
    # the same place: back from the other ellipsoids and the other datum to Earth-fixed coordinates of WGS-84
    for name, ellipsoid in (("pz_90_11", "pz-90.11"), ("krasovsky_1940", "krasovsky-1940")):
        place = earth.geodetic_to_ecef(
            *columns(folder, f"{name}_quaternion")[:, 1:].T, earth.ellipsoid_by_name(ellipsoid)
        )
        if ellipsoid in earth.DATUMS:
            place = earth.change_datum(place, ellipsoid, "wgs84")
        np.testing.assert_allclose(place, fixed.position, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize(
    ("frame", "output", "message"),
    [
        (
            "level",
            {"coordinates": ["frame"]},
            r'"frame" needs the frame wander, free-azimuth or transverse; .* "level"',
        ),
        ("wander", {"coordinates": ["conditional"]}, r'"conditional" needs the frame transverse; .* "wander"'),
        ("level", {"coordinates": ["ecef"]}, r"unknown kind of coordinates 'ecef'"),
        ("level", {"coordinates": ["wgs-84"]}, r"unknown kind of coordinates 'wgs-84'. Did you mean 'wgs84'\?"),
        ("level", {"angles": "0..180"}, r"0\.\.360"),
    ],
)
def test_what_cannot_be_is_refused(frame: str, output: dict[str, Any], message: str) -> None:
    with pytest.raises((InputError, ValueError), match=message):
        flight(frame, **output)


def test_the_azimuth_of_the_axes_at_the_start(tmp_path: Path) -> None:
    """Axes 30° from north: the speed is the same, and course and heading are 30° less than relative to north."""
    own = flight("free-azimuth").model_dump(exclude_unset=True)
    own["navigation"]["azimuth_deg"] = 30.0
    true = run(Scenario.model_validate(own), tmp_path / "run").truth.state
    north, east, down = true.velocity_ned[0]
    course = np.arctan2(east, north) - np.radians(30.0)
    heading = rotation.euler_from_quaternion(true.q_nb[0])[2] - np.radians(30.0)
    speed = np.hypot(north, east)
    wanted = [np.radians(30.0), speed * np.cos(course), speed * np.sin(course), down, heading]
    np.testing.assert_allclose(columns(tmp_path / "run", "frame_quaternion")[0, 1:], wanted, atol=1e-9)


def test_every_column_by_its_name() -> None:
    """Two instants on the equator, at the longitudes 0 and 0.6 rad, 2 s apart; north is z, and up is outwards.

    The nose points north with the wings level, which is a turn of −90° about y at the longitude zero."""
    time, a, rate = np.array([5.0, 7.0]), 6378137.0, 7.292115e-5
    half = np.sqrt(0.5)
    heading = np.radians([350.0, 10.0])
    turned = rotation.multiply(
        np.column_stack((np.cos(heading / 2.0), np.zeros((2, 2)), np.sin(heading / 2.0))),
        rotation.multiply(
            np.array([np.cos(0.05), 0.0, np.sin(0.05), 0.0]), np.array([np.cos(0.1), np.sin(0.1), 0.0, 0.0])
        ),
    )  # roll 0.2 rad, pitch 0.1 rad
    velocity = np.array([[3.0, 200.0, -7.0], [4.0, 300.0, -8.0]])
    level = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    motion = NavSolution(time, np.zeros(2), np.array([0.0, 0.6]), np.array([10.0, 20.0]), velocity, level, np.zeros(2))
    kinds = ("earth-fixed", "inertial", "frame", "conditional")
    coordinates = CoordinateStreams(kinds, None, earth.WGS84, np.array([0.0, 0.0, 1.0]), (0.0, -0.2), 5.0)
    assert [stream.name for stream in coordinates.of("truth", time, motion)] == [
        "earth_fixed_truth",
        "inertial_truth",
        "conditional_truth",
    ]
    own = replace(motion, azimuth=np.radians([30.0, 90.0]))
    held = {stream.name: table(stream) for stream in coordinates.of("euler", time, own)}
    assert list(held) == ["earth_fixed_euler", "inertial_euler", "frame_euler", "conditional_euler"]
    for name, axes, angle, added in (("earth_fixed", "e", 0.6, 0.0), ("inertial", "i", 0.6 + 2.0 * rate, rate)):
        out, east = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        second = 8.0 * out + (300.0 + added * (a + 20.0)) * east
        about = np.array([np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)])
        q = rotation.multiply(about, np.array([half, 0.0, -half, 0.0]))
        expected = {
            "time_s": time, f"x_{axes}_m": [a + 10.0, (a + 20.0) * out[0]], f"y_{axes}_m": [0.0, (a + 20.0) * out[1]],
            f"z_{axes}_m": [0.0, 0.0], f"vx_{axes}_mps": [7.0, second[0]],
            f"vy_{axes}_mps": [200.0 + added * (a + 10.0), second[1]], f"vz_{axes}_mps": [3.0, 4.0],
            f"q_{axes}b_w": [half, q[0]], f"q_{axes}b_x": [0.0, q[1]], f"q_{axes}b_y": [-half, q[2]],
            f"q_{axes}b_z": [0.0, q[3]],
        }  # fmt: skip
        found = held[f"{name}_euler"]
        angles = [found.pop(f"about_{axis}_i_rad") for axis in "xyz"] if axes == "i" else []
        assert list(found) == list(expected)
        for column, wanted in expected.items():
            np.testing.assert_allclose(found[column], wanted, rtol=1e-12, atol=1e-8, err_msg=column)
        if angles:
            np.testing.assert_allclose(angles[1], np.full(2, -np.pi / 2.0), atol=1e-7)
    along = np.cos(np.radians(30.0)), np.sin(np.radians(30.0))
    frame = {
        "time_s": time, "azimuth_of_x_rad": np.radians([30.0, 90.0]),
        "velocity_x_mps": [3.0 * along[0] + 200.0 * along[1], 300.0],
        "velocity_y_mps": [200.0 * along[0] - 3.0 * along[1], -4.0], "velocity_d_mps": [-7.0, -8.0],
        "heading_from_x_rad": np.radians([330.0, 270.0]),
    }  # fmt: skip
    route = {
        "time_s": time, "conditional_latitude_rad": [0.0, 0.0], "conditional_longitude_rad": [0.2, 0.8],
        "azimuth_of_x_rad": [0.0, 0.0], "velocity_x_mps": [3.0, 4.0], "velocity_y_mps": [200.0, 300.0],
        "velocity_d_mps": [-7.0, -8.0], "heading_from_x_rad": [0.0, 0.0],
    }  # fmt: skip
    for name, expected in (("frame", frame), ("conditional", route)):
        assert list(held[f"{name}_euler"]) == list(expected)
        for column, wanted in expected.items():
            np.testing.assert_allclose(held[f"{name}_euler"][column], wanted, rtol=1e-12, atol=1e-8, err_msg=column)
    north = replace(motion, q_nb=turned)
    for angles, wanted in (("0..360", [350.0, 10.0]), ("-180..180", [-10.0, 10.0]), ("continuous", [350.0, 370.0])):
        (stream,) = replace(coordinates, names=(), angles=angles).of("euler", time, north)
        found = table(stream)
        assert (stream.name, list(found)) == ("angles_euler", ["time_s", "roll_rad", "pitch_rad", "heading_rad"])
        np.testing.assert_allclose(found["roll_rad"], [0.2, 0.2])
        np.testing.assert_allclose(found["pitch_rad"], [0.1, 0.1])
        if angles == "continuous":  # whole turns are free at the start
            assert np.diff(found["heading_rad"]) == pytest.approx(np.radians(20.0))
        else:
            np.testing.assert_allclose(np.degrees(found["heading_rad"]), wanted, atol=1e-9)


def test_inertial_axes_are_the_same_for_all_motions_of_a_run(tmp_path: Path) -> None:
    """A parked vehicle that aligns itself for 20 s: its solution begins 20 s after the truth, in the same axes."""
    parked = {"latitude_deg": 50.0, "longitude_deg": 10.0, "duration_s": 30.0}
    scenario = {
        "name": "p", "parked": parked, "imu": {"grade": "ideal", "rate_hz": 10.0},
        "output": {"coordinates": ["inertial"]},
        "navigation": {"alignment": {"duration_s": 20.0}, "vertical": "truth"}, "recording": {"keep": "streams"},
    }  # fmt: skip
    run(Scenario.model_validate(scenario), tmp_path / "run")
    true, found = (columns(tmp_path / "run", f"inertial_{name}") for name in ("truth", "quaternion"))
    assert (true[0, 0], found[0, 0]) == (0.0, 20.0)
    place = earth.geodetic_to_ecef(np.radians(50.0), np.radians(10.0), 0.0)
    assert true[0, 1:4] == pytest.approx(place, abs=1e-6)
    later = true[true[:, 0] >= 20.0]
    np.testing.assert_allclose(found[:, 1:4], later[:, 1:4], atol=1e-3)  # the Earth turns by 6 km in 20 s
    np.testing.assert_allclose(found[:, 4:7], later[:, 4:7], atol=1e-3)


def table(stream: Stream) -> dict[str, Array]:
    found = {"time_s": stream.time}
    for vector in stream.vectors:
        rows = np.asarray(vector.values[0 : len(stream.time)])
        found |= {name: rows[:, k] for k, name in enumerate(vector.columns)}
    return found
