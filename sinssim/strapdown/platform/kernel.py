"""The closed loop of platform and navigator, interval by interval.

The platform p turns in inertial space at the rate at which its gyros are torqued, and with their drift d:

    ω_ip = (1 + κ) ω_commanded − d,     readings of the accelerometers   Δv = ∫C_pi f dt + errors

The navigator takes the platform's axes for those of its frame w (a frame of `sinssim.strapdown.frames.azimuth`) and
integrates

    v̇ = f + g − (2ω_ie + ω_ew) × v,     position from ω_ew,     ω_commanded = ω_ie + ω_ew

so that the platform turns with what the navigator computes from the platform's own readings: the loop is closed. The
level frame is the transverse one whose pole is the Earth's: ω_z = ω_x k_z/k_x = −v_E tan φ/(R₂+h) + … keeps x to the
north.

Nothing is known before it is read. The rate commanded during an interval is extrapolated from the computed rates at its
beginning and at that of the interval before; what the interval's own integral ∫ω dt then turns out to differ by is
commanded in the next one. The platform therefore follows the frame to some 1e-10 rad at 100 Hz, and without growth.

A platform that is not torqued keeps its direction in inertial space. The navigator then resolves the readings by the
attitude q_wp that it computes from its own ω_ie + ω_ew.

The step over an interval is that of the frame, `step_azimuth_k`, with increments in axes that turn with it; the
specific force at the ends comes from the reading and the one before it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.jit import inline
from sinssim.rotation.kernels import Quaternion, Vector, multiply_k, quaternion_from_rotation_vector_k, rotate_k
from sinssim.rotation.vectors import add, along, cross, mul, simpson, sub
from sinssim.sensors.imu.error_kernel import FAULTY, LIMITED, STATES, advance, begin, draw_block, measure
from sinssim.strapdown.frames.azimuth import north_k, rates_k, start_azimuth_k, step_azimuth_k
from sinssim.strapdown.frames.problem import Models, Rows
from sinssim.strapdown.frames.vertical import Channel, loop_gains_k, reference_k, start_loop_k

_BLOCK = 256  # number of samples whose random numbers are drawn together
_ZERO = (0.0, 0.0, 0.0)


class Sensors(NamedTuple):
    """Errors of the gyros and accelerometers, as in `measure_all`."""

    active: int
    conditions: Array
    parameters: Array
    key_0: np.uint64
    key_1: np.uint64
    kinds: NDArray[np.int64]
    spans: Array
    amounts: Array


class Platform(NamedTuple):
    """The platform; N intervals. The first rows of q_ip and q_wp hold the start, all other rows are written.

    push: integrals of the specific force, inertial axes, (N, 3) m/s; not written.
    torqued: whether the platform turns with the frame.
    torquer: κ, (3,).
    q_ip: attitude, (N+1, 4).
    q_wp: attitude in the frame as the navigator computes it, (N+1, 4); (0, 4) if torqued.
    commanded: commanded rates about the platform's axes, (N, 3) rad/s.
    readings: readings of the accelerometers, (N, 3) m/s.
    drift: drift of the gyros, (N, 3) rad/s.
    flags: flags of the accelerometers, (N, 6), if the sensors can set any; else (0, 6).
    """

    push: Array
    torqued: bool
    torquer: Array
    q_ip: Array
    q_wp: Array
    commanded: Array
    readings: Array
    drift: Array
    flags: NDArray[np.uint8]


@inline
def moving_k(x: Vector, g: Vector, z: Vector) -> Vector:
    """∫a dt in axes that turn by ζ during the interval: x − ζ × (x/2 + g/12) + ½ ζ × (ζ × x)/3.

    x is the integral in the axes of the start, g the change of a·dt over the interval.
    """
    return along(sub(x, cross(z, along(mul(0.5, x), 1.0 / 12.0, g))), 1.0 / 6.0, cross(z, cross(z, x)))


@inline
def _felt_k(push: Array, k: int, q: Quaternion, turn: Vector) -> Vector:
    """What the accelerometers of a platform at q_ip, which turns during interval k, integrate."""
    low, high = max(k - 1, 0), min(k + 1, push.shape[0] - 1)
    half = 1.0 / (high - low) if high > low else 0.0
    x = rotate_k(q[0], -q[1], -q[2], -q[3], push[k, 0], push[k, 1], push[k, 2])
    change = push[high, 0] - push[low, 0], push[high, 1] - push[low, 1], push[high, 2] - push[low, 2]
    return moving_k(x, mul(half, rotate_k(q[0], -q[1], -q[2], -q[3], *change)), turn)


@inline
def _keep_k(out: Array, k: int, a: Vector) -> None:
    """Store a vector as row k."""
    out[k, 0], out[k, 1], out[k, 2] = a


# `bind` gives it the form of the radii of curvature.
def simulate(
    time: Array, of: Models, channel: Channel, rows: Rows, rule: int, axis: Array, of_x: Array, sensors: Sensors,
    platform: Platform,
) -> None:  # fmt: skip
    """Run the loop.

    Args:
        time: edges, (N+1,) s.
        of, channel, rows, rule, axis, of_x: the navigator, as in `sinssim.strapdown.frames.azimuth`; attitude and
            defect are not written.
    """
    c, p, count = sensors, platform, time.shape[0] - 1
    z, s = np.empty((4, 6, _BLOCK)), np.empty((1, 6, STATES))
    u, y, f = np.zeros(6), np.zeros(6), np.zeros(6, np.uint8)
    begin(c.active, s, 0, c.key_0, c.key_1)
    x, of_x[0], _, _ = start_azimuth_k(of, rule, axis, of_x[0], rows, start_loop_k(channel, rows.height[0]))
    gains = loop_gains_k(channel.time_constant, x.x.down, x.x.k2)
    ip = (p.q_ip[0, 0], p.q_ip[0, 1], p.q_ip[0, 2], p.q_ip[0, 3])
    wp = (1.0, 0.0, 0.0, 0.0)
    if not p.torqued:
        p.q_wp[0, 0], p.q_wp[0, 1], p.q_wp[0, 2], p.q_wp[0, 3] = wp
    owed, drift, d_before, w_before, dt_before = _ZERO, _ZERO, _ZERO, _ZERO, 1.0
    for k in range(count):
        dt = time[k + 1] - time[k]
        # what is commanded: the frame's rate, extrapolated to mid-interval, and what the last command missed
        _, _, w = rates_k(rule, of.earth.omega, x.x, x.v)
        expected = mul(dt, along(w, 0.5 * dt / dt_before if k > 0 else 0.0, sub(w, w_before)))
        command = add(expected, owed) if p.torqued else _ZERO
        w_before, dt_before = w, dt
        _keep_k(p.commanded, k, mul(1.0 / dt, command))
        turn = (1.0 + p.torquer[0]) * command[0], (1.0 + p.torquer[1]) * command[1], (1.0 + p.torquer[2]) * command[2]
        # the platform: its accelerometers, its gyros' drift, its turn
        u[3], u[4], u[5] = _felt_k(p.push, k, ip, sub(turn, drift))
        if k % _BLOCK == 0:
            draw_block(c.active, z, k, min(_BLOCK, count - k), c.key_0, c.key_1)
        advance(c.active, c.conditions, time[k], time[k + 1])
        measure(
            c.active, u, y, f, c.conditions, c.parameters, s, 0, z, k % _BLOCK, c.kinds, c.spans, c.amounts
        )  # fmt: skip
        drift, d = (y[0], y[1], y[2]), (y[3], y[4], y[5])
        ip = multiply_k(*ip, *quaternion_from_rotation_vector_k(*sub(turn, drift)))
        p.q_ip[k + 1, 0], p.q_ip[k + 1, 1], p.q_ip[k + 1, 2], p.q_ip[k + 1, 3] = ip
        _keep_k(p.readings, k, d)
        _keep_k(p.drift, k, mul(1.0 / dt, drift))
        if c.active & (FAULTY | LIMITED):
            p.flags[k] = f
        # the readings in the frame, its step, and what the command missed; or the platform in the turned frame
        if not p.torqued:
            d = moving_k(rotate_k(*wp, *d), _ZERO, expected)
        change = sub(d, d_before) if k > 0 else _ZERO  # of the acceleration times dt
        d_before = d
        x, rate = step_azimuth_k(
            of, rule, axis, False, channel.number, gains, dt, reference_k(channel, k + 1),
            (d, along(d, -0.5, change), along(d, 0.5, change)), x,
        )  # fmt: skip
        turn = simpson(*rate)
        owed = sub(turn, expected)
        if not p.torqued:
            wp = multiply_k(*quaternion_from_rotation_vector_k(*mul(-1.0, turn)), *wp)
            p.q_wp[k + 1, 0], p.q_wp[k + 1, 1], p.q_wp[k + 1, 2], p.q_wp[k + 1, 3] = wp
        rows.latitude[k + 1], rows.longitude[k + 1], v, of_x[k + 1], _, _ = north_k(x)
        rows.height[k + 1] = x.x.h
        _keep_k(rows.velocity, k + 1, v)
