"""Values on both sides of each limit that follows from other keys, and the number that the message proposes."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from sinssim.logs.log_settings import Outages
from sinssim.scenario.navigation_section import NavigationSection
from sinssim.scenario.schema import Scenario
from sinssim.scenario.tables import RecordingSection
from sinssim.sensors.imu.faults import BiasStep, Dropout, Freeze, Saturation, Spike, channels_of
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.imu.laser_gyro import LaserGyros
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.motion import TrueGravity
from sinssim.truth.motions.imu_rotation import SEQUENCES, Continuous, Indexed, Reversing
from sinssim.truth.motions.turntable import TurnStep
from sinssim.truth.motions.vibration import Vibration
from sinssim.truth.one_component import ArmAccelerometer, OneComponent

RING = {"perimeter_mm": 400.0, "area_mm2": 9000.0, "lock_in_deg_h": 300.0, "dither_amplitude_arcsec": 150.0,
        "dither_frequency_hz": 400.0}  # fmt: skip
PLANE: dict[str, Any] = {"variant": "one-integral", "gyro": {}, "duration_s": 125.0}
TURN = {"type": "turn", "axis": [0.0, 0.0, 1.0], "angle_deg": -30.0, "rate_deg_s": 20.0}
AIR = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 3000.0}
# 1 / interval of a hundredth of the Schuler period of 2π √(6.371e6/9.81) = 5063.5 s
SLOW = 100.0 / (2.0 * math.pi * math.sqrt(6.371e6 / 9.81))

LIMITS: list[tuple[type[BaseModel], dict[str, Any], str, Any, Any, str]] = [
    # section, its keys, the key that is changed, a value within the limit, one beyond, what is said
    # a circle of 400 mm: 400²/4π = 12 732 mm²
    (LaserGyros, RING, "area_mm2", 12_732.0, 12_733.0, r"encloses at most 1\.273e\+04 mm² \(a circle\)"),
    # 2π · 400 Hz · 150″ = 376 991 ″/s, deg/h
    (LaserGyros, RING, "lock_in_deg_h", 376_980.0, 377_000.0, r"the dither reaches only 3\.77e\+05 deg/h"),
    (LaserGyros, RING, "lock_in_deg_h", 376_980.0, 400_000.0,
     r"only 3\.77e\+05 deg/h, which is within lock_in_deg_h = 400000; increase dither_amplitude_arcsec or"),
    (Imu, {"rate_hz": 40.0}, "accel_delay_ms", -25.0, -25.1, "can be at most 25"),
    (Imu, {"rate_hz": 40.0}, "faults", [{"type": "jitter", "from_s": 0.0, "sigma_ms": 2.5}],
     [{"type": "jitter", "from_s": 0.0, "sigma_ms": 2.6}], "it can be at most 2.5, a tenth of the interval"),
    (Imu, {"rate_hz": 40.0, "sensor_set": {"type": "redundant"}}, "sensor_set",
     {"type": "redundant", "windows_s": [0.04]}, {"type": "redundant", "windows_s": [0.03]},
     "a window has at least 0.05 s"),
    (Imu, {"rate_hz": 40.0}, "rotation", {"type": "continuous", "rate_deg_s": -80.0},
     {"type": "continuous", "rate_deg_s": -81.0}, "2.025 degrees per sample.* at most 80"),
    (Imu, {"rate_hz": 40.0}, "rotation", {"type": "reversing", "ramp_s": 0.125},
     {"type": "reversing", "ramp_s": 0.12}, "shorter than 5 samples.* at least 0.125"),
    (Reversing, {"type": "reversing", "rate_deg_s": 20.0, "ramp_s": 2.0}, "turn_deg", 40.0, 39.0,
     r"a ramp of at most 1\.95 s"),
    (TurnStep, TURN, "ramp_s", 1.5, 1.6, "a ramp_s of at most 1.5"),
    (Vibration, {"coordinate": "down", "rms_g": 1.0, "low_hz": 3.0}, "high_hz", 3.1, 3.0, "from 3 Hz to 3 Hz"),
    (OneComponent, PLANE, "rate_hz", 1.001 * SLOW, 0.999 * SLOW, "give at least 0.0197"),
    (OneComponent, PLANE, "motion", {"pitch_deg": [[0.0, 1.0], [125.0, 2.0]]},
     {"pitch_deg": [[0.0, 1.0], [124.9, 2.0]]}, "motion.pitch_deg ends at 124.9 s, before the run"),
    (OneComponent, PLANE, "motion", {"height_m": [[0.0, 1.0], [0.001, 1.0], [200.0, -1e6]]},
     {"height_m": [[0.0, 1.0], [0.0009, 1.0], [200.0, 2.0]]}, "row 2 at 0.0009 s must be at least 0.001 s after row 1"),
    (OneComponent, PLANE, "motion", {"velocity_mps": -12_000.0}, {"velocity_mps": 12_001.0},
     "12001 of row 1 must be from -12000 to 12000"),
    (ArmAccelerometer, {}, "arm_m", -1e-4, -0.9e-4, "at least 0.0001 m"),
    (Outages, {"every_s": 40.0}, "length_s", 39.9, 40.0, "length_s = 40 must be less than every_s = 40"),
    (NavigationSection, {"frame": "transverse"}, "route_deg", [10.0, 20.0, -10.0, -159.9], [10.0, 20.0, -10.0, -160.0],
     "coincide or are antipodal"),
    (TrueGravity, {"model": "egm2008"}, "degree", 120, 121, "121"),
    (FlightPlan, {"aircraft": "737", "start": AIR}, "legs", [{"type": "climb", "altitude_m": 3000.1}],
     [{"type": "climb", "altitude_m": 2999.9}], "goes down, from 3000 m"),
    (Spike, {"type": "spike", "at_s": 1.0}, "accel_mm_s", [0.0, 0.0, 1e-9], [0.0, 0.0, 0.0], "has no size"),
    (Dropout, {"type": "dropout", "from_s": 5.0}, "to_s", 5.1, 5.0, "to_s = 5 must be later than from_s = 5"),
]  # fmt: skip


@pytest.mark.parametrize(("section", "keys", "key", "within", "beyond", "said"), LIMITS)
def test_both_sides(
    section: type[BaseModel], keys: dict[str, Any], key: str, within: Any, beyond: Any, said: str
) -> None:
    section.model_validate({**keys, key: within})
    with pytest.raises(ValidationError, match=said):
        section.model_validate({**keys, key: beyond})


def test_the_degree_that_a_navigator_uses() -> None:
    """At most that of the truth."""
    plan = {
        "name": "n",
        "parked": {"latitude_deg": 5.0, "duration_s": 9.0},
        "gravity": {"model": "egm2008", "degree": 40},
    }
    Scenario.model_validate({**plan, "navigation": {"gravity_degree": 40}})
    with pytest.raises(ValidationError, match=r"gravity_degree = 41 is above gravity\.degree = 40"):
        Scenario.model_validate({**plan, "navigation": {"gravity_degree": 41}})


def test_pressure_and_temperature_of_the_air() -> None:
    """994 hPa are 99 400 Pa; the standard day has 101 325 Pa."""
    flight = {"aircraft": "737", "start": AIR, "legs": [{"type": "hold", "duration_s": 9.0}]}

    def air(**day: float) -> Any:
        return FlightPlan.model_validate({**flight, "atmosphere": day} if day else flight).air()

    # 1000 m up it is by the hydrostatic equation 11.4 kPa less
    assert air().pressure_altitude(1000.0) == pytest.approx(1000.0, abs=0.5)
    assert air(sea_level_pressure_hpa=994.0).pressure_altitude(0.0) == pytest.approx(161.5, abs=1.0)
    assert air(isa_deviation_k=20.0).pressure_altitude(1000.0) == pytest.approx(1000.0 * 284.9 / 304.9, abs=1.5)


def test_sensors_that_a_fault_names() -> None:
    """By number from 1; sizes of zero are no fault, and a fault of all sensors names none."""
    step = BiasStep(type="bias-step", from_s=1.0, gyro_deg_h=(0.0, 2.0, 0.0, -1.0), accel_ug=(5.0, 0.0, 0.0, 0.0))
    assert (step.sensors("gyro"), step.sensors("accel")) == ({2, 4}, {1})
    lost = Dropout(type="dropout", from_s=1.0, channels=("gyro_3", "accel_2", "gyro_x"))
    assert (lost.sensors("gyro"), lost.sensors("accel")) == ({3}, {2})
    assert Freeze(type="freeze", from_s=1.0).sensors("gyro") == set()
    assert channels_of(4) == ("gyro_1", "gyro_2", "gyro_3", "gyro_4", "accel_1", "accel_2", "accel_3", "accel_4")
    gyros = [
        lost, Dropout(type="dropout", from_s=1.0), step, Saturation(type="saturation", from_s=1.0, gyro_deg_s=3.0),
        Spike(type="spike", at_s=1.0, gyro_arcsec=(0.0, 1.0, 0.0)),
    ]  # fmt: skip
    others = [
        Freeze(type="freeze", from_s=1.0, channels=("accel_z",)),
        Saturation(type="saturation", from_s=1.0, accel_g=3.0),
        BiasStep(type="bias-step", from_s=1.0, gyro_deg_h=(0.0, 0.0, 0.0), accel_ug=(5.0, 0.0, 0.0)),
    ]  # fmt: skip
    assert [fault.of_gyros for fault in (*gyros, *others)] == [True] * 5 + [False] * 3


def test_ready_sequences_come_back() -> None:
    """Each axis ends where it began; the sixteen positions repeat the eight with all signs reversed."""
    for turns in SEQUENCES.values():
        for axis in ("outer", "inner"):
            assert sum(turn for name, turn in turns if name == axis) == 0.0
    assert [len(SEQUENCES[f"{n}-position"]) for n in (4, 8, 16)] == [8, 8, 16]
    assert {abs(turn) for _, turn in SEQUENCES["4-position"]} == {90.0}
    eight = SEQUENCES["8-position"]
    assert SEQUENCES["16-position"][8:] == tuple((axis, -turn) for axis, turn in eight)
    half: dict[float, float] = {}
    outer = inner = 0.0
    for axis, turn in eight:  # all three biases cancel over the stops: four orientations, each twice
        outer, inner = (outer + turn, inner) if axis == "outer" else (outer, inner + turn)
        place = (outer % 360.0) * 1000.0 + inner % 360.0
        half[place] = half.get(place, 0.0) + 1.0
    assert half == dict.fromkeys((0.0, 180.0, 180_000.0, 180_180.0), 2.0)


def test_defaults_that_depend_on_other_keys() -> None:
    """The outer axis: down for one axis, forward if the inner one turns, too; the sequence of sixteen positions."""
    assert Indexed(type="indexed").outer == (1.0, 0.0, 0.0)
    assert Indexed(type="indexed").turns == SEQUENCES["16-position"]
    assert Indexed(type="indexed", sequence="4-position").outer == (0.0, 0.0, 1.0)
    assert Indexed(type="indexed", axis=(0.0, 1.0, 0.0)).outer == (0.0, 1.0, 0.0)
    assert Continuous(type="continuous", rate_deg_s=-3.0, inner_rate_deg_s=-4.0).fastest_deg_s == 4.0
    assert Reversing(type="reversing", turn_deg=90.0).turns == (("outer", 90.0), ("outer", -90.0))
    kept = [(r.has_report, r.has_streams, r.has_recording) for r in (
        RecordingSection(keep="summary"), RecordingSection(keep="report"), RecordingSection(keep="streams"),
        RecordingSection(), RecordingSection(detail="none"),
    )]  # fmt: skip
    assert kept == [
        (False, False, False),
        (True, False, False),
        (True, True, False),
        (True, True, True),
        (True, True, False),
    ]


@pytest.mark.parametrize(
    ("own", "ellipsoid"), [("truth", "krasovsky-1940"), ("wgs84", "wgs84"), ("pz-90.11", "pz-90.11")]
)
def test_the_earth_of_the_navigator(own: str, ellipsoid: str) -> None:
    assert NavigationSection(ellipsoid=own).ellipsoid_over("krasovsky-1940") == ellipsoid
