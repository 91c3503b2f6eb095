"""CHC inertial receivers (CGI-410, CGI-610): $GPCHC sentences with gyros, accelerometers and the solution.

Week, seconds, heading, pitch, roll [°], gyros x, y, z [°/s], accelerometers x, y, z [g], latitude, longitude [°],
height [m], velocity east, north, up, speed [m/s], satellites, status, age, warning. Axes right, forward, up. Layout:
CHC protocol "GPCHC" of the CGI-610 user guide.
"""

from __future__ import annotations

import math
from functools import reduce
from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.errors import InputError
from sinssim.logs.gps_time import WEEK
from sinssim.logs.recorded_streams import Clock, InertialStream, SolutionStream, Streams
from sinssim.system.user_file import read_text
from sinssim.units import DEG, G0

_ADDRESSES = ("$GPCHC", "$GICHC")
_FIELDS = 18
"""Numbers of a sentence that are used: from the week to the speed."""


def recognises(path: Path, head: bytes) -> bool:
    """Return whether one of the first lines is such a sentence."""
    return any(line[:6].decode("latin-1") in _ADDRESSES for line in head.splitlines()[:20])


def read(path: Path) -> Streams:
    """Read the readings and the solution."""
    rows: list[list[float]] = []
    damaged: list[int] = []
    for number, line in enumerate(read_text(path, encoding="latin-1").splitlines(), start=1):
        body, star, check = line.strip().partition("*")
        if body[:6] not in _ADDRESSES:
            continue
        try:
            if star and reduce(lambda a, b: a ^ b, body[1:].encode("latin-1")) != int(check[:2], 16):
                raise ValueError("checksum")
            values = [float(field) for field in body.split(",")[1 : _FIELDS + 1]]
            if len(values) < _FIELDS or not all(map(math.isfinite, values)):
                raise ValueError("fields")
            rows.append(values)
        except ValueError:
            damaged.append(number)
    if len(rows) < 2:
        raise InputError(f"{path} has {len(rows)} undamaged GPCHC sentences; at least two are needed.")
    r = np.array(rows)
    week = int(r[:, 0].min())
    time = (r[:, 0] - week) * WEEK + r[:, 1]
    axes = "right", "forward", "up"
    imu = InertialStream(time, r[:, 5:8] * DEG, r[:, 8:11] * G0, axes=axes)
    solved = (r[:, 11] != 0.0) | (r[:, 12] != 0.0)
    s = r[solved]
    solutions = {}
    if len(s):
        q_nb = rotation.quaternion_from_euler(s[:, 4] * DEG, s[:, 3] * DEG, s[:, 2] * DEG)
        velocity = s[:, (15, 14, 16)] * (1.0, 1.0, -1.0)
        solutions["solution"] = SolutionStream(
            time[solved], s[:, 11] * DEG, s[:, 12] * DEG, s[:, 13], velocity_ned=velocity, q_nb=q_nb
        )
    notes = (f"{len(damaged)} damaged sentences were left out, the first in line {damaged[0]}.",) if damaged else ()
    clock = Clock("gps", week * WEEK if week else None, f"seconds of the GPS week {week}")
    return Streams(path, "chc", clock, {"imu": imu}, {}, solutions, notes=notes)
