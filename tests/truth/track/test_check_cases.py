"""NASA's atmospheric check-cases as tracks, where a person has them: rates and velocities against the files' own.

The environment variable SINSSIM_CHECK_CASES names a folder with the CSV files of the check-cases of bodies and aircraft
on a rotating ellipsoidal Earth (NASA/TM-2015-218675, https://nescacademy.nasa.gov/flightsim); without it nothing is
tested. The files are not part of the project.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.strapdown.navigate import navigate
from sinssim.truth.motions.great_circle import GreatCircle
from sinssim.truth.motions.vibration import Tone, Vibrating
from sinssim.truth.trajectory import Trajectory

FOLDER = os.environ.get("SINSSIM_CHECK_CASES", "")
FILES = sorted(Path(FOLDER).rglob("*.csv")) if FOLDER else []
FOOT = 0.3048
RATES = tuple(f"bodyAngularRateWrtEi_deg_s_{axis}" for axis in ("Roll", "Pitch", "Yaw"))
ANGLES = tuple(f"eulerAngle_deg_{axis}" for axis in ("Roll", "Pitch", "Yaw"))
SPEEDS = tuple(f"feVelocity_ft_s_{axis}" for axis in "XYZ")
NEEDED = ("time", "latitude_deg", "longitude_deg", "altitudeMsl_ft", *ANGLES, *RATES)


def departures(file: Path) -> dict[str, float]:
    """Return rms departures: rates, deg/s; velocities, m/s; position after navigation on the increments, m."""
    table = np.genfromtxt(file, delimiter=",", names=True)
    missing = [name for name in NEEDED if name not in (table.dtype.names or ())]
    if missing:
        pytest.skip(f"{file.name} has no columns {', '.join(missing)}")
    roll, pitch, heading = (np.radians(table[name]) for name in ANGLES)
    time = table["time"]
    track = Trajectory.from_samples(
        time, np.radians(table["latitude_deg"]), np.radians(table["longitude_deg"]), FOOT * table["altitudeMsl_ft"],
        rotation.quaternion_from_euler(roll, pitch, heading),
        vehicle="aircraft", smoothing_s=0.0, max_speed_mps=12_000.0,
    )  # fmt: skip
    inside = slice(5, -5)  # a spline's rates are least certain at its ends
    at = np.asarray(time[inside] - time[0])
    rates = np.degrees(track.rates(at)[0]) - np.stack([table[name][inside] for name in RATES], axis=1)
    found = {"rates": rms(rates)}
    if all(name in (table.dtype.names or ()) for name in SPEEDS):
        velocity = FOOT * np.stack([table[name][inside] for name in SPEEDS], axis=1)
        found["velocity"] = rms(track.state(at).velocity_ned - velocity)
    imu = track.increments(100.0)
    solution = navigate(imu, track.state(imu.time[0]))
    there = track.state(imu.time[-1])
    found["height"] = float(abs(solution.height[-1] - there.height))
    found["north"] = float(abs(solution.latitude[-1] - there.latitude) * 6.4e6)
    return found


def rms(rows: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(rows))))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_check_cases_as_tracks(file: Path) -> None:
    """Rates to 0.05 deg/s and velocities to 0.05 m/s, the digits and spacing of the files; navigation to 0.1 m."""
    found = departures(file)
    assert found["rates"] < 0.05
    assert found.get("velocity", 0.0) < 0.05
    assert found["height"] < 0.1
    assert found["north"] < 0.1


def test_the_comparison_itself_on_a_file_of_this_format(tmp_path: Path) -> None:
    """A great circle written with the columns, units and digits of the check-cases passes, a wrong sign not."""
    circle = GreatCircle(0.6, 0.2, 3000.0, 0.7, 150.0, 30.0)
    tones = (Tone("roll", 0.1, 0.1), Tone("pitch", 0.02, 0.05), Tone("yaw", 0.05, 0.07))
    motion = Vibrating(circle, tones)
    time = np.arange(0.0, 30.01, 0.1)
    s, (omega, _) = motion.state(time), motion.rates(time)
    angles = np.degrees(np.stack(rotation.euler_from_quaternion(s.q_nb), axis=1))
    place = (np.degrees(s.latitude), np.degrees(s.longitude), s.height / FOOT)
    columns = np.column_stack([time, *place, angles, np.degrees(omega), s.velocity_ned / FOOT])
    file = tmp_path / "case.csv"
    header = ",".join((*NEEDED, *SPEEDS))
    np.savetxt(file, columns, delimiter=",", header=header, comments="", fmt="%.12g")
    found = departures(file)
    assert found["rates"] < 1e-3
    assert found["velocity"] < 1e-3
    assert found["height"] < 0.01
    columns[:, 7] *= -1.0
    np.savetxt(file, columns, delimiter=",", header=header, comments="", fmt="%.12g")
    assert departures(file)["rates"] > 0.1
