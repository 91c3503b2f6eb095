"""Writes the pages of a scenario's tables for the site, build/scenario/*.md, from the schema."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from sinssim.scenario.schema import Key, KeyTable, key_tables, toml_lines
from sinssim.truth.flight.legs import LEGS
from sinssim.truth.motions.drop import Motor
from sinssim.truth.motions.multirotor import MultirotorLeg
from sinssim.truth.motions.rocket import Stage
from sinssim.truth.motions.surface_vehicles import Stop, Straight, Turn
from sinssim.truth.motions.walk import StandingWalk, StraightWalk, TurningWalk

# Values for the keys that have no default, and for one of two keys that exclude each other: by key, or by table.key.
EXAMPLES: dict[str, Any] = {
    "name": "my_flight",
    "description": "one sentence about it",
    "aircraft": "737",
    "latitude_deg": 51.47,
    "longitude_deg": -0.45,
    "heading_deg": 90.0,
    "course_deg": 45.0,
    "speed_mps": 230.0,
    "airspeed_kt": 250.0,
    "altitude_m": 3000.0,
    "angle_deg": 180.0,
    "shape": "doublet",
    "direction": "right",
    "bank_deg": 25.0,
    "duration_s": 600.0,
    "until_s": 1200.0,
    "leg_length_m": 30000.0,
    "vertical_speed_mps": 10.0,
    "velocity_ned_mps": [0.0, 5.0, 0.0],
    "flight.legs.name": "ALPHA",
    "flight.legs.waypoints.name": "ALPHA",
    "flight.legs.waypoints.height_m": 5000.0,
    "WaypointLeg.height_m": 5000.0,
    "path_deg": 3.0,
    "flight.wind.from_deg": 270.0,
    "flight.wind.speed_mps": 10.0,
    "flight.wind.speed_kt": 20.0,
    "flight.wind.profile.height_m": 3000.0,
    "flight.wind.profile.from_deg": 290.0,
    "flight.wind.profile.speed_kt": 40.0,
    "flight.wind.profile.speed_mps": 20.0,
    "motion.duration_s": 60.0,
    "turntable.sequence": "19-positions",
    "turntable.roll_deg": -90.0,
    "turntable.pitch_deg": 0.0,
    "turntable.first_dwell_s": 300.0,
    "turntable.turns.axis": [0.0, 0.0, 1.0],
    "turntable.turns.angle_deg": 90.0,
    "turntable.turns.rate_deg_s": 20.0,
    "turntable.turns.dwell_s": 60.0,
    "calibration.arms": True,
    "calibration.position_sigma_arcsec": 2.0,
    "calibration.tilt_sigma_arcsec": 10.0,
    "compensation.file": "compensation.toml",
    "track.file": "drive.gpx",
    "track.format": "gpx",
    "track.stream": "gnss",
    "track.start_s": 60.0,
    "track.end_s": 1260.0,
    "track.smoothing_s": 1.0,
    "track.height_smoothing_s": 5.0,
    "track.attitude_smoothing_s": 0.0,
    "track.position_sigma_m": 0.5,
    "track.height_sigma_m": 1.0,
    "track.gap_s": 10.0,
    "track.max_speed_mps": 150.0,
    "track.speed_mps": 15.0,
    "track.pitch": "flat",
    "track.standstill_mps": 1.0,
    "track.acceleration_mps2": 1.0,
    "drive.altitude_m": 400.0,
    "drive.legs.duration_s": 60.0,
    "drive.legs.speed_mps": 15.0,
    "drive.legs.angle_deg": 90.0,
    "drive.legs.rate_deg_s": 5.0,
    "voyage.significant_height_m": 1.0,
    "voyage.peak_period_s": 6.0,
    "voyage.legs.duration_s": 600.0,
    "voyage.legs.speed_mps": 6.0,
    "voyage.legs.angle_deg": 90.0,
    "voyage.legs.rate_deg_s": 0.5,
    "rocket.payload_kg": 300.0,
    "drop.release_s": 20.0,
    "track.waypoints.name": "crossing",
    "track.waypoints.speed_mps": 15.0,
    "track.waypoints.turn_radius_m": 20.0,
    "track.waypoints.bank_deg": 25.0,
    "one_component.variant": "one-integral",
    "one_component.duration_s": 8000.0,
    "one_component.arm_accelerometer.arm_m": 1.0,
    "motion.half_angle_deg": 1.0,
    "motion.angle_deg": 2.0,
    "motion.displacement_mm": 1.0,
    "motion.frequency_hz": 5.0,
    "motion.precession_deg_s": 360.0,
    "motion.spin_deg_s": 90.0,
    "motion.axis": [0.0, 0.0, 1.0],
    "motion.steps.duration_s": 30.0,
    "motion.steps.axis": [0.0, 0.0, 1.0],
    "motion.steps.angle_deg": 90.0,
    "motion.steps.rate_deg_s": 10.0,
    "file": "imu.csv",
    "format": "text",
    "stream": "imu",
    "first_row": "2025-07-08 19:34:21.723",
    "time_unit": "ms",
    "log.imu.rate_hz": 100.0,
    "log.imu.gyro.columns": ["gx", "gy", "gz"],
    "log.imu.gyro.unit": "rad",
    "log.imu.accel.columns": ["ax", "ay", "az"],
    "log.imu.accel.unit": "m/s",
    "log.imu.gravity.columns": ["gravity_x", "gravity_y", "gravity_z"],
    "log.imu.gravity.unit": "m/s^2",
    "log.from_s": 10.0,
    "log.to_s": 600.0,
    **{
        f"log.{table}.{key}": value
        for table, file in (("gnss", "gnss.csv"), ("reference", "reference.csv"))
        for key, value in {
            "file": file,
            "stream": table,
            "quality": "Q",
            "quaternion": ["qw", "qx", "qy", "qz"],
            "position_sigma_m": [0.5, 0.5, 1.0],
            "velocity_sigma_mps": [0.1, 0.1, 0.1],
            "quality_factors": {"1": 1.0, "2": 20.0},
            "gap_s": 1.0,
            **{
                f"{q}.column": q
                for q in ("latitude", "longitude", "height", "roll", "pitch", "heading", "speed", "course")
            },
            **{
                f"{q}.unit": "deg"
                for q in ("latitude", "longitude", "roll", "pitch", "heading", "course", "attitude_sigma")
            },
            **{f"{q}.unit": "m" for q in ("height", "position_sigma")},
            **{f"{q}.unit": "m/s" for q in ("velocity", "speed", "velocity_sigma")},
            "velocity.columns": ["vn", "ve", "vd"],
            "position_sigma.columns": ["sn", "se", "sd"],
            "velocity_sigma.columns": ["svn", "sve", "svd"],
            "attitude_sigma.columns": ["s_roll", "s_pitch", "s_heading"],
        }.items()
    },
    "log.others.name": "baro",
    "log.others.kind": "baro-height",
    "log.others.file": "baro.csv",
    "log.others.reading.column": "height",
    "log.others.reading.unit": "m",
    "log.others.sigma.column": "sigma",
    "log.others.sigma.unit": "m",
    "log.others.bias_sigma.value": 10.0,
    "log.others.bias_sigma.unit": "m",
    "log.start.latitude_deg": 40.1,
    "log.start.longitude_deg": -105.1,
    "log.start.height_m": 1600.0,
    "log.start.heading_deg": 355.0,
    "log.start.velocity_ned_mps": [0.0, 0.0, 0.0],
    "log.outages.length_s": 15.0,
    "log.outages.every_s": 45.0,
    "log.outages.first_s": 60.0,
    "imu.sensor_set.arm_m": 0.5,
    "imu.sensor_set.layout": "dodecahedron",
    "imu.sensor_set.directions": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, 0.6, 0.8]],
    "imu.sensor_set.monitoring": "exclude",
    "imu.rotation.encoder_bias_arcsec": [10.0, 0.0],
    "imu.rotation.sequence": "16-position",
    "imu.rotation.axis": [0.0, 0.0, 1.0],
    "imu.rotation.steps.turn_deg": 180.0,
    "imu.faults.channels": ["gyro_x", "gyro_y", "gyro_z"],
    "imu.gyro_correlation_time_s": 3600.0,
    "imu.accel_correlation_time_s": 3600.0,
    "imu.gyro_range_deg_s": 400.0,
    "imu.accel_range_g": 60.0,
    "gravity.file": "field.gfc",
    "gravity.degree": 120,
    "gravity.remainder.xi_sigma_arcsec": 5.0,
    "gravity.remainder.eta_sigma_arcsec": 5.0,
    "gravity.remainder.anomaly_sigma_mgal": 30.0,
    "gravity.remainder.correlation_km": 20.0,
    "navigation.gravity_degree": 60,
    "navigation.rates_hz": [100.0, 50.0, 10.0],
    "navigation.route_deg": [51.47, -0.45, 40.64, -73.78],
    "navigator.name": "mine",
    "navigator.command": ["./my_navigator"],
    "navigator.library": "libmy_navigator.so",
    "filters.name": "other",
    "perimeter_mm": 420.0,
    "area_mm2": 8487.0,
    "lock_in_deg_h": 360.0,
    "dither_amplitude_arcsec": 140.0,
    "dither_frequency_hz": 400.0,
    "output.coordinates": ["earth-fixed", "pz-90.11"],
    "output.angles": "continuous",
    "filter.alignment_s": 120.0,
    "filter.initial_sigma.position_m": 10.0,
    "filter.initial_sigma.height_m": 10.0,
    "filter.initial_sigma.velocity_mps": 0.1,
    "filter.initial_sigma.tilt_arcmin": 1.0,
    "filter.initial_sigma.heading_arcmin": 10.0,
    "aiding.gnss.jumps.north_m": 50.0,
    "aiding.gnss.ramps.east_mps": 0.5,
    "aiding.gnss.jumps.from_s": 600.0,
    "aiding.gnss.jumps.to_s": 700.0,
    "aiding.gnss.ramps.from_s": 600.0,
    "aiding.gnss.ramps.to_s": 900.0,
    "imu.faults.from_s": 600.0,
    "imu.faults.to_s": 660.0,
    "imu.faults.at_s": 630.0,
    "imu.faults.sigma_ms": 0.1,
    "imu.faults.gyro_deg_h": [0.0, 0.0, 10.0],
    "imu.faults.gyro_arcsec": [0.0, 100.0, 0.0],
    "imu.faults.gyro_deg_s": 10.0,
    "ensemble.epoch_s": 10.0,
    "ensemble.solution": "aided",
    "coordinate": "pitch",
    "rms_arcsec": 20.0,
    "rms_mm": 0.05,
    "rms_g": 0.1,
    "linear_hz": 30.0,
    "angular_hz": 45.0,
    "low_hz": 8.0,
    "high_hz": 40.0,
}
# Keys without a default value that are nevertheless set in the example: one of each "exactly one of" group.
CHOSEN = {
    "Vibration": {"rms_arcsec", "high_hz"},
    "WindLevel": {"speed_kt"},
    "Spike": {"gyro_arcsec"},
    "BiasStep": {"gyro_deg_h"},
    "Saturation": {"gyro_deg_s"},
    "Track": {"file"},
    "NavigatorSection": {"command"},
    "Quantity": {"column"},
    "Triple": {"columns"},
    "Outages": {"length_s", "every_s"},
}

LEG_EXAMPLES: dict[str, dict[str, Any]] = {
    leg.__name__: leg.example
    for leg in (
        *LEGS,
        Straight,
        Turn,
        Stop,
        StraightWalk,
        TurningWalk,
        StandingWalk,
        Stage,
        Motor,
        *get_args(get_args(MultirotorLeg)[0]),
    )
} | {
    "Normal": {"key": "navigation.initial_error.heading_arcmin", "mean": 0.0, "sigma": 3.0},
    "Uniform": {"key": "imu.temperature_start_c", "low": -20.0, "high": 40.0},
    "Choice": {"key": "imu.rate_hz", "values": [100.0, 200.0]},
}
"""Keys of a valid leg by the name of its class: what its file gives as an example."""

# Tables that exclude others of the example: they are shown as comments.
OTHERS = {
    "flight.legs.waypoints",
    "track.waypoints",
    "turntable.turns",
    "one_component.attitude_sensor",
    "one_component.arm_accelerometer",
    "log.imu.gravity",
    "log.gnss.speed",
    "log.gnss.course",
    "log.reference.speed",
    "log.reference.course",
}

TITLES = {
    "flight": "Flight",
    "parked": "Parked vehicle",
    "great_circle": "Great-circle motion",
    "motion": "Motion in closed form for tests of algorithms, a walk, a multirotor",
    "track": "Recorded or planned track",
    "drive": "Drive on a road",
    "voyage": "Voyage of a ship",
    "rocket": "Flight of a rocket",
    "turntable": "Calibration on a turntable",
    "log": "Recorded sensors",
    "one_component": "One-component system",
    "calibration": "Calibration settings",
    "drop": "A bomb or missile that a carrier drops",
    "vibration": "Vibration",
    "isolator": "Shock mounts",
    "truth": "Gravity model and ellipsoid of the truth",
    "gravity": "The true gravity field",
    "imu": "The sensor block",
    "compensation": "Compensation of sensor errors",
    "aiding": "Aiding sensors",
    "navigation": "Navigation",
    "navigator": "Navigators of others",
    "filters": "Further filters",
    "filter": "The filter",
    "output": "Further coordinates",
    "recording": "Files of a run",
    "ensemble": "Ensembles",
}
"""Titles of the tables of the top level, in the order of the site."""

PAGES = Path(__file__).parents[1] / "build" / "scenario"


def lines_of(table: KeyTable) -> Iterator[str]:
    """Yield one table as TOML, with an example for each key without a default."""
    example = LEG_EXAMPLES.get(table.model, {})

    def value_of(key: Key) -> Any:
        own = f"{table.path}.{key.name}"
        if key.name in ("type", "on") and table.tag:
            return table.tag
        if key.name in example:
            return example[key.name]
        if key.name == "description" or key.default is None or own in EXAMPLES:
            return EXAMPLES.get(own, EXAMPLES.get(f"{table.model}.{key.name}", EXAMPLES.get(key.name)))
        return key.default

    return toml_lines(table, value_of, CHOSEN.get(table.model, set()) | set(example))


def toml_of(name: str, tables: list[KeyTable]) -> str:
    """Return a table of the top level with the tables in it; of kinds that exclude each other, the first is live."""
    lines: list[str] = []
    left_out = ""
    for table in (table for table in tables if f"{table.path}.".startswith(f"{name}.")):
        if left_out and not table.path.startswith(f"{left_out}."):
            left_out = ""
        if (table.kind and not table.array) or table.path in OTHERS:
            left_out = table.path
        own = lines_of(table)
        lines += map(_commented, own) if left_out else own
    return "\n".join(lines).rstrip()


def _commented(line: str) -> str:
    return f"# {line}" if line and not line.startswith("#") else line


def pages() -> dict[str, str]:
    """Return the pages of the tables by the name of the table; "head" for the keys of the top level.

    Returns:
        Markdown; its TOML blocks together are the file's head, each kind of motion, and the rest.
    """
    tables = list(key_tables())
    head = "\n".join(lines_of(tables[0])).rstrip()
    found = {"head": f"# Head of the file\n\n```toml\n{head}\n```\n"}
    for name, title in TITLES.items():
        found[name] = f"# {title}: `[{name}]`\n\n```toml\n{toml_of(name, tables)}\n```\n"
    return found


if __name__ == "__main__":
    PAGES.mkdir(parents=True, exist_ok=True)
    for name, text in pages().items():
        (PAGES / f"{name}.md").write_text(text, encoding="utf-8")
