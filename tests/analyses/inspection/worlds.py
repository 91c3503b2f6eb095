"""A drive with stops and turns whose truth is known, and what a unit and a receiver in the car record."""

from __future__ import annotations

from functools import cache

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, NavState
from sinssim.logs.recorded_streams import FixStream, InertialStream
from sinssim.truth.curve import Curve

DURATION = 150.0
PLACE = (np.radians(48.1), np.radians(11.5), 520.0)
TO_UNIT = rotation.dcm_from_quaternion(
    rotation.quaternion_from_euler(np.radians(0.0), np.radians(-4.0), np.radians(6.0))
)


@cache
def drive() -> Curve:
    """Return the drive: half a minute standing, then straights, turns and stops."""
    time = np.arange(0.0, DURATION + 0.05, 0.1)
    rise = np.clip((time - 30.0) / 10.0, 0.0, 1.0)
    on = rise**2 * (3.0 - 2.0 * rise)
    speed = on * (10.0 + 2.5 * np.sin(0.31 * time) + 1.5 * np.sin(0.83 * time))
    heading = 0.6 + on * (1.2 * np.sin(0.07 * time) + 0.25 * np.sin(0.47 * time) + 0.06 * np.sin(1.1 * time))
    fine = np.arange(0.0, DURATION + 0.05, 0.01)
    v, h = np.interp(fine, time, speed), np.interp(fine, time, heading)
    north, east = (np.append(0.0, np.cumsum(0.01 * v[:-1] * f(h[:-1]))) for f in (np.cos, np.sin))
    north, east = (np.interp(time, fine, x) for x in (north, east))
    r1, r2 = earth.radii(PLACE[0])
    latitude, longitude = PLACE[0] + north / (r1 + PLACE[2]), PLACE[1] + east / ((r2 + PLACE[2]) * np.cos(PLACE[0]))
    roll, pitch = 0.03 * on * np.sin(0.9 * time), 0.015 * on * np.sin(0.53 * time)
    q_nb = rotation.quaternion_from_euler(roll, pitch, heading)
    q_eb = rotation.multiply(earth.q_en(latitude, longitude), q_nb)
    for k in range(1, len(q_eb)):
        if q_eb[k] @ q_eb[k - 1] < 0.0:
            q_eb[k] *= -1.0
    place = earth.geodetic_to_ecef(latitude, longitude, np.full_like(time, PLACE[2]))
    return Curve(time, place, q_eb)


@cache
def _increments(rate_hz: float) -> ImuData:
    return drive().increments(rate_hz)


def readings(rate_hz: float = 100.0, late: float = 0.0, noise: float = 1.0) -> InertialStream:
    """Return instantaneous-looking readings of a unit turned by `TO_UNIT`: mean rates over its intervals.

    The stamp of a mean rate is the middle of its interval; all stamps are `late` seconds late.
    """
    increments = _increments(rate_hz)
    interval = np.diff(increments.time)[:, None]
    rng = np.random.default_rng(5)
    gyro = increments.dtheta / interval + noise * rng.normal(0.0, np.radians(0.05), increments.dtheta.shape)
    gyro += np.radians((0.1, -0.2, 0.15))
    accel = increments.dvel / interval + noise * rng.normal(0.0, 0.02, increments.dvel.shape)
    middle = increments.time[:-1] + 0.5 * interval[:, 0]
    return InertialStream(middle + late, gyro @ TO_UNIT, accel @ TO_UNIT)


def fixes(rate_hz: float = 4.0, delay: float = 0.0, sigma: float = 0.01) -> FixStream:
    """Return fixes whose velocities are `delay` seconds older than their positions."""
    time = np.arange(1.0, DURATION - 1.0, 1.0 / rate_hz)
    state, older = drive().state(time), drive().state(time - delay)
    rng = np.random.default_rng(6)
    place = _moved(state, rng.normal(0.0, sigma, (len(time), 3)))
    velocity = older.velocity_ned + rng.normal(0.0, 0.03, (len(time), 3))
    return FixStream(
        time,
        *place,
        datum="ellipsoid",
        position_sigma=np.full((len(time), 3), sigma),
        velocity_ned=velocity,
        velocity_sigma=np.full((len(time), 3), 0.03),
    )


def _moved(state: NavState, error: Array) -> tuple[Array, Array, Array]:
    r1, r2 = earth.radii(state.latitude)
    return (
        state.latitude + error[:, 0] / (r1 + state.height),
        state.longitude + error[:, 1] / ((r2 + state.height) * np.cos(state.latitude)),
        state.height - error[:, 2],
    )
