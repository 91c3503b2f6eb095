"""The laser gyro's closed forms against published geometry, Adler's solution, scipy's integrator and each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp
from scipy.special import wofz

from scenarios.support import lock_in_equation
from scenarios.support.lock_in_equation import angle_error, turnarounds
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.sensors import TriadErrors, draw
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_errors import WarmUp
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.imu.laser_gyro import LaserGyro, detuning, null_shift, path_change
from tests.slow import slow

DEG = np.pi / 180.0
TRIANGLE = np.sqrt(3.0) / 4.0 * 0.14**2


def gyro(dither_deg_s: float = 100.0, frequency: float = 400.0, lock_in_deg_s: float = 0.1) -> LaserGyro:
    """A triangle of 14 cm with a lock-in rate of 0.1 deg/s."""
    amplitude = dither_deg_s * DEG / (2.0 * np.pi * frequency)
    return LaserGyro(0.42, TRIANGLE, 632.8e-9, lock_in_deg_s * DEG, amplitude, frequency)


def test_pulse_of_a_known_ring() -> None:
    """An equilateral triangle of side s: λL/(4A) = √3 λ/s; Honeywell's GG1342 of 42 cm is known for 1.6 arcsec."""
    weight = gyro().pulse_weight
    assert weight == pytest.approx(np.sqrt(3.0) * 632.8e-9 / 0.14, rel=1e-14)
    assert weight / DEG * 3600.0 == pytest.approx(1.61482, rel=1e-5)
    assert gyro().scale * weight == pytest.approx(2.0 * np.pi, rel=1e-15)
    # the Earth's 15.041 deg/h beat at 9.3 Hz
    assert 15.041 * DEG / 3600.0 / weight == pytest.approx(9.314, rel=1e-4)


def test_random_walk_worked_out_by_hand() -> None:
    """0.1 deg/s of lock-in, 100 deg/s of dither: 1.74533e-3 / √(802566 · 1.74533) rad/√s."""
    assert gyro().random_walk == pytest.approx(1.4746880e-6, rel=1e-5)
    assert gyro(frequency=200.0).random_walk == pytest.approx(gyro().random_walk, rel=1e-14)


@pytest.mark.parametrize("ratio", [1.02, 1.5, 4.0, -2.0])
def test_undithered_phase_is_adlers_solution(ratio: float) -> None:
    """tan ψ/2 = b/a + √(1 − b²/a²) tan(½√(a² − b²) (t − t₀)), a = KΩ and b = KΩ_L (Adler 1946)."""
    g = gyro()
    rate = ratio * g.lock_in
    error = angle_error(g, rate, np.zeros(401), phase=0.3, step=0.05)
    t = (np.arange(400) + 0.5) * 0.5 / g.dither_frequency
    psi = 0.3 + g.scale * (rate * t + error)
    a, b = g.scale * rate, g.scale * g.lock_in
    beat = np.sqrt(a * a - b * b) * np.sign(a)
    u0 = (np.tan(0.15) - b / a) * a / beat
    angle = np.arctan(u0) + 0.5 * beat * t
    u = b / a + beat / a * np.tan(angle)
    apart = (psi - 2.0 * np.arctan(u) + np.pi) % (2.0 * np.pi) - np.pi
    assert np.abs(apart).max() < 2e-4 if abs(ratio) < 1.1 else np.abs(apart).max() < 2e-6
    # one pulse of the mean beat for every 2π, whatever the distance from the dead zone
    periods = np.abs(psi[-1] - psi[0]) / (2.0 * np.pi)
    assert periods * g.pulse_weight / (t[-1] - t[0]) == pytest.approx(
        abs(float(g.undithered_rate(rate))), abs=g.pulse_weight / (t[-1] - t[0])
    )


@pytest.mark.parametrize("ratio", [-0.99, -0.4, 0.0, 0.7])
def test_dead_zone(ratio: float) -> None:
    """Inside it the phase comes to rest at sin ψ = Ω/Ω_L and no pulse is given."""
    g = gyro()
    error = angle_error(g, ratio * g.lock_in, np.zeros(801), phase=1.0)
    t = (np.arange(800) + 0.5) * 0.5 / g.dither_frequency
    psi = 1.0 + g.scale * (ratio * g.lock_in * t + error)
    assert np.sin(psi[-1]) == pytest.approx(ratio, abs=1e-9)
    assert abs(psi[-1] - psi[0]) < 2.0 * np.pi
    assert g.undithered_rate(ratio * g.lock_in) == 0.0


def test_method_is_of_the_fourth_order_and_right() -> None:
    """A dither with random turnarounds, against scipy's eighth-order method on the plain equation (1)."""
    g = gyro(20.0)
    at = turnarounds(g, 6, np.random.default_rng(1))
    swing, rate = 0.5 / g.dither_frequency, 0.3 * g.lock_in

    def equation(t: float, psi: np.ndarray) -> np.ndarray:
        k = min(int(t / swing), 5)
        dither = 0.5 * np.pi / swing * (at[k + 1] - at[k]) * np.sin(np.pi * (t / swing - k))
        return g.scale * (rate + dither) - g.scale * g.lock_in * np.sin(psi)

    psi, exact, options = np.array([0.4]), [], {"method": "DOP853", "rtol": 1e-13, "atol": 1e-10, "max_step": 2e-6}
    for k in range(6):
        for part in (0.5, 1.0):
            # never asked across a turnaround, where the dither's acceleration jumps
            start, end = (k + part - 0.5) * swing, (k + part) * swing
            psi = solve_ivp(equation, (start, np.nextafter(end, 0.0)), psi, **options).y[:, -1]
            if part == 0.5:
                dithered = 0.5 * (at[k] + at[k + 1]) - at[0]
                exact.append((psi[0] - 0.4) / g.scale - rate * end - dithered)
    off = [np.abs(angle_error(g, rate, at, 0.4, *step) - exact).max() for step in ((), (0.5,), (0.25,))]  # from 1 rad
    assert off[2] < 1e-12  # of errors of 4e-8 rad
    assert 12.0 < off[0] / off[1] < 20.0


def walk(g: LaserGyro, swings: int, seed: int, block: int = 10) -> float:
    """Return N from the error's growth over blocks of half periods, rad/√s."""
    rng = np.random.default_rng(seed)
    error = angle_error(g, 1e-4, turnarounds(g, swings, rng), phase=float(rng.uniform(0.0, 6.28)))
    grown = np.diff(error[::block])
    return float(np.sqrt(np.mean(grown**2) / (block * 0.5 / g.dither_frequency)))


@pytest.mark.parametrize(("dither", "frequency"), [(20.0, 400.0), *slow((63.0, 800.0), (200.0, 800.0))])
def test_random_walk_of_a_random_dither(dither: float, frequency: float) -> None:
    """Over a decade of dither rates; 600 blocks tell N to 1/√1200 = 2.9 %."""
    g = gyro(dither, frequency)
    assert walk(g, 6000, 3) == pytest.approx(g.random_walk, rel=3.0 * 0.029)


def test_constant_of_the_formula_is_that_of_radians_of_phase() -> None:
    """With K in pulses per radian, N = Ω_L/√(K Ω_D) would be √(2π) too large."""
    g = gyro(20.0)
    assert g.lock_in * np.sqrt(g.pulse_weight / g.dither_rate) / walk(g, 6000, 4) == pytest.approx(2.507, rel=0.09)


@pytest.mark.parametrize(("randomised", "side"), [("one", -1.0), *slow(("none", 1.0), ("none", -1.0), ("one", 1.0))])
def test_what_is_left_of_the_dead_zone(randomised: str, side: float) -> None:
    """Just inside (3) or (4) the gyro gives no rate; half as far outside it gives √(Ω² − zone²)."""
    # KΘ where |J₀| has a maximum, so that the zone is wide
    g = LaserGyro(0.42, TRIANGLE, 632.8e-9, 0.1 * DEG, 64.25 * np.pi / gyro().scale, 400.0)
    zone = g.regular_dead_zone if randomised == "none" else g.half_random_dead_zone
    swings = 4000
    at = turnarounds(g, swings, np.random.default_rng(2), randomised)
    t = (swings - 1) * 0.5 / g.dither_frequency

    def given(rate: float) -> float:
        error = angle_error(g, rate, at)
        return float(rate + (error[-1] - error[0]) / t)

    noise = 3.0 * g.random_walk / np.sqrt(2.0 * t) + g.pulse_weight / t
    assert abs(given(0.7 * side * zone)) < noise
    assert given(1.5 * side * zone) == pytest.approx(side * np.sqrt(1.25) * zone, abs=noise)


def test_both_turnarounds_at_random_leave_no_dead_zone() -> None:
    g = gyro()
    at = turnarounds(g, 400, np.random.default_rng(5))
    t = 399 * 0.5 / g.dither_frequency
    for rate in (0.05 * g.half_random_dead_zone, 0.5 * g.lock_in, 0.99 * g.lock_in):
        error = angle_error(g, rate, at)
        assert abs(error[-1] - error[0]) < 3.5 * g.random_walk * np.sqrt(t)


def test_turnarounds() -> None:
    g = gyro()
    both, one, none = (turnarounds(g, 2001, np.random.default_rng(1), which) for which in ("both", "one", "none"))
    assert np.array_equal(none[::2], np.full(1001, -g.dither_amplitude))
    assert np.array_equal(none[1::2], np.full(1001, g.dither_amplitude))
    assert np.array_equal(one[1::2], none[1::2])
    assert np.array_equal(one[::2], both[::2])  # switching one side off leaves the other's draws alone
    assert np.std(both[1::2]) == pytest.approx(g.pulse_weight, rel=0.1)


def test_null_shift_is_the_split_of_two_pulled_modes() -> None:
    """Each beam's pulling from the plasma dispersion function of its own, shifted gain line; their beat in pulses."""
    g, gain, v, u, c = gyro(), 0.008, 0.05, 550.0, 299792458.0

    def pulled(xi: np.ndarray) -> np.ndarray:  # frequency shift, Hz: half the gain, phase of the line, over 2πL/c
        return -0.5 * gain * wofz(xi).imag * c / (2.0 * np.pi * g.perimeter)

    change = np.linspace(-2.3, 1.9, 57) * g.wavelength
    xi = detuning(g, change, u)
    beat = pulled(xi - v / u) - pulled(xi + v / u)
    found = null_shift(g, change, gain, v, u)
    np.testing.assert_allclose(found, beat * g.pulse_weight, rtol=1e-6, atol=1e-12)
    assert float(null_shift(g, 0.0, gain, v, u)) / DEG * 3600.0 == pytest.approx(150.5, rel=1e-3)  # deg/h
    np.testing.assert_allclose(found, null_shift(g, change + 3.0 * g.wavelength, gain, v, u), rtol=1e-9, atol=0.0)


def test_detuning_by_the_frequencies_of_the_ring() -> None:
    """ν = Nc/L: the mode nearest to the line's centre, for a ring that was longer by a part of a wavelength."""
    g, u = gyro(), 550.0
    length = 663716 * g.wavelength  # a whole number of waves
    ring = LaserGyro(length, g.area, g.wavelength, g.lock_in, g.dither_amplitude, g.dither_frequency)
    for change in np.array([-0.45, -0.1, 0.3, 0.7, 1.2]) * g.wavelength:
        modes = 299792458.0 * np.arange(663710, 663722) / (length + change)
        off = modes - 299792458.0 / g.wavelength
        nearest = off[np.argmin(np.abs(off))] / (u / g.wavelength)
        assert detuning(ring, change, u) == pytest.approx(nearest, rel=1e-5)


def test_path_change_with_temperature() -> None:
    """42 cm of Zerodur at 2e-8/K over 30 K: 0.252 µm, two fifths of a fringe; nine tenths of it taken out."""
    change = path_change(gyro(), np.array([0.0, 30.0]), 2e-8)
    np.testing.assert_allclose(change, [0.0, 2.52e-7], rtol=1e-12)
    np.testing.assert_allclose(path_change(gyro(), 30.0, 2e-8, 0.9), 2.52e-8, rtol=1e-12)


PHYSICS = {
    "perimeter_mm": 420.0,
    "area_mm2": 8487.0,
    "lock_in_deg_h": 360.0,
    "dither_amplitude_arcsec": 140.0,
    "dither_frequency_hz": 400.0,
}
WARMING = {"gas_flow_mps": 0.004, "gain_percent": 0.8, "path_control": 0.5}


def test_null_shift_in_the_readings() -> None:
    """A block that warms by 40 °C, against the two pulled modes of its ring; half the expansion is taken out."""
    temperature = {"temperature_start_c": -30.0, "temperature_steady_c": 10.0, "warm_up_time_s": 300.0}
    section = Imu.model_validate({"grade": "ideal", "laser_gyro": {**PHYSICS, **WARMING}, **temperature})
    errors = replace(draw(section), gyro=TriadErrors())  # neither pulses nor random walk
    edges = 50.0 + np.arange(6001) * 0.1
    rng = np.random.default_rng(4)
    ideal = ImuData(edges, rng.normal(0.0, 1e-3, (6000, 3)), rng.normal(0.0, 1.0, (6000, 3)))
    extra = emulate(ideal, errors).dtheta - ideal.dtheta

    t, u, v = edges[:-1] + 0.05 - 50.0, 550.0, 0.004
    longer = 0.5 * 2e-8 * 0.42 * (10.0 - 40.0 * np.exp(-t / 300.0))
    xi = -(longer / 632.8e-9) * 299792458.0 / 0.42 / (u / 632.8e-9)
    assert np.abs(longer).max() < 0.5 * 632.8e-9  # no mode hop
    pull = 0.008 * 299792458.0 / (4.0 * np.pi * 0.42)
    beat = pull * (wofz(xi + v / u).imag - wofz(xi - v / u).imag)
    at_calibration = pull * (wofz(v / u).imag - wofz(-v / u).imag)
    expected = (beat - at_calibration) * gyro().pulse_weight * 0.1
    assert np.abs(expected).max() > 1e-9
    for axis in range(3):
        np.testing.assert_allclose(extra[:, axis], expected, rtol=1e-4, atol=1e-18)


def test_null_shift_leaves_every_draw_alone() -> None:
    temperature = {"temperature_start_c": -30.0, "temperature_steady_c": 10.0, "warm_up_time_s": 300.0}
    still = Imu.model_validate({"grade": "laser-standard", "laser_gyro": PHYSICS, **temperature})
    flowing = Imu.model_validate({**still.model_dump(), "laser_gyro": {**PHYSICS, **WARMING}})
    ideal = ImuData(np.arange(2001) * 0.5, np.zeros((2000, 3)), np.zeros((2000, 3)))
    without, with_it = (emulate(ideal, section, 5) for section in (still, flowing))
    assert np.array_equal(without.dvel, with_it.dvel)
    shift = draw(flowing).null_shift
    assert shift is not None
    drift = shift.bias(WarmUp(-30.0, 10.0, 300.0).temperature(ideal.time[:-1] + 0.25)) * 0.5
    between = np.cumsum(with_it.dtheta - without.dtheta, axis=0) - np.cumsum(drift)[:, None]
    assert np.abs(between).max() < 1.1 * gyro().pulse_weight  # each is within half a pulse; scale factor and tilt 1e-4


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"area": 0.02}, "encloses at most 0.014 m²"),
        ({"perimeter": 0.0}, "perimeter = 0.0 must be positive"),
        ({"wavelength": np.nan}, "wavelength = nan"),
        ({"lock_in": -1e-3}, "lock_in"),
        ({"dither_amplitude": 1e-7}, "only 0.000251 rad/s, which is within the lock-in of 0.00175 rad/s"),
    ],
)
def test_rings_that_cannot_be(changes: dict[str, float], text: str) -> None:
    with pytest.raises(InputError, match=text):
        LaserGyro(**{**vars(gyro()), **changes})


def test_other_mistakes() -> None:
    with pytest.raises(InputError, match="swings = 0 must be one finite number from 1"):
        turnarounds(gyro(), 0, np.random.default_rng(0))
    with pytest.raises(InputError, match="at least two turning points"):
        angle_error(gyro(), 0.0, [1e-4])
    with pytest.raises(InputError, match="finite"):
        angle_error(gyro(), np.nan, np.zeros(3))
    with pytest.raises(InputError, match="step"):
        angle_error(gyro(), 0.0, np.zeros(3), step=0.0)
    with pytest.raises(InputError, match="between 0 and 1"):
        path_change(gyro(), 1.0, 1e-8, 2.0)
    with pytest.raises(InputError, match="thermal_speed"):
        detuning(gyro(), 0.0, 0.0)


def test_steps_are_as_long_as_asked_and_as_many_as_bearable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three swings of a quarter of a pulse's angle, of unlike size: K times the fastest rate they reach, by hand."""
    g = gyro()
    at = np.array([0.0, 2e-6, -1e-6, 1e-6])
    swing = 1.0 / 800.0
    fastest = np.pi / 2.0 * 3e-6 / swing + 2e-3 + g.lock_in
    monkeypatch.setattr(lock_in_equation, "_MOST_STEPS", 300.0)
    step = 3.0 * g.scale * fastest * swing / 300.0  # 100 a swing
    angle_error(g, -2e-3, at, step=1.000001 * step)
    with pytest.raises(InputError, match="needs more than 300 steps over 3 swings") as found:
        angle_error(g, -2e-3, at, step=0.999999 * step)
    assert f"a beat of up to {g.scale * fastest:.3g} rad/s" in str(found.value)


def test_physics_in_a_scenario() -> None:
    """By hand: pulse 632.8e-9·0.42/(4·8.487e-3) rad; Ω_D = 2π·400·140\" = 97.74 deg/s, N = Ω_L √(pulse/(2πΩ_D))."""
    errors = draw(Imu.model_validate({"grade": "laser-standard", "laser_gyro": PHYSICS}), 3)
    plain = draw(Imu(grade="laser-standard"), 3)
    assert errors.gyro.quantum / DEG * 3600.0 == pytest.approx(1.61483, rel=1e-5)
    assert errors.gyro.random_walk / DEG * 60.0 == pytest.approx(0.0051279, rel=1e-4)
    assert np.array_equal(errors.gyro.bias, plain.gyro.bias)  # the rest is the grade's
    assert errors.accel.random_walk == plain.accel.random_walk
    still = Imu.model_validate({"laser_gyro": {**PHYSICS, "lock_in_deg_h": 0.0}})
    assert draw(still).gyro.random_walk == 0.0


@pytest.mark.parametrize(
    ("data", "text"),
    [
        ({"gyro_arw_deg_sqrt_h": 0.003, "laser_gyro": PHYSICS}, "gyro_arw_deg_sqrt_h follows from the physics"),
        ({"gyro_quantum_arcsec": 1.0, "laser_gyro": PHYSICS}, "gyro_quantum_arcsec follows from the physics"),
        ({"laser_gyro": {**PHYSICS, "area_mm2": 20000.0}}, "encloses at most 1.404e\\+04 mm²"),
        ({"laser_gyro": {**PHYSICS, "lock_in_deg_h": 4e5}}, "is within lock_in_deg_h = 400000"),
        ({"laser_gyro": {**PHYSICS, "wavelength_nm": 0.0}}, "greater than 0"),
        ({"laser_gyro": {**PHYSICS, "gas_flow_mps": 0.01}}, "gas_flow_mps = 0.01 with gain_percent = 0: a null shift"),
        ({"laser_gyro": {**PHYSICS, "gain_percent": 1.0}}, "needs both"),
        ({"laser_gyro": {**PHYSICS, **WARMING, "path_control": 1.5}}, "less than or equal to 1"),
    ],
)
def test_physics_that_cannot_be(data: dict[str, object], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        Imu.model_validate(data)


def test_the_error_of_an_angle_begins_with_phase_zero() -> None:
    g, angles = gyro(), 1e-6 * np.sin(np.arange(81.0))
    np.testing.assert_array_equal(angle_error(g, 0.1, angles), angle_error(g, 0.1, angles, phase=0.0))
    assert not np.array_equal(angle_error(g, 0.1, angles), angle_error(g, 0.1, angles, phase=1.0))
