"""Motion on roads and at sea: spectra against the stated ones, standstill, and the closure of ideal sensors."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import welch

import sinssim
from sinssim.earth.ellipsoids import WGS84
from sinssim.rotation.quaternions import euler_from_quaternion
from sinssim.scenario.schema import Scenario
from sinssim.truth.curve import Curve
from sinssim.truth.motions import road_and_sea_spectra
from sinssim.truth.motions.surface_vehicles import ROADS, Drive, Voyage, respond

LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def drive(*legs: dict[str, Any], **keys: Any) -> Drive:
    return Drive.model_validate({"latitude_deg": 47.0, "altitude_m": 400.0, "legs": list(legs), **keys})


def voyage(*legs: dict[str, Any], **keys: Any) -> Voyage:
    return Voyage.model_validate({"latitude_deg": 54.0, "legs": list(legs), **keys})


def curve(section: Drive | Voyage, seed: int = 1) -> Curve:
    return section.trajectory(seed=seed)


def gain(frequency_hz: Any, natural_hz: float, damping: float, *, on_carrier: bool) -> np.ndarray:
    """Return |H| of a damped oscillator: the amplitude of the body over that of the carrier."""
    r = np.asarray(frequency_hz, dtype=np.float64) / natural_hz
    below = (1.0 - r * r) ** 2 + (2.0 * damping * r) ** 2
    return np.asarray(np.sqrt((1.0 + (2.0 * damping * r) ** 2 if on_carrier else 1.0) / below))


def banded(frequency: np.ndarray, values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return np.array([values[(frequency >= a) & (frequency < b)].mean() for a, b in pairwise(edges)])


@pytest.mark.parametrize("on_carrier", [True, False])
def test_response_to_a_sine_is_the_transfer_function(on_carrier: bool) -> None:
    time = np.arange(0.0, 60.0, 0.005)
    for frequency in (0.4, 1.3, 3.0):
        z = respond(np.sin(2.0 * np.pi * frequency * time), 0.005, 1.3, 0.3, on_carrier=on_carrier)
        late = time > 30.0
        assert np.abs(z[late]).max() == pytest.approx(gain(frequency, 1.3, 0.3, on_carrier=on_carrier), rel=2e-3)


def test_road_has_the_density_of_the_standard() -> None:
    heights = road_and_sea_spectra.heights(100_000.0, ROADS["C"], road_and_sea_spectra.HIGHEST, 3)
    n, found = welch(heights, 1.0 / road_and_sea_spectra.STEP, nperseg=8192)
    edges = np.geomspace(0.03, 2.5, 9)
    # over 250 segments of 819 m; a band of ten lines and more has a relative 1σ of at most 2 %
    inside = (n > 0.02) & (n < 2.6)
    n, found = n[inside], found[inside]
    assert banded(n, found / road_and_sea_spectra.road_density(n, ROADS["C"]), edges) == pytest.approx(
        np.ones(8), abs=0.08
    )
    assert road_and_sea_spectra.road_density(0.1, ROADS["A"]) == 16e-6  # ISO 8608, class A
    # variance over the range of the standard, ∫G dn = G(n₀) n₀² (1/n₁ − 1/n₂)
    whole = ROADS["C"] * 0.01 * (1.0 / road_and_sea_spectra.LOWEST - 1.0 / road_and_sea_spectra.HIGHEST)
    assert heights.var() == pytest.approx(whole, rel=0.2)


def test_heave_and_pitch_on_the_road_have_the_spectrum_of_road_and_suspension() -> None:
    speed = 15.0
    legs = ({"type": "straight", "distance_m": 200.0, "speed_mps": speed}, {"type": "straight", "duration_s": 900.0})
    motion = curve(drive(*legs, road="C"))
    time = np.arange(60.0, motion.end, 0.02)
    state = motion.state(time)
    n = lambda f: f / speed  # noqa: E731
    edges = np.geomspace(0.3, 12.0, 9)
    _, pitch, _ = euler_from_quaternion(state.q_nb)
    for values, of in (
        (state.height, lambda f: np.cos(np.pi * n(f) * 2.7) ** 2),  # the mean of both axles
        (pitch, lambda f: (2.0 * np.sin(np.pi * n(f) * 2.7) / 2.7) ** 2),  # their difference over the wheelbase
    ):
        f, found = welch(values, 50.0, nperseg=2048)
        stated = (
            road_and_sea_spectra.road_density(n(f), ROADS["C"])
            / speed
            * gain(f, 1.3, 0.3, on_carrier=True) ** 2
            * of(f)
        )
        # 40 segments: 16 % for one line, at most 8 % for a band, with overlap
        assert banded(f, found, edges) / banded(f, stated, edges) == pytest.approx(np.ones(8), abs=0.3)


def test_vehicle_leans_outwards_and_stands_still() -> None:
    legs = (
        {"type": "stop", "duration_s": 20.0},
        {"type": "straight", "distance_m": 200.0, "speed_mps": 10.0},
        {"type": "turn", "angle_deg": 360.0},
        {"type": "stop", "duration_s": 60.0},
    )
    motion = curve(drive(*legs, road="smooth"))
    begin, end = (event.time for event in motion.events if event.text.startswith("leg 3 "))
    roll, _, _ = euler_from_quaternion(motion.state(np.array([0.5 * (begin + end)])).q_nb)
    assert np.degrees(roll[0]) == pytest.approx(-0.5 * 1.5, rel=1e-3)  # to the left in a turn to the right
    rough = curve(drive(*legs, road="D"))
    for span in ((0.0, 19.0), (rough.end - 30.0, rough.end)):
        assert np.abs(rough.state(np.linspace(*span, 200)).velocity_ned).max() < 1e-9
    place = motion.state(np.array([0.0, begin]))
    north = np.diff(place.latitude)[0] * 6.3700e6  # meridian's radius at 47° and 400 m
    assert north == pytest.approx(200.0, rel=1e-3)


def test_sea_has_its_height_and_its_peak() -> None:
    height = 2.5
    omega_p = road_and_sea_spectra.peak(height, None)
    # Pierson and Moskowitz: ω_p = 0.877 g/U with H = 0.21 U²/g, so that ω_p² H = 0.1615 g
    assert omega_p**2 * height / road_and_sea_spectra.G == pytest.approx(0.877**2 * 0.21, rel=0.01)
    area, _ = quad(lambda w: float(road_and_sea_spectra.wave_density(w, height, omega_p)), 0.05, 40.0, points=[omega_p])
    assert 4.0 * np.sqrt(area) == pytest.approx(height, rel=1e-4)
    grid = np.linspace(0.2, 3.0, 5001)
    assert grid[np.argmax(road_and_sea_spectra.wave_density(grid, height, omega_p))] == pytest.approx(omega_p, rel=1e-3)
    squares = [
        np.sum(w.cosine**2 + w.sine**2) / 2.0
        for w in (road_and_sea_spectra.waves(height, omega_p, k) for k in range(100))
    ]
    assert np.mean(squares) == pytest.approx(height**2 / 16.0, rel=0.06)


def test_ship_at_anchor_moves_with_the_spectrum_of_sea_and_hull() -> None:
    section = voyage(
        {"type": "stop", "duration_s": 6000.0},
        significant_height_m=2.0, waves_towards_deg=60.0, heading_deg=0.0,
    )  # fmt: skip
    motion = curve(section, 5)
    omega_p = road_and_sea_spectra.peak(2.0, None)
    waves = road_and_sea_spectra.waves(2.0, omega_p, 5)
    time = np.arange(0.0, motion.end, 0.25)
    state = motion.state(time)
    roll, pitch, _ = euler_from_quaternion(state.q_nb)
    power = 0.5 * (waves.cosine**2 + waves.sine**2)
    f = waves.omega / (2.0 * np.pi)
    heave = power * gain(f, 1.0 / 6.0, 0.4, on_carrier=False) ** 2
    assert state.height.var() == pytest.approx(heave.sum(), rel=0.03)
    for values, period, damping, part in ((roll, 10.0, 0.1, np.sin), (pitch, 6.0, 0.4, np.cos)):
        slope = power * waves.k**2 * gain(f, 1.0 / period, damping, on_carrier=False) ** 2 * part(np.radians(60.0)) ** 2
        assert values.var() == pytest.approx(slope.sum(), rel=0.03)
    # and by bands, against the stated spectrum itself: a band of 32 waves has a relative 1σ of 18 %
    at, found = welch(state.height, 4.0, nperseg=2048)
    edges = np.linspace(0.6, 2.2, 5) * omega_p / (2.0 * np.pi)
    stated = 2.0 * np.pi * road_and_sea_spectra.wave_density(2.0 * np.pi * np.maximum(at, 1e-3), 2.0, omega_p)
    stated *= gain(at, 1.0 / 6.0, 0.4, on_carrier=False) ** 2
    assert banded(at, found, edges) / banded(at, stated, edges) == pytest.approx(np.ones(4), abs=0.7)


@pytest.mark.slow
def test_ship_meets_head_seas_more_often() -> None:
    keys = {"significant_height_m": 1.0, "peak_period_s": 8.0, "waves_towards_deg": 180.0}
    legs = ({"type": "straight", "duration_s": 3000.0, "speed_mps": 8.0},)
    motion = curve(voyage(*legs, acceleration_mps2=0.5, **keys), 2)
    time = np.arange(100.0, motion.end, 0.25)
    wave = motion.channels["wave_height_m"]
    f, power = welch(np.interp(time, wave.time, wave.values), 4.0, nperseg=2048)
    omega = 2.0 * np.pi / 8.0
    waves = road_and_sea_spectra.waves(1.0, omega, 2)
    met = (waves.omega + waves.omega**2 * 8.0 / road_and_sea_spectra.G) / (
        2.0 * np.pi
    )  # encounter frequency, Lloyd, Seakeeping, 1989
    own = waves.cosine**2 + waves.sine**2
    assert np.sum(f * power) / np.sum(power) == pytest.approx(np.sum(met * own) / np.sum(own), rel=0.02)
    assert np.sum(f * power) / np.sum(power) > 1.5 * np.sum(waves.omega * own) / np.sum(own) / (2.0 * np.pi)


CLOSED: dict[str, dict[str, Any]] = {
    "drive": {
        "latitude_deg": 47.0, "longitude_deg": 8.0, "altitude_m": 400.0, "road": "D",
        "legs": [
            {"type": "stop", "duration_s": 10.0},
            {"type": "straight", "distance_m": 400.0, "speed_mps": 15.0},
            {"type": "turn", "angle_deg": 90.0},
            {"type": "stop", "duration_s": 10.0},
        ],
    },
    "voyage": {
        "latitude_deg": 54.0, "longitude_deg": 8.0, "sea_state": 5,
        "legs": [
            {"type": "stop", "duration_s": 30.0},
            {"type": "straight", "duration_s": 120.0, "speed_mps": 4.0},
            {"type": "turn", "angle_deg": -40.0},
        ],
    },
}  # fmt: skip


@pytest.mark.parametrize("source", ["drive", "voyage"])
def test_ideal_sensors_close(source: str) -> None:
    scenario = Scenario.model_validate({"name": "c", source: CLOSED[source], "imu": {"grade": "ideal", "rate_hz": 200}})
    run = sinssim.run(scenario)
    assert run.errors["quaternion"].horizontal.max() < 0.01
    assert np.abs(run.errors["quaternion"].height).max() < 0.01
    assert list(run.summary["phases"]) == ["quaternion"]
    assert run.summary["phases"]["quaternion"][0]["phase"] == "standstill"


def test_swaying_ship_aligns_itself() -> None:
    table = {**CLOSED["voyage"], "legs": [{"type": "stop", "duration_s": 400.0}], "sea_state": 3}
    scenario = Scenario.model_validate(
        {
            "name": "sway",
            "voyage": table,
            "imu": {"grade": "ideal", "rate_hz": 50},
            "navigation": {"alignment": {"method": "disturbed"}},
        }
    )
    run = sinssim.run(scenario)
    assert abs(run.errors["quaternion"].attitude[0, 2]) < np.radians(0.5)
    assert np.abs(run.errors["quaternion"].attitude[0, :2]).max() < np.radians(0.05)
    # the ship moves at that instant, and the fit knows how fast
    moving = run.truth.state.velocity_ned[np.searchsorted(run.truth.time, 300.0)]
    assert np.linalg.norm(moving) > 0.1
    assert np.linalg.norm(run.errors["quaternion"].velocity_ned[0]) < 0.03


def test_place_and_height_on_the_road() -> None:
    """Heading 60° for 2 km on a smooth road 400 m up: on the ellipsoid's radii there, and level again at the end."""
    legs = ({"type": "straight", "distance_m": 2000.0, "speed_mps": 10.0},)
    motion = curve(drive(*legs, road="smooth", heading_deg=60.0, longitude_deg=8.0))
    state = motion.state(np.array([0.0, motion.end]))
    lat = np.radians(47.0)
    w = 1.0 - WGS84.e2 * np.sin(lat) ** 2
    north, east = (2000.0 * part(np.radians(60.0)) for part in (np.cos, np.sin))
    assert np.diff(state.latitude)[0] == pytest.approx(north / (WGS84.a * (1.0 - WGS84.e2) / w**1.5 + 400.0), rel=2e-6)
    middle = lat + 0.5 * north / 6.367e6  # of the parallel's radius
    assert np.diff(state.longitude)[0] == pytest.approx(
        east / ((WGS84.a / np.sqrt(1.0 - WGS84.e2 * np.sin(middle) ** 2) + 400.0) * np.cos(middle)), rel=2e-6
    )
    assert np.degrees([state.latitude[0], state.longitude[0]]) == pytest.approx([47.0, 8.0], abs=1e-12)
    np.testing.assert_allclose(state.height, 400.0, atol=1e-6)
    assert np.degrees(euler_from_quaternion(state.q_nb)[2]) == pytest.approx([60.0, 60.0], abs=1e-6)
    assert (motion.start, motion.end) == (0.0, pytest.approx(205.0))  # 10 s to speed up, in which half the way is lost
    assert set(motion.channels) == {"road_height_m"}
    assert motion.channels["road_height_m"].unit == "m"


def test_a_body_pitches_up_as_it_speeds_up() -> None:
    """0.3° per m/s²: the S-shaped change of speed by 10 m/s at a mean of 2 m/s² has 4 m/s² in its middle, at 2.5 s."""
    legs = ({"type": "straight", "distance_m": 300.0, "speed_mps": 10.0},)
    stiff = curve(drive(*legs, road="smooth", suspension_hz=10.0, suspension_damping=0.7, acceleration_mps2=2.0))
    _, pitch, _ = euler_from_quaternion(stiff.state(np.array([2.5])).q_nb)
    assert np.degrees(pitch[0]) == pytest.approx(1.2, rel=2e-3)


def test_a_body_follows_a_slope_of_the_road(monkeypatch: pytest.MonkeyPatch) -> None:
    """A road that rises by 1 in 50 from 200 m on: 10 s later pitch and height are those of the middle of the axles."""
    asked = []

    def heights(length: float, at_reference: float, highest: float, seed: int) -> np.ndarray:
        asked.append((length, at_reference, highest, seed))
        x = road_and_sea_spectra.STEP * np.arange(int(length / road_and_sea_spectra.STEP) + 3)
        return 0.02 * np.maximum(x - 200.0, 0.0)

    monkeypatch.setattr(road_and_sea_spectra, "heights", heights)
    legs = ({"type": "straight", "distance_m": 500.0, "speed_mps": 8.0},)
    motion = curve(drive(*legs, road="C", wheelbase_m=4.0), seed=7)
    t = np.array([50.0, 55.0])
    state = motion.state(t)
    centre = 8.0 * t - 32.0 + 2.0  # the rear axle has the way; 32 m are lost in speeding up
    np.testing.assert_allclose(state.height - 400.0, 0.02 * (centre - 200.0), rtol=2e-3)
    np.testing.assert_allclose(euler_from_quaternion(state.q_nb)[1], 0.02, rtol=1e-3)
    channel = motion.channels["road_height_m"]
    np.testing.assert_allclose(np.interp(t, channel.time, channel.values), 0.02 * (centre - 200.0), rtol=1e-4)
    ((length, at_reference, highest, seed),) = asked
    assert (length, at_reference, seed) == (pytest.approx(508.0), 256e-6, 7)
    assert highest == pytest.approx(road_and_sea_spectra.HIGHEST)  # at 8 m/s, 0.35 of 100 Hz is 4.4 cycles/m
    curve(drive({"type": "straight", "distance_m": 5000.0, "speed_mps": 50.0}, road="E"), seed=7)
    assert asked[-1][1:3] == (4096e-6, pytest.approx(0.7, rel=1e-3))


def test_a_hull_follows_a_long_wave(monkeypatch: pytest.MonkeyPatch) -> None:
    """One wave of 3 m and 50 s towards 60°, which a hull of short periods rides: heave, surge and sway, roll and pitch.

    At the place h = 3 cos ωt; the water is ahead of its mean by 3 sin ωt, and the surface slopes by 3k sin ωt.
    """
    omega = 2.0 * np.pi / 50.0
    one = road_and_sea_spectra.Sea(
        np.array([omega]), np.array([omega**2 / road_and_sea_spectra.G]), np.array([3.0]), np.array([0.0])
    )
    asked = []
    monkeypatch.setattr(
        road_and_sea_spectra, "waves", lambda height, peak, seed: asked.append((height, peak, seed)) or one
    )
    quick = {f"{name}_{key}": value for name in ("roll", "pitch", "heave")
             for key, value in (("period_s", 0.3), ("damping", 0.7))}  # fmt: skip
    section = voyage({"type": "stop", "duration_s": 120.0}, significant_height_m=2.0, peak_period_s=9.0,
                     waves_towards_deg=60.0, heading_deg=20.0, longitude_deg=5.0, **quick)  # fmt: skip
    motion = curve(section, seed=4)
    assert asked == [(2.0, pytest.approx(2.0 * np.pi / 9.0), 4)]
    t = np.linspace(1.0, 119.0, 60)
    state = motion.state(t)
    roll, pitch, heading = euler_from_quaternion(state.q_nb)
    height, along = 3.0 * np.cos(omega * t), 3.0 * np.sin(omega * t)
    slope = along * omega**2 / road_and_sea_spectra.G
    np.testing.assert_allclose(state.height, height, atol=0.03)
    north, east = (state.latitude - np.radians(54.0)) * 6.3774e6, (state.longitude - np.radians(5.0)) * 3.7565e6
    np.testing.assert_allclose(north, along * 0.5, atol=0.03)
    np.testing.assert_allclose(east, along * np.sqrt(0.75), atol=0.04)
    # the waves go 40° to the right of the bow: on the rising face ahead the bow goes up, and the right side up
    np.testing.assert_allclose(pitch, slope * np.cos(np.radians(40.0)), atol=1e-4)
    np.testing.assert_allclose(roll, -slope * np.sin(np.radians(40.0)), atol=1e-4)
    np.testing.assert_allclose(np.degrees(heading), 20.0, atol=1e-9)
    wave = motion.channels["wave_height_m"]
    np.testing.assert_allclose(np.interp(t, wave.time, wave.values), height, atol=1e-3)
    assert set(motion.channels) == {"wave_height_m"}


def test_a_ship_heels_outwards() -> None:
    """5° per m/s² of lateral acceleration: 0.2 m/s² in the middle of a turn to the left heel it to the right by 1°."""
    legs = ({"type": "straight", "duration_s": 200.0, "speed_mps": 5.0}, {"type": "turn", "angle_deg": -180.0})
    motion = curve(voyage(*legs, sea_state=0, lateral_mps2=0.2, roll_damping=0.7, roll_period_s=2.0))
    begin, end = (event.time for event in motion.events if event.text.startswith("leg 2 "))
    roll, pitch, _ = euler_from_quaternion(motion.state(np.array([0.5 * (begin + end)])).q_nb)
    assert np.degrees(roll[0]) == pytest.approx(1.0, rel=1e-4)
    assert pitch[0] == pytest.approx(0.0, abs=1e-9)


def test_waves_have_frequencies_in_equal_bands() -> None:
    """256 bands from half the peak's frequency to four times it, or to 2 Hz, but at least to twice the peak's."""
    for omega_p, highest in ((0.8, 3.2), (5.0, 4.0 * np.pi), (7.0, 14.0)):
        one = road_and_sea_spectra.waves(2.0, omega_p, 3)
        edges = np.linspace(0.5 * omega_p, highest, 257)
        assert np.all((one.omega > edges[:-1]) & (one.omega < edges[1:]))
        np.testing.assert_allclose(one.k, one.omega**2 / 9.80665)
    assert road_and_sea_spectra.peak(2.0, 8.0) == pytest.approx(0.25 * np.pi)
    # a unit of variance at the peak: 5/16 H² e^−1.25/ω_p
    assert road_and_sea_spectra.wave_density(0.8, 2.0, 0.8) == pytest.approx(1.25 / 0.8 * np.exp(-1.25))


def test_a_road_has_no_waves_beyond_its_range() -> None:
    """Up to 0.5 cycles/m of the 2.83 of the standard, and from 0.011 on; its period is longer than the road."""
    heights = road_and_sea_spectra.heights(300.0, ROADS["E"], 0.5, 5)
    assert len(heights) == 4096  # of 0.1 m, the power of two above 3002
    assert len(road_and_sea_spectra.heights(90.0, ROADS["E"], 0.5, 5)) == 2048  # two periods of the longest wave, 182 m
    size = np.abs(np.fft.rfft(heights))
    n = np.fft.rfftfreq(4096, 0.1)
    inside = (n >= 0.011) & (n <= 0.5)
    assert size[~inside].max() < 1e-9 * size.max()
    assert size[inside].min() > 1e-4 * size.max()
    found = road_and_sea_spectra.road_density([0.01, 0.02, 0.2, 2.9], 64e-6)
    assert found.tolist() == pytest.approx([0.0, 64e-6 * 25.0, 64e-6 / 4.0, 0.0])


def test_same_seed_same_motion_and_another_seed_another() -> None:
    section = drive({"type": "straight", "distance_m": 100.0, "speed_mps": 5.0})
    one, again, other = (curve(section, seed).state(np.array([15.0])) for seed in (1, 1, 2))
    assert one.height[0] == again.height[0] != other.height[0]


def test_waves_are_met_by_the_way_along_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """A kilometre on a heading of 20° is 766 m along waves towards 60°."""
    ways: list[np.ndarray] = []
    monkeypatch.setattr(road_and_sea_spectra, "ride", lambda waves, time, ahead, *motion: ways.append(ahead))
    leg = {"type": "straight", "distance_m": 1000.0, "speed_mps": 10.0}
    curve(voyage(leg, waves_towards_deg=60.0, heading_deg=20.0, sea_state=2))
    assert np.ptp(ways[0]) == pytest.approx(1000.0 * np.cos(np.radians(40.0)), rel=0.02)
