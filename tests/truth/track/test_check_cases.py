"""NASA's atmospheric check-cases as tracks: rates, velocities, gravity and forces of other simulations of flight.

Slices of two files are in `tests/data/check_cases`, see the NOTE there. The environment variable SINSSIM_CHECK_CASES
names a folder with more CSV files of the check-cases of bodies and aircraft on a rotating ellipsoidal Earth
(NASA/TM-2015-218675, https://nescacademy.nasa.gov/flightsim).
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

import sinssim
from sinssim import earth, rotation
from sinssim.data import ImuData
from sinssim.strapdown.navigate import navigate
from sinssim.truth.motions.mounted_block import Vibrating
from sinssim.truth.motions.parked_and_great_circle import GreatCircle
from sinssim.truth.motions.vibration import Tone
from sinssim.truth.trajectory import Trajectory

SHIPPED = Path(__file__).parents[2] / "data" / "check_cases"
BRICK, POLE = (SHIPPED / f"{stem}.csv" for stem in ("Atmos_02_sim_01", "Atmos_15_sim_04"))
FOLDER = os.environ.get("SINSSIM_CHECK_CASES", "")
FILES = [BRICK, POLE, *(sorted(Path(FOLDER).rglob("*.csv")) if FOLDER else [])]
FOOT = 0.3048
F16_MASS = 637.1595  # slug: 20 500 lb, as its definition says
RATES = tuple(f"bodyAngularRateWrtEi_deg_s_{axis}" for axis in ("Roll", "Pitch", "Yaw"))
ANGLES = tuple(f"eulerAngle_deg_{axis}" for axis in ("Roll", "Pitch", "Yaw"))
SPEEDS = tuple(f"feVelocity_ft_s_{axis}" for axis in "XYZ")
NEEDED = ("time", "latitude_deg", "longitude_deg", "altitudeMsl_ft", *ANGLES, *RATES)

# Largest rms departures: rates, deg/s; velocities, m/s. A file without an entry: its digits and spacing are not known.
# The brick: digits of 1e-14 deg/s and 3e-8 m, halving the interval says 1e-8 deg/s for the spline. The circle at the
# pole: the file's own roll rate differs by 5e-5 deg/s from what its constant attitude says.
LIMITS = {BRICK: (1e-7, 1e-6), POLE: (6e-5, 5e-6)}
UNKNOWN = (0.05, 0.05)
NOT_THE_ELLIPSOID = {
    "Atmos_04_": "on a spherical Earth that does not turn",
    "Atmos_05_": "on a spherical Earth",
    "Atmos_11_sim_02": "its places move by its velocities on a sphere of the equatorial radius, 0.3 % apart",
    "Atmos_15_sim_02": "its places move by its velocities on a sphere of the equatorial radius, 0.3 % apart",
}


def read(file: Path) -> Any:
    """Return the file's table, a structured array."""
    table = np.genfromtxt(file, delimiter=",", names=True)
    missing = [name for name in NEEDED if name not in (table.dtype.names or ())]
    if missing:
        pytest.skip(f"{file.name} has no columns {', '.join(missing)}")
    return table


def columns(table: Any, names: tuple[str, ...]) -> NDArray[np.float64]:
    return np.stack([table[name] for name in names], axis=1)


def track(table: Any, gravity: str = "normal") -> Trajectory:
    """Return the curve through the places and attitudes of a file."""
    roll, pitch, heading = (np.radians(table[name]) for name in ANGLES)
    return Trajectory.from_samples(
        table["time"], np.radians(table["latitude_deg"]), np.radians(table["longitude_deg"]),
        FOOT * table["altitudeMsl_ft"], rotation.quaternion_from_euler(roll, pitch, heading),
        vehicle="aircraft", smoothing_s=0.0, max_speed_mps=12_000.0, gravity=gravity,
    )  # fmt: skip


def departures(file: Path) -> dict[str, float]:
    """Return rms departures: rates, deg/s; velocities, m/s; position after navigation on the increments, m."""
    table = read(file)
    motion = track(table)
    inside = slice(5, -5)  # a spline's rates are least certain at its ends
    at = np.asarray(table["time"][inside] - table["time"][0])
    found = {"rates": rms(np.degrees(motion.rates(at)[0]) - columns(table, RATES)[inside])}
    if all(name in table.dtype.names for name in SPEEDS):
        found["velocity"] = rms(motion.state(at).velocity_ned - FOOT * columns(table, SPEEDS)[inside])
    imu = motion.increments(100.0)
    polar = np.abs(table["latitude_deg"]).max() > 89.8  # where the north-pointing frame refuses
    solution = navigate(imu, motion.state(imu.time[0]), frame="wander" if polar else "level")
    there = motion.state(imu.time[-1])
    found["height"] = float(abs(solution.height[-1] - there.height))
    found["north"] = float(abs(solution.latitude[-1] - there.latitude) * 6.4e6)
    return found


def rms(rows: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(rows))))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_check_cases_as_tracks(file: Path) -> None:
    """Rates and velocities to the digits and spacing of the file, see `LIMITS`; navigation to 0.1 m."""
    for beginning, reason in NOT_THE_ELLIPSOID.items():
        if file.stem.startswith(beginning):
            pytest.skip(reason)
    found = departures(file)
    rates, velocity = LIMITS.get(file, UNKNOWN)
    assert found["rates"] < rates
    assert found.get("velocity", 0.0) < velocity
    assert found["height"] < 0.1
    assert found["north"] < 0.1


def test_the_accelerometers_of_a_falling_brick_read_zero() -> None:
    """The last digit of height, 1e-7 ft, gives √(6/12) · 3e-8 m/(0.1 s)² = 2e-6 m/s², rms.

    Coriolis and centrifugal accelerations and the gradient of gravity are part of what cancels. Under normal gravity
    the sensors read its difference from J2, the zonal harmonic of degree 4: at the equator 15/8 GM/r² J₄ (a/r)⁴.
    """
    table = read(BRICK)[1:]  # the first row is not on the parabola of the others
    at = np.asarray(table["time"][5:-5] - table["time"][0])
    motion = track(table, "j2")
    state, force = motion.state(at), motion.rates(at)[1]
    assert rms(np.linalg.norm(force, axis=1)) < 6e-6  # m/s²; found 3.4e-6
    east = rotation.rotate(state.q_nb, force)[:, 1]
    coriolis = 2.0 * earth.OMEGA_IE * state.velocity_ned[:, 2]
    assert coriolis.max() > 4e-3
    assert np.abs(east).max() < 1e-8  # longitudes are written to 1e-17 m
    normal = track(table).rates(at)[1]
    r = earth.WGS84.a + float(np.mean(state.height))
    expected = 15.0 / 8.0 * earth.WGS84.gm / r**2 * 2.37091222e-6 * (earth.WGS84.a / r) ** 4  # J₄ of NIMA TR8350.2
    assert float(np.mean(np.linalg.norm(normal, axis=1))) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(("file", "tolerance"), [(BRICK, 3e-7), (POLE, 1e-9)], ids=["equator", "pole"])
def test_gravitation_of_other_simulations(file: Path, tolerance: float) -> None:
    """J2 as the files have it, m/s². The brick's gradient is 0.2 % below that of GM/r² with J₂, 2e-7 m/s² in all."""
    table = read(file)
    place = (np.radians(table[name]) for name in ("latitude_deg", "longitude_deg"))
    at = earth.geodetic_to_ecef(*place, FOOT * table["altitudeMsl_ft"])
    found = np.linalg.norm(earth.gravitation_ecef(at, "j2"), axis=1)
    np.testing.assert_allclose(found, FOOT * table["localGravity_ft_s2"], atol=tolerance, rtol=0.0)


def test_a_navigator_falls_with_the_brick() -> None:
    """No specific force, and the integrals of the file's rates: the navigator has the file's places and attitudes.

    Nothing of the track is used. The integrals of a quintic spline through the rates are off by some 1e-10 rad.
    """
    table = read(BRICK)[1:]
    time = table["time"]
    angle = make_interp_spline(time, np.radians(columns(table, RATES)), k=5).antiderivative()
    edges = np.linspace(time[0], time[-1], 391)
    imu = ImuData(edges, np.diff(angle(edges), axis=0), np.zeros((390, 3)))
    roll, pitch, heading = (np.radians(table[name]) for name in ANGLES)
    attitude = rotation.quaternion_from_euler(roll, pitch, heading)
    velocity = FOOT * columns(table, SPEEDS)
    latitude, longitude = (np.radians(table[name]) for name in ("latitude_deg", "longitude_deg"))
    start = sinssim.NavState(latitude[0], longitude[0], FOOT * table["altitudeMsl_ft"][0], velocity[0], attitude[0])
    found = navigate(imu, start, gravity="j2")
    rows = slice(None, None, 10)
    np.testing.assert_allclose(found.height[rows], FOOT * table["altitudeMsl_ft"], atol=1e-6, rtol=0.0)
    np.testing.assert_allclose(6.39e6 * (found.longitude[rows] - longitude), 0.0, atol=1e-6)
    np.testing.assert_allclose(found.velocity_ned[rows], velocity, atol=1e-6, rtol=0.0)
    turned = rotation.multiply(rotation.conjugate(attitude), found.q_nb[rows])
    assert np.abs(2.0 * turned[:, 1:]).max() < 1e-8
    normal = navigate(imu, start)  # half of 4.3e-5 m/s² times the square of 3.9 s
    assert normal.height[-1] - found.height[-1] == pytest.approx(-0.5 * 4.33e-5 * 3.9**2, rel=0.02)


def test_the_accelerometers_of_an_aircraft_feel_its_aerodynamic_forces() -> None:
    """Across and down, where no engine pulls, to 5e-6 m/s² of 11 m/s²; the circle alone takes 5 m/s²."""
    table = read(POLE)
    at = np.asarray(table["time"][5:-5] - table["time"][0])
    force = track(table, "j2").rates(at)[1]
    for axis, name in ((1, "aero_bodyForce_lbf_Y"), (2, "aero_bodyForce_lbf_Z")):
        np.testing.assert_allclose(force[:, axis], FOOT * table[name][5:-5] / F16_MASS, atol=5e-6, rtol=0.0)


def test_the_comparison_itself_on_a_file_of_this_format(tmp_path: Path) -> None:
    """A great circle written with the columns, units and digits of the check-cases passes, a wrong sign not."""
    circle = GreatCircle(0.6, 0.2, 3000.0, 0.7, 150.0, 30.0)
    tones = (Tone("roll", 0.1, 0.1), Tone("pitch", 0.02, 0.05), Tone("yaw", 0.05, 0.07))
    motion = Vibrating(circle, tones)
    time = np.arange(0.0, 30.01, 0.1)
    s, (omega, _) = motion.state(time), motion.rates(time)
    angles = np.degrees(np.stack(rotation.euler_from_quaternion(s.q_nb), axis=1))
    place = (np.degrees(s.latitude), np.degrees(s.longitude), s.height / FOOT)
    table = np.column_stack([time, *place, angles, np.degrees(omega), s.velocity_ned / FOOT])
    file = tmp_path / "case.csv"
    header = ",".join((*NEEDED, *SPEEDS))
    np.savetxt(file, table, delimiter=",", header=header, comments="", fmt="%.12g")
    found = departures(file)
    assert found["rates"] < 1e-3
    assert found["velocity"] < 1e-3
    assert found["height"] < 0.01
    table[:, 7] *= -1.0
    np.savetxt(file, table, delimiter=",", header=header, comments="", fmt="%.12g")
    assert departures(file)["rates"] > 0.1
