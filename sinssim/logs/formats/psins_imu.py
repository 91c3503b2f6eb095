"""IMU file of PSINS (Gongmin Yan), .imu: integer counts of angle and velocity, right-front-up axes.

Comments begin with %, the first one names PSINS and SIMU. Three rows of data follow: initial pitch, roll, yaw [°] and
velocity east, north, up; latitude, longitude [°], height, time t0 [s], sampling interval [ms], g [m/s²]; scale factors
of the gyros [arcsec] and accelerometers [µg s]. Then one row of counts for each sample, with the deviation of its time
[µs] in a seventh column where the rate varies. Layout: base/io/imufile.m of PSINS. (Its header calls the seventh column
milliseconds; its code reads microseconds, and so does this reader.)
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim.errors import InputError
from sinssim.logs.recorded_streams import Clock, InertialStream, Streams
from sinssim.logs.text.numeric_columns import check_finite, read_numbers
from sinssim.units import ARCSEC


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first line names PSINS and SIMU."""
    first = head.split(b"\n", 1)[0]
    return first.lstrip().startswith(b"%") and b"PSINS" in first and b"SIMU" in first


def read(path: Path) -> Streams:
    """Read the increments."""
    notes: list[str] = []
    rows = read_numbers(path, (6, 7), notes)
    if len(rows) < 4:
        raise InputError(f"{path} has {len(rows)} rows; three rows of the header and at least one sample are needed.")
    check_finite(path, rows, "number")
    t0, interval, g = rows[1, 3], rows[1, 4] * 1e-3, rows[1, 5]
    if not 0.0 < interval <= 10.0:
        raise InputError(f"{path}, row 2: the sampling interval is {rows[1, 4]:g} ms; between 0 and 10000 is needed.")
    if not 9.0 < g < 11.0:
        raise InputError(f"{path}, row 2: g is {g:g} m/s²; a value near 9.8 is needed.")
    scale = rows[2, :6] * np.array([ARCSEC] * 3 + [1e-6 * g] * 3)
    if (scale == 0.0).any():
        raise InputError(f"{path}, row 3: a scale factor is 0.")
    counts = rows[3:]
    time = t0 + interval * np.arange(1, len(counts) + 1)
    if rows.shape[1] == 7:
        time += 1e-6 * np.cumsum(counts[:, 6])
    values = counts[:, :6] * scale
    stream = InertialStream(time, values[:, :3], values[:, 3:], "increments", axes=("right", "forward", "up"))
    place = f"latitude {rows[1, 0]:.6f}°, longitude {rows[1, 1]:.6f}°, height {rows[1, 2]:.1f} m"
    angles = f"pitch {rows[0, 0]:g}°, roll {rows[0, 1]:g}°, yaw {rows[0, 2]:g}° (counter-clockwise from north)"
    note = f"The header gives the start: {place}, {angles}; it may be inaccurate."
    clock = Clock("machine", None, f"seconds from {t0:g} s, the time of the header")
    return Streams(path, "psins-imu", clock, inertial={"imu": stream}, notes=(note, *notes))
