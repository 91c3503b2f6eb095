"""A parked unit over 48 h, one source of error at a time, against the classical solutions.

The errors of a unit at rest oscillate with the Schuler frequency, modulated by the Foucault frequency, and with the
Earth's rate: the roots of (s² + Ω²) [(s² + ω_s²)² + 4 s² Ω² sin² L] = 0 (Britting, Inertial Navigation Systems
Analysis, 1971; Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, ch. 12).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sinssim import earth
from sinssim.earth.ellipsoids import WGS84
from sinssim.experiments.run.run_execution import run
from sinssim.scenario.schema import Scenario
from sinssim.strapdown.navigation_error import NavError
from sinssim.units import ARCMIN, DEG_H, UG
from tests.oracles.parked_errors import errors, system
from tests.slow import slow

LATITUDE, HOURS = np.radians(45.0), 48.0
RADII = tuple(float(radius) for radius in earth.radii(LATITUDE, WGS84))
GRAVITY = float(earth.gravity_ned(LATITUDE, 0.0, "normal", WGS84)[2])
F = system(LATITUDE, GRAVITY, *RADII, WGS84.omega)
SCHULER = np.sqrt(GRAVITY / np.sqrt(RADII[0] * RADII[1]))

NONE = np.zeros(7)


def parked(hours: float = HOURS, rate_hz: float = 1.0, initial: dict[str, Any] | None = None, **imu: Any) -> NavError:
    """Return the errors of a unit at rest, level, with its axes north, east, down."""
    scenario = Scenario.model_validate(
        {
            "name": "parked-error",
            "parked": {"latitude_deg": 45.0, "longitude_deg": 10.0, "altitude_m": 0.0, "duration_s": 3600.0 * hours},
            "imu": {"grade": "ideal", "rate_hz": rate_hz, **imu},
            "navigation": {"vertical": "truth", "initial_error": initial or {}},
        }
    )
    (found,) = run(scenario).errors.values()
    return found


def driven(drift: int | None = None, force: int | None = None, size: float = 0.0) -> NDArray[np.float64]:
    """Return the input of F by a gyro's drift or an accelerometer's error about one axis."""
    found = np.zeros(7)
    if drift is not None:
        found[drift] = -size
    if force is not None:
        found[3 + force] = size
    return found


def started(state: int, size: float) -> NDArray[np.float64]:
    """Return an initial error."""
    found = np.zeros(7)
    found[state] = size
    return found


DRIFT, FORCE = 0.01 * DEG_H, 50.0 * UG
CASES: dict[str, tuple[dict[str, Any], NDArray[np.float64], NDArray[np.float64]]] = {
    "gyro north": ({"gyro_bias_deg_h": (0.01, 0.0, 0.0)}, NONE, driven(drift=0, size=DRIFT)),
    "gyro east": ({"gyro_bias_deg_h": (0.0, 0.01, 0.0)}, NONE, driven(drift=1, size=DRIFT)),
    "gyro down": ({"gyro_bias_deg_h": (0.0, 0.0, 0.01)}, NONE, driven(drift=2, size=DRIFT)),
    "accelerometer north": ({"accel_bias_ug": (50.0, 0.0, 0.0)}, NONE, driven(force=0, size=FORCE)),
    "accelerometer east": ({"accel_bias_ug": (0.0, 50.0, 0.0)}, NONE, driven(force=1, size=FORCE)),
    "roll": ({"initial": {"roll_arcmin": 0.2}}, started(0, -0.2 * ARCMIN), NONE),
    "pitch": ({"initial": {"pitch_arcmin": 0.2}}, started(1, -0.2 * ARCMIN), NONE),
    "heading": ({"initial": {"heading_arcmin": 2.0}}, started(2, -2.0 * ARCMIN), NONE),
    "velocity north": ({"initial": {"velocity_north_mps": 0.1}}, started(3, 0.1), NONE),
    "velocity east": ({"initial": {"velocity_east_mps": 0.1}}, started(4, 0.1), NONE),
}


FEW = ("accelerometer east", "velocity north")


@pytest.mark.parametrize("case", [*FEW, *slow(*(case for case in CASES if case not in FEW))])
def test_oscillations_of_a_parked_unit_over_two_days(case: str) -> None:
    keys, start, drive = CASES[case]
    found = parked(**keys)
    expected = errors(F, start, drive, NONE, NONE, 1.0, 60.0, int(HOURS * 60.0))
    rows = slice(None, None, 60)
    got = np.hstack([found.attitude[rows], found.velocity_ned[rows, :2], found.position_ned[rows, :2]])
    peak = np.abs(expected).max(axis=0)
    # of the largest error of each state; errors of 27 km leave 0.9 % of the second order, the others a tenth of that
    assert np.all(np.abs(got - expected).max(axis=0) <= 0.02 * peak), np.abs(got - expected).max(axis=0) / peak


def test_first_oscillation_has_the_closed_forms_of_a_single_axis() -> None:
    """Titterton and Weston, ch. 12, the level channel alone, over a tenth of the Schuler period.

    R ε (t − sin ω_s t/ω_s), a (1 − cos ω_s t)/ω_s², v sin ω_s t/ω_s, R φ (1 − cos ω_s t).
    """
    t, meridian, normal = 500.0, *RADII
    turned = np.sqrt(GRAVITY / np.array(RADII)) * t
    rows = {name: parked(500.0 / 3600.0, 10.0, **CASES[name][0]).position_ned[-1] for name in CASES}
    gained = DRIFT * (t - np.sin(turned) * t / turned)
    assert rows["gyro east"][0] == pytest.approx(-meridian * gained[0], rel=0.01)
    assert rows["gyro north"][1] == pytest.approx(normal * gained[1], rel=0.01)
    pushed = FORCE * (t / turned) ** 2 * (1.0 - np.cos(turned))
    assert rows["accelerometer north"][0] == pytest.approx(pushed[0], rel=0.01)
    assert rows["accelerometer east"][1] == pytest.approx(pushed[1], rel=0.01)
    assert rows["velocity north"][0] == pytest.approx(0.1 * np.sin(turned[0]) * t / turned[0], rel=0.01)
    assert rows["velocity east"][1] == pytest.approx(0.1 * np.sin(turned[1]) * t / turned[1], rel=0.01)
    tilted = 0.2 * ARCMIN * (1.0 - np.cos(turned))
    assert rows["pitch"][0] == pytest.approx(-meridian * tilted[0], rel=0.01)
    assert rows["roll"][1] == pytest.approx(normal * tilted[1], rel=0.01)


def test_longitude_drifts_by_the_part_of_a_gyro_bias_along_the_axis_of_the_earth() -> None:
    """The axes that the gyros hold drift about the polar axis without bound, and about others return in a day."""
    for case, axis in (("gyro north", np.cos(LATITUDE)), ("gyro east", 0.0), ("gyro down", -np.sin(LATITUDE))):
        found = parked(**CASES[case][0])
        day = (
            86164.0905  # in whole sidereal days the daily oscillation returns; that of Schuler is small beside the sum
        )
        rows = np.searchsorted(found.time, (0.5 * day, 1.5 * day))
        smooth = [found.position_ned[max(r - 2532, 0) : r + 2532, 1].mean() for r in rows]  # a Schuler period
        rate = (smooth[1] - smooth[0]) / day / (RADII[1] * np.cos(LATITUDE))
        assert rate == pytest.approx(DRIFT * axis, abs=0.02 * DRIFT)


def test_frequencies_are_the_roots_of_the_characteristic_equation() -> None:
    """Lines of the spectrum of two days: ω_s ± Ω sin L, from the oscillation after a jolt of velocity."""
    found = parked(**CASES["velocity north"][0])
    omega, sine = WGS84.omega, np.sin(LATITUDE)
    # the oscillation as a whole turns clockwise, from north to east, with Ω sin L: Foucault's pendulum
    motion = found.velocity_ned[::30, 0] + 1j * found.velocity_ned[::30, 1]
    time = found.time[::30]
    window = np.hanning(len(time))
    lines = []
    for near in (1.0, -1.0):
        tried = np.linspace(0.93, 1.07, 1401) * SCHULER * near
        power = [abs(np.sum(window * motion * np.exp(-1j * w * time))) for w in tried]
        lines.append(tried[int(np.argmax(power))])
    foucault = 0.5 * (lines[0] + lines[1])
    assert foucault == pytest.approx(omega * sine, rel=0.02)
    published = np.roots([1.0, 0.0, 2.0 * SCHULER**2 + 4.0 * omega**2 * sine**2, 0.0, SCHULER**4])
    assert 0.5 * (lines[0] - lines[1]) == pytest.approx(np.mean(np.unique(np.abs(published.imag).round(12))), rel=2e-3)
