"""A platform against the truth, against the textbook's error equations, and against the simple Schuler forms.

The error equations are those of `tests.oracles.error_equations`, written apart from the package. A platform enters them
as a block whose axes are those of the frame (C = 1 for one that points north), whose gyros have the bias b and, for the
torquing scale factor κ, the error −κ ω_commanded: ω_ip = (1 + κ) ω_commanded − b.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from sinssim import NavState, rotation
from sinssim.data import Array
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError, RunError
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import Fault, ImuErrors
from sinssim.sensors.sensor_set_readings import PlatformErrors
from sinssim.strapdown.gimballed_platform import Forces, PlatformSolution, inertial_forces, navigate_platform
from sinssim.strapdown.mechanization import Mechanization
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.units import ARCSEC, DEG_H, PPM, UG
from tests.oracles import error_equations as oracle
from tests.oracles.s_turn import STurn
from tests.slow import slow

HOUR = 3600.0
SPEED = 220.0


def on_a_parallel(
    latitude: float, speed: float, duration: float = HOUR, rate: float = 20.0
) -> tuple[Array, NavState, Forces]:
    """A vehicle that flies east at constant speed, 5 km high, or stands there: exact truth, in closed form."""
    time = np.arange(round(duration * rate) + 1) / rate
    r2 = WGS84.a / np.sqrt(1.0 - WGS84.e2 * np.sin(latitude) ** 2)
    longitude = 0.3 + speed * time / ((r2 + 5000.0) * np.cos(latitude))
    longitude = (longitude + np.pi) % (2 * np.pi) - np.pi
    same = np.ones_like(time)
    velocity = np.outer(same, [0.0, speed, 0.0])
    q_nb = np.tile(rotation.quaternion_from_euler(0.1, 0.05, 1.2), (len(time), 1))
    truth = NavState(latitude * same, longitude, 5000.0 * same, velocity, q_nb)
    return time, truth, inertial_forces(time, truth, "normal", WGS84)


def fly(
    motion: tuple[Array, NavState, Forces],
    errors: ImuErrors | None = None,
    platform: PlatformErrors | None = None,
    **options: object,
) -> PlatformSolution:
    time, truth, forces = motion
    first = NavState(*(getattr(truth, name)[0] for name in ("latitude", "longitude", "height", "velocity_ned", "q_nb")))
    held = {"vertical": "truth", "height": truth.height, **options}
    return navigate_platform(time, forces, first, errors, platform, **held)  # type: ignore[arg-type]


def expected(
    time: Array,
    latitude: float,
    speed: float,
    sources: oracle.Sources,
    azimuth: Callable[[float], float] = lambda t: 0.0,
    torqued: Array | None = None,
) -> tuple[Array, Array, Array]:
    """The textbook's errors of a levelled platform on a parallel."""
    earth = oracle.Earth()
    ie, en = oracle.rates(earth, latitude, 5000.0, np.array([0.0, speed, 0.0]))
    coriolis = np.cross(2 * ie + en, [0.0, speed, 0.0])
    force_n = coriolis - np.array([0.0, 0.0, oracle.gravity_down(earth, latitude, 5000.0)])
    command = ie + en

    def nominal(t: float) -> oracle.Nominal:
        c, s = np.cos(azimuth(t)), np.sin(azimuth(t))
        c_np = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        rate = c_np.T @ command
        rate = rate if torqued is None else np.array([rate[0], rate[1], torqued[2]])
        return oracle.Nominal(latitude, 5000.0, np.array([0.0, speed, 0.0]), c_np, rate, c_np.T @ force_n)

    return oracle.solve(nominal, time, sources, height_held=True)


def compare(motion: tuple[Array, NavState, Forces], solution: PlatformSolution, found: tuple[Array, ...]) -> None:
    """Position, velocity and attitude agree to 1 % of their largest value."""
    time, truth, _ = motion
    rows = np.searchsorted(time, np.linspace(0.0, time[-1], 61))
    error = navigation_error(truth, solution)
    for name, own, want in (
        ("position", error.position_ned[rows, :2], found[0][:, :2]),
        ("velocity", error.velocity_ned[rows, :2], found[1][:, :2]),
        ("attitude", error.attitude[rows], found[2]),
    ):
        assert np.abs(own - want).max() < 0.01 * np.abs(want).max(), name


CAUSES = {
    "gyro bias": (ImuErrors(gyro=TriadErrors(bias=np.array([0.01, -0.02, 0.015]) * DEG_H)), None),
    "north gyro": (ImuErrors(gyro=TriadErrors(bias=np.array([0.01, 0.0, 0.0]) * DEG_H)), None),
    "east gyro": (ImuErrors(gyro=TriadErrors(bias=np.array([0.0, 0.01, 0.0]) * DEG_H)), None),
    "down gyro": (ImuErrors(gyro=TriadErrors(bias=np.array([0.0, 0.0, 0.01]) * DEG_H)), None),
    "torquer": (None, PlatformErrors(np.array([200.0, 300.0, -150.0]) * PPM)),
    "accelerometers": (ImuErrors(accel=TriadErrors(bias=np.array([50.0, -80.0, 30.0]) * UG)), None),
    "their scale and misalignment": (
        ImuErrors(accel=TriadErrors(
            scale=np.array([300.0, -200.0, 100.0]) * PPM,
            misalignment=np.array([[0.0, 5.0, 9.0], [-4.0, 0.0, 6.0], [3.0, 2.0, 0.0]]) * ARCSEC,
        )),
        None,
    ),
    "g-sensitivity": (ImuErrors(gyro=TriadErrors(
        g_sensitivity=np.array([[0.0, 0.0, 0.01], [0.0, 0.0, 0.02], [0.0, 0.0, 0.01]]) * DEG_H / 9.8)), None),
}  # fmt: skip


def sources_of(cause: str) -> oracle.Sources:
    errors, platform = CAUSES[cause]
    errors, platform = errors or ImuErrors(), platform or PlatformErrors()
    return oracle.Sources(
        gyro_bias=errors.gyro.bias,
        gyro_matrix=-np.diag(platform.torquer_scale),
        accel_bias=errors.accel.bias,
        accel_matrix=np.diag(errors.accel.scale) + errors.accel.misalignment,
        gyro=lambda t, true: errors.gyro.g_sensitivity @ true.force,
    )


@pytest.mark.parametrize("speed", [*slow(0.0), SPEED])
@pytest.mark.parametrize("cause", CAUSES)
def test_one_error_alone_is_that_of_the_error_equations(cause: str, speed: float) -> None:
    motion = on_a_parallel(np.radians(50.0), speed)
    solution = fly(motion, *CAUSES[cause])
    times = motion[0][np.searchsorted(motion[0], np.linspace(0.0, HOUR, 61))]
    compare(motion, solution, expected(times, np.radians(50.0), speed, sources_of(cause)))


@pytest.mark.parametrize("cause", ["gyro bias", "torquer", "accelerometers"])
def test_a_free_azimuth_platform_has_the_errors_of_its_own_axes(cause: str) -> None:
    """The free platform does not turn about the vertical in inertial space: its azimuth grows with ω sin φ + ω_en."""
    latitude = np.radians(50.0)
    motion = on_a_parallel(latitude, SPEED)
    solution = fly(motion, *CAUSES[cause], frame="free-azimuth")
    ie, en = oracle.rates(oracle.Earth(), latitude, 5000.0, np.array([0.0, SPEED, 0.0]))
    turn = -(ie + en)[2]
    times = motion[0][np.searchsorted(motion[0], np.linspace(0.0, HOUR, 61))]
    found = expected(times, latitude, SPEED, sources_of(cause), lambda t: turn * t, np.zeros(3))
    compare(motion, solution, found)
    assert np.abs(solution.commanded[:, 2]).max() < 1e-16
    assert np.abs(solution.commanded[:, :2]).max() > 0.9 * np.hypot(*(ie + en)[:2])


@pytest.mark.parametrize("cause", ["gyro bias", "accelerometers"])
def test_an_inertial_platform_has_the_errors_of_fixed_axes(cause: str) -> None:
    latitude = np.radians(50.0)
    motion = on_a_parallel(latitude, SPEED)
    time = motion[0]
    solution = fly(motion, *CAUSES[cause], frame="inertial")
    earth, v = oracle.Earth(), np.array([0.0, SPEED, 0.0])
    ie, en = oracle.rates(earth, latitude, 5000.0, v)
    force_n = np.cross(2 * ie + en, v) - np.array([0.0, 0.0, oracle.gravity_down(earth, latitude, 5000.0)])

    turn = float(np.linalg.norm(ie + en))
    axis = -(ie + en) / turn  # of the fixed axes, as seen from north, east and down

    def nominal(t: float) -> oracle.Nominal:
        c = np.eye(3) * np.cos(turn * t) + (1.0 - np.cos(turn * t)) * np.outer(axis, axis)
        c += np.sin(turn * t) * np.cross(np.eye(3), axis)
        return oracle.Nominal(latitude, 5000.0, v, c, np.zeros(3), c.T @ force_n)

    times = time[np.searchsorted(time, np.linspace(0.0, HOUR, 61))]
    compare(motion, solution, oracle.solve(nominal, times, sources_of(cause), height_held=True))
    assert not solution.commanded.any()


def test_torquing_errors_do_nothing_to_a_platform_that_is_not_torqued() -> None:
    motion = on_a_parallel(np.radians(50.0), SPEED, 60.0)
    plain, other = (
        fly(motion, None, one, frame="inertial") for one in (None, PlatformErrors(np.array([1e-3, 1e-3, 1e-3])))
    )
    np.testing.assert_array_equal(plain.latitude, other.latitude)


def test_the_schuler_forms_at_rest() -> None:
    """b (1 − cos ωt)/ω² of an accelerometer and d R (t − sin ωt/ω) of a level gyro, for half a Schuler period.

    At the equator, an accelerometer to the north and a gyro to the north do not couple with the Earth's rotation.
    """
    motion = on_a_parallel(0.0, 0.0, 2500.0)
    time, truth, _ = motion
    r1, r2 = (r + 5000.0 for r in oracle.radii(oracle.Earth(), 0.0))
    gravity = oracle.gravity_down(oracle.Earth(), 0.0, 5000.0)
    north = fly(motion, ImuErrors(accel=TriadErrors(bias=np.array([100.0, 0.0, 0.0]) * UG)))
    w = np.sqrt(gravity / r1)
    want = 100.0 * UG * (1.0 - np.cos(w * time)) / w**2
    np.testing.assert_allclose(navigation_error(truth, north).position_ned[:, 0], want, atol=0.01 * want.max())
    gyro = fly(motion, ImuErrors(gyro=TriadErrors(bias=np.array([0.01, 0.0, 0.0]) * DEG_H)))
    w = np.sqrt(gravity / r2)
    want = 0.01 * DEG_H * r2 * (time - np.sin(w * time) / w)
    own = navigation_error(truth, gyro).position_ned[:, 1]
    # the drift lifts the platform's east side: an eastward error of −, to which the sign of the bias adds
    np.testing.assert_allclose(np.abs(own), want, atol=0.01 * want.max())


@cache
def s_turns() -> tuple[Array, NavState, Forces]:
    turns = STurn(duration=600.0).fly(100)
    truth = NavState(turns.latitude, turns.longitude, turns.height, turns.velocity_ned, turns.q_nb)
    return turns.time, truth, inertial_forces(turns.time, truth, "somigliana", WGS84)


@pytest.mark.parametrize(
    ("frame", "azimuth"),
    [("level", 0.0), ("wander", 0.0), ("wander", 2.5), ("free-azimuth", 0.0), ("transverse", 0.0), ("inertial", 0.0)],
)
def test_ideal_sensors_stay_on_the_truth_through_s_turns(frame: str, azimuth: float) -> None:
    """The bar is 0.01 m in an hour; ten minutes of 45° banks every 30 s, 100 Hz: measured 2e-5 m."""
    time, truth, forces = s_turns()
    options = {"frame": frame, "azimuth": azimuth, "gravity": "somigliana", "vertical": "free", "height": None}
    solution = fly((time, truth, forces), **options)
    assert azimuth == 0.0 or (solution.azimuth is not None and solution.azimuth[0] == azimuth)
    error = navigation_error(truth, solution)
    assert error.horizontal.max() < 1e-3
    assert error.angle.max() < 0.001 * ARCSEC


@pytest.mark.slow
@pytest.mark.parametrize("frame", ["level", "wander", "inertial"])
def test_an_hour_of_s_turns(frame: str) -> None:
    turns = STurn(duration=HOUR).fly(100)
    truth = NavState(turns.latitude, turns.longitude, turns.height, turns.velocity_ned, turns.q_nb)
    forces = inertial_forces(turns.time, truth, "somigliana", WGS84)
    solution = fly((turns.time, truth, forces), frame=frame, gravity="somigliana")
    assert navigation_error(truth, solution).horizontal.max() < 0.01


def test_the_order_of_the_loop() -> None:
    """The delay of the command and the integration are of the second order at least: half the interval, a quarter."""
    error = []
    for rate in (2.0, 4.0, 8.0):
        turns = STurn(duration=300.0).fly(rate)
        truth = NavState(turns.latitude, turns.longitude, turns.height, turns.velocity_ned, turns.q_nb)
        forces = inertial_forces(turns.time, truth, "somigliana", WGS84)
        solution = fly((turns.time, truth, forces), gravity="somigliana")
        error.append(navigation_error(truth, solution).horizontal.max())
    assert error[0] / error[1] > 3.5
    assert error[1] / error[2] > 3.5


def test_the_errors_of_turning_gyros_do_not_act() -> None:
    """Scale factor, misalignment and non-linearity multiply what a gyro senses, which is nothing on a platform."""
    turns = STurn(duration=60.0).fly(50)
    truth = NavState(turns.latitude, turns.longitude, turns.height, turns.velocity_ned, turns.q_nb)
    motion = turns.time, truth, inertial_forces(turns.time, truth, "somigliana", WGS84)
    bad = TriadErrors(
        scale=np.full(3, 1e-3), misalignment=np.full((3, 3), 1e-3) - 1e-3 * np.eye(3), asymmetry=np.full(3, 1e-3),
        quadratic=np.full(3, 1e-3), cubic=np.full(3, 1e-3), quantum=1e-4, limit=0.01,
    )  # fmt: skip
    plain, other = (fly(motion, errors, gravity="somigliana") for errors in (None, ImuErrors(gyro=bad)))
    np.testing.assert_array_equal(plain.latitude, other.latitude)
    assert other.flags is None


def test_noise_is_that_of_the_same_sensors_strapped_down() -> None:
    """The random walk of the platform's drift has N/√T of white noise: 72000 numbers, 1 % is 3.8σ; p = 2e-4."""
    motion = on_a_parallel(0.5, 0.0, 1200.0)
    walk = 0.003 * np.radians(1.0) / 60.0
    solution = fly(motion, ImuErrors(gyro=TriadErrors(random_walk=walk)))
    assert np.std(solution.drift) == pytest.approx(walk * np.sqrt(20.0), rel=0.01)


def test_pickoffs_disturb_the_attitude_alone() -> None:
    motion = on_a_parallel(0.5, SPEED, 30.0)
    pickoff = np.array([10.0, -20.0, 30.0]) * ARCSEC
    plain, read = (fly(motion, None, one) for one in (None, PlatformErrors(pickoff=pickoff)))
    np.testing.assert_array_equal(plain.latitude, read.latitude)
    np.testing.assert_allclose(read.gimbals - plain.gimbals, np.tile(pickoff, (len(read.time), 1)), atol=1e-12)
    roll, pitch, heading = rotation.euler_from_quaternion(read.q_nb)
    own = np.stack([roll, pitch, heading], axis=1) - [0.1, 0.05, 1.2]
    np.testing.assert_allclose(own, np.tile(pickoff, (len(own), 1)), atol=1e-9)
    noisy = fly(motion, None, PlatformErrors(pickoff_noise=5.0 * ARCSEC))
    assert np.std(noisy.gimbals - plain.gimbals) == pytest.approx(5.0 * ARCSEC, rel=0.1)  # 1800 numbers: 6σ


def test_a_step_of_a_gyros_bias_begins_when_it_is_said() -> None:
    motion = on_a_parallel(0.5, 0.0, 60.0)
    fault = Fault("bias-step", 30.0, np.inf, np.array([0.0, 0.0, 1.0 * DEG_H, 0.0, 0.0, 0.0]))
    solution = fly(motion, ImuErrors(faults=(fault,)))
    assert not solution.drift[:600].any()
    np.testing.assert_allclose(solution.drift[600:], np.tile([0.0, 0.0, DEG_H], (600, 1)), rtol=1e-9)
    turned = navigation_error(motion[1], solution).attitude[-1, 2]
    assert turned == pytest.approx(-30.0 * DEG_H, rel=1e-3)


def test_no_platform_points_north_at_the_pole() -> None:
    motion = on_a_parallel(np.radians(89.95), 50.0, 10.0)
    with pytest.raises(RunError, match=r"within 0\.1° of a pole: latitude 89\.95"):
        fly(motion)
    solution = fly(motion, frame="wander")
    assert navigation_error(motion[1], solution).horizontal.max() < 1e-3


def test_the_navigators_own_earth_is_used() -> None:
    motion = on_a_parallel(0.5, SPEED, 60.0)
    other = fly(motion, ellipsoid="krasovsky-1940")
    assert navigation_error(motion[1], other).horizontal.max() > 0.01


@pytest.mark.slow  # a kernel that nothing else compiles
def test_the_navigators_own_radii_are_used() -> None:
    motion = on_a_parallel(0.5, SPEED, 60.0)
    simple = fly(motion, curvature="spherical")
    assert navigation_error(motion[1], simple).horizontal.max() > 1.0


def test_what_cannot_be_used_is_named() -> None:
    time, truth, forces = on_a_parallel(0.5, 0.0, 2.0)
    first = NavState(*(getattr(truth, name)[0] for name in ("latitude", "longitude", "height", "velocity_ned", "q_nb")))
    with pytest.raises(InputError, match="frame 'northward'"):
        navigate_platform(time, forces, first, frame="northward")
    with pytest.raises(InputError, match=r"N\+1 times"):
        navigate_platform(time[1:], forces, first)
    with pytest.raises(InputError, match="curvature"):
        navigate_platform(time, forces, first, frame="inertial", curvature="spherical")
    with pytest.raises(InputError, match="a platform has no fast part and cannot run at three rates"):
        navigate_platform(time, forces, first, mechanization=Mechanization(rates_hz=(100.0, 50.0)))
    with pytest.raises(InputError, match=r"not a finite number"):
        navigate_platform(time, Forces(np.full_like(forces.push, np.nan), forces.q_ib), first)
