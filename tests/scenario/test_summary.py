"""A scenario in a few lines, each written down from its contents; and what excites its sensors, in closed form."""

from __future__ import annotations

import math
import re
from types import SimpleNamespace
from typing import Any

import pytest

from sinssim.scenario import plan_summary
from sinssim.scenario.filter_model import excitation
from sinssim.scenario.plan_summary import _clock, named_places, plan_lines, sensor_words
from sinssim.scenario.schema import Scenario
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth import track_curve
from sinssim.truth.flight.flight_plan import Atmosphere, FlightPlan, Wind, planned_path

AIR = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 3000.0, "airspeed_kt": 280.0,
       "heading_deg": 70.0}  # fmt: skip
WIND = {
    "from_deg": 230.0, "speed_kt": 20.0, "down_mps": -0.5,
    "gusts": [{"start_s": 30.0, "rise_s": 3.0, "steady_s": 4.0, "fall_s": 5.0, "velocity_ned_mps": [1.0, -2.0, 0.5]}],
}  # fmt: skip
PLACES = [{"latitude_deg": 48.5, "longitude_deg": 12.0, "name": "ALPHA"},
          {"latitude_deg": 48.7, "longitude_deg": 12.6, "height_m": 2500.0}]  # fmt: skip
DEG, G0, EARTH = math.pi / 180.0, 9.80665, 7.292115e-5


def made(**tables: Any) -> Scenario:
    return Scenario.model_validate({"name": "made", **tables})


def test_a_flight_line_by_line() -> None:
    flight = {
        "aircraft": "737", "start": AIR, "wind": WIND, "turbulence": {"severity": 3},
        "atmosphere": {"isa_deviation_k": -7.0, "sea_level_pressure_hpa": 1013.25},
        "legs": [{"type": "hold", "duration_s": 605.0}, {"type": "hold", "duration_s": 90.0},
                 {"type": "waypoint", "waypoints": PLACES}],
    }  # fmt: skip
    lines = list(plan_lines(made(
        description="A trip.", seed=31, flight=flight, imu={"rate_hz": 37.0, "grade": "tactical",
                                                            "gyro_bias_sigma_deg_h": 3.0},
        vibration=[{"coordinate": "pitch", "rms_arcsec": 20.0, "low_hz": 2.0, "high_hz": 5.0}],
        isolator={"linear_hz": 11.0, "angular_hz": 13.0, "linear_damping": 0.3},
        aiding={"gnss": {"rate_hz": 2.0, "latency_s": 0.3}, "baro": {"bias_sigma_m": 90.0}}, filter={},
        ensemble={"runs": 17, "epoch_s": 3.0, "vary": [
            {"type": "uniform", "key": "flight.start.heading_deg", "low": 1.0, "high": 2.5}]},
    )))  # fmt: skip
    assert re.fullmatch(r"  leg 3   waypoint     about 1\d min", lines[4])
    assert re.fullmatch(r"duration    about 2\d min, \d\d,000 samples", lines[12])
    assert lines[:4] + lines[5:12] + lines[13:17] + lines[18:] == [
        "made: A trip.",
        "flight      737, starts in the air at 48°, 11°, 3000 m, heading 70°",
        "  leg 1   hold         about 10 min     duration_s = 605",
        "  leg 2   hold         about 1 min 30 s duration_s = 90",
        "          to ALPHA at 48.5°, 12°",
        "          to waypoint 2 at 48.7°, 12.6°, height_m = 2500",
        "wind        from 230°, 20 kt, down_mps = -0.5, gust at 30 s of [1, -2, 0.5] m/s north, east, down over 3 + 4 "
        "+ 5 s",
        "atmosphere  ISA−7 K, 1013.25 hPa at sea level",
        "turbulence  severity = 3, wind_at_6m_mps = 7.7",
        "vibration   pitch, rms_arcsec = 20, low_hz = 2, high_hz = 5",
        "isolator    linear_hz = 11, linear_damping = 0.3, angular_hz = 13, angular_damping = 0.2",
        "sensors     three accelerometers and three gyros",
        "imu         tactical, rate_hz = 37, gyro_bias_sigma_deg_h = 3",
        "aiding      gnss, 2 Hz; latency_s = 0.3",
        "aiding      baro, 1 Hz; bias_sigma_m = 90",
        "height      stabilised by a baro loop with a time constant of 50 s, which prevents a growing height error "
        "from degrading the horizontal solution; its error is that of [aiding.baro]",
        "filter      states by default; all by default",
        "ensemble    runs = 17, epoch_s = 3",
        "  varied    flight.start.heading_deg: uniform, low = 1, high = 2.5",
        "seed        31",
    ]
    assert lines[17] == "navigation  quaternion; vertical = baro-loop"


def test_a_parked_redundant_set_line_by_line() -> None:
    """1 h 2 min is 3725 s to the minute; 372 500 samples to two digits."""
    lines = list(plan_lines(made(
        parked={"latitude_deg": 50.0, "duration_s": 3725.0},
        imu={"grade": "ideal", "sensor_set": {"type": "redundant", "layout": "cone-5", "monitoring": "detect"}},
        gravity={"model": "egm2008", "degree": 40, "remainder": {"order": 3}},
        navigation={"gravity_degree": 20, "vertical": "truth"}, compensation={},
    )))  # fmt: skip
    assert lines == [
        "made",
        "parked      latitude_deg = 50, duration_s = 3725",
        "gravity     egm2008 to degree 40, random remainder of order 3; the navigator knows it to degree 20",
        "duration    about 1 h 2 min, 370,000 samples",
        "sensors     five single gyros and five single accelerometers on a cone, monitored: faults are detected",
        "imu         ideal, as in the grade",
        "calibrated  perfect",
        "navigation  quaternion; gravity_degree = 20, vertical = truth",
        "height      the true height: the height has no error and does not affect the horizontal solution",
        "seed        0",
    ]


def test_a_plane_line_by_line() -> None:
    """2π √(R/g) of R = 6.371e6 m and g = 9.81 m/s² is 84.39 min."""
    motion = {"velocity_mps": [[0.0, 10.0], [60.0, 35.0], [125.0, -5.0]], "pitch_deg": 4.0}
    assert 2.0 * math.pi * math.sqrt(6.371e6 / 9.81) / 60.0 == pytest.approx(84.39, abs=5e-3)
    lines = list(plan_lines(made(one_component={
        "variant": "one-integral", "duration_s": 125.0, "rate_hz": 8.0, "gyro": {"bias_deg_h": 0.3},
        "accelerometer_y": {"scale_ppm": 7.0}, "motion": motion, "initial_error": {"position_m": 6.0},
        "altitude_effects": True,
    })))  # fmt: skip
    assert lines == [
        "made",
        "one component      pitch by one integral of a gyro's rate",
        "velocity           -5 to 35 m/s, 3 rows",
        "height             0 m",
        "pitch              4°",
        "duration           2 min 5 s, 1,000 samples; the Schuler period is 84.39 min",
        "accelerometer x    no errors",
        "accelerometer y    scale_ppm = 7",
        "gyro               bias_deg_h = 0.3",
        "initial error      position_m = 6",
        "altitude           acts on the motion; the equations of the system neglect it",
        "seed               0",
    ]


def test_a_track_line_by_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Facts of the fit, when the vehicle stands, and notes before warnings."""
    fit = SimpleNamespace(notes=("few fixes.",), warnings=("no heights.", "a gap."))
    events = [SimpleNamespace(time=12.34, text="stops"), SimpleNamespace(time=99.96, text="goes on")]
    prepared = SimpleNamespace(fit=fit, events=events)
    track: Any = SimpleNamespace(what="drive.gpx", vehicle="car", prepared=lambda earth: prepared)
    monkeypatch.setattr(track_curve, "fit_lines", lambda fit: [("samples", "5 fixes"), ("length", "1.000 km in 60 s")])
    for more, words in (("smoothing_s = 2", "car, smoothing_s = 2"), ("", "car")):
        monkeypatch.setattr(plan_summary, "given", lambda section, *without, more=more: more)
        earth: Any = None
        assert list(plan_summary._track_lines(track, earth)) == [
            f"track       drive.gpx, {words}", f"  samples{19 * ' '}5 fixes", f"  length{20 * ' '}1.000 km in 60 s",
            f"  at 12.3{19 * ' '}stops", f"  at 100.0{18 * ' '}goes on", f"  note{22 * ' '}few fixes.",
            f"  note{22 * ' '}WARNING: no heights.", f"  note{22 * ' '}WARNING: a gap.",
        ]  # fmt: skip


@pytest.mark.parametrize(
    ("sensor_set", "words"),
    [
        ({"type": "accelerometers", "arm_m": 0.25},
         "six accelerometers on the faces of a cube, 0.25 m from its centre, and no gyro"),
        ({"type": "attitude-sensor"}, "three accelerometers and an attitude sensor, with the drift of its grade"),
        ({"type": "attitude-sensor", "noise_arcsec": 3.0},
         "three accelerometers and an attitude sensor, noise_arcsec = 3"),
        ({"type": "platform"}, "three accelerometers and three gyros on a gimballed platform"),
        ({"type": "platform", "pickoff_noise_arcsec": 2.0},
         "three accelerometers and three gyros on a gimballed platform, pickoff_noise_arcsec = 2"),
        ({"type": "redundant"}, "six single gyros and six single accelerometers perpendicular to the faces of a "
         "dodecahedron, monitored: faulty sensors are excluded"),
        ({"type": "redundant", "layout": "cone-4"},
         "four single gyros and four single accelerometers on a cone, monitored: faults are detected"),
        ({"type": "redundant", "layout": "skewed-triads", "monitoring": "none"}, "six single gyros and six single "
         "accelerometers in two triads turned by 60° against each other, not monitored"),
    ],
)  # fmt: skip
def test_sensor_sets_in_words(sensor_set: dict[str, Any], words: str) -> None:
    assert sensor_words(Imu.model_validate({"grade": "laser-standard", "sensor_set": sensor_set})) == words


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.2, "0 s"), (59.6, "1 min"), (75.4, "1 min 15 s"), (599.0, "9 min 59 s"), (600.0, "10 min"), (629.0, "10 min"),
     (631.0, "11 min"), (3600.0, "1 h"), (5430.1, "1 h 31 min"), (90_000.0, "25 h")],
)  # fmt: skip
def test_a_duration_in_words(seconds: float, text: str) -> None:
    assert _clock(seconds) == text


def test_named_places_in_radians() -> None:
    legs = [{"type": "hold", "duration_s": 9.0}, {"type": "waypoint", "waypoints": PLACES},
            {"type": "waypoint", "latitude_deg": 49.0, "longitude_deg": 13.0, "name": "END"}]  # fmt: skip
    found = named_places(made(flight={"aircraft": "737", "start": AIR, "legs": legs}))
    assert [name for name, _, _ in found] == ["ALPHA", "waypoint 2", "END"]
    assert [x for _, *place in found for x in place] == pytest.approx(
        [x * DEG for x in (48.5, 12.0, 48.7, 12.6, 49.0, 13.0)]
    )


def test_wind_in_its_forms() -> None:
    """From the south-west it blows to the north and east; a knot is 1852 m/h."""
    speed = 20.0 * 1852.0 / 3600.0
    one = Wind.model_validate({"from_deg": 210.0, "speed_kt": 20.0, "down_mps": -0.5})
    ((height, vector),) = one.levels()
    assert (height, *vector) == pytest.approx((0.0, speed * math.cos(30.0 * DEG), speed * 0.5, -0.5))
    profile = Wind.model_validate({"down_mps": 0.25, "profile": [
        {"height_m": 500.0, "from_deg": 90.0, "speed_mps": 7.0},
        {"height_m": 3000.0, "from_deg": 0.0, "speed_kt": 20.0},
    ]})  # fmt: skip
    (low, east), (high, north) = profile.levels()
    assert (low, *east) == pytest.approx((500.0, 0.0, -7.0, 0.25))
    assert (high, *north) == pytest.approx((3000.0, -speed, 0.0, 0.25))
    assert profile.words() == "500 m: from 90°, 7 m/s; 3000 m: from 0°, 20 kt, down_mps = 0.25"
    towards = Wind.model_validate({"north_mps": 3.0, "east_mps": -4.0})
    assert towards.levels() == ((0.0, (3.0, -4.0, 0.0)),)
    assert (towards.words(), Wind().words()) == ("north_mps = 3, east_mps = -4", "none")
    assert Atmosphere(isa_deviation_k=12.5).words() == "ISA+12.5 K, 1013.25 hPa at sea level"


STILL = {"parked": {"latitude_deg": 50.0, "duration_s": 400.0}}


def test_rotation_and_force_that_excite_the_sensors() -> None:
    """∫ω² dt and ∫f² dt in closed form: the Earth's rate, and the transport rate or the turns of the block."""
    found = excitation(made(**STILL))
    assert found == pytest.approx((400.0, 400.0 * EARTH**2, 400.0 * G0**2), rel=1e-12)
    circle = {"latitude_deg": 0.0, "course_deg": 45.0, "speed_mps": 200.0, "duration_s": 300.0}
    assert excitation(made(great_circle=circle)).rate == pytest.approx(300.0 * (EARTH + 200.0 / 6.371e6) ** 2)
    shaking = [{"coordinate": "roll", "rms_arcsec": 40.0, "low_hz": 4.0, "high_hz": 9.0},
               {"coordinate": "yaw", "rms_arcsec": 25.0, "low_hz": 3.0}]  # fmt: skip
    added = sum((a * DEG / 3600.0 * 2.0 * math.pi * f) ** 2 for a, f in ((40.0, 6.0), (25.0, 3.0)))
    assert excitation(made(**STILL, vibration=shaking)).rate == pytest.approx(400.0 * (EARTH**2 + added))
    for turning, square in (
        ({"type": "continuous", "rate_deg_s": 6.0, "inner_rate_deg_s": -2.0}, 40.0),
        # 8 quarter turns of 720° at 9°/s take 80 s, and the rest 8 · 22 s
        ({"type": "indexed", "sequence": "4-position", "rate_deg_s": 9.0, "ramp_s": 2.0, "dwell_s": 20.0},
         81.0 * 80.0 / 256.0),
        ({"type": "reversing", "turn_deg": 180.0, "rate_deg_s": 9.0, "ramp_s": 2.0, "dwell_s": 3.0},
         81.0 * 40.0 / 50.0),
    ):  # fmt: skip
        rate = excitation(made(**STILL, imu={"rotation": turning})).rate
        assert rate == pytest.approx(400.0 * (EARTH**2 + square * DEG**2), rel=1e-9), turning
    gusts = {"aircraft": "737", "start": AIR, "legs": [{"type": "hold", "duration_s": 50.0}]}
    for turbulence, sigma in (({"severity": 4, "wind_at_6m_mps": 7.7}, 3.0), ({"severity": 1}, 0.77)):
        rate = excitation(made(flight={**gusts, "turbulence": turbulence})).rate
        roll = 1.9 * sigma / math.sqrt(533.0 * 20.0)  # MIL-F-8785C
        assert rate == pytest.approx(50.0 * ((EARTH + 250.0 / 6.371e6) ** 2 + roll**2), rel=1e-9)


@pytest.mark.parametrize(
    ("motion", "square"),  # of the rate, deg²/s², over 20 s
    [
        ({"type": "coning", "half_angle_deg": 20.0, "frequency_hz": 3.0},
         (360.0 * 3.0 * 2.0 * math.sin(10.0 * DEG)) ** 2),
        ({"type": "sculling", "angle_deg": 2.0, "displacement_mm": 3.0, "frequency_hz": 5.0},
         0.5 * (2.0 * math.pi * 5.0 * 2.0) ** 2),
        ({"type": "spin-cone", "angle_deg": 60.0, "precession_deg_s": 8.0, "spin_deg_s": 5.0}, 64.0 + 25.0 + 40.0),
        ({"type": "spin-rock", "axis": [0.0, 0.0, 1.0], "spin_deg_s": 7.0, "angle_deg": 2.0, "frequency_hz": 5.0},
         49.0 + 0.5 * (2.0 * math.pi * 5.0 * 2.0) ** 2),
    ],
)  # fmt: skip
def test_rotation_of_motions_in_closed_form(motion: dict[str, Any], square: float) -> None:
    found = excitation(made(motion={**motion, "duration_s": 20.0}))
    assert found.rate == pytest.approx(20.0 * (EARTH**2 + square * DEG**2), rel=1e-9)


def test_rotation_of_a_table() -> None:
    """∫ω² dt of a turn at its full rate: angle times rate."""
    steps = [{"type": "turn", "axis": [1.0, 0.0, 0.0], "angle_deg": -90.0, "rate_deg_s": 12.0},
             {"type": "dwell", "duration_s": 30.0},
             {"type": "turn", "axis": [0.0, 0.0, 1.0], "angle_deg": 40.0, "rate_deg_s": 5.0}]  # fmt: skip
    found = excitation(made(motion={"type": "rotation-table", "steps": steps}))
    assert found.rate - EARTH**2 * found.duration == pytest.approx((90.0 * 12.0 + 40.0 * 5.0) * DEG**2, rel=1e-9)


def test_the_path_of_a_plan() -> None:
    """At sea level 200 kt are 102.9 m/s over the ground, northwards 111 km for a degree, then half a turn."""
    start = {**AIR, "altitude_m": 0.0, "airspeed_kt": 200.0, "heading_deg": 0.0}
    legs = [{"type": "hold", "duration_s": 540.0}, {"type": "turn", "angle_deg": 180.0, "direction": "right"}]
    found = planned_path(FlightPlan.model_validate({"aircraft": "737", "start": start, "legs": legs}))
    speed = 200.0 * 1852.0 / 3600.0
    assert [name for name, _, _ in found.legs] == ["1 hold", "2 turn"]
    assert found.legs[0][1:] == (0.0, 540.0)
    assert found.legs[1][1] == 540.0
    assert found.time[0] == 0.0
    assert found.time == sorted(found.time)
    row = found.time.index(540.0)
    assert math.degrees(found.latitude[row]) == pytest.approx(48.0 + 540.0 * speed / 111_200.0, abs=2e-3)
    assert found.longitude[row] == pytest.approx(11.0 * DEG, abs=1e-9)
    assert found.speed[row] == pytest.approx(speed, rel=1e-3)
    assert found.longitude[-1] > found.longitude[row] + 1e-4  # to the right of north is east
    assert len(found.height) == len(found.speed) == len(found.ceiling) == len(found.time)
    assert set(found.height) == {0.0}
    assert 13_000.0 < found.ceiling[0] < 15_000.0  # flown at 273 kt: 12 832 m; it is higher at a lower airspeed
