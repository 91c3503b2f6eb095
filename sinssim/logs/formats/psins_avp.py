"""Solution or fixes of PSINS (Gongmin Yan), .avp: attitude, velocity, position, time; east-north-up axes.

Comments begin with %, the first one names PSINS and AVP. Columns: latitude, longitude [°], height [m] (4 or 5 columns);
before them velocity east, north, up [m/s] (7 or 8); before these pitch, roll, yaw [°] (10 or 11); a tag before the time
where their number is 5, 8 or 11; the time [s] is the last. Yaw is counter-clockwise from north. Layout:
base/io/avpfile.m of PSINS.
"""

from __future__ import annotations

from pathlib import Path

from sinssim import rotation
from sinssim.logs.local_level import swapped
from sinssim.logs.recorded_streams import Clock, SolutionStream, Streams
from sinssim.logs.text.numeric_columns import check_finite, read_numbers
from sinssim.units import DEG

WIDTHS = (4, 5, 7, 8, 10, 11)


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first line names PSINS and AVP."""
    first = head.split(b"\n", 1)[0]
    return first.lstrip().startswith(b"%") and b"PSINS" in first and b"AVP" in first


def read(path: Path) -> Streams:
    """Read the solution."""
    notes: list[str] = []
    rows = read_numbers(path, WIDTHS, notes)
    check_finite(path, rows, "number")
    tagged = rows.shape[1] in (5, 8, 11)
    parts = rows[:, : rows.shape[1] - 1 - tagged]
    position = parts[:, -3:]
    velocity = swapped(parts[:, -6:-3]) if parts.shape[1] >= 6 else None
    q_nb = None
    if parts.shape[1] == 9:
        pitch, roll, yaw = (parts[:, :3] * DEG).T
        q_nb = rotation.quaternion_from_euler(roll, pitch, -yaw)
    stream = SolutionStream(
        rows[:, -1], position[:, 0] * DEG, position[:, 1] * DEG, position[:, 2], "ellipsoid", velocity, q_nb
    )
    clock = Clock("machine", None, "seconds of the program's own clock")
    return Streams(path, "psins-avp", clock, solutions={"solution": stream}, notes=tuple(notes))
