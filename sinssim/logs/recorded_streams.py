"""What a file of recorded sensors holds, in SI units and on one clock: the common form of every format.

A reader (`sinssim.logs.formats`) changes units and names, and nothing else: it keeps the axes of the unit, and it keeps
readings that are doubtful. What the data are worth is judged afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import printable

ClockKind = Literal["gps", "utc", "machine"]
HeightDatum = Literal["ellipsoid", "mean sea level", "unknown"]


@dataclass(frozen=True)
class Clock:
    """The clock of a file's times.

    Attributes:
        kind: "gps" for GPS time; "utc" for UTC, whose leap seconds the reader has removed, so that its times are GPS
            time, too; "machine" for a clock of the logger, with an unknown offset.
        origin_gps_s: GPS time of the time 0 of the file's streams, whole seconds since 1980-01-06 00:00:00 GPST; None
            if it is unknown: seconds of a week or of a day without the week or the day, or since a machine's start. A
            machine's clock that gives dates has one, as good as that clock.
        note: one sentence on what the file gives, for example "seconds of the GPS week 2374".
    """

    kind: ClockKind
    origin_gps_s: int | None = None
    note: str = ""


@dataclass(frozen=True)
class InertialStream:
    """Readings of gyros and accelerometers, in the unit's own axes.

    Attributes:
        time: stamps, (N,) s.
        gyro: (N, 3), rad/s, or rad for increments.
        accel: specific force, which points up at rest, (N, 3), m/s², or m/s for increments.
        kind: whether the numbers are instantaneous (or averaged) rates, or integrals over an interval.
        interval: lengths of the integration intervals that end at the stamps, (N, 2) s for gyros and accelerometers;
            None if the file does not give them.
        axes: directions of x, y and z if the format defines them, for example ("forward", "right", "down"); None if it
            leaves them to the user.
    """

    time: Array
    gyro: Array
    accel: Array
    kind: Literal["rates", "increments"] = "rates"
    interval: Array | None = None
    axes: tuple[str, str, str] | None = None

    def __len__(self) -> int:
        return len(self.time)


NO_FIX = ("no fix", "none")
"""Words of formats for codes with which a receiver says that it has no position."""


@dataclass(frozen=True)
class FixStream:
    """Fixes of a satellite receiver, at its antenna. A missing number is NaN.

    Attributes:
        time: instants of validity as the file states them, (M,) s.
        latitude, longitude: (M,) rad.
        height: (M,) m.
        datum: what the heights refer to.
        position_sigma: north, east, down, (M, 3) m; None if not given.
        velocity_ned: (M, 3) m/s; None if not given.
        velocity_sigma: (M, 3) m/s; None if not given.
        quality: the receiver's code of quality, (M,); None if not given.
        quality_words: meaning of each code, for example {1: "fixed", 2: "float"}.
        heading: of two antennas, (M,) rad; None if not given.
        heading_sigma: (M,) rad; None if not given.
        covariance: whole covariance of north, east, down, (M, 3, 3) m²; None if not given.
    """

    time: Array
    latitude: Array
    longitude: Array
    height: Array
    datum: HeightDatum = "unknown"
    position_sigma: Array | None = None
    velocity_ned: Array | None = None
    velocity_sigma: Array | None = None
    quality: NDArray[np.int64] | None = None
    quality_words: dict[int, str] = field(default_factory=dict)
    heading: Array | None = None
    heading_sigma: Array | None = None
    covariance: Array | None = None

    def __len__(self) -> int:
        return len(self.time)

    @property
    def has_fix(self) -> NDArray[np.bool_]:
        """Whether the receiver had a fix, by its code of quality, (M,)."""
        without = [code for code, word in self.quality_words.items() if word in NO_FIX]
        return np.ones(len(self), dtype=bool) if self.quality is None else ~np.isin(self.quality, without)

    def rows(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> FixStream:
        """Return some of the fixes, by their numbers or by a mask."""
        arrays: dict[str, Any] = {
            f.name: getattr(self, f.name)[rows] for f in fields(self) if isinstance(getattr(self, f.name), np.ndarray)
        }
        return replace(self, **arrays)


@dataclass(frozen=True)
class SolutionStream:
    """A navigation solution of any program: a reference, or a solution to be judged. A missing number is NaN.

    Attributes:
        time: (M,) s.
        latitude, longitude: (M,) rad.
        height: (M,) m.
        datum: what the heights refer to.
        velocity_ned: (M, 3) m/s; None if not given.
        q_nb: attitude quaternion, scalar first, v_n = C_nb v_b, body forward-right-down, (M, 4); None if not given.
        position_sigma: north, east, down, (M, 3) m; None if not given.
        velocity_sigma: (M, 3) m/s; None if not given.
        attitude_sigma: roll, pitch, heading, (M, 3) rad; None if not given.
        local_enu: position along east, north, up from an origin that the file does not give, (M, 3) m; then latitude,
            longitude and height are NaN, and velocity and attitude are in the level of that origin. None
            for a position on the Earth.
    """

    time: Array
    latitude: Array
    longitude: Array
    height: Array
    datum: HeightDatum = "unknown"
    velocity_ned: Array | None = None
    q_nb: Array | None = None
    position_sigma: Array | None = None
    velocity_sigma: Array | None = None
    attitude_sigma: Array | None = None
    local_enu: Array | None = None

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True)
class OtherStream:
    """Readings of another aiding sensor.

    Attributes:
        name: name in the file, for example "vehicle_air_data".
        kind: kind of measurement of `sinssim.data.Measurements`: "baro-height", "heading", "speed", "airspeed".
        time: (M,) s.
        value: (M, k), units as in `Measurements`.
        sigma: (M, k); None if not given.
    """

    name: str
    kind: str
    time: Array
    value: Array
    sigma: Array | None = None

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True)
class Streams:
    """The streams of one file.

    Attributes:
        path: the file.
        format: name of the format, see `sinssim.logs.formats.registry`.
        clock: the clock of all its times.
        inertial: readings of gyros and accelerometers by name; most files have one, named "imu".
        fixes: fixes by name; most files have one, named "gnss".
        solutions: solutions by name; most files have one, named "solution".
        others: readings of other sensors.
        notes: sentences on what the reader found and did, for example rows that it left out.
    """

    path: Path
    format: str
    clock: Clock
    inertial: dict[str, InertialStream] = field(default_factory=dict)
    fixes: dict[str, FixStream] = field(default_factory=dict)
    solutions: dict[str, SolutionStream] = field(default_factory=dict)
    others: tuple[OtherStream, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "notes", tuple(map(printable, self.notes)))
