"""A drive of a land vehicle for tests: its wheels roll without slip, and it stands at the beginning and once later."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from sinssim.data import Array, ImuData
from sinssim.truth.curve import Curve
from tests.oracles import integrator as oracle

STANDS = ((0.0, 10.0), (60.0, 69.0))
"""Times at which it stands, s."""

MOUNTED_DEG = (0.0, 5.0, -6.0)
"""Roll, pitch and yaw of the block in the vehicle."""


def speed(time: Array) -> Array:
    """Return the speed along the forward axis, m/s."""

    def ramp(at: float, lasting: float) -> Array:
        u = np.clip((time - at) / lasting, 0.0, 1.0)
        return np.asarray(u**3 * (10.0 - 15.0 * u + 6.0 * u * u))

    cruise = 12.0 * ramp(10.0, 8.0) - 12.0 * ramp(50.0, 10.0) + 10.0 * ramp(69.0, 6.0)
    return cruise * (1.0 + 0.15 * np.sin(0.7 * time))


def turned(time: Array) -> Array:
    """Return the heading, rad; the vehicle does not turn while it stands."""
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed(time[1:]) + speed(time[:-1])) * np.diff(time))])
    return 0.6 + 0.9 * np.sin(way / 40.0) + 0.3 * np.sin(way / 17.0)


@lru_cache(maxsize=4)
def drive(duration: float, rate_hz: float, mounted: bool = True, forward: float = 0.0) -> tuple[Curve, ImuData]:
    """Return the motion of the block and its increments from time 0 on.

    The point that rolls without slip lies `forward` metres ahead of the block along the vehicle's axis.
    """
    time = np.arange(-120, round(120 * duration) + 121) / 120.0
    fine = turned(np.linspace(time[0], time[-1], 2 * len(time) - 1))
    heading, middle = fine[::2], fine[1::2]
    latitude, longitude = np.empty((2, len(time)))
    latitude[0], longitude[0] = 0.7, -1.8
    v, v_middle = speed(time), speed(0.5 * (time[1:] + time[:-1]))
    step = 1.0 / 120.0

    def rates(lat: float, v: float, psi: float) -> tuple[float, float]:
        w = 1.0 - oracle.F * (2.0 - oracle.F) * np.sin(lat) ** 2
        prime = oracle.A / np.sqrt(w)
        meridian = prime * (1.0 - oracle.F) ** 2 / w
        return v * np.cos(psi) / meridian, v * np.sin(psi) / (prime * np.cos(lat))

    for k in range(len(time) - 1):  # Simpson's rule; the latitude hardly changes within a step
        parts = [
            rates(latitude[k], *at) for at in ((v[k], heading[k]), (v_middle[k], middle[k]), (v[k + 1], heading[k + 1]))
        ]
        north, east = ((a + 4.0 * b + c) * step / 6.0 for a, b, c in zip(*parts, strict=True))
        latitude[k + 1], longitude[k + 1] = latitude[k] + north, longitude[k] + east
    c_nb = Rotation.from_euler("Z", heading[:, None]).as_matrix()
    c_eb = np.swapaxes(oracle.ned_axes(latitude, longitude), -1, -2) @ c_nb
    place = oracle.geodetic_to_ecef(latitude, longitude, np.zeros_like(latitude))
    place = place - c_eb @ np.array([forward, 0.0, 0.0])
    angles = np.radians(MOUNTED_DEG[::-1]) if mounted else np.zeros(3)
    q_bs = Rotation.from_euler("ZYX", angles).as_quat(scalar_first=True)
    curve = Curve(time, place, Rotation.from_matrix(c_eb).as_quat(scalar_first=True), (0.0, 0.0, 0.0), q_bs)
    ideal = curve.increments(rate_hz)
    first = int(np.searchsorted(ideal.time, -1e-9))
    last = first + round(duration * rate_hz)
    return curve, ImuData(ideal.time[first : last + 1], ideal.dtheta[first:last], ideal.dvel[first:last])


def block_in_vehicle(mounted: bool = True) -> Array:
    """Return q_bs of the drive."""
    angles = np.radians(MOUNTED_DEG[::-1]) if mounted else np.zeros(3)
    return np.asarray(Rotation.from_euler("ZYX", angles).as_quat(scalar_first=True))
