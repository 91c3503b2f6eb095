"""What a scenario means that leaves keys out: the usual values, written down a second time by hand."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest
from pydantic import BaseModel
from pydantic_core import PydanticUndefinedType

from sinssim.scenario import Scenario

USUAL: dict[str, dict[str, Any]] = {
    # the aircraft: metres and seconds of a landing, 3° of a glide path, ICAO's standard pressure, moderate turbulence
    "TaxiLeg": {"radius_m": 40.0, "timeout_s": 1800.0},
    "TakeoffLeg": {"height_m": 300.0, "timeout_s": 300.0},
    "LandLeg": {"length_m": 3000.0, "glide_deg": 3.0, "exit_mps": 8.0, "timeout_s": 3600.0},
    "WaypointLeg": {"capture_radius_m": 500.0, "timeout_s": 7200.0},
    "STurnsLeg": {"first": "right", "swing_deg": 30.0, "timeout_s": 86_400.0},
    "LoopLeg": {"load_factor_g": 4.0, "recovery_s": 10.0, "timeout_s": 120.0},
    "BarrelRollLeg": {"direction": "right", "duration_s": 8.0, "load_factor_g": 1.5, "recovery_s": 10.0,
                      "timeout_s": 120.0},
    "DoubletLeg": {"shape": "doublet", "duration_s": 1.0, "recovery_s": 10.0, "timeout_s": 600.0},
    "AltitudeLeg": {"timeout_s": 1800.0},
    "SpeedLeg": {"timeout_s": 600.0},
    "TurnLeg": {"timeout_s": 1800.0},
    "Gust": {"rise_s": 2.0, "fall_s": 2.0},
    "Atmosphere": {"sea_level_pressure_hpa": 1013.25},
    "Turbulence": {"severity": 3, "wind_at_6m_mps": 7.7},
    "Guidance": {"source": "truth", "quantities": ("position", "height", "velocity", "attitude"), "rate_hz": 30.0,
                 "latency_s": 0.0},
    # a car, a ship, a turntable, a rotating unit
    "Drive": {"road": "B", "acceleration_mps2": 1.0, "lateral_mps2": 1.5, "wheelbase_m": 2.7, "suspension_hz": 1.3,
              "suspension_damping": 0.3, "roll_deg_per_mps2": 0.5, "pitch_deg_per_mps2": 0.3},
    "Voyage": {"sea_state": 3, "waves_towards_deg": 90.0, "acceleration_mps2": 0.05, "lateral_mps2": 0.1,
               "heel_deg_per_mps2": 5.0, "roll_period_s": 10.0, "roll_damping": 0.1, "pitch_period_s": 6.0,
               "pitch_damping": 0.4, "heave_period_s": 6.0, "heave_damping": 0.4},
    "Turntable": {"latitude_deg": 45.0, "dwell_s": 120.0, "rate_deg_s": 10.0, "ramp_s": 1.0, "settle_s": 1.0},
    "Continuous": {"inner_axis": (0.0, 0.0, 1.0), "axis": (0.0, 0.0, 1.0), "rate_deg_s": 6.0, "wobble_cycles": 2,
                   "encoder_cycles": 1},
    "Reversing": {"inner_axis": (0.0, 0.0, 1.0), "axis": (0.0, 0.0, 1.0), "wobble_cycles": 2, "encoder_cycles": 1,
                  "rate_deg_s": 6.0, "turn_deg": 360.0, "ramp_s": 1.0},
    "Indexed": {"inner_axis": (0.0, 0.0, 1.0), "wobble_cycles": 2, "encoder_cycles": 1, "rate_deg_s": 20.0,
                "ramp_s": 1.0, "dwell_s": 60.0},
    "Isolator": {"linear_damping": 0.2, "angular_damping": 0.2},
    "OneComponent": {"rate_hz": 20.0, "radius_m": 6.371e6, "gravity_mps2": 9.81},
    # inertial sensors: a helium-neon laser of 632.8 nm
    "Imu": {"grade": "laser-standard", "output": "increments", "rate_hz": 100.0, "warm_up_time_s": 600.0},
    "LaserGyros": {"wavelength_nm": 632.8, "thermal_speed_mps": 550.0, "expansion_ppm_per_c": 0.02},
    "Redundant": {"windows_s": (1.0, 10.0, 100.0), "false_alarm_probability": 1e-9,
                  "missed_detection_probability": 1e-3},
    # aiding sensors
    "Gnss": {"position": True, "velocity": True, "rate_hz": 1.0, "position_sigma_m": 1.5, "height_sigma_m": 3.0,
             "velocity_sigma_mps": 0.05, "correlation_time_s": 300.0},
    "Barometer": {"rate_hz": 1.0, "sigma_m": 1.0, "bias_sigma_m": 10.0, "bias_correlation_time_s": 7200.0},
    "Magnetometer": {"declination": "exact", "rate_hz": 1.0, "sigma_deg": 0.5, "date": 2025.0},
    "Airspeed": {"rate_hz": 1.0, "sigma_mps": 1.0, "wind_sigma_mps": 10.0, "wind_correlation_time_s": 1200.0},
    "Odometer": {"rate_hz": 1.0, "sigma_mps": 0.05},
    "ZeroVelocity": {"rate_hz": 1.0, "sigma_mps": 0.01, "detector": "vehicle", "window_s": None, "threshold": 3.0},
    "ZeroRate": {"rate_hz": 1.0, "sigma_deg_h": 0.1, "detector": "vehicle", "window_s": None, "threshold": 3.0},
    "AttitudeReference": {"rate_hz": 1.0, "sigma_arcmin": (6.0, 6.0, 18.0), "bias_correlation_time_s": 600.0},
    "StarTracker": {"rate_hz": 1.0, "sigma_arcsec": (5.0, 5.0, 5.0)},
    "Master": {"grade": "laser-navigation", "velocity": True, "rate_hz": 1.0, "velocity_sigma_mps": 0.05,
               "velocity_drift_mps": 0.1, "drift_time_s": 3600.0, "attitude_sigma_arcmin": 1.0},
    "DualAntenna": {"rate_hz": 1.0, "baseline_m": (1.0, 0.0, 0.0), "sigma_deg": 0.2},
    "LandVehicle": {"rate_hz": 2.0, "sigma_lateral_mps": 0.1, "sigma_vertical_mps": 0.1,
                    "drift_correlation_time_s": 3.0, "lateral_limit_mps2": 4.0},
    # navigation, filter, recorded sensors, studies
    "NavigationSection": {"ellipsoid": "truth", "curvature": "exact", "vertical": "free", "slow_quantities": "hold",
                          "algorithms": ("quaternion",), "frame": "level", "gravity": "normal",
                          "baro_time_constant_s": 50.0},
    "AlignmentSection": {"method": "quiet", "duration_s": 300.0},
    "FilterSection": {"kind": "error-state", "loop": "closed", "alignment": "at-rest", "inertial_noise_factor": 1.0,
                      "measurement_noise_factor": 1.0, "rate_hz": 10.0, "gate": 1e-4},
    "LogImu": {"kind": "increments", "readings": "instantaneous", "stamps": "as-given", "check_scale": True,
               "delimiter": ",", "decimal": ".", "time": "time_s", "clock": "gps",
               "axes": ("forward", "right", "down"), "max_gap_s": 0.1},
    "LogGnss": {"sigma_factor": 1.0, "velocity_sigma_factor": 1.0, "delimiter": ",", "decimal": ".", "time": "time_s",
                "clock": "gps", "use": ("position", "velocity"), "correlation_time_s": 100.0},
    "CalibrationSection": {"method": "systematic", "use": "positions-and-rates", "interval_s": 1.0,
                           "velocity_sigma_mm_s": 0.01, "attitude_sigma_deg": 10.0},
    "EnsembleSection": {"runs": 1000},
    # words, axes and numbers of what is rarely changed
    "Scenario": {"description": "", "views": ()},
    "RunwayStart": {"engines": "running"},
    "ParkedLeg": {"timeout_s": 86_400.0},
    "HoldLeg": {"timeout_s": 86_400.0},
    "RacetrackLeg": {"timeout_s": 86_400.0, "direction": "right", "laps": 1},
    "ConingMotion": {"latitude_deg": 45.0},
    "ScullingMotion": {"latitude_deg": 45.0},
    "SpinConeMotion": {"latitude_deg": 45.0},
    "SpinRockMotion": {"latitude_deg": 45.0},
    "RotationTableMotion": {"latitude_deg": 45.0},
    "WalkMotion": {"latitude_deg": 45.0, "stride_m": 1.4, "stride_s": 1.1, "stance": 0.4, "length_scatter": 0.05,
                   "duration_scatter": 0.03, "clearance_m": 0.12, "swing_deg_s": 600.0, "heel_strike_g": 8.0},
    "TurningWalk": {"radius_m": 2.0},
    "MultirotorMotion": {"latitude_deg": 45.0, "speed_mps": 8.0, "climb_mps": 2.0, "acceleration_mps2": 1.5,
                         "yaw_deg_s": 60.0, "drag_per_s": 0.2, "gust_s": 3.0, "loop_rad_s": 1.0, "rotor_lag_s": 0.15,
                         "rotors": 4, "rotor_hz": 95.0, "blades": 2},
    "BalloonMotion": {"latitude_deg": 45.0, "rise_mps": 5.0, "burst_height_m": 30e3, "fall_mps": 6.0, "ground_s": 30.0,
                      "line_m": 30.0, "swing_deg": 5.0, "spin_deg_s": 10.0},
    "Orbit": {"radius_m": 30.0},
    "Rocket": {"longitude_deg": 0.0, "altitude_m": 0.0, "heading_deg": 0.0, "elevation_deg": 88.0, "pad_s": 60.0,
               "sway_hz": 0.4, "sway_arm_m": 10.0, "diameter_m": 0.5, "drag_coefficient": 0.4},
    "Drop": {"ground_m": 0.0, "mass_kg": 227.0, "diameter_m": 0.273, "drag_coefficient": 0.15, "fins_hz": 0.6,
             "fins_damping": 0.2},
    "Motor": {"ignition_s": 1.0},
    "TurnStep": {"ramp_s": 1.0, "profile": "smooth"},
    "Track": {"vehicle": "land", "attitude": True},
    "LogReference": {"delimiter": ",", "decimal": ".", "time": "time_s", "clock": "gps"},
    "LogOther": {"delimiter": ",", "time": "time_s", "clock": "gps"},
    "TriadColumns": {"signs": (1, 1, 1)},
    "Triple": {"axes": "north-east-down"},
    "PlaneCourse": {"velocity_mps": ((0.0, 0.0),), "height_m": ((0.0, 0.0),), "pitch_deg": ((0.0, 0.0),),
                    "interpolation": "monotone"},
    "TrueEarth": {"gravity": "normal", "ellipsoid": "wgs84"},
    "TrueGravity": {"model": "normal"},
    "GravityRemainder": {"order": 2},
    "Step": {"axis": "outer"},
    "NavigatorSection": {"inputs": ("imu",), "imu_as": "increments", "form": "binary", "step": "bulk",
                         "timeout_s": 60.0},
    "RecordingSection": {"keep": "all", "detail": "light"},
}  # fmt: skip
USUAL["FurtherFilter"] = USUAL["FilterSection"]


def _tables(of: Any, found: dict[str, type[BaseModel]]) -> dict[str, type[BaseModel]]:
    """Return the tables that a type holds, by the names of their classes."""
    if isinstance(of, type) and issubclass(of, BaseModel):
        if of.__name__ not in found:
            found[of.__name__] = of
            for field in of.model_fields.values():
                _tables(field.annotation, found)
    else:
        for part in get_args(of):
            _tables(part, found)
    return found


@pytest.mark.parametrize("name", USUAL)
def test_usual_values(name: str) -> None:
    fields = _tables(Scenario, {})[name].model_fields
    assert {key: fields[key].default for key in USUAL[name]} == USUAL[name]


def test_all_other_defaults_have_no_effect() -> None:
    """No key left out adds an error, a motion or a condition that the tables above do not name."""
    others = [
        (f"{name}.{key}", field.default)
        for name, table in _tables(Scenario, {}).items()
        for key, field in table.model_fields.items()
        if key != "type" and key not in USUAL.get(name, ())
    ]
    plain = [(key, value) for key, value in others if not isinstance(value, BaseModel | PydanticUndefinedType)]
    assert len(plain) > 250
    assert [(key, value) for key, value in plain if value is not None and np.any(value)] == []
