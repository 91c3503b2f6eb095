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

The integration over an interval is Simpson's rule with cubic Hermite values in the middle; the accelerations at the
ends come from the reading and the one before it.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.earth.kernels import EarthParameters, q_en_k
from sinssim.jit import inline
from sinssim.rotation.kernels import (
    Quaternion,
    Vector,
    cross_k,
    multiply_k,
    quaternion_from_rotation_vector_k,
    rotate_k,
)
from sinssim.sensors.imu.error_kernel import FAULTY, LIMITED, STATES, advance, begin, draw_block, measure
from sinssim.strapdown.frames.azimuth import (
    TRANSVERSE,
    carried_sum_k,
    coriolis_k,
    earth_k,
    into_w_k,
    third_row_k,
    transport_k,
    turned_k,
)
from sinssim.strapdown.frames.vertical import loop_gains_k, vertical_channel_k

_BLOCK = 256  # number of samples whose random numbers are drawn together


@inline
def moving_k(x: float, y: float, z: float, gx: float, gy: float, gz: float, zx: float, zy: float, zz: float) -> Vector:
    """∫a dt in axes that turn by ζ during the interval: x − ζ × (x/2 + g/12) + ½ ζ × (ζ × x)/3.

    x is the integral in the axes of the start, g the change of a·dt over the interval.
    """
    ax, ay, az = cross_k(zx, zy, zz, 0.5 * x + gx / 12.0, 0.5 * y + gy / 12.0, 0.5 * z + gz / 12.0)
    bx, by, bz = cross_k(zx, zy, zz, x, y, z)
    bx, by, bz = cross_k(zx, zy, zz, bx, by, bz)
    return x - ax + bx / 6.0, y - ay + by / 6.0, z - az + bz / 6.0


@inline
def turned_by_k(q: Quaternion, x: float, y: float, z: float) -> Quaternion:
    """q ∘ q(x, y, z)."""
    r0, r1, r2, r3 = quaternion_from_rotation_vector_k(x, y, z)
    return multiply_k(q[0], q[1], q[2], q[3], r0, r1, r2, r3)


# A compiled engine: one loop with its state in scalars. `bind` gives it the form of the radii of curvature.
def simulate(
    time: Array,
    push: Array,
    q_ip: Array,
    torqued: bool,
    torquer: Array,
    active: int,
    conditions: Array,
    parameters: Array,
    key_0: np.uint64,
    key_1: np.uint64,
    kinds: NDArray[np.int64],
    spans: Array,
    amounts: Array,
    p: EarthParameters,
    gravity: int,
    simplified: bool,
    vertical: int,
    height_reference: Array,
    climb_reference: Array,
    time_constant: float,
    rule: int,
    axis: Array,
    latitude: Array,
    longitude: Array,
    height: Array,
    velocity: Array,
    of_x: Array,
    q_wp: Array,
    commanded: Array,
    readings: Array,
    drift: Array,
    flags: NDArray[np.uint8],
) -> None:
    """Run the loop; the first rows of the solution and of q_ip hold the start, q_wp is filled if not torqued.

    Args:
        time: edges, (N+1,) s.
        push: integrals of the specific force, inertial axes, (N, 3) m/s.
        q_ip: attitude of the platform, (N+1, 4), written.
        torqued: whether the platform turns with the frame.
        torquer: κ, (3,).
        active, conditions, parameters, key_0, key_1, kinds, spans, amounts: errors of the sensors, as in `measure_all`.
        p, gravity, simplified, vertical, height_reference, climb_reference, time_constant, rule, axis: the navigator,
            as in `sinssim.strapdown.frames.azimuth`.
        latitude, longitude, height, velocity, of_x: its solution, (N+1,) and (N+1, 3).
        q_wp: attitude of the platform in the frame as the navigator computes it, (N+1, 4); (0, 4) if torqued.
        commanded: commanded rates about the platform's axes, (N, 3) rad/s, written.
        readings: readings of the accelerometers, (N, 3) m/s, written.
        drift: drift of the gyros, (N, 3) rad/s, written.
        flags: flags of the accelerometers, (N, 6), written if the sensors can set any; else (0, 6).
    """
    count = time.shape[0] - 1
    omega = p.omega
    z = np.empty((4, 6, _BLOCK))
    s = np.empty((1, 6, STATES))
    u, y, f = np.zeros(6), np.zeros(6), np.zeros(6, np.uint8)
    begin(active, s, 0, key_0, key_1)

    # --- the frame at the start
    h = height[0]
    e0, e1, e2, e3 = q_en_k(latitude[0], longitude[0])
    azimuth = of_x[0]
    if rule == TRANSVERSE:
        px, py, pz = into_w_k(e0, e1, e2, e3, axis[0], axis[1], axis[2])
        azimuth = atan2(py, px)
    of_x[0] = azimuth
    e0, e1, e2, e3 = multiply_k(e0, e1, e2, e3, cos(0.5 * azimuth), 0.0, 0.0, sin(0.5 * azimuth))
    l0, l1, l2, l3 = 0.0, 0.0, 0.0, 0.0  # rounding errors of the additions to it
    vx = cos(azimuth) * velocity[0, 0] + sin(azimuth) * velocity[0, 1]
    vy = cos(azimuth) * velocity[0, 1] - sin(azimuth) * velocity[0, 0]
    vz = velocity[0, 2]
    kx, ky, kz = third_row_k(e0, e1, e2, e3)
    px, py, pz = 1.0, 0.0, 0.0
    if rule == TRANSVERSE:
        px, py, pz = into_w_k(e0, e1, e2, e3, axis[0], axis[1], axis[2])
    k2, kappa, along, down = earth_k(p, gravity, simplified, kx, ky, kz, h)
    loop1, loop2, loop3 = loop_gains_k(time_constant, down, k2)
    loop_sum = 0.0
    ip = (q_ip[0, 0], q_ip[0, 1], q_ip[0, 2], q_ip[0, 3])
    wp = (1.0, 0.0, 0.0, 0.0)
    if not torqued:
        q_wp[0, 0], q_wp[0, 1], q_wp[0, 2], q_wp[0, 3] = 1.0, 0.0, 0.0, 0.0
    owed_x, owed_y, owed_z = 0.0, 0.0, 0.0
    wx_before, wy_before, wz_before, dt_before = 0.0, 0.0, 0.0, 0.0
    dx_before, dy_before, dz_before = 0.0, 0.0, 0.0
    drift_x, drift_y, drift_z = 0.0, 0.0, 0.0

    for k in range(count):
        dt = time[k + 1] - time[k]

        # --- rates at the start; what is commanded: their extrapolation to the middle, and what the last one missed
        tx0, ty0, tz0 = transport_k(rule, omega, kx, ky, kz, px, pz, k2, kappa, vx, vy)
        gx0, gy0, gz0 = coriolis_k(omega, kx, ky, kz, tx0, ty0, tz0, vx, vy, vz)
        gx0, gy0, gz0 = gx0 + along * kx, gy0 + along * ky, gz0 + down
        wx0, wy0, wz0 = omega * kx + tx0, omega * ky + ty0, omega * kz + tz0
        ahead = 0.5 * dt / dt_before if k > 0 else 0.0
        fx = dt * (wx0 + ahead * (wx0 - wx_before))
        fy = dt * (wy0 + ahead * (wy0 - wy_before))
        fz = dt * (wz0 + ahead * (wz0 - wz_before))
        wx_before, wy_before, wz_before, dt_before = wx0, wy0, wz0, dt
        cx, cy, cz = 0.0, 0.0, 0.0
        if torqued:
            cx, cy, cz = fx + owed_x, fy + owed_y, fz + owed_z
        commanded[k, 0], commanded[k, 1], commanded[k, 2] = cx / dt, cy / dt, cz / dt
        cx, cy, cz = (1.0 + torquer[0]) * cx, (1.0 + torquer[1]) * cy, (1.0 + torquer[2]) * cz

        # --- the platform: its accelerometers, its gyros' drift, its turn
        i0, i1, i2, i3 = ip
        ax, ay, az = rotate_k(i0, -i1, -i2, -i3, push[k, 0], push[k, 1], push[k, 2])
        low, high = max(k - 1, 0), min(k + 1, count - 1)
        half = 1.0 / (high - low) if high > low else 0.0
        bx, by, bz = rotate_k(
            i0, -i1, -i2, -i3,
            half * (push[high, 0] - push[low, 0]), half * (push[high, 1] - push[low, 1]),
            half * (push[high, 2] - push[low, 2]),
        )  # fmt: skip
        u[3], u[4], u[5] = moving_k(ax, ay, az, bx, by, bz, cx - drift_x, cy - drift_y, cz - drift_z)
        if k % _BLOCK == 0:
            draw_block(active, z, k, min(_BLOCK, count - k), key_0, key_1)
        advance(active, conditions, time[k], time[k + 1])
        measure(active, u, y, f, conditions, parameters, s, 0, z, k % _BLOCK, kinds, spans, amounts)
        drift_x, drift_y, drift_z = y[0], y[1], y[2]
        ip = turned_by_k(ip, cx - drift_x, cy - drift_y, cz - drift_z)
        q_ip[k + 1, 0], q_ip[k + 1, 1], q_ip[k + 1, 2], q_ip[k + 1, 3] = ip
        readings[k, 0], readings[k, 1], readings[k, 2] = y[3], y[4], y[5]
        drift[k, 0], drift[k, 1], drift[k, 2] = drift_x / dt, drift_y / dt, drift_z / dt
        if active & (FAULTY | LIMITED):
            for i in range(6):
                flags[k, i] = f[i]

        # --- the readings in the frame
        dx, dy, dz = y[3], y[4], y[5]
        if not torqued:
            dx, dy, dz = rotate_k(wp[0], wp[1], wp[2], wp[3], dx, dy, dz)
            dx, dy, dz = moving_k(dx, dy, dz, 0.0, 0.0, 0.0, fx, fy, fz)
        if k == 0:
            dx_before, dy_before, dz_before = dx, dy, dz
        jx, jy, jz = dx - dx_before, dy - dy_before, dz - dz_before  # change of the acceleration times dt
        dx_before, dy_before, dz_before = dx, dy, dz

        # --- velocity at the end, predicted with Coriolis as at mid-interval, and the Earth there
        vxm, vym, vzm = vx + 0.5 * (dx + dt * gx0), vy + 0.5 * (dy + dt * gy0), vz + 0.5 * (dz + dt * gz0)
        mx, my, mz = transport_k(rule, omega, kx, ky, kz, px, pz, k2, kappa, vxm, vym)
        rx, ry, rz = dt * mx, dt * my, dt * mz
        mx, my, mz = coriolis_k(omega, kx, ky, kz, mx, my, mz, vxm, vym, vzm)
        vx1 = vx + dx + dt * (mx + along * kx)
        vy1 = vy + dy + dt * (my + along * ky)
        vz1 = vz + dz + dt * (mz + down)
        kx1, ky1, kz1 = turned_k(kx, ky, kz, rx, ry, rz)
        px1, _, pz1 = turned_k(px, py, pz, rx, ry, rz)
        h_taken = h - dt * vzm
        k2_1, kappa_1, along_1, down_1 = earth_k(p, gravity, simplified, kx1, ky1, kz1, h_taken)
        tx1, ty1, tz1 = transport_k(rule, omega, kx1, ky1, kz1, px1, pz1, k2_1, kappa_1, vx1, vy1)
        gx1, gy1, gz1 = coriolis_k(omega, kx1, ky1, kz1, tx1, ty1, tz1, vx1, vy1, vz1)
        gx1, gy1, gz1 = gx1 + along_1 * kx1, gy1 + along_1 * ky1, gz1 + down_1

        # --- middle of the interval
        vxm, vym, vzm = 0.5 * (vx + vx1) - 0.125 * jx, 0.5 * (vy + vy1) - 0.125 * jy, 0.5 * (vz + vz1) - 0.125 * jz
        bend_h = 0.125 * dt * (vz - vz1)
        bend_x, bend_y, bend_z = 0.125 * dt * (tx0 - tx1), 0.125 * dt * (ty0 - ty1), 0.125 * dt * (tz0 - tz1)
        kxm, kym, kzm = 0.5 * (kx + kx1), 0.5 * (ky + ky1), 0.5 * (kz + kz1)
        rx, ry, rz = cross_k(bend_x, bend_y, bend_z, kxm, kym, kzm)
        kxm, kym, kzm = kxm - rx, kym - ry, kzm - rz
        pxm, pzm = 0.5 * (px + px1), 0.5 * (pz + pz1)
        k2m, kappam = 0.5 * (k2 + k2_1) + k2_1 * k2_1 * bend_h, 0.5 * (kappa + kappa_1)
        along_m, down_m = 0.5 * (along + along_1), 0.5 * (down + down_1) + 2.0 * down_1 * k2_1 * bend_h
        txm, tym, tzm = transport_k(rule, omega, kxm, kym, kzm, pxm, pzm, k2m, kappam, vxm, vym)
        gxm, gym, gzm = coriolis_k(omega, kxm, kym, kzm, txm, tym, tzm, vxm, vym, vzm)
        gxm, gym, gzm = gxm + along_m * kxm, gym + along_m * kym, gzm + down_m

        # --- velocity, position and frame at the end
        sixth = dt / 6.0
        vx1 = vx + dx + sixth * (gx0 + 4.0 * gxm + gx1)
        vy1 = vy + dy + sixth * (gy0 + 4.0 * gym + gy1)
        vz1 = vz + dz + sixth * (gz0 + 4.0 * gzm + gz1)
        h1 = h - sixth * (vz + 4.0 * vzm + vz1)
        rx, ry, rz = sixth * (tx0 + 4.0 * txm + tx1), sixth * (ty0 + 4.0 * tym + ty1), sixth * (tz0 + 4.0 * tzm + tz1)
        r0, r1, r2, r3 = quaternion_from_rotation_vector_k(rx, ry, rz)
        # e + e ∘ (r − 1): a step is ten million times smaller than e and would lose half its digits
        d0, d1, d2, d3 = multiply_k(e0, e1, e2, e3, -(r1 * r1 + r2 * r2 + r3 * r3) / (1.0 + r0), r1, r2, r3)
        e0, l0 = carried_sum_k(e0, l0, d0)
        e1, l1 = carried_sum_k(e1, l1, d1)
        e2, l2 = carried_sum_k(e2, l2, d2)
        e3, l3 = carried_sum_k(e3, l3, d3)
        h1, vz1, loop_sum = vertical_channel_k(
            vertical, dt, loop1, loop2, loop3, loop_sum, h, h1, vz1, height_reference, climb_reference, k
        )

        # --- what the command missed; or the platform in the turned frame
        zx = rx + sixth * omega * (kx + 4.0 * kxm + kx1)
        zy = ry + sixth * omega * (ky + 4.0 * kym + ky1)
        zz = rz + sixth * omega * (kz + 4.0 * kzm + kz1)
        if torqued:
            owed_x, owed_y, owed_z = zx - fx, zy - fy, zz - fz
        else:
            r0, r1, r2, r3 = quaternion_from_rotation_vector_k(-zx, -zy, -zz)
            wp = multiply_k(r0, r1, r2, r3, wp[0], wp[1], wp[2], wp[3])
            q_wp[k + 1, 0], q_wp[k + 1, 1], q_wp[k + 1, 2], q_wp[k + 1, 3] = wp

        vx, vy, vz, h = vx1, vy1, vz1, h1
        kx, ky, kz = third_row_k(e0, e1, e2, e3)
        if rule == TRANSVERSE:
            px, py, pz = into_w_k(e0, e1, e2, e3, axis[0], axis[1], axis[2])
        moved_h = h1 - h_taken
        k2, kappa = k2_1 - k2_1 * k2_1 * moved_h, kappa_1
        along, down = along_1, down_1 - 2.0 * down_1 * k2_1 * moved_h

        # --- output relative to geodetic north
        azimuth = -atan2(ky, kx)
        of_x[k + 1] = azimuth
        latitude[k + 1] = atan2(-kz, sqrt(kx * kx + ky * ky))
        longitude[k + 1] = atan2(-2.0 * (e2 * e3 - e0 * e1), -2.0 * (e1 * e3 + e0 * e2))
        height[k + 1] = h
        ca, sa = cos(azimuth), sin(azimuth)
        velocity[k + 1, 0], velocity[k + 1, 1], velocity[k + 1, 2] = ca * vx - sa * vy, sa * vx + ca * vy, vz
