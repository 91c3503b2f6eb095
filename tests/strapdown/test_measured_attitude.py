"""Three accelerometers and a measured attitude: closed loop, closed forms of each error, and the sensor itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.errors import InputError, RunError
from sinssim.sensors.sensor_set_readings import AttitudeSensorErrors, inertial_attitude, sense_attitude
from sinssim.strapdown.measured_attitude import navigate_by_attitude
from sinssim.strapdown.navigation_error import NavError, navigation_error
from sinssim.truth.curve import Curve
from sinssim.truth.motions.analytic import OnEarth
from sinssim.truth.motions.coning_and_rocking import SpinRock
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from sinssim.truth.trajectory import Trajectory
from tests.oracles import integrator as oracle
from tests.slow import slow
from tests.truth.motions import synthetic_flight

UG = 9.80665e-6
ARCMIN = 2.908882086657216e-4
DEG_H = 4.84813681109536e-6
PERFECT = AttitudeSensorErrors()
# A sphere that does not turn, gravity 9.81 m/s²: the Earth of the closed forms. "order-1e-2" knows no flattening.
BALL = Ellipsoid("ball", 6371000.0, 1e-12, 9.81 * 6371000.0**2, 1e-15)


def run(
    trajectory: Trajectory,
    errors: AttitudeSensorErrors,
    rate_hz: float,
    *,
    bias: tuple[float, float, float] = (0.0, 0.0, 0.0),
    held: bool = False,
    seed: int = 0,
) -> NavError:
    imu = trajectory.increments(rate_hz)
    truth = trajectory.state(imu.time)
    measured = sense_attitude(imu.time, inertial_attitude(truth, imu.time, trajectory.ellipsoid), errors, seed)
    solution = navigate_by_attitude(
        imu.time,
        imu.dvel + np.multiply.outer(np.diff(imu.time), bias),
        measured,
        trajectory.state(trajectory.start),
        gravity=trajectory.gravity,
        ellipsoid=trajectory.ellipsoid.name,
        vertical="truth" if held else "free",
        height=truth.height if held else None,
    )
    return navigation_error(truth, solution, trajectory.ellipsoid)


@pytest.fixture
def ball(monkeypatch: pytest.MonkeyPatch) -> Ellipsoid:
    from sinssim.earth.ellipsoids import ELLIPSOIDS

    monkeypatch.setitem(ELLIPSOIDS, "ball", BALL)
    return BALL


def test_inertial_attitude_is_that_of_a_turning_earth() -> None:
    """C_ib = R_z(ω t) C_en C_nb, with scipy's rotations and the reference's local axes."""
    trajectory = GreatCircle(0.9, 0.3, 9000.0, 1.0, 250.0, 600.0)
    t = np.linspace(0.0, 600.0, 13)
    s = trajectory.state(t)
    c_en = np.swapaxes(oracle.ned_axes(s.latitude, s.longitude), -1, -2)
    turned = Rotation.from_rotvec(np.outer(oracle.OMEGA * t, [0.0, 0.0, 1.0]))
    expected = turned * Rotation.from_matrix(c_en @ oracle.matrix(s.q_nb))
    got = Rotation.from_quat(inertial_attitude(s, t, trajectory.ellipsoid), scalar_first=True)
    assert (expected.inv() * got).magnitude().max() < 1e-15


@pytest.mark.parametrize("gravity", ["normal", *slow("j2", "somigliana")])  # a kernel for each
def test_perfect_sensors_close_the_loop(gravity: str) -> None:
    flown = np.arange(0.0, 120.0 + 1.0, 1.0 / 30.0)
    # 1e-5 m: the rounding of twelve thousand steps at six thousand kilometres
    for trajectory, bar in (
        (Parked(0.8, 0.5, 150.0, Rotation.from_euler("ZYX", [1, 0.2, 0.1]).as_quat(scalar_first=True), 120.0), 1e-5),
        (GreatCircle(0.9, 0.3, 9000.0, 1.0, 250.0, 120.0, gravity=gravity), 1e-5),
        (GreatCircle(np.radians(89.9), 0.3, 9000.0, 0.0, 250.0, 120.0, gravity=gravity), 1e-5),  # over the pole
        (Curve(flown, *synthetic_flight(flown), gravity=gravity), 1e-4),
    ):
        error = run(trajectory, PERFECT, 100.0)
        assert np.linalg.norm(error.position_ned, axis=1).max() < bar
        # the attitude is measured; what the computed place makes of it is wrong by the place's own error
        level = np.linalg.norm(error.attitude[:, :2], axis=1)
        assert level.max() < 1e-10


def test_order_of_the_method() -> None:
    """Halving the step on a body that spins and rocks on a lever arm of two metres."""
    rocking = SpinRock([1.0, 2.0, -0.5], 0.3, 0.4, 3.0, [1.5, -1.0, 0.5])
    trajectory = OnEarth(rocking, 0.8, 0.5, 150.0, (1.0, 0.0, 0.0, 0.0), 20.0)
    worst = [np.abs(run(trajectory, PERFECT, rate).velocity_ned).max() for rate in (5.0, 10.0, 20.0)]
    assert worst[0] / worst[1] > 2.0**4
    assert worst[1] / worst[2] > 2.0**4


def test_accelerometer_error_8_13(ball: Ellipsoid) -> None:
    trajectory = Parked(0.0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), 6000.0, ellipsoid=ball)
    error = run(trajectory, PERFECT, 1.0, bias=(50.0 * UG, 0.0, 0.0), held=True)
    w = np.sqrt(9.81 / 6371000.0)
    expected = 50.0 * UG / w**2 * (1.0 - np.cos(w * error.time))
    assert np.abs(error.position_ned[:, 0] - expected).max() < 1e-3 * expected.max()


def test_attitude_bias_and_drift_8_14_8_15(ball: Ellipsoid) -> None:
    """A constant tilt makes Δα (1 − cos ω_s t), a drift Δω₀ (t − sin ω_s t/ω_s)."""
    trajectory = Parked(0.0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), 6000.0, ellipsoid=ball)
    east = np.array([0.0, 1.0, 0.0])  # at 0°, 0° east is the inertial y axis; a turn about it lifts the nose
    w = np.sqrt(9.81 / 6371000.0)
    bias = run(trajectory, AttitudeSensorErrors(bias=0.1 * ARCMIN * east), 1.0, held=True)
    expected = -0.1 * ARCMIN * 6371000.0 * (1.0 - np.cos(w * bias.time))
    assert np.abs(bias.position_ned[:, 0] - expected).max() < 1e-3 * np.abs(expected).max()
    drift = run(trajectory, AttitudeSensorErrors(drift=0.01 * DEG_H * east), 1.0, held=True)
    expected = -0.01 * DEG_H * 6371000.0 * (drift.time - np.sin(w * drift.time) / w)
    assert np.abs(drift.position_ned[:, 0] - expected).max() < 1e-3 * np.abs(expected).max()


def test_error_fixed_in_inertial_space_turns_with_the_earth() -> None:
    """A quarter of a day later an inertial-fixed east error has become a vertical one: its tilt has gone."""
    trajectory = Parked(0.0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), 21541.0)
    time = np.array([0.0, 21541.0])  # a quarter of a sidereal day
    truth = trajectory.state(time)
    q_ib = inertial_attitude(truth, time, trajectory.ellipsoid)
    off = sense_attitude(time, q_ib, AttitudeSensorErrors(bias=np.array([0.0, ARCMIN, 0.0])))
    true, measured = (Rotation.from_quat(q, scalar_first=True) for q in (q_ib, off))
    about_body = (true.inv() * measured).as_rotvec() / ARCMIN
    assert about_body[0] == pytest.approx([0.0, 1.0, 0.0], rel=0.0, abs=1e-6)
    assert about_body[1] == pytest.approx([0.0, 0.0, -1.0], rel=0.0, abs=1e-4)


def test_noise_of_the_readings() -> None:
    trajectory = Parked(0.8, 0.5, 150.0, (1.0, 0.0, 0.0, 0.0), 100.0)
    time = np.linspace(0.0, 100.0, 20001)
    q_ib = inertial_attitude(trajectory.state(time), time, trajectory.ellipsoid)
    noisy = sense_attitude(time, q_ib, AttitudeSensorErrors(noise=ARCMIN), 5)
    true, measured = (Rotation.from_quat(q, scalar_first=True) for q in (q_ib, noisy))
    off = (true.inv() * measured).as_rotvec()
    assert off.std(axis=0) == pytest.approx(np.full(3, ARCMIN), rel=0.02)
    assert np.abs(np.corrcoef(off.T) - np.eye(3)).max() < 0.03
    assert np.array_equal(noisy, sense_attitude(time, q_ib, AttitudeSensorErrors(noise=ARCMIN), 5))
    # white noise of a tilt integrates to g σ √(t Δt) of velocity
    error = run(trajectory, AttitudeSensorErrors(noise=0.1 * ARCMIN), 100.0, seed=1)
    sigma = 9.81 * 0.1 * ARCMIN * np.sqrt(100.0 * 0.01)
    assert 0.05 * sigma < np.abs(error.velocity_ned[-1, :2]).max() < 3.0 * sigma


def test_held_height() -> None:
    flight = GreatCircle(0.9, 0.3, 9000.0, 1.0, 250.0, 3600.0)
    free, held = (run(flight, PERFECT, 10.0, bias=(0.0, 0.0, 100.0 * UG), held=h) for h in (False, True))
    assert np.abs(free.position_ned[:, 2]).max() > 1000.0
    assert np.abs(held.position_ned[:, 2]).max() < 1e-6
    assert np.abs(held.position_ned[:, :2]).max() < 10.0


def test_bad_input() -> None:
    trajectory = Parked(0.8, 0.5, 150.0, (1.0, 0.0, 0.0, 0.0), 10.0)
    imu = trajectory.increments(1.0)
    q = inertial_attitude(trajectory.state(imu.time), imu.time)
    start = trajectory.state(0.0)
    good = {"time": imu.time, "dvel": imu.dvel, "q_ib": q}

    def with_value(name: str, row: int, value: object) -> dict[str, np.ndarray]:
        changed = good[name].copy()
        changed[row] = value
        return {**good, name: changed}

    wrong = [
        ({**good, "q_ib": q[:-1]}, r"time \(11,\), dvel \(10, 3\) and q_ib \(10, 4\) do not belong together"),
        ({**good, "dvel": imu.dvel[0]}, r"dvel \(3,\)"),
        ({**good, "dvel": 0.0}, r"dvel \(1,\)"),
        ({**good, "dvel": [[1.0, 2.0], [3.0]]}, "dvel is not an array of numbers"),
        ({**good, "q_ib": "north"}, "q_ib = 'north' is not an array of numbers"),
        ({"time": imu.time[:4], "dvel": imu.dvel[:3], "q_ib": q[:4]}, "N ≥ 5"),
        (with_value("dvel", 3, [0.0, np.inf, 0.0]), r"dvel\[3\].*interval ending at t = 4.000000 s"),
        (with_value("time", 2, np.nan), r"time\[2\] = nan s"),
        (with_value("q_ib", 7, np.nan), r"q_ib\[7\]"),
        (with_value("q_ib", 7, 0.0), r"q_ib\[7\].*unit quaternion"),
        ({**good, "time": imu.time[::-1]}, "must increase"),
    ]
    for arguments, said in wrong:
        with pytest.raises(InputError, match=said) as caught:
            navigate_by_attitude(**arguments, initial=start)
        assert "\n" not in str(caught.value)
    for options, said in (
        ({"vertical": "truth", "height": [1.0]}, "height has shape"),
        ({"vertical": "truth"}, "needs height"),
        ({"vertical": "barometer"}, "unknown vertical channel"),
        ({"baro_time_constant": 0.0}, "baro_time_constant"),
        ({"gravity": "flat"}, "gravity model"),
    ):
        with pytest.raises(InputError, match=said):
            navigate_by_attitude(**good, initial=start, **options)
    with pytest.raises(InputError, match=r"initial\.latitude"):
        navigate_by_attitude(**good, initial=replace(start, latitude=np.array(50.0)))


def test_numbers_that_diverge() -> None:
    trajectory = Parked(0.8, 0.5, 150.0, (1.0, 0.0, 0.0, 0.0), 10.0)
    imu = trajectory.increments(1.0)
    q = inertial_attitude(trajectory.state(imu.time), imu.time)
    with pytest.raises(RunError, match="height diverged"):
        navigate_by_attitude(imu.time, imu.dvel * 1e306, q, trajectory.state(0.0))


def test_inertial_axes_are_the_earths_at_time_zero_and_not_at_the_first_sample() -> None:
    """A parked vehicle from 5000 s on: the place stays, and the attitude is the true one, not 0.36 rad off."""
    t = 5000.0 + np.arange(201) / 10.0
    parked = Parked(0.9, 0.3, 200.0, (np.cos(0.3), 0.0, 0.0, np.sin(0.3)), 6000.0)
    truth = parked.state(t)
    measured = inertial_attitude(truth, t, parked.ellipsoid)
    imu = parked.increments(10.0)
    solution = navigate_by_attitude(t, imu.dvel[50_000:50_200], measured, parked.state(5000.0))
    error = navigation_error(truth, solution, parked.ellipsoid)
    assert error.angle.max() < 1e-8
    assert error.horizontal.max() < 1e-3
