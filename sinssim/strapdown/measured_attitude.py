"""Sensor set 3 of the chapter (section 8.1): three accelerometers and a measured attitude.

The sensor measures the attitude in inertial space at the edges of the accelerometers' intervals, so velocity and
position are integrated in inertial space, too: v̇ = C_ib f + gravitation. Attitude and accumulated velocity increments
are interpolated by quintic splines. ∫C_ib f dt and its second integral follow by Gauss-Legendre quadrature, and
gravitation is integrated by the trapezoidal rule along the path. The attitude error is that of the sensor and drives
the Schuler oscillation (8.14).
"""

from __future__ import annotations

from math import cos, sin
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth, rotation
from sinssim.arguments import check_finite, check_increasing, checked_initial, doubles, not_finite_in
from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth.geodetic_coordinates import radii_k
from sinssim.earth.gravity import gravitation_ecef_k, gravity_ned_k
from sinssim.errors import InputError, RunError
from sinssim.jit import kernel
from sinssim.rotation.vectors import add, along
from sinssim.strapdown.attitude import MEASURED_ATTITUDE
from sinssim.strapdown.frames.inertial import coordinates_k, settled_k
from sinssim.strapdown.frames.navigation_problem import Models, channel_of, models_of
from sinssim.strapdown.frames.vertical_channel import (
    Channel,
    HeightReadings,
    height_reference,
    loop_gains_k,
    reference_k,
    start_loop_k,
)
from sinssim.strapdown.mechanization import Mechanization, Options, chosen
from sinssim.strapdown.navigate import navigate

_POINTS = 4
_CHUNK = 65536  # number of intervals processed at once
_UNIT = 1e-3  # largest deviation of the norm of a quaternion from 1


@kernel
def _integrate(
    of: Models, channel: Channel, time: Array, push: Array, shift: Array, position: Array, velocity: Array,
    latitude: Array, longitude: Array, height: Array, velocity_ned: Array,
) -> None:  # fmt: skip
    """Integrate over the intervals in inertial axes; the first rows of the outputs hold the start."""
    p, h0, s, c = of.earth, height[0], sin(latitude[0]), cos(latitude[0])
    _, r2 = radii_k(p, s)
    _, gravity_down = gravity_ned_k(p, of.gravity, s, c, r2, h0)
    gains, loop = loop_gains_k(channel.time_constant, gravity_down, 1.0 / (r2 + h0)), start_loop_k(channel, h0)
    r, v = (position[0], position[1], position[2]), (velocity[0], velocity[1], velocity[2])
    g = gravitation_ecef_k(p, of.gravity, *r)
    for k in range(len(push)):
        dt, angle = time[k + 1] - time[k], p.omega * time[k + 1]
        # gravitation at the end from a position with constant gravitation, then the mean of both
        r = add(along(r, dt, v), (shift[k, 0], shift[k, 1], shift[k, 2]))
        g1 = gravitation_ecef_k(p, of.gravity, *along(r, 0.5 * dt * dt, g))
        r = along(along(r, dt * dt / 3.0, g), dt * dt / 6.0, g1)
        v = along(add(v, (push[k, 0], push[k, 1], push[k, 2])), 0.5 * dt, add(g, g1))
        # inertial axes at time t equal the Earth-fixed ones except for the longitude, measured from the x axis
        turn = cos(angle), sin(angle)
        x = settled_k(of, channel.number, gains, dt, turn, reference_k(channel, k + 1), r, v, g1, loop)
        r, v, loop, g = x.r, x.v, x.loop, gravitation_ecef_k(p, of.gravity, *x.r)
        latitude[k + 1], longitude[k + 1], _ = coordinates_k(x.north)
        height[k + 1] = x.north.h
        velocity_ned[k + 1, 0], velocity_ned[k + 1, 1], velocity_ned[k + 1, 2] = x.north.v


def _pushes(time: Array, dvel: Array, q_ib: Array) -> tuple[Array, Array]:
    """Return ∫C_ib f dt and ∫(t_end − t) C_ib f dt over each interval, (N, 3) m/s and m."""
    from scipy.interpolate import make_interp_spline

    sign = np.where(np.einsum("ij,ij->i", q_ib[1:], q_ib[:-1]) < 0.0, -1.0, 1.0)
    continuous = q_ib * np.concatenate([[1.0], np.cumprod(sign)])[:, None]
    attitude = make_interp_spline(time, continuous, k=5)
    accumulated = np.concatenate([np.zeros((1, 3)), np.cumsum(dvel, axis=0)])
    force = make_interp_spline(time, accumulated, k=5).derivative()
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    push, shift = np.empty_like(dvel), np.empty_like(dvel)
    for first in range(0, len(dvel), _CHUNK):
        part = slice(first, first + _CHUNK)
        half = 0.5 * (time[1:][part] - time[:-1][part])[:, None]
        t = time[:-1][part, None] + half * (1.0 + nodes)
        f = rotation.rotate(rotation.normalize(attitude(t)), force(t))
        push[part] = half * np.einsum("j,nji->ni", weights, f)
        shift[part] = half * half * np.einsum("j,nji->ni", weights * (1.0 - nodes), f)
    return push, shift


# Long: half of it says what its nine arguments are.
def navigate_by_attitude(
    time: ArrayLike,
    dvel: ArrayLike,
    q_ib: ArrayLike,
    initial: NavState,
    mechanization: Mechanization | None = None,
    *,
    height: ArrayLike | HeightReadings | None = None,
    **options: Unpack[Options],
) -> NavSolution:
    """Navigate by velocity increments and measured attitudes.

    `time` are the edges of N ≥ 5 intervals, (N+1,) s; inertial and Earth-fixed axes coincide at 0. `dvel` are the
    increments in the moving body's axes, (N, 3) m/s, and q_ib the attitudes at the edges, (N+1, 4), which must turn by
    well under half a turn between edges. The attitude of `initial` is not used; `height` is as for `navigate`. The
    attitude of the solution is the measured one, referred to the computed place.
    """
    time, dvel, q_ib, defect = _checked(time, dvel, q_ib)
    count = len(dvel)
    of = chosen(mechanization, options)
    reference, climb = height_reference(of.vertical, height, time)
    body = of.earth

    latitude, longitude, altitude = (np.empty(count + 1) for _ in range(3))
    velocity_ned = np.empty((count + 1, 3))
    latitude[0], longitude[0], altitude[0], velocity_ned[0], _ = checked_initial(initial)
    inertial_longitude = longitude[0] + body.omega * time[0]
    position = earth.geodetic_to_ecef(latitude[0], inertial_longitude, altitude[0], body)
    velocity = rotation.rotate(earth.q_en(latitude[0], inertial_longitude), velocity_ned[0])
    velocity += np.cross([0.0, 0.0, body.omega], position)
    push, shift = _pushes(time, dvel, q_ib)
    _integrate(
        models_of(of), channel_of(of, reference, climb), time, push, shift, position, velocity,
        latitude, longitude, altitude, velocity_ned,
    )  # fmt: skip
    q_in = earth.q_en(latitude, longitude + body.omega * time)
    q_nb = rotation.multiply(rotation.conjugate(q_in), rotation.normalize(q_ib))
    if failure := not_finite_in(altitude, velocity_ned, q_nb):
        name, row = failure
        raise RunError(
            f"the navigation's {name} diverged and is not usable at t = {time[row]:.2f} s: velocity increments "
            f"of up to {np.abs(dvel).max():.3g} m/s in one interval are impossible for a vehicle.",
            time=float(time[row]),
        )
    return NavSolution(time, latitude, longitude, altitude, velocity_ned, q_nb, defect, MEASURED_ATTITUDE)


def _checked(time: ArrayLike, dvel: ArrayLike, q_ib: ArrayLike) -> tuple[Array, Array, Array, Array]:
    """Return the arrays, and the defect of the norm of each attitude, after checking them."""
    time, dvel, q_ib = doubles("time", time), doubles("dvel", dvel), doubles("q_ib", q_ib)
    count = len(dvel)
    if count < 5 or time.shape != (count + 1,) or dvel.shape != (count, 3) or q_ib.shape != (count + 1, 4):
        raise InputError(
            f"navigating by measured attitude: time {time.shape}, dvel {dvel.shape} and q_ib {q_ib.shape} do not "
            "belong together: N ≥ 5 intervals have N+1 edges in time, (N, 3) increments and (N+1, 4) attitudes."
        )
    check_finite("time", time, "s")
    check_finite("dvel", dvel, "m/s", time)
    check_finite("q_ib", q_ib, "")
    check_increasing("time", time)
    defect = np.abs(np.linalg.norm(q_ib, axis=1) - 1.0)
    if not defect.max() < _UNIT:
        row = int(np.argmax(defect))
        raise InputError(f"q_ib[{row}] = {q_ib[row]} at t = {time[row]:.6f} s must be a unit quaternion, scalar first.")
    return time, dvel, q_ib, defect


def navigate_set(
    imu: ImuData,
    attitude: Array | None,
    initial: NavState,
    mechanization: Mechanization,
    height: ArrayLike | HeightReadings | None = None,
) -> NavSolution:
    """Navigate with the readings of a sensor set: by its gyros, or by its measured attitude q_ib if it has one."""
    if attitude is None:
        return navigate(imu, initial, mechanization, height=height)
    return navigate_by_attitude(imu.time, imu.dvel, attitude, initial, mechanization, height=height)
