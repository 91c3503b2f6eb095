"""What a run's recording shows, against a flight and errors that are known in closed form.

The flight goes east along the equator with constant speed and height. The only error is the bias of the forward
accelerometer: the position error is b (1 − cos ω t)/ω², with Schuler's frequency ω, and it lies to the east.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

import sinssim
from sinssim.data import Array

HEIGHT, SPEED, DURATION, BIAS_UG = 9000.0, 230.0, 60.0, 1000.0
G0, EARTH_RATE, EQUATOR = 9.80665, 7.292115e-5, 6378137.0
LEVEL_GRAVITY = 9.7803253359 * (1.0 - 2.0 * HEIGHT * (1.0 + 1.0 / 298.257 + 0.00344979) / EQUATOR)
"""Normal gravity at the equator at this height, to 1e-5 of it (Somigliana's value and its gradient)."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("known") / "run"


@pytest.fixture(scope="module")
def recording(folder: Path) -> dict[str, tuple[Array, Array]]:
    """Time, s, and values of every series and of the map's aircraft, by name."""
    scenario = {
        "name": "known",
        "great_circle": {
            "latitude_deg": 0.0, "longitude_deg": 10.0, "altitude_m": HEIGHT, "course_deg": 90.0, "speed_mps": SPEED,
            "duration_s": DURATION,
        },
        "imu": {"grade": "ideal", "rate_hz": 10.0, "accel_bias_ug": [BIAS_UG, 0.0, 0.0]},
        "navigation": {"algorithms": ["quaternion"]},
        "aiding": {"gnss": {"rate_hz": 1.0, "position_sigma_m": 2.0, "height_sigma_m": 3.0}},
        "filter": {},
    }  # fmt: skip
    sinssim.run(sinssim.Scenario.model_validate(scenario), folder)
    return series(folder / "recording.rrd")


def series(path: Path) -> dict[str, tuple[Array, Array]]:
    """Return what a recording holds over time, time in s."""
    found: dict[str, tuple[Array, Array]] = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        held = {field.name: batch.column(i) for i, field in enumerate(batch.schema)}
        values = held.get("Scalars:scalars", held.get("GeoPoints:positions"))
        if values is None or "sim_time" not in held:
            continue
        time = held["sim_time"].cast("int64").to_numpy() * 1e-9
        rows = np.array(values.to_pylist(), dtype=np.float64).reshape(len(time), -1)
        before = found.get(chunk.entity_path, (np.empty(0), np.empty((0, rows.shape[1]))))
        found[chunk.entity_path] = np.append(before[0], time), np.concatenate([before[1], rows])
    return found


def test_the_motion(recording: dict[str, tuple[Array, Array]]) -> None:
    """Level flight to the east: heights in m, speeds in m/s, up positive, angles in degrees."""
    for name, wanted, slack in (
        ("/flight/height", [HEIGHT], 1e-3),
        ("/flight/speed", [SPEED], 1e-6),
        ("/flight/vertical_speed", [0.0], 1e-6),
        ("/flight/heading", [90.0], 1e-6),
        ("/flight/roll_pitch", [0.0, 0.0], 1e-6),
    ):
        time, values = recording[name]
        assert (time[0], time[-1]) == pytest.approx((0.0, DURATION))
        np.testing.assert_allclose(values, np.broadcast_to(wanted, values.shape), atol=slack, err_msg=name)
    time, place = recording["/map/vehicle"]
    east = np.degrees(SPEED * time / (EQUATOR + HEIGHT))
    np.testing.assert_allclose(place, np.column_stack((np.zeros_like(time), 10.0 + east)), atol=1e-7)


def test_the_sensors(recording: dict[str, tuple[Array, Array]]) -> None:
    """Right is south: the Earth's rate and the transport rate turn the block about left; errors in µg."""
    _, rate = recording["/sensors/gyro/reading"]
    rate = rate[:, 3:]
    turning = -np.degrees(EARTH_RATE + SPEED / (EQUATOR + HEIGHT))
    np.testing.assert_allclose(rate, np.broadcast_to([0.0, turning, 0.0], rate.shape), atol=2e-8)
    _, ideal = recording["/sensors/accel/reading"]
    ideal = ideal[:, :3]
    eotvos = SPEED**2 / (EQUATOR + HEIGHT) + 2.0 * EARTH_RATE * SPEED
    np.testing.assert_allclose(ideal, np.broadcast_to([0.0, 0.0, eotvos - LEVEL_GRAVITY], ideal.shape), atol=2e-4)
    _, error = recording["/sensors/accel/error"]
    np.testing.assert_allclose(error, np.broadcast_to([BIAS_UG, 0.0, 0.0], error.shape), atol=1e-6)


def test_the_summary(folder: Path, recording: dict[str, tuple[Array, Array]]) -> None:
    """Span, rate, and the errors at the end and over the run: ½ b t² grows as the square of time, its rms is √(1/5)."""
    summary = json.loads((folder / "summary.json").read_text())
    assert (summary["start_s"], summary["end_s"], summary["rate_hz"]) == pytest.approx((0.0, DURATION, 10.0))
    own = summary["algorithms"]["quaternion"]
    end = 0.5 * BIAS_UG * 1e-6 * G0 * DURATION**2
    assert own["final_horizontal_error_m"] == pytest.approx(end, rel=2e-3)
    assert own["max_horizontal_error_m"] == pytest.approx(end, rel=2e-3)
    assert own["rms_horizontal_error_m"] == pytest.approx(end / np.sqrt(5.0), rel=5e-3)
    assert own["final_velocity_error_mps"] == pytest.approx(BIAS_UG * 1e-6 * G0 * DURATION, rel=2e-3)


def test_the_errors(recording: dict[str, tuple[Array, Array]]) -> None:
    """To the east as the pendulum says, in m and m/s; nothing to the north."""
    time, east = recording["/navigation/position_east"]
    w = np.sqrt(LEVEL_GRAVITY / (EQUATOR + HEIGHT))
    bias = BIAS_UG * 1e-6 * G0
    np.testing.assert_allclose(east[:, 0], bias * (1.0 - np.cos(w * time)) / w**2, rtol=5e-3, atol=1e-6)
    _, speed = recording["/navigation/velocity_east"]
    np.testing.assert_allclose(speed[:, 0], bias * np.sin(w * time) / w, rtol=5e-3, atol=1e-6)
    np.testing.assert_allclose(recording["/navigation/horizontal/1"][1], np.abs(east), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(recording["/navigation/position_north"][1], 0.0, atol=1e-3)


def test_the_bands(recording: dict[str, tuple[Array, Array]]) -> None:
    """The published 2.5 % and 97.5 % points of χ² with 60 degrees of freedom, 40.482 and 83.298, by 60; 3σ."""
    _, band = recording["/filter/squares/0"]
    np.testing.assert_allclose(band, np.broadcast_to([83.298 / 60.0, 40.482 / 60.0], band.shape), atol=2e-5)
    band = next(values for name, (_, values) in recording.items() if re.fullmatch("/filter/innovations/[^/]+", name))
    np.testing.assert_allclose(np.abs(band), 3.0)
