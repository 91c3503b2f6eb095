"""Aiding sensors against statements that do not come from them: closed forms, χ² bands, central differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from sinssim.data import Measurements, NavSolution, NavState
from sinssim.earth import WGS84
from sinssim.errors import InputError
from sinssim.estimation import BLOCKS, Block, ErrorModel
from sinssim.estimation.linearisation import Prediction, observe
from sinssim.scenario.filter_section import AidingSection
from sinssim.sensors.aiding.air_data import Airspeed, Barometer
from sinssim.sensors.aiding.attitude import AttitudeReference, Master, StarTracker
from sinssim.sensors.aiding.gnss import Gnss
from sinssim.sensors.aiding.land_vehicle import Odometer
from sinssim.sensors.aiding.magnetometer import Magnetometer
from sinssim.sensors.aiding.standstill import ZeroRate, ZeroVelocity
from sinssim.sensors.aiding_sensor import Vehicle, lagged
from sinssim.truth.curve import Curve
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from sinssim.truth.sampling import Channel
from tests.oracles import integrator as oracle
from tests.truth.motions import ecef, synthetic_flight

PLACE = {"latitude": 0.9, "longitude": 0.2, "height": 400.0}
STILL = (0.0, 0.0, 0.0)
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def parked(duration: float, q_nb=LEVEL) -> Parked:
    return Parked(*PLACE.values(), q_nb, duration, STILL, LEVEL)


@pytest.fixture(scope="module")
def flight() -> Curve:
    """A minute with turns, climbs and rolling."""
    time = np.arange(0.0, 60.001, 1.0 / 120.0)
    return Curve(time, *synthetic_flight(time), STILL, LEVEL)


class Climb:
    """Straight up and down: heights in closed form, for lags."""

    start, end, ellipsoid = 3.0, 203.0, WGS84

    def __init__(self, height) -> None:
        self._height = height
        self.channels: dict[str, Channel] = {}

    def state(self, t):
        n, zero = len(t), np.zeros(len(t))
        return NavState(zero + 0.5, zero, self._height(t - self.start), np.zeros((n, 3)), np.tile(LEVEL, (n, 1)))


def sensed(trajectory, section, seed=0):
    """Return the readings of a sensor, with the truth about them: one set, or one for each kind."""
    given = section.read(Vehicle(trajectory, seed))
    return given if isinstance(section, Gnss) else given[0]


def read(trajectory, section, seed=0):
    """Return the measurements of a sensor: one set, or one for each kind."""
    given = sensed(trajectory, section, seed)
    return [g.measurements for g in given] if isinstance(given, list) else given.measurements


def every(trajectory, section, seed):
    """Return the readings of all sensors of a section."""
    return [g for sensor in section.sensors().values() for g in sensor.read(Vehicle(trajectory, seed))]


def metres(given: Measurements, place=PLACE) -> np.ndarray:
    """Return fixes minus the place, north, east, up, m, by the oracle's radii."""
    r = oracle.geodetic_to_ecef(given.value[:, 0], given.value[:, 1], given.value[:, 2])
    r = r - oracle.geodetic_to_ecef(*place.values())
    return r @ oracle.ned_axes(place["latitude"], place["longitude"]).T * (1.0, 1.0, -1.0)


def assert_sigma(error: np.ndarray, sigma: float) -> None:
    """The sum of squares lies in the χ² band that white noise leaves once in 10⁵ times."""
    n = error.size
    low, high = chi2.ppf([0.5e-5, 1.0 - 0.5e-5], n)
    assert low < np.sum((error / sigma) ** 2) < high


def correlation(error: np.ndarray, lag: int) -> float:
    return float(np.mean(error[:-lag] * error[lag:]) / np.mean(error * error))


# Satellites


def test_white_noise_of_fixes_has_the_given_sigma_and_is_white():
    section = Gnss(position_sigma_m=2.0, height_sigma_m=5.0, velocity_sigma_mps=0.1)
    position, velocity = read(parked(20_000.0), section, 3)
    error = metres(position)
    for i, sigma in enumerate((2.0, 2.0, 5.0)):
        assert_sigma(error[:, i], sigma)
        assert abs(correlation(error[:, i], 1)) < 4.5 / np.sqrt(len(error))
        assert_sigma(velocity.value[:, i], 0.1)
    pairs = np.corrcoef(np.column_stack((error, velocity.value)).T)[np.triu_indices(6, 1)]
    assert np.max(np.abs(pairs)) < 4.5 / np.sqrt(len(error))
    assert np.array_equal(position.sigma, np.tile([2.0, 2.0, 5.0], (20_000, 1)))
    assert np.array_equal(velocity.sigma, np.full((20_000, 3), 0.1))


def test_correlated_noise_decays_with_its_time_and_is_stationary():
    tau, n, runs = 50.0, 4_000, 40
    section = Gnss(
        position_sigma_m=1e-9,
        height_sigma_m=1e-9,
        velocity_sigma_mps=1e-9,
        correlated_position_sigma_m=3.0,
        correlated_height_sigma_m=4.0,
        correlated_velocity_sigma_mps=0.2,
        correlation_time_s=tau,
    )
    found = [read(parked(float(n)), section, seed) for seed in range(runs)]
    first = np.array([np.concatenate((metres(p)[0], v.value[0])) for p, v in found])
    for i, sigma in enumerate((3.0, 3.0, 4.0, 0.2, 0.2, 0.2)):
        assert_sigma(first[:, i], sigma)  # from the first fix on
        error = np.array([metres(p)[:, i] if i < 3 else v.value[:, i - 3] for p, v in found])
        # a mean square of correlated numbers spreads by √(2/N) with N = n T/τ independent ones (Bendat and Piersol)
        independent = runs * n / tau
        assert np.mean(error**2) == pytest.approx(sigma**2, rel=4.5 * np.sqrt(2.0 / independent), abs=0)
        for lag in (1, 25, 50, 100):
            product = np.mean(error[:, :-lag] * error[:, lag:]) / sigma**2
            assert product == pytest.approx(np.exp(-lag / tau), abs=4.5 * np.sqrt(2.0 / independent))


def test_antenna_moves_as_the_rigid_body_does(flight):
    """Position by the oracle's matrices; velocity is the central difference of the position."""
    arm = np.array([4.0, -7.0, -2.5])
    exact = {"position_sigma_m": 1e-9, "height_sigma_m": 1e-9, "velocity_sigma_mps": 1e-12}
    section = Gnss(rate_hz=2.0, lever_arm_m=tuple(arm), **exact)
    position, velocity = read(flight, section, 0)
    t, h = velocity.time[:-1], 2e-3

    def antenna(instants):
        centre, _, c_es = ecef(flight, instants)
        return centre + c_es @ arm

    fix = oracle.geodetic_to_ecef(*position.value[:-1].T)
    np.testing.assert_allclose(fix, antenna(t), rtol=0, atol=5e-8)
    difference = (8.0 * (antenna(t + h) - antenna(t - h)) - antenna(t + 2 * h) + antenna(t - 2 * h)) / (12.0 * h)
    north_east_down = oracle.ned_axes(position.value[:-1, 0], position.value[:-1, 1])
    expected = np.einsum("nij,nj->ni", north_east_down, difference)
    np.testing.assert_allclose(velocity.value[:-1], expected, rtol=0, atol=3e-6)  # rounding 2e-9 m over 12 h / 8
    without = flight.state(t).velocity_ned
    assert np.max(np.abs(velocity.value[:-1] - without)) > 0.5  # the lever arm is no trifle
    assert np.array_equal(position.lever_arm, arm)


def test_reading_is_of_its_time_of_validity_and_arrives_later():
    circle = GreatCircle(0.8, 0.1, 9000.0, 1.0, 250.0, 100.0)
    late, _ = read(circle, Gnss(rate_hz=5.0, latency_s=0.4), 1)
    prompt, _ = read(circle, Gnss(rate_hz=5.0), 1)
    assert np.array_equal(late.value, prompt.value)
    assert np.array_equal(late.time, prompt.time)
    np.testing.assert_allclose(late.arrival - late.time, 0.4, rtol=0, atol=1e-13)
    assert np.array_equal(prompt.arrival, prompt.time)
    np.testing.assert_allclose(late.time, np.arange(1, 501) / 5.0, rtol=0, atol=1e-12)


def test_outage_takes_readings_and_leaves_the_others_noise():
    section = Gnss(correlated_position_sigma_m=2.0)
    whole, _ = read(parked(1000.0), section, 1)
    broken, velocity = read(
        parked(1000.0), section.model_copy(update={"outages_s": ((100.5, 200.0), (900.0, 2000.0))}), 1
    )
    kept = ((whole.time < 100.5) | (whole.time > 200.0)) & (whole.time < 900.0)
    assert np.array_equal(broken.time, whole.time[kept])
    assert np.array_equal(broken.value, whole.value[kept])
    assert np.array_equal(velocity.time, broken.time)
    assert len(broken.time) == len(broken.sigma) == len(broken.arrival) == 799


def test_jumps_and_ramps_are_what_they_say():
    clean = Gnss()
    spoofed = Gnss(
        jumps=({"from_s": 50.0, "to_s": 59.5, "north_m": 100.0, "east_m": -50.0, "up_m": 7.0},),
        ramps=({"from_s": 100.0, "to_s": 300.0, "north_mps": 0.5, "east_mps": 2.0, "up_mps": -0.25},),
    )
    (p0, v0), (p1, v1) = (read(parked(400.0), section, 4) for section in (clean, spoofed))
    t = p0.time
    moved, faster = metres(p1) - metres(p0), v1.value - v0.value
    jump, ramp = (t >= 50.0) & (t <= 59.5), (t >= 100.0) & (t <= 300.0)
    expected = jump[:, None] * [100.0, -50.0, 7.0] + (ramp * (t - 100.0))[:, None] * [0.5, 2.0, -0.25]
    np.testing.assert_allclose(moved, expected, rtol=0, atol=0.02)  # the Earth is round: (400 m)²/2R
    np.testing.assert_allclose(faster, ramp[:, None] * [0.5, 2.0, 0.25], rtol=0, atol=1e-12)


# Height


def test_lag_of_a_climb_and_of_a_wave():
    tau, omega = 2.5, 0.4
    exact = {"sigma_m": 1e-9, "bias_sigma_m": 0.0, "rate_hz": 4.0}
    lagging = Barometer(lag_s=tau, **exact)
    climb = read(Climb(lambda t: 100.0 + 8.0 * t), lagging)
    np.testing.assert_allclose(climb.arrival - climb.time, tau, rtol=0, atol=1e-12)
    # long after its begin a steady climb is told as it was at the time of validity
    np.testing.assert_allclose(climb.value[200:, 0], 100.0 + 8.0 * (climb.time[200:] - Climb.start), rtol=0, atol=1e-7)
    t = climb.arrival - Climb.start
    expected = 100.0 + 8.0 * (t - tau * (1.0 - np.exp(-t / tau)))
    np.testing.assert_allclose(climb.value[:, 0], expected, rtol=0, atol=1e-7)

    wave = read(Climb(lambda t: 50.0 * np.sin(omega * t)), lagging)
    x = omega * tau
    expected = 50.0 * (np.sin(omega * t) - x * np.cos(omega * t) + x * np.exp(-t / tau)) / (1.0 + x * x)
    most = 50.0 * omega**2 * (tau / 32) ** 2 / 8  # a line instead of the curve
    np.testing.assert_allclose(wave.value[:, 0], expected, rtol=0, atol=most)
    assert np.max(np.abs(expected - 50.0 * np.sin(omega * t))) > 20.0


def test_any_lag_is_exact_and_cheap():
    """Against the closed form of a climb with a wave on it; memory is that of a few blocks for every time constant."""
    slope, high, omega = 8.0, 30.0, 0.9

    def height(t):
        return slope * t + high * np.sin(omega * t)

    for rate, duration in ((1.0, 4000.0), (20.0, 200.0)):
        time = 3.0 + np.arange(1, round(rate * duration) + 1) / rate
        for tau in (1e-9, 1e-4, 1e-3, 0.02, 0.3, 5.0, 900.0):
            sizes = []

            def signal(t, sizes=sizes):
                sizes.append(t.size)
                return height(t - 3.0)

            t, x = time - 3.0, omega * tau
            past = np.exp(-t / tau)
            wave = high * (np.sin(omega * t) - x * np.cos(omega * t) + x * past) / (1.0 + x * x)
            expected = slope * (t - tau * (1.0 - past)) + wave
            step = max(tau / 32, 1e-3)
            most = high * omega**2 * step**2 / 8 + 1e-10
            np.testing.assert_allclose(lagged(signal, 3.0, time, tau), expected, rtol=0, atol=most)
            assert max(sizes) <= 1 << 18
            assert sum(sizes) < 5e6


def test_barometer_errors():
    section = Barometer(sigma_m=1e-9, bias_m=12.0, bias_sigma_m=0.0, scale_ppm=5000.0)
    given = read(parked(100.0), section)
    np.testing.assert_allclose(given.value[:, 0], 400.0 * 1.005 + 12.0, rtol=0, atol=1e-7)

    drawn = [read(parked(2.0), Barometer(bias_sigma_m=8.0, sigma_m=1e-9), k) for k in range(500)]
    assert_sigma(np.array([d.value[0, 0] - 400.0 for d in drawn]), 8.0)
    noise = read(parked(5_000.0), Barometer(bias_sigma_m=0.0, sigma_m=0.7), 1)
    assert_sigma(noise.value[:, 0] - 400.0, 0.7)
    assert noise.kind == "baro-height"
    assert noise.sigma.shape == noise.value.shape == (5_000, 1)


def test_barometer_bias_wanders_as_the_filter_is_told():
    tau = 20.0
    section = Barometer(sigma_m=1e-9, bias_sigma_m=5.0, bias_correlation_time_s=tau)
    error = read(parked(40_000.0), section, 2).value[:, 0] - 400.0
    independent = 40_000.0 / tau
    assert np.mean(error**2) == pytest.approx(25.0, rel=4.5 * np.sqrt(2.0 / independent), abs=0)
    assert correlation(error, 20) == pytest.approx(np.exp(-1.0), abs=4.5 * np.sqrt(2.0 / independent))


# Speed


def test_odometer_reads_the_wheels_forward_velocity(flight):
    arm = np.array([-1.2, 0.8, 0.5])
    section = Odometer(sigma_mps=1e-12, scale_ppm=2000.0, lever_arm_m=tuple(arm))
    given = read(flight, section)
    t, h = given.time[:-1], 2e-3

    def wheel(instants):
        centre, _, c_es = ecef(flight, instants)
        return centre + c_es @ arm

    velocity = (8.0 * (wheel(t + h) - wheel(t - h)) - wheel(t + 2 * h) + wheel(t - 2 * h)) / (12.0 * h)
    forward = np.einsum("ni,ni->n", ecef(flight, t)[2][:, :, 0], velocity)
    np.testing.assert_allclose(given.value[:-1, 0], 1.002 * forward, rtol=0, atol=3e-6)
    noise = read(parked(20_000.0), Odometer(sigma_mps=0.2), 5)
    assert_sigma(noise.value[:, 0], 0.2)


@pytest.mark.parametrize(
    ("section", "mean", "sigma", "term"),
    [
        (Odometer, {"scale_ppm": 2000.0}, {"scale_sigma_ppm": 500.0}, "odometer scale"),
        (Barometer, {"scale_ppm": 2000.0}, {"scale_sigma_ppm": 500.0}, "baro scale"),
        (Airspeed, {"scale_ppm": 2000.0}, {"scale_sigma_ppm": 500.0}, "airspeed scale"),
        (Airspeed, {"bias_mps": 2.0}, {"bias_sigma_mps": 0.5}, "airspeed bias"),
        (Magnetometer, {"bias_deg": 2.0}, {"bias_sigma_deg": 0.5}, "magnetometer bias"),
    ],
)
def test_mean_and_sigma_of_one_error(flight, section, mean, sigma, term):
    for seed in range(3):
        alone, drawn, both = (
            float(section(**keys).read(Vehicle(flight, seed))[0].parameters[term][0])
            for keys in (mean, sigma, {**mean, **sigma})
        )
        assert both == pytest.approx(alone + drawn, rel=1e-12)
        assert drawn != 0.0
    states = {state.block: state.sigma for state in section(**mean, **sigma).states()}
    assert states[term][0] == pytest.approx(float(np.hypot(alone, alone / 4.0)), rel=1e-12)  # root of the mean square


def test_airspeed_is_the_aircrafts_own_where_there_is_one(flight):
    exact = {"sigma_mps": 1e-12, "bias_mps": 2.0, "scale_ppm": -10_000.0, "wind_sigma_mps": 4.0}
    still_air = read(flight, Airspeed(**exact))
    ground = np.linalg.norm(flight.state(still_air.time).velocity_ned, axis=1)
    np.testing.assert_allclose(still_air.value[:, 0], 0.99 * ground + 2.0, rtol=0, atol=1e-9)

    climb = Climb(lambda t: 0.0 * t)
    knots = np.arange(0.0, 300.0, 0.5)
    climb.channels = {"airspeed_mps": Channel(knots, 80.0 + 0.1 * knots, "m/s")}
    windy = read(climb, Airspeed(lag_s=1.0, **exact))
    t = windy.time
    assert np.array_equal(t, np.arange(3.0, 203.0))  # a lag of 1 s: what it reads at 4 s is told as that of 3 s
    t = t + 1.0
    lagging = 80.3 + 0.1 * (t - 3.0) - 0.1 * (1.0 - np.exp(-(t - 3.0)))
    np.testing.assert_allclose(windy.value[:, 0], 0.99 * lagging + 2.0, rtol=0, atol=1e-9)


def test_airspeed_and_the_filters_model_are_one_at_an_angle_of_attack():
    """Nose 5° above the path, 8° of sideslip in a steady wind: at the truth nothing is left of the reading."""

    class Nose(Climb):
        def state(self, t):
            s = super().state(t)
            s.velocity_ned[:] = (120.0, 60.0, -3.0)
            heading = np.degrees(np.arctan2(60.0, 120.0)) + 8.0
            s.q_nb[:] = Rotation.from_euler("ZYX", (heading, 6.3, 0.0), degrees=True).as_quat(scalar_first=True)
            return s

    nose, wind = Nose(lambda t: 0.0 * t), np.array([-7.0, 12.0, 0.0])
    knots = np.array([0.0, 300.0])
    through_air = float(np.linalg.norm([127.0, 48.0, -3.0]))
    nose.channels = {
        "airspeed_mps": Channel(knots, np.full(2, through_air), "m/s"),
        "wind_north_mps": Channel(knots, np.full(2, -7.0), "m/s"),
        "wind_east_mps": Channel(knots, np.full(2, 12.0), "m/s"),
    }
    given = sensed(nose, Airspeed(sigma_mps=1e-12))
    np.testing.assert_allclose(given.parameters["airspeed wind"], np.tile(wind[:2], (200, 1)), rtol=0, atol=1e-12)
    model = ErrorModel((*(Block(name, 1.0) for name in BLOCKS), Block("airspeed wind", np.ones(2))), 0.0, 0.0)
    now = Prediction(nose.state(given.time), np.zeros((200, 3)), WGS84)
    residual, h = observe(given.measurements, now, model, {"airspeed wind": wind[:2]})
    np.testing.assert_allclose(residual, 0.0, rtol=0, atol=1e-9)
    expected = np.array([127.0, 48.0, -3.0]) / through_air
    np.testing.assert_allclose(h[0, 0, 3:6], expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(h[0, 0, model.slices["airspeed wind"]], expected[:2], rtol=0, atol=1e-12)
    assert not h[0, 0, 6:9].any()  # a pitot tube tells nothing of the attitude


def test_airspeed_is_silent_on_the_ground():
    class Running(Climb):
        def state(self, t):
            s = super().state(t)
            s.velocity_ned[:, 0] = 0.5 * (t - self.start)
            return s

    given = read(Running(lambda t: 0.0 * t), Airspeed())
    assert np.array_equal(given.time, np.arange(33.0, 204.0))  # 15 m/s after 30 s


# Heading and attitude


def test_magnetometer_follows_the_heading_with_deviation(flight):
    exact = {"sigma_deg": 1e-9, "bias_deg": 1.5, "deviation_sigma_deg": 2.0}
    found = []
    for seed in range(400):
        given = read(flight, Magnetometer(**exact), seed)
        q = flight.state(given.time).q_nb
        heading = Rotation.from_quat(q, scalar_first=True).as_euler("ZYX")[:, 0]
        error = np.degrees(np.angle(np.exp(1j * (given.value[:, 0] - heading))))
        base = np.column_stack((np.ones_like(heading), np.sin(heading), np.cos(heading)))
        fit = np.linalg.lstsq(base, error, rcond=None)
        np.testing.assert_allclose(base @ fit[0], error, rtol=0, atol=1e-7)
        found.append(fit[0])
        if seed == 0:
            assert np.all((given.value >= 0.0) & (given.value < 2.0 * np.pi))
    constant, sine, cosine = np.array(found).T
    np.testing.assert_allclose(constant, 1.5, rtol=0, atol=1e-6)
    assert_sigma(sine, 2.0)
    assert_sigma(cosine, 2.0)
    noise = read(parked(20_000.0), Magnetometer(sigma_deg=0.5), 5)
    assert_sigma(np.degrees(np.angle(np.exp(1j * noise.value[:, 0]))), 0.5)
    np.testing.assert_allclose(noise.sigma, np.radians(0.5), rtol=1e-15, atol=0)


def test_attitude_noise_is_about_the_blocks_axes():
    tilted = Rotation.from_euler("ZYX", [2.0, 0.5, -1.0])
    standing = parked(20_000.0, tilted.as_quat(scalar_first=True))
    level = Rotation.from_matrix(oracle.ned_axes(PLACE["latitude"], PLACE["longitude"])).inv()
    sigma = (3.0, 6.0, 20.0)
    for given, unit, true in (
        (read(standing, AttitudeReference(sigma_arcmin=sigma), 2), 60.0, tilted),
        (read(standing, StarTracker(sigma_arcsec=sigma), 2), 3600.0, level * tilted),
    ):
        error = (true.inv() * Rotation.from_quat(given.value, scalar_first=True)).as_rotvec(degrees=True) * unit
        for i in range(3):
            assert_sigma(error[:, i], sigma[i])
        np.testing.assert_allclose(np.degrees(given.sigma[7]) * unit, sigma, rtol=1e-12, atol=0)
    assert given.kind == "earth-attitude"


# Standing still


class Stopping(Climb):
    """Stands, drives north from 50 s to 120 s, stands again, turns on the spot from 150 s to 160 s; creeps at last."""

    def state(self, t):
        s = super().state(t)
        s.velocity_ned[:, 0] = 5.0 * ((t > 50.0) & (t < 120.0)) + 0.02 * (t > 180.0)
        heading = 0.3 * np.clip(t - 150.0, 0.0, 10.0)
        s.q_nb[:] = Rotation.from_euler("z", heading[:, None]).as_quat(scalar_first=True)
        return s


def test_standstill_is_known_when_it_is_true():
    driving = Stopping(lambda t: 0.0 * t)
    velocity = read(driving, ZeroVelocity(sigma_mps=0.02), 3)
    rate = read(driving, ZeroRate(rate_hz=2.0, sigma_deg_h=0.5), 3)
    for given in (velocity, rate):
        assert given.value.shape == given.sigma.shape == (len(given.time), 3)
    t = np.arange(4.0, 203.5)
    assert np.array_equal(velocity.time, t[((t <= 50.0) | (t >= 120.0)) & (t <= 180.0)])
    t = np.arange(3.5, 203.25, 0.5)
    assert np.array_equal(rate.time, t[(t <= 150.0) | (t >= 160.5)])  # the mean from 159.5 s to 160 s is no zero
    creeping = read(driving, ZeroVelocity(sigma_mps=0.0601), 3)
    assert creeping.time[-1] == 203.0
    said = read(driving, ZeroVelocity(during_s=((60.0, 69.5),)), 3)
    np.testing.assert_array_equal(said.time, np.arange(60.0, 70.0))

    long = read(parked(20_000.0), ZeroVelocity(sigma_mps=0.02), 3)
    assert_sigma(long.value, 0.02)
    long = read(parked(20_000.0), ZeroRate(sigma_deg_h=0.5), 3)
    assert_sigma(np.degrees(long.value) * 3600.0, 0.5)
    moving = GreatCircle(0.8, 0.1, 9000.0, 1.0, 250.0, 100.0)
    assert len(read(moving, ZeroVelocity()).time) == 0


@pytest.mark.parametrize("sigma", [0.006, 0.01, 0.1])
def test_zero_velocity_is_as_good_as_its_sigma_of_a_vehicle_that_creeps(sigma):
    """The velocity swings by less than 0.05 m/s, and the readings' errors are χ² with the σ that is told.

    The true velocity adds at most 1/9 to the mean of 3.
    """

    class Creeping(Climb):
        end = 20_003.0

        def state(self, t):
            s = super().state(t)
            s.velocity_ned[:, 0] = 0.04 * np.sin(0.37 * t)
            s.velocity_ned[:, 1] = 0.02 * np.sin(0.23 * t + 1.0)
            return s

    creeping = Creeping(lambda t: 0.0 * t)
    given = read(creeping, ZeroVelocity(sigma_mps=sigma), 8)
    error = given.value - creeping.state(given.time).velocity_ned
    nees = np.sum((error / given.sigma) ** 2)
    low, high = chi2.ppf([0.5e-5, 1.0 - 0.5e-5], error.size)
    assert len(given.time) > 20
    assert low < nees < high * (1.0 + 1.0 / 27.0)


# All of them


def test_no_sensors_draws_depend_on_another():
    tables = {
        "gnss": {}, "baro": {}, "magnetometer": {"bias_sigma_deg": 1.0}, "airspeed": {}, "odometer": {},
        "zero_velocity": {}, "zero_rate": {}, "attitude": {}, "star_tracker": {"bias_sigma_arcsec": 1.0},
    }  # fmt: skip
    standing = parked(50.0)
    standing.channels = {"airspeed_mps": Channel(np.array([0.0, 100.0]), np.full(2, 60.0), "m/s")}  # in a wind tunnel
    everything = every(standing, AidingSection.model_validate(tables), 9)
    assert len(everything) == len(tables) + 1
    alone = [g for n, t in tables.items() for g in every(standing, AidingSection.model_validate({n: t}), 9)]
    values = [g.measurements.value for g in everything]
    for one, other in zip(everything, alone, strict=True):
        assert one.measurements.label == other.measurements.label
        assert np.array_equal(one.measurements.value, other.measurements.value)
    assert len({g.measurements.label for g in everything}) == len(everything)
    for i in range(len(values)):
        for j in range(i):
            a, b = (v - v.mean(axis=0) for v in (values[i][:, 0], values[j][:, 0]))
            assert not np.allclose(a / np.linalg.norm(a), b / np.linalg.norm(b), rtol=0, atol=1e-3)


def test_terms_of_one_sensor_draw_apart():
    standing = parked(500.0)
    plain = Gnss(velocity_sigma_mps=0.5)
    noisier = Gnss(velocity_sigma_mps=0.5, correlated_velocity_sigma_mps=1.0, position=False)
    assert np.array_equal(
        read(standing, plain.model_copy(update={"position": False}), 1)[0].value,
        read(standing, plain, 1)[1].value,
    )
    both = read(standing, noisier, 1)[0].value
    slow = read(standing, noisier.model_copy(update={"velocity_sigma_mps": 1e-300}), 1)[0].value
    np.testing.assert_allclose(both - slow, read(standing, plain, 1)[1].value, rtol=0, atol=1e-15)


def test_true_parameters_are_what_the_readings_are_off_by(flight):
    """Reading less truth less what a filter may estimate: nothing is left but the white noise, here none."""
    tiny = 1e-9
    fix, velocity = sensed(
        flight,
        Gnss(
            position_sigma_m=tiny, height_sigma_m=tiny, velocity_sigma_mps=tiny, correlated_position_sigma_m=3.0,
            correlated_height_sigma_m=5.0, correlated_velocity_sigma_mps=0.4, outages_s=((10.0, 20.0),),
        ),
        1,
    )  # fmt: skip
    kept = np.isin(fix.time, fix.measurements.time)
    assert len(fix.time) == 60
    assert np.count_nonzero(kept) == 49
    truth = flight.state(fix.time)
    up = fix.measurements.value[:, 2] - truth.height[kept]
    np.testing.assert_allclose(-up, fix.parameters["gnss-position bias"][kept, 2], rtol=0, atol=1e-7)
    east = (fix.measurements.value[:, 1] - truth.longitude[kept]) * np.cos(truth.latitude[kept]) * 6.39e6
    np.testing.assert_allclose(east, fix.parameters["gnss-position bias"][kept, 1], rtol=5e-3, atol=1e-3)
    off = velocity.measurements.value - truth.velocity_ned[kept]
    np.testing.assert_allclose(off, velocity.parameters["gnss-velocity bias"][kept], rtol=0, atol=1e-7)

    height = sensed(flight, Barometer(sigma_m=tiny, bias_m=3.0, scale_sigma_ppm=5000.0), 1)
    h = flight.state(height.time).height
    expected = (1.0 + height.parameters["baro scale"][0]) * h + height.parameters["baro bias"][:, 0]
    np.testing.assert_allclose(height.measurements.value[:, 0], expected, rtol=0, atol=1e-7)
    assert abs(height.parameters["baro scale"][0]) > 1e-4

    speed = sensed(flight, Airspeed(sigma_mps=tiny, bias_sigma_mps=1.0, scale_sigma_ppm=900.0), 1)
    through_air = np.linalg.norm(ecef(flight, speed.time)[1], axis=1)
    expected = (1.0 + speed.parameters["airspeed scale"]) * through_air + speed.parameters["airspeed bias"]
    np.testing.assert_allclose(speed.measurements.value[:, 0], expected, rtol=0, atol=1e-7)
    np.testing.assert_array_equal(speed.parameters["airspeed wind"], np.zeros((60, 2)))

    compass = sensed(flight, Magnetometer(sigma_deg=tiny, bias_sigma_deg=1.0, deviation_sigma_deg=2.0), 1)
    psi = Rotation.from_quat(flight.state(compass.time).q_nb, scalar_first=True).as_euler("ZYX")[:, 0]
    a, b = compass.parameters["magnetometer deviation"]
    off = compass.measurements.value[:, 0] - psi - compass.parameters["magnetometer bias"]
    expected = a * np.sin(psi) + b * np.cos(psi)
    np.testing.assert_allclose(np.angle(np.exp(1j * (off - expected))), 0.0, rtol=0, atol=1e-9)
    assert np.ptp(expected) > 1e-3

    reference = sensed(flight, AttitudeReference(sigma_arcmin=(1e-11,) * 3, bias_sigma_arcmin=9.0), 1)
    true = Rotation.from_quat(flight.state(reference.time).q_nb, scalar_first=True)
    turned = true * Rotation.from_rotvec(reference.parameters["attitude bias"])
    apart = turned.inv() * Rotation.from_quat(reference.measurements.value, scalar_first=True)
    assert np.max(apart.magnitude()) < 1e-12


def test_filter_is_told_a_wrong_lever_arm():
    section = Gnss(lever_arm_m=(1.0, -2.0, 0.5), lever_arm_sigma_m=0.3)
    found = [sensed(parked(2.0), section, seed) for seed in range(700)]
    off = np.array([f.measurements.lever_arm for f, _ in found]) - section.lever_arm_m
    for i in range(3):
        assert_sigma(off[:, i], 0.3)
    for fix, velocity in found[:5]:
        np.testing.assert_allclose(
            fix.measurements.lever_arm + fix.parameters["gnss lever arm"], section.lever_arm_m, rtol=0, atol=1e-15
        )
        assert np.array_equal(fix.measurements.lever_arm, velocity.measurements.lever_arm)


def test_better_system_gives_its_own_solution():
    """Its errors are in it, the noise of the comparison and the mounting on top."""
    standing, n = parked(2000.0), 20_001
    time = np.arange(n) / 10.0
    drift = np.column_stack((0.1 * np.sin(time / 300.0), 1e-4 * time, 0.0 * time))
    tilt = Rotation.from_rotvec(np.column_stack((1e-4 * np.sin(time / 500.0), 0.0 * time, 2e-4 + 0.0 * time)))
    solution = NavSolution(
        time, *(np.zeros(n),) * 3, drift, tilt.as_quat(scalar_first=True), np.zeros(n), "quaternion"
    )  # fmt: skip
    section = Master(
        attitude=True, velocity_sigma_mps=0.05, attitude_sigma_arcmin=2.0, mounting_sigma_arcmin=20.0,
        lever_arm_m=(0.0, 3.0, 0.0), latency_s=0.1,
    )  # fmt: skip
    velocity, attitude = section.read(Vehicle(standing, 6, lambda grade, arm: solution))
    assert velocity.measurements.label == "master-velocity"
    assert np.array_equal(velocity.measurements.lever_arm, [0.0, 3.0, 0.0])
    whole = np.arange(10, n, 10)
    assert np.array_equal(velocity.time, time[whole])
    for i in range(3):
        assert_sigma(velocity.measurements.value[:, i] - drift[whole, i], 0.05)
    askew = Rotation.from_rotvec(attitude.parameters["master-attitude bias"])
    turn = (tilt[whole] * askew).inv() * Rotation.from_quat(attitude.measurements.value, scalar_first=True)
    for axis in turn.as_rotvec(degrees=True).T * 60.0:
        assert abs(np.std(axis) - 2.0) < 4.5 * 2.0 / np.sqrt(2.0 * len(axis))
    assert 1.0 < askew.magnitude() * 60.0 * 180.0 / np.pi < 100.0


def test_motion_that_is_over_before_the_first_reading():
    with pytest.raises(
        InputError, match=r"aiding\.gnss\.rate_hz = 0\.01: the first measurement comes after 100 s, and the"
    ):
        read(parked(50.0), Gnss(rate_hz=0.01))
