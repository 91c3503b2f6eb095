"""Every deterministic error of the sensors alone in a flight: the navigation error it makes against a reference.

The reference is the linear error equations of `tests.oracles.error_equations` under the error that the instrument model
of `tests.oracles.imu_model` gives at the true motion, or a closed form. The bar is 2 %; what is left is of second order
in the errors and in the interval, and most terms come within 0.2 %.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import dawsn

from sinssim import rotation
from sinssim.data import ImuData
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_errors import Fault, WarmUp
from sinssim.sensors.imu.laser_gyro import LaserGyro, NullShift
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import NavError, navigation_error
from sinssim.truth.motions.analytic import OnEarth
from sinssim.truth.motions.coning_and_rocking import SpinRock
from sinssim.truth.motions.parked_and_great_circle import GreatCircle
from tests.oracles import error_equations
from tests.oracles.error_equations import Nominal, Sources
from tests.oracles.imu_model import output, temperature
from tests.strapdown.test_error_sources import SPHERE, SPHERE_RADIUS, SPHERE_RATE, mismatch, nominal_of, simulate

DURATION = 1800.0
WARM = WarmUp(-12.0, 8.0, 500.0)
SIGNS = np.array([1.0, -1.5, 2.0])
OFF = np.array([[0.0, 1.0, -2.0], [3.0, 0.0, 1.5], [-0.5, 2.5, 0.0]])

# Sizes that make errors of about 0.01 deg/h and 50 µg at the flight's rates of 5e-5 rad/s and its forces of 10 m/s²
GYRO = {
    "bias": 5e-8 * SIGNS,
    "scale": 1e-3 * SIGNS,
    "misalignment": 1e-3 * OFF,
    "asymmetry": 2e-3 * SIGNS,
    "quadratic": 20.0 * SIGNS,
    "cubic": 4e5 * SIGNS,
    "cross_axis": 20.0 * OFF,
    "g_sensitivity": 5e-9 * (OFF + np.diag(SIGNS)),
    "bias_temperature": 5e-9 * SIGNS,
    "scale_temperature": 1e-4 * SIGNS,
    "ramp": 5e-11 * SIGNS,
}
ACCEL = {
    "bias": 5e-4 * SIGNS,
    "scale": 1e-4 * SIGNS,
    "misalignment": 1e-4 * OFF,
    "asymmetry": 1e-4 * SIGNS,
    "quadratic": 1e-5 * SIGNS,
    "cubic": 1e-6 * SIGNS,
    "cross_axis": 1e-5 * OFF,
    "bias_temperature": 5e-5 * SIGNS,
    "scale_temperature": 1e-5 * SIGNS,
    "ramp": 5e-7 * SIGNS,
}


@pytest.fixture(scope="module")
def flight() -> GreatCircle:
    """Level flight with a block that is mounted askew, so that every axis feels both gravity and rotation."""
    askew = rotation.quaternion_from_euler(0.6, -0.5, 2.0)
    return GreatCircle(np.radians(50.0), np.radians(10.0), 9000.0, np.radians(60.0), 230.0, DURATION, q_bs=askew)


def reference(flight: GreatCircle, time: np.ndarray, sources: Sources) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return error_equations.solve(nominal_of(flight), time, sources, height_held=True)


def compare(error: NavError, every: int, expected: tuple[np.ndarray, np.ndarray, np.ndarray], tolerance: float) -> None:
    position, velocity, attitude = expected
    assert mismatch(error.position_ned[::every, :2], position[:, :2]) < tolerance
    assert mismatch(error.velocity_ned[::every, :2], velocity[:, :2]) < tolerance
    assert mismatch(error.attitude[::every], attitude) < tolerance


@pytest.mark.parametrize(("triad", "term"), [*(("gyro", term) for term in GYRO), *(("accel", term) for term in ACCEL)])
def test_each_term_alone_in_level_flight(flight: GreatCircle, triad: str, term: str) -> None:
    one = TriadErrors(**{term: (GYRO if triad == "gyro" else ACCEL)[term]})
    errors = ImuErrors(**{triad: one}, warm_up=WARM)

    def of(kind: str):
        def wrong(t: float, true: Nominal) -> np.ndarray:
            since = np.array([t])
            warmth, force = temperature(errors, since), true.force[None]
            inputs = true.rate[None] if kind == "gyro" else force
            return (output(getattr(errors, kind), inputs, force, warmth, since) - inputs)[0]

        return wrong

    error = simulate(flight, errors, rate_hz=20.0)
    every = 20 * 60
    expected = reference(flight, error.time[::every], Sources(gyro=of("gyro"), accel=of("accel")))
    assert np.abs(expected[0]).max() > 30.0  # m: there is something to compare
    compare(error, every, expected, 0.004)


def test_the_null_shift_of_laser_gyros_alone_in_level_flight(flight: GreatCircle) -> None:
    """Gas that flows at 0.3 mm/s in a ring of 42 cm, which warms from −15 to 25 °C and hops to the next mode."""
    ring = LaserGyro(0.42, 8.487e-3, 632.8e-9, 0.0, 1e-3, 400.0)
    speed, flow, gain, expansion = 550.0, 3e-4, 0.008, 5e-8
    warm = WarmUp(-15.0, 25.0, 500.0)
    errors = ImuErrors(warm_up=warm, null_shift=NullShift(ring, gain, flow, speed, expansion))

    def shift(t: float, true: Nominal) -> np.ndarray:
        waves = expansion * 0.42 * temperature(errors, np.array([t]))[0] / 632.8e-9
        off = (waves - round(waves)) * 299792458.0 / 0.42  # Hz, of the mode from the line's centre
        xi = off * 632.8e-9 / speed
        at_centre = 299792458.0 * gain * 632.8e-9 * flow / (4.0 * np.pi**1.5 * 8.487e-3 * speed)
        return np.full(3, -at_centre * 2.0 * xi * dawsn(xi))

    assert 0.5 < expansion * 0.42 * 25.0 / 632.8e-9 < 1.0
    error = simulate(flight, errors, rate_hz=20.0)
    every = 20 * 60
    expected = reference(flight, error.time[::every], Sources(gyro=shift))
    assert np.abs(expected[0]).max() > 30.0
    compare(error, every, expected, 0.004)


# Faults


def test_a_step_of_the_biases(flight: GreatCircle) -> None:
    gyro, accel = 1e-7 * SIGNS, 1e-3 * SIGNS
    fault = Fault("bias-step", 600.0, 1200.0, np.concatenate([gyro, accel]))
    error = simulate(flight, ImuErrors(faults=(fault,)))
    every = 600

    def within(value: np.ndarray):
        return lambda t, true: value if 600.0 < t <= 1200.0 else np.zeros(3)

    expected = reference(flight, error.time[::every], Sources(gyro=within(gyro), accel=within(accel)))
    compare(error, every, expected, 0.004)


@pytest.mark.parametrize("triad", ["gyro", "accel"])
def test_a_spike_is_an_error_of_the_start_from_then_on(flight: GreatCircle, triad: str) -> None:
    spike = np.concatenate([1e-5 * SIGNS, np.zeros(3)] if triad == "gyro" else [np.zeros(3), 0.1 * SIGNS])
    error = simulate(flight, ImuErrors(faults=(Fault("spike", 600.0, 600.0, spike),)))
    assert np.abs(error.velocity_ned[:5999]).max() < 1e-6
    c_nb = rotation.dcm_from_quaternion(flight.state(600.0).q_nb)
    start = np.concatenate([-c_nb @ spike[:3], c_nb @ spike[3:], np.zeros(3)])
    start[5] = 0.0  # the height is held
    time = error.time[6000::600]
    after = replace(
        error,
        **{name: getattr(error, name)[6000:] for name in ("time", "position_ned", "velocity_ned", "attitude")},
    )
    compare(after, 600, reference(flight, time, Sources(start=start)), 0.01)


def test_a_dropout_loses_the_velocity_gained_meanwhile(flight: GreatCircle) -> None:
    fault = Fault("dropout", 600.0, 600.5, np.array([0, 0, 0, 1, 0, 0], dtype=float))
    error = simulate(flight, ImuErrors(faults=(fault,)))
    force = flight.rates(600.25)[1][0]
    lost = rotation.dcm_from_quaternion(flight.state(600.25).q_nb) @ [-0.5 * force, 0.0, 0.0]
    assert np.hypot(*lost[:2]) > 0.5
    assert error.velocity_ned[6006, :2] == pytest.approx(lost[:2], rel=0.02)


def test_a_range_that_is_too_small_loses_what_is_beyond() -> None:
    # turning at 10 deg/s about the vertical with a range of 9.99: the heading falls behind by 0.01 deg/s
    trajectory = OnEarth(SpinRock((0, 0, 1), np.radians(10.0), 0.0, 1.0), 0.8, 0.0, 0.0, (1.0, 0, 0, 0), 60.0)
    limit = np.radians(9.99)
    error = simulate(trajectory, ImuErrors(gyro=TriadErrors(limit=limit)))
    down = trajectory.rates(30.0)[0][2]
    assert error.attitude[-1, 2] == pytest.approx((down - limit) * 60.0, rel=1e-3)


def test_jitter_of_the_stamps_moves_the_position_along_the_path_and_does_not_add_up(flight: GreatCircle) -> None:
    sigma, dt = 1e-3, 0.1
    error = simulate(flight, ImuErrors(faults=(Fault("jitter", 0.0, np.inf, np.array([sigma, 0, 0, 0, 0, 0])),)))
    late = error.time - np.arange(len(error.time)) * dt
    assert np.std(late) == pytest.approx(sigma, rel=0.03)
    speed = np.linalg.norm(flight.state(0.0).velocity_ned)
    along = speed * np.abs(late)
    # a frame that turns late by white instants tilts the force by ω_in times them, of which the velocity is the sum:
    # its random walk g ω_in σ √(dt t), and the walk's integral
    turning = 7.292e-5 + speed / 6.38e6
    drift = 9.8 * turning * sigma * np.sqrt(dt / 3.0) * error.time**1.5
    assert np.all(np.abs(error.horizontal - along) < 0.02 * along.max() + 3.5 * drift)
    assert 3.5 * drift[-1] < 0.1 * along.max()


# Places and instants of the accelerometers


def test_size_effect_of_rocking_is_a_constant_force_inwards(monkeypatch) -> None:
    # A sin Ωt about the vertical; the forward accelerometer at r forward feels −φ̇² r, on average −½(AΩ)² r along the
    # direction that "forward" has on average: a constant error north, and Schuler's pendulum makes of it (8.13).
    monkeypatch.setitem(ELLIPSOIDS, SPHERE.name, SPHERE)
    amplitude, frequency, arm = 0.05, 2 * np.pi * 0.5, 0.10
    motion = SpinRock((0, 0, 1), 0.0, amplitude, frequency)
    trajectory = OnEarth(motion, np.radians(5.0), 0.0, 0.0, (1.0, 0, 0, 0), 2600.0, ellipsoid=SPHERE)
    arms = np.zeros((3, 3))
    arms[0, 0] = arm
    error = simulate(trajectory, ImuErrors(arms=arms))
    force = -0.5 * (amplitude * frequency) ** 2 * arm
    y = force / (SPHERE_RATE**2 * SPHERE_RADIUS) * (1 - np.cos(SPHERE_RATE * error.time))  # (8.13)
    assert np.abs(error.position_ned[:, 0] / SPHERE_RADIUS - y).max() < 0.02 * np.abs(y).max()
    assert np.abs(y).max() * SPHERE_RADIUS > 1000.0


def test_the_same_arms_are_those_of_the_truth() -> None:
    """Fed with increments of a truth that has an accelerometer at each place, navigation goes as wrong."""
    arms = np.array([[0.05, -0.02, 0.03], [-0.03, 0.06, 0.02], [0.01, 0.03, -0.06]])
    place = (0.8, 0.1, 500.0, (1.0, 0.0, 0.0, 0.0), 120.0)

    def motion(arm) -> SpinRock:
        return SpinRock((0.3, -0.2, 1.0), 0.1, 0.3, 2 * np.pi * 0.7, arm)

    trajectory = OnEarth(motion((0.0, 0.0, 0.0)), *place)
    ideal, truth = trajectory.increments(100.0), trajectory.state(np.arange(12_001) / 100.0)
    exact = np.stack([OnEarth(motion(arm), *place).increments(100.0).dvel[:, i] for i, arm in enumerate(arms)], axis=1)
    found = []
    for imu in (emulate(ideal, ImuErrors(arms=arms)), ImuData(ideal.time, ideal.dtheta, exact)):
        solution = navigate(imu, trajectory.state(0.0), vertical="truth", height=truth.height)
        found.append(navigation_error(truth, solution))
    assert found[1].horizontal.max() > 10.0
    assert mismatch(found[0].position_ned[:, :2], found[1].position_ned[:, :2]) < 0.002
    assert mismatch(found[0].velocity_ned[:, :2], found[1].velocity_ned[:, :2]) < 0.002


@pytest.mark.parametrize("delay", [0.003, -0.003])
def test_delayed_accelerometers_on_a_rocking_base(delay: float) -> None:
    # Forces turned by φ(t) − φ(t − δ): gravity seems to tilt by δφ̇, and the velocity is off by gδ(φ(t) − φ(0)).
    amplitude, frequency = 0.1, 2 * np.pi * 0.4
    trajectory = OnEarth(SpinRock((1, 0, 0), 0.0, amplitude, frequency), 0.8, 0.0, 0.0, (1.0, 0, 0, 0), 20.0)
    error = simulate(trajectory, ImuErrors(delay=delay), rate_hz=100.0)
    gravity = -trajectory.rates(0.0)[1][2]
    # right wing down at φ: the late reading is that of a smaller roll, gravity's part to the right, −g sin φ, too small
    east = gravity * delay * amplitude * np.sin(frequency * error.time)
    assert np.abs(error.velocity_ned[:, 1] - east).max() < 0.02 * np.abs(east).max()
    assert np.abs(error.velocity_ned[:, 0]).max() < 0.02 * np.abs(east).max()
