#!/usr/bin/env python3
"""A textbook navigator in Python for the protocol of sinssim: north-pointing, one sample a step, without a filter."""

import math
import struct
import sys

read, write = sys.stdin.buffer.read, sys.stdout.buffer.write


def turned(q, x, y, z):
    """Return the quaternion q times that of the rotation vector (x, y, z)."""
    angle = math.sqrt(x * x + y * y + z * z)
    s = 0.5 if angle < 1e-8 else math.sin(0.5 * angle) / angle
    w, x, y, z = math.cos(0.5 * angle), s * x, s * y, s * z
    a, b, c, d = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def resolved(q, x, y, z):
    """Return a vector of the body in the axes north, east, down."""
    a, b, c, d = q
    u, v, w = 2 * (c * z - d * y), 2 * (d * x - b * z), 2 * (b * y - c * x)
    return x + a * u + c * w - d * v, y + a * v + d * u - b * w, z + a * w + b * v - c * u


def step(state, dt, gyro, accel):
    """Return the state after one sample."""
    lat, lon, h, vn, ve, vd, *q = state
    sine = math.sin(lat)
    root = math.sqrt(1 - E2 * sine * sine)
    rn, rm = A / root + h, A * (1 - E2) / root**3 + h
    turn = OMEGA * math.cos(lat), 0.0, -OMEGA * sine
    rate = turn[0] + ve / rn, -vn / rm, turn[2] - ve * math.tan(lat) / rn
    (gx, gy, gz), (ax, ay, az) = gyro, accel
    f = resolved(q, ax + 0.5 * (gy * az - gz * ay), ay + 0.5 * (gz * ax - gx * az), az + 0.5 * (gx * ay - gy * ax))
    g = GE * (1 + K * sine * sine) / root * (1 - 2 * h / A * (1 + F + M - 2 * F * sine**2) + 3 * (h / A) ** 2)
    wx, wy, wz = rate[0] + turn[0], rate[1], rate[2] + turn[2]
    new = (
        vn + f[0] - (wy * vd - wz * ve) * dt,
        ve + f[1] - (wz * vn - wx * vd) * dt,
        vd + f[2] - (wx * ve - wy * vn - g) * dt,
    )
    lat += 0.5 * (vn + new[0]) / rm * dt
    lon += 0.5 * (ve + new[1]) / (rn * math.cos(lat)) * dt
    h -= 0.5 * (vd + new[2]) * dt
    q = turned(q, gx, gy, gz)
    b, c, d = resolved((q[0], -q[1], -q[2], -q[3]), *rate)  # the turn of north, east, down in axes of the body
    return (lat, lon, h, *new, *turned(q, -b * dt, -c * dt, -d * dt))


assert struct.unpack("<8sII", read(16))[:2] == (b"SINSSIM\0", 1), "another version of the protocol"
write(struct.pack("<8sII", b"SINSSIM\0", 1, 0))
while True:
    kind, index, size = struct.unpack("<HHI", read(8))
    data = read(size)
    if kind == 1:  # the beginning: see the page for all its numbers
        numbers = struct.unpack_from("<62d", data)
        state = numbers[2:12]
        A, F, GM, OMEGA, GE, K = numbers[56:62]
        E2, M = F * (2 - F), OMEGA**2 * A**3 * (1 - F) / GM
    elif kind == 3:  # a sample
        time, dt, *readings = struct.unpack("<8d", data)
        state = step(state, dt, readings[:3], readings[3:])
        write(struct.pack("<HHI11d", 6, 0, 88, time, *state))
        sys.stdout.flush()
    elif kind == 5:
        break
