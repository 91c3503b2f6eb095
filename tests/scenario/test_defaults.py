"""What a scenario means that leaves keys out: the usual values, written down a second time by hand."""

from __future__ import annotations

from typing import Any, get_args

import pytest
from pydantic import BaseModel

from sinssim.scenario import Scenario

USUAL: dict[str, dict[str, Any]] = {
    # the aircraft: metres and seconds of a landing, 3° of a glide path, ICAO's standard pressure, moderate turbulence
    "TaxiLeg": {"radius_m": 40.0, "timeout_s": 1800.0},
    "TakeoffLeg": {"height_m": 300.0, "timeout_s": 300.0},
    "LandLeg": {"length_m": 3000.0, "glide_deg": 3.0, "exit_mps": 8.0, "timeout_s": 3600.0},
    "WaypointLeg": {"capture_radius_m": 500.0, "timeout_s": 7200.0},
    "STurnsLeg": {"swing_deg": 30.0, "timeout_s": 86_400.0},
    "LoopLeg": {"load_factor_g": 4.0, "recovery_s": 10.0, "timeout_s": 120.0},
    "BarrelRollLeg": {"duration_s": 8.0, "load_factor_g": 1.5, "recovery_s": 10.0, "timeout_s": 120.0},
    "DoubletLeg": {"duration_s": 1.0, "recovery_s": 10.0, "timeout_s": 600.0},
    "AltitudeLeg": {"timeout_s": 1800.0},
    "SpeedLeg": {"timeout_s": 600.0},
    "TurnLeg": {"timeout_s": 1800.0},
    "Gust": {"rise_s": 2.0, "fall_s": 2.0},
    "Atmosphere": {"sea_level_pressure_hpa": 1013.25},
    "Turbulence": {"severity": 3, "wind_at_6m_mps": 7.7},
    "Guidance": {"rate_hz": 30.0, "latency_s": 0.0},
    # a car, a ship, a turntable, a rotating unit
    "Drive": {"acceleration_mps2": 1.0, "lateral_mps2": 1.5, "wheelbase_m": 2.7, "suspension_hz": 1.3,
              "suspension_damping": 0.3, "roll_deg_per_mps2": 0.5, "pitch_deg_per_mps2": 0.3},
    "Voyage": {"sea_state": 3, "waves_towards_deg": 90.0, "acceleration_mps2": 0.05, "lateral_mps2": 0.1,
               "heel_deg_per_mps2": 5.0, "roll_period_s": 10.0, "roll_damping": 0.1, "pitch_period_s": 6.0,
               "pitch_damping": 0.4, "heave_period_s": 6.0, "heave_damping": 0.4},
    "Turntable": {"latitude_deg": 45.0, "dwell_s": 120.0, "rate_deg_s": 10.0, "ramp_s": 1.0, "settle_s": 1.0},
    "Continuous": {"rate_deg_s": 6.0, "wobble_cycles": 2, "encoder_cycles": 1},
    "Reversing": {"rate_deg_s": 6.0, "turn_deg": 360.0, "ramp_s": 1.0},
    "Indexed": {"rate_deg_s": 20.0, "ramp_s": 1.0, "dwell_s": 60.0},
    "Isolator": {"linear_damping": 0.2, "angular_damping": 0.2},
    "OneComponent": {"rate_hz": 20.0, "radius_m": 6.371e6, "gravity_mps2": 9.81},
    # inertial sensors: a helium-neon laser of 632.8 nm
    "Imu": {"rate_hz": 100.0, "warm_up_time_s": 600.0},
    "LaserGyros": {"wavelength_nm": 632.8, "thermal_speed_mps": 550.0, "expansion_ppm_per_c": 0.02},
    "Redundant": {"windows_s": (1.0, 10.0, 100.0), "false_alarm_probability": 1e-9,
                  "missed_detection_probability": 1e-3},
    # aiding sensors
    "Gnss": {"rate_hz": 1.0, "position_sigma_m": 1.5, "height_sigma_m": 3.0, "velocity_sigma_mps": 0.05,
             "correlation_time_s": 300.0},
    "Barometer": {"rate_hz": 1.0, "sigma_m": 1.0, "bias_sigma_m": 10.0, "bias_correlation_time_s": 7200.0},
    "Magnetometer": {"rate_hz": 1.0, "sigma_deg": 0.5, "date": 2025.0},
    "Airspeed": {"rate_hz": 1.0, "sigma_mps": 1.0, "wind_sigma_mps": 10.0, "wind_correlation_time_s": 1200.0},
    "Odometer": {"rate_hz": 1.0, "sigma_mps": 0.05},
    "ZeroVelocity": {"rate_hz": 1.0, "sigma_mps": 0.01},
    "ZeroRate": {"rate_hz": 1.0, "sigma_deg_h": 0.1},
    "AttitudeReference": {"rate_hz": 1.0, "sigma_arcmin": (6.0, 6.0, 18.0), "bias_correlation_time_s": 600.0},
    "StarTracker": {"rate_hz": 1.0, "sigma_arcsec": (5.0, 5.0, 5.0)},
    "Master": {"rate_hz": 1.0, "velocity_sigma_mps": 0.05, "velocity_drift_mps": 0.1, "drift_time_s": 3600.0,
               "attitude_sigma_arcmin": 1.0},
    "DualAntenna": {"rate_hz": 1.0, "baseline_m": (1.0, 0.0, 0.0), "sigma_deg": 0.2},
    "LandVehicle": {"rate_hz": 2.0, "sigma_lateral_mps": 0.1, "sigma_vertical_mps": 0.1,
                    "drift_correlation_time_s": 3.0, "lateral_limit_mps2": 4.0},
    # navigation, filter, recorded sensors, studies
    "NavigationSection": {"algorithms": ("quaternion",), "frame": "level", "gravity": "normal",
                          "baro_time_constant_s": 50.0},
    "AlignmentSection": {"method": "quiet", "duration_s": 300.0},
    "FilterSection": {"rate_hz": 10.0, "gate": 1e-4},
    "LogImu": {"axes": ("forward", "right", "down"), "max_gap_s": 0.1},
    "LogGnss": {"use": ("position", "velocity"), "correlation_time_s": 100.0},
    "CalibrationSection": {"interval_s": 1.0, "velocity_sigma_mm_s": 0.01, "attitude_sigma_deg": 10.0},
    "EnsembleSection": {"runs": 1000},
}  # fmt: skip


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
