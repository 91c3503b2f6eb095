"""The air of a flight against published tables, closed forms, and JSBSim's own atmosphere and wind."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sinssim.data import NavState
from sinssim.errors import InputError
from sinssim.sensors.aiding.air_data import Barometer
from sinssim.sensors.aiding_sensor import Vehicle
from sinssim.truth.atmosphere import Air
from sinssim.truth.flight import jsbsim_simulation
from sinssim.truth.flight.flight_log import flight_log
from sinssim.truth.flight.flight_plan import FlightPlan, Wind
from sinssim.truth.flight.jsbsim_simulation import fly_plan
from sinssim.truth.sampling import Channel

PROFILE = [
    {"height_m": 0.0, "from_deg": 200.0, "speed_mps": 5.0},
    {"height_m": 3100.0, "from_deg": 270.0, "speed_kt": 60.0},
    {"height_m": 9000.0, "from_deg": 300.0, "speed_mps": 50.0},
]


@pytest.mark.parametrize(
    ("height", "pressure", "temperature"),  # ICAO Doc 7488, by geometric height
    [
        (0.0, 101325.0, 288.150),
        (1000.0, 89876.3, 281.651),
        (5000.0, 54048.3, 255.676),
        (15000.0, 12111.8, 216.650),
        (20000.0, 5529.31, 216.650),
        (25000.0, 2549.22, 221.552),
    ],
)
def test_standard_atmosphere_is_that_of_the_tables(height: float, pressure: float, temperature: float) -> None:
    assert Air().pressure(height) == pytest.approx(pressure, rel=1e-5)
    assert Air().temperature(height) == pytest.approx(temperature, abs=1e-3)


def test_pressure_follows_from_the_hydrostatic_equation() -> None:
    air = Air(isa_deviation=25.0, sea_level_pressure=99_000.0)
    for height in np.arange(-300.0, 24_000.0, 400.0):
        slope = (air.pressure(height + 1.0) - air.pressure(height - 1.0)) / 2.0
        gravity = 9.80665 * (6_356_766.0 / (6_356_766.0 + height)) ** 2
        density = air.pressure(height) / (287.05287 * air.temperature(height))
        assert slope == pytest.approx(-density * gravity, rel=2e-4 if abs(height % 10_900) < 600 else 1e-6)


def test_pressure_altitude_is_the_standard_height_of_the_same_pressure() -> None:
    air = Air(isa_deviation=-30.0, sea_level_pressure=102_500.0)
    for height in np.arange(-400.0, 21_000.0, 700.0):
        assert Air().pressure(air.pressure_altitude(height)) == pytest.approx(air.pressure(height), rel=1e-12)
    warm = Air(isa_deviation=20.0)
    assert warm.pressure_altitude(3000.0) == pytest.approx(3000.0 * 288.15 / 308.15, abs=0.2)  # geopotential: 0.09 m


@pytest.mark.parametrize(
    ("mach", "pitot"),  # p02/p1 behind a normal shock, NACA Report 1135, table II, inverted (four digits)
    [(1.2, 1 / 0.4154), (1.5, 1 / 0.2930), (2.0, 1 / 0.1773), (3.0, 1 / 0.08291)],
)
def test_true_airspeed_above_the_speed_of_sound(mach: float, pitot: float) -> None:
    """The calibrated airspeed has the same impact pressure at sea level, subsonic here for heights of 15 to 24 km."""
    height = {1.2: 15_000.0, 1.5: 15_000.0, 2.0: 18_000.0, 3.0: 24_000.0}[mach]
    air, sound = Air(), 340.294
    impact = (pitot - 1.0) * air.pressure(height) / 101_325.0
    calibrated = sound * math.sqrt(5.0 * ((impact + 1.0) ** (2.0 / 7.0) - 1.0))
    assert calibrated < sound
    expected = mach * math.sqrt(1.4 * 287.05287 * air.temperature(height))
    assert air.true_airspeed(calibrated, height) == pytest.approx(expected, rel=3e-4)


def test_true_airspeed_at_sea_level_is_the_calibrated_airspeed() -> None:
    for calibrated in (50.0, 340.0, 340.5, 500.0, 900.0):
        assert Air().true_airspeed(calibrated, 0.0) == pytest.approx(calibrated, rel=1e-12)


@pytest.mark.parametrize(
    ("wind", "expected"),
    [
        ({"from_deg": 270.0, "speed_mps": 10.0}, (0.0, 10.0, 0.0)),  # a westerly moves the air to the east
        ({"from_deg": 0.0, "speed_kt": 36.0, "down_mps": 1.0}, (-36.0 * 1852.0 / 3600.0, 0.0, 1.0)),
        ({"north_mps": 3.0, "east_mps": -4.0}, (3.0, -4.0, 0.0)),
        # half-way from a westerly of 10 to a southerly of 20 m/s, by components: from 207° with 11 m/s
        (
            {"profile": [{"height_m": 0.0, "from_deg": 270.0, "speed_mps": 10.0},
                         {"height_m": 1000.0, "from_deg": 180.0, "speed_mps": 20.0}]},
            (10.0, 5.0, 0.0),
        ),
    ],
)  # fmt: skip
def test_wind_as_people_give_it(wind: dict[str, Any], expected: tuple[float, float, float]) -> None:
    assert Air(Wind(**wind).levels()).wind(500.0) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("wind", "words"),
    [
        ({"from_deg": 270.0, "speed_mps": 10.0, "north_mps": 1.0}, "given twice, by from_deg, speed_mps and north_mps"),
        ({"profile": PROFILE, "east_mps": 1.0}, "given twice, by profile and east_mps"),
        ({"profile": PROFILE, "from_deg": 0.0, "speed_kt": 3.0}, "given twice, by profile, from_deg and speed_kt"),
        ({"from_deg": 270.0}, "here is from_deg"),
        ({"speed_kt": 20.0}, "here is speed_kt"),
        ({"from_deg": 270.0, "speed_mps": 10.0, "speed_kt": 20.0}, "here is from_deg and speed_mps and speed_kt"),
        ({"profile": [PROFILE[1], PROFILE[0]]}, "heights of a wind profile increase: 0 m follows 3100 m"),
        (
            {"profile": [{"height_m": 0.0, "from_deg": 10.0}]},
            "speed_mps or speed_kt: give exactly one of them; here none is given",
        ),
    ],
)
def test_a_wind_given_twice_or_by_halves_is_refused(wind: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Wind(**wind)


def test_a_wind_accepts_its_own_defaults_written_out() -> None:
    for wind in (Wind(), Wind(from_deg=10.0, speed_kt=5.0), Wind.model_validate({"profile": PROFILE})):
        assert Wind.model_validate(wind.model_dump(exclude_none=True)) == wind


def test_the_speed_over_the_ground_closes_the_triangle_of_the_winds() -> None:
    """At sea level 50 m/s through the air along 30°, in a wind of 3 m/s to the north and 8 m/s to the west."""
    air = Air(levels=((0.0, (3.0, -8.0, 0.0)),))
    speed = air.ground_speed(50.0, 0.0, math.radians(30.0))
    north, east = speed * math.cos(math.radians(30.0)), speed * math.sin(math.radians(30.0))
    assert math.hypot(north - 3.0, east + 8.0) == pytest.approx(50.0, rel=1e-9)
    assert speed == pytest.approx(3.0 * 0.8660254 - 8.0 * 0.5 + math.sqrt(2500.0 - 8.4282032**2), rel=1e-7)


def test_jsbsim_flies_in_this_air() -> None:
    """Its pressure altitude, temperature, pressure, true airspeed and wind at every tenth of a second of a climb."""
    flight = FlightPlan.model_validate(
        {
            "aircraft": "c172x",
            "start": {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 3080.0},
            "legs": [{"type": "climb", "altitude_m": 3115.0}],
            "wind": {"profile": PROFILE, "down_mps": 0.5},
            "atmosphere": {"isa_deviation_k": 20.0, "sea_level_pressure_hpa": 1000.0},
        }
    )
    rows: list[list[float]] = []
    plain = jsbsim_simulation._Link.sense_slowly

    def sense(link: Any) -> None:
        plain(link)
        e = link._executive
        rows.append([
            e["position/geod-alt-ft"] * 0.3048, e["velocities/vc-fps"] * 0.3048,
            e["atmosphere/pressure-altitude"] * 0.3048, e["atmosphere/T-R"] / 1.8,
            e["atmosphere/P-psf"] * 4.4482216152605 / 0.3048**2, e["velocities/vtrue-fps"] * 0.3048,
            *(e[f"atmosphere/total-wind-{axis}-fps"] * 0.3048 for axis in ("north", "east", "down")),
        ])  # fmt: skip

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jsbsim_simulation._Link, "sense_slowly", sense)
        fly_plan(flight)
    own = np.array(rows[1:])  # JSBSim's first row is before the vertical wind
    assert np.ptp(own[:, 0]) > 25.0
    air = flight.air()
    ours = np.array(
        [
            [air.pressure_altitude(h), air.temperature(h), air.pressure(h), air.true_airspeed(cas, h), *air.wind(h)]
            for h, cas in own[:, :2]
        ]
    )
    # Its sea level lies 0.06 m beside the ellipsoid; its gas constant has six digits; the wind is that of a step ago.
    worst = np.abs(ours - own[:, 2:]).max(axis=0)
    assert worst[0] < 0.08
    assert worst[1] < 1e-3
    assert worst[2] < 1.0
    assert worst[3] < 2e-3
    assert worst[4:].max() < 2e-3


class _Climb:
    """A climb from 0 to 8 km in 800 s, with the channels of an atmosphere."""

    start, end = 0.0, 800.0

    def __init__(self, air: Air) -> None:
        time = np.arange(0.0, 800.05, 0.1)
        self.channels = {
            "pressure_altitude_m": Channel(time, np.array([air.pressure_altitude(10.0 * t) for t in time]), "m"),
            "static_temperature_k": Channel(time, np.array([air.temperature(10.0 * t) for t in time]), "K"),
        }

    def state(self, t: NDArray[np.float64]) -> NavState:
        zero = np.zeros(len(t))
        return NavState(zero, zero, 10.0 * np.asarray(t), np.zeros((len(t), 3)), np.zeros((len(t), 4)))


def test_a_barometer_reads_the_pressure_altitude_and_its_true_errors_are_those_of_the_air() -> None:
    air = Air(isa_deviation=20.0, sea_level_pressure=100_000.0)
    section = Barometer(rate_hz=1.0, sigma_m=1e-6, bias_sigma_m=0.0, bias_m=2.0, scale_ppm=1e-3)
    (given,) = section.read(Vehicle(_Climb(air), seed=1))  # type: ignore[arg-type]
    height, value = 10.0 * given.time, given.measurements.value[:, 0]
    assert np.abs(value - 2.0 - [air.pressure_altitude(h) for h in height]).max() < 1e-3
    scale, bias = given.parameters["baro scale"][0], given.parameters["baro bias"][:, 0]
    assert scale == pytest.approx(-20.0 / 308.15, abs=2e-9)
    assert np.abs((1.0 + scale) * height + bias - value).max() < 1e-4  # what the filter's model says
    low = 288.15 / 6.5e-3 * (1.0 - (100_000.0 / 101_325.0) ** (6.5e-3 * 287.05287 / 9.80665))  # 111 m at 1000 hPa
    assert bias[0] - 2.0 == pytest.approx(low, abs=0.05)


def test_without_a_scale_state_the_error_of_the_air_is_a_bias() -> None:
    air = Air(isa_deviation=20.0)
    (given,) = Barometer(sigma_m=1e-6, bias_sigma_m=0.0).read(Vehicle(_Climb(air), seed=1))  # type: ignore[arg-type]
    expected = [air.pressure_altitude(h) - h for h in 10.0 * given.time]
    assert np.abs(given.parameters["baro bias"][:, 0] - expected).max() < 1e-3
    assert expected[-1] < -500.0


@pytest.mark.slow
@pytest.mark.parametrize(("severity", "feet_per_second"), [(2, 1.10), (3, 6.04), (4, 9.44)])
def test_turbulence_has_the_strength_of_the_specification(severity: int, feet_per_second: float) -> None:
    """MIL-F-8785C, figure 7, between 7500 and 15 000 ft at 3 km; JSBSim's table has its values there.

    The scale is 1750 ft, 3.6 s at 250 kt: an hour has 1000 independent values, twice as many of three components. 10 %
    are then 6 standard errors.
    """
    flight = {
        "aircraft": "737",
        "start": {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 3000.0, "airspeed_kt": 250.0},
        "turbulence": {"severity": severity},
        "legs": [{"type": "hold", "duration_s": 3600.0}],
    }
    log = flight_log(fly_plan(FlightPlan.model_validate(flight), 1))
    square = [np.var(log.channels[f"wind_{axis}_mps"].values) for axis in ("north", "east", "down")]
    assert np.sqrt(np.mean(square)) == pytest.approx(feet_per_second * 0.3048, rel=0.1)
