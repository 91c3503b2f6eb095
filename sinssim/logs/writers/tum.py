"""TUM trajectory: Unix time [s], position east, north, up [m] from the true start, quaternion x, y, z, w."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim.errors import InputError
from sinssim.logs.gps_time import unix_from_gps
from sinssim.logs.text.numeric_columns import columns_of, write_columns
from sinssim.logs.writers.local import LOCAL, origin_words, pose
from sinssim.logs.writers.run_export import Content

SUFFIX = ".tum"
HOLDS = "solution"


def write(content: Content, place: Path) -> list[str]:
    """Write the file.

    Raises:
        InputError: the stream has no attitude.
    """
    if content.solution.q_nb is None:
        raise InputError(f"TUM has an attitude in every row; {content.solution_name} has none.")
    position, q = pose(content)
    seconds, ns = content.stamps(content.solution.time)
    unix = unix_from_gps(seconds.astype(np.float64)).astype(np.int64)
    stamps = [f"{s}.{part:09d}" for s, part in zip(unix.tolist(), ns.tolist(), strict=True)]
    header = f"# timestamp tx ty tz qx qy qz qw\n# {origin_words(content)}\n"
    write_columns(place, [stamps, *columns_of(position, q[:, (1, 2, 3, 0)])], header=header)
    return [f"{content.solution_name}: Unix time, position, quaternion.", LOCAL, origin_words(content)]
