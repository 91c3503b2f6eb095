"""What a scenario may ask of a run beside the defaults: three rates, a route, a calibration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from pydantic import ValidationError

from sinssim import ImuData, navigate
from sinssim.data import DROPPED, FROZEN
from sinssim.errors import InputError
from sinssim.experiments.run.run_execution import run
from sinssim.recording.result import flagged_words
from sinssim.scenario import Scenario, load_scenario
from sinssim.sensors.imu.compensation import Compensation
from sinssim.sensors.imu.imu_section import Imu, draw
from sinssim.strapdown.frames import FRAMES
from sinssim.units import DEG_H, UG

QUIET = {
    "gyro_arw_deg_sqrt_h": 0.0,
    "accel_vrw_ug_sqrt_hz": 0.0,
    "gyro_instability_deg_h": 0.0,
    "accel_instability_ug": 0.0,
}
FLIGHT = {"latitude_deg": 50.0, "course_deg": 40.0, "speed_mps": 200.0, "duration_s": 60.0}


def scenario(navigation: dict[str, Any], **more: Any) -> Scenario:
    navigation = {"vertical": "free", **navigation}  # the default of `navigate`, which results are compared with
    data = {"name": "options", "great_circle": FLIGHT, "imu": {"grade": "ideal"}, "navigation": navigation, **more}
    return Scenario.model_validate(data)


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("rates", [(50.0, 25.0, 5.0), (50.0, 5.0)])
def test_three_rates_as_navigate_has_them(frame: str, rates: tuple[float, ...]) -> None:
    errors = {}
    for slow in ("hold", "extrapolate"):
        result = run(scenario({"rates_hz": rates, "slow_quantities": slow, "frame": frame}))
        solution = result.solutions["quaternion"]
        assert np.allclose(np.diff(solution.time), 0.2, rtol=0, atol=1e-9)
        first = result.truth.trajectory.state(result.truth.ideal.time[0])
        direct = navigate(result.truth.ideal, first, rates_hz=rates, slow_quantities=slow, frame=frame)
        assert np.array_equal(solution.latitude, direct.latitude)
        errors[slow] = result.summary["algorithms"]["quaternion"]["max_horizontal_error_m"]
    assert errors["extrapolate"] < errors["hold"]


@pytest.mark.parametrize("frame", ["level", "inertial"])
def test_navigator_on_another_ellipsoid_as_navigate_has_it(frame: str) -> None:
    result = run(scenario({"ellipsoid": "krasovsky-1940", "frame": frame}, truth={"ellipsoid": "pz-90.11"}))
    solution = result.solutions["quaternion"]
    first = result.truth.trajectory.state(result.truth.ideal.time[0])
    direct = navigate(result.truth.ideal, first, ellipsoid="krasovsky-1940", frame=frame)
    assert np.array_equal(solution.latitude, direct.latitude)
    assert solution.latitude[0] == first.latitude  # the same numbers at the start
    own = run(scenario({"frame": frame}, truth={"ellipsoid": "pz-90.11"}))
    same = run(scenario({"frame": frame, "ellipsoid": "pz-90.11"}, truth={"ellipsoid": "pz-90.11"}))
    assert np.array_equal(own.solutions["quaternion"].latitude, same.solutions["quaternion"].latitude)
    most = {name: r.summary["algorithms"]["quaternion"]["max_horizontal_error_m"] for name, r in
            (("own", own), ("other", result))}  # fmt: skip
    assert most["own"] < 1e-3 < 0.1 < most["other"]


def test_navigator_on_another_ellipsoid_is_said(tmp_path: Path) -> None:
    from sinssim.scenario.notes import earth_of_the_navigator

    (note,) = earth_of_the_navigator(scenario({"ellipsoid": "chapter"}))
    assert 'navigation.ellipsoid = "chapter" differs from truth.ellipsoid = "wgs84"' in note
    assert not list(earth_of_the_navigator(scenario({"ellipsoid": "wgs84"})))
    assert not list(earth_of_the_navigator(scenario({})))


def test_height_loop_goes_by_the_barometer() -> None:
    """Told b too high it follows as 1 − s²/(s + 1/τ)³ does: b (1 − (1 − 2x + x²/2) e⁻ˣ), x = t/τ.

    t counts from the middle of the sample at whose end the first reading comes: the loop is of second order in it.

    k₂ makes up for the gradient of gravity as if the height were the barometer's: 2gb/R is left over, and pushes like
    an accelerometer's bias, by t²/2 e⁻ˣ of it.
    """
    exact = {"bias_m": 30.0, "bias_sigma_m": 0.0, "sigma_m": 1e-9, "rate_hz": 100.0}
    loop = {"vertical": "baro-loop", "baro_time_constant_s": 10.0}
    result = run(scenario(loop, aiding={"baro": exact}))
    x = np.maximum(result.truth.ideal.time - np.mean(result.truth.ideal.time[:2]), 0.0) / 10.0
    expected = 30.0 * (1.0 - (1.0 - 2.0 * x + 0.5 * x * x) * np.exp(-x))
    expected += 2.0 * 9.81 * 30.0 / 6.371e6 * 0.5 * (10.0 * x) ** 2 * np.exp(-x)
    np.testing.assert_allclose(result.errors["quaternion"].height, expected, rtol=0, atol=2e-4)
    assert "filter" not in result.summary
    beside = run(scenario(loop, aiding={"baro": exact}, filter={}))
    assert np.array_equal(beside.solutions["quaternion"].height, result.solutions["quaternion"].height)
    true = run(scenario(loop))
    assert np.abs(true.errors["quaternion"].height).max() < 1e-3


def test_height_loop_without_a_single_reading() -> None:
    silent = {"baro": {"outages_s": [[0.0, 60.0]]}}
    with pytest.raises(InputError, match=r"no height reference: the outages of \[aiding\.baro\] cover the whole run"):
        run(scenario({"vertical": "baro-loop"}, aiding=silent))
    beside = run(scenario({"vertical": "baro-loop"}, aiding=silent, filter={}))  # the filter says so
    free = run(scenario({"vertical": "free"}))
    assert np.array_equal(beside.solutions["quaternion"].height, free.solutions["quaternion"].height)
    for navigation, aiding, said in (
        ({"vertical": "free"}, {"baro": {}}, r'add \[filter\], or navigation\.vertical = "baro-loop"'),
        ({"vertical": "baro-loop"}, {"baro": {}, "gnss": {}}, r"\[aiding\] needs a \[filter\] that uses it"),
    ):
        with pytest.raises(ValidationError, match=said):
            scenario(navigation, aiding=aiding)


def test_route_of_the_transverse_frame() -> None:
    """The vehicle on the route's equator and 90° away from it along a meridian: one flight, one answer."""
    route = [50.0, 0.0, 60.0, 20.0]
    result = run(scenario({"frame": "transverse", "route_deg": route}))
    first = result.truth.trajectory.state(result.truth.ideal.time[0])
    direct = navigate(result.truth.ideal, first, frame="transverse", route=tuple(np.radians(route)))
    assert np.array_equal(result.solutions["quaternion"].latitude, direct.latitude)
    other = run(scenario({"frame": "transverse"}))
    assert not np.array_equal(other.solutions["quaternion"].latitude, direct.latitude)
    for each in (result, other):
        assert each.summary["algorithms"]["quaternion"]["max_horizontal_error_m"] < 1e-4


@pytest.mark.parametrize(
    ("imu_hz", "navigation", "said"),
    [
        (100.0, {"rates_hz": [100.0, 30.0, 10.0]}, "navigation.rates_hz: the medium rate, 30 Hz, does not divide"),
        (100.0, {"rates_hz": [80.0, 40.0, 10.0]}, "navigation.rates_hz: the fast rate, 80 Hz, does not divide"),
        (50.0, {"rates_hz": [100.0, 50.0, 10.0]}, "the fast rate, 100 Hz, does not divide the data's rate, 50 Hz"),
        (100.0, {"rates_hz": [100.0, 30.0]}, "the medium rate, 30 Hz, does not divide the fast rate, 100 Hz, a whole"),
        (100.0, {"rates_hz": [100.0]}, "or two, of attitude and of velocity and position; it has 1"),
        (100.0, {"rates_hz": [100.0, 50.0, 10.0, 5.0]}, "must have three rates, of the fast, medium and slow part, or"),
        (100.0, {"rates_hz": [100.0, -50.0, 10.0]}, "navigation.rates_hz"),
        (
            100.0,
            {"rates_hz": [100.0, 50.0, 10.0], "algorithms": ["quaternion", "rotation-vector-2"]},
            "sample by sample, but rotation-vector-2 by several at once; use quaternion, poisson, euler or one of "
            "their variants, or rotation-vector-1p.",
        ),
        (
            100.0,
            {"rates_hz": [100.0, 50.0, 10.0], "algorithms": ["functional-iteration"]},
            "sample by sample, but functional-iteration by several",
        ),
        (100.0, {"slow_quantities": "holds"}, "Did you mean 'hold'?"),
        (100.0, {"slow_quantities": "extrapolate"}, 'slow_quantities = "extrapolate" would have no effect'),
        (100.0, {"frame": "inertial", "curvature": "simplified"}, 'curvature = "simplified" would have no effect'),
        (
            100.0,
            {"vertical": "free", "baro_time_constant_s": 20.0},
            "baro_time_constant_s = 20 would have no effect: it belongs to",
        ),
        (
            100.0,
            {"route_deg": [50.0, 0.0, 60.0, 20.0]},
            'navigation.route_deg would have no effect: it is for frame = "transverse"',
        ),
        (100.0, {"frame": "transverse", "route_deg": [50.0, 0.0, 50.0, 360.0]}, "coincide or are antipodal"),
        (100.0, {"frame": "transverse", "route_deg": [50.0, 0.0, -50.0, 180.0]}, "coincide or are antipodal"),
        (100.0, {"frame": "transverse", "route_deg": [50.0, 0.0, 95.0, 180.0]}, "must be at most 90"),
    ],
)
def test_what_cannot_be_is_said_when_the_scenario_is_loaded(
    tmp_path: Path, imu_hz: float, navigation: dict[str, Any], said: str
) -> None:
    import tomli_w

    file = tmp_path / "wrong.toml"
    file.write_text(tomli_w.dumps({"great_circle": FLIGHT, "imu": {"rate_hz": imu_hz}, "navigation": navigation}))
    with pytest.raises(InputError) as caught:
        load_scenario(file)
    assert said in str(caught.value)


def test_perfect_calibration_gives_the_ideal_increments_back(tmp_path: Path) -> None:
    imu = {"grade": "tactical", **QUIET, "gyro_quadratic_sigma_ppm_per_deg_s": 10.0, "accel_cubic_sigma_ug_per_g3": 9.0}
    plain = run(scenario({}, imu=imu))
    assert plain.sensed.imu is plain.sensed.measured
    result = run(scenario({}, imu=imu, compensation={}), tmp_path / "run")
    assert np.abs(result.sensed.measured.dvel - result.truth.ideal.dvel).max() > 1e-6
    # the measured increments are whole steps, whose remainders enter the next increment: one step at most
    for name, step in (("dvel", 2.0**-46), ("dtheta", 2.0**-52)):
        off = getattr(result.sensed.imu, name) - getattr(result.truth.ideal, name)
        assert np.abs(off).max() < 1.01 * step
    before = plain.summary["algorithms"]["quaternion"]["max_horizontal_error_m"]
    after = result.summary["algorithms"]["quaternion"]["max_horizontal_error_m"]
    assert before > 1.0
    assert after < 1e-5
    stream = pq.read_table(tmp_path / "run" / "streams" / "imu_compensated.parquet")
    assert stream.column_names == pq.read_schema(tmp_path / "run" / "streams" / "imu_measured.parquet").names
    assert np.array_equal(stream["dvel_z_mps"].to_numpy(), result.sensed.imu.dvel[:, 2])


def test_what_the_sensors_flag_is_recorded_and_counted(tmp_path: Path) -> None:
    faults = [
        {"type": "dropout", "from_s": 2.0, "to_s": 3.0, "channels": ["accel_x"]},
        {"type": "freeze", "from_s": 2.5, "to_s": 3.5},
    ]
    result = run(scenario({}, imu={"grade": "ideal", "rate_hz": 10.0, "faults": faults}), tmp_path / "run")
    assert result.summary["flagged_samples"] == {"saturated": 0, "dropped": 10, "frozen": 10}
    stream = pq.read_table(tmp_path / "run" / "streams" / "imu_measured.parquet")
    late = stream["time_s"].to_numpy()
    assert np.array_equal(late[stream["flags_accel_x"].to_numpy() >= FROZEN], late[25:35])
    assert np.array_equal(late[stream["flags_accel_x"].to_numpy() % FROZEN == DROPPED], late[20:30])
    assert not stream["flags_gyro_x"].to_numpy()[:25].any()
    found = flagged_words(result.summary["flagged_samples"], len(result.sensed.measured))
    assert found == f"Flagged by the sensors, of {len(result.sensed.measured)} samples: 10 dropped, 10 frozen."
    assert found in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert run(scenario({})).summary["flagged_samples"] == {}


def test_imperfect_calibration_leaves_its_own_errors() -> None:
    """Of a bias alone, a constant; drawn anew for every seed, with the given 1σ."""
    imu = Imu(grade="laser-standard")
    section = Compensation(gyro_bias_sigma_deg_h=0.004, accel_bias_sigma_ug=20.0, accel_scale_sigma_ppm=7.0)
    left = {"gyro bias": [], "accel bias": [], "accel scale": []}
    for seed in range(300):
        true = draw(imu, seed)
        known = section.draw(true, seed)
        assert np.array_equal(true.gyro.scale, known.gyro.scale)
        assert np.array_equal(true.accel.misalignment, known.accel.misalignment)
        left["gyro bias"].append(true.gyro.bias - known.gyro.bias)
        left["accel bias"].append(true.accel.bias - known.accel.bias)
        left["accel scale"].append(true.accel.scale - known.accel.scale)
    sigmas = (0.004 * DEG_H, 20.0 * UG, 7e-6)
    for values, sigma in zip(left.values(), sigmas, strict=True):  # 900 draws: 2.4 % of spread
        assert np.std(values) == pytest.approx(sigma, rel=0.08)
        assert abs(np.mean(values)) < 4.0 * sigma / 30.0


def test_calibration_is_of_this_run_and_seeded() -> None:
    imu, compensation = {"grade": "laser-standard", **QUIET}, {"gyro_bias_sigma_deg_h": 0.01}
    first, again, other = (run(scenario({}, imu=imu, compensation=compensation, seed=s)) for s in (3, 3, 4))

    def left(imu: ImuData, ideal: ImuData) -> np.ndarray:
        return (imu.dtheta - ideal.dtheta) / np.diff(ideal.time)[:, None] / DEG_H

    bias = left(first.sensed.imu, first.truth.ideal)
    assert np.ptp(bias, axis=0).max() < 1e-6
    assert 1e-4 < np.abs(bias[0]).max() < 0.04
    assert np.array_equal(first.sensed.imu.dtheta, again.sensed.imu.dtheta)
    assert np.abs(left(other.sensed.imu, other.truth.ideal)[0] - bias[0]).max() > 1e-4


def test_calibration_has_no_negative_uncertainty() -> None:
    with pytest.raises(ValidationError, match="gyro_scale_sigma_ppm"):
        scenario({}, compensation={"gyro_scale_sigma_ppm": -1.0})
