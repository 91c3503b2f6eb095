"""The data exchanged between the stages: IMU increments, navigation states and solutions, measurements.

Objects that hold arrays have short texts on the console and in notebooks: shapes and spans instead of numbers.
"""

from __future__ import annotations

import dataclasses
import html
import inspect
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from sinssim.errors import shortened

C = TypeVar("C", bound=type)

_FEW, _WIDTH, _LINES = 4, 100, 10
_NAME = re.compile(r"^    ((?:\w+, )*\w+): (.*)$")


def short_repr(kind: C) -> C:
    """Give a dataclass a short `repr`, and a table for notebooks with the meaning of each attribute from its
    docstring."""
    for name, function in (("__repr__", _repr), ("_repr_html_", _html)):
        if name not in vars(kind) or name == "__repr__":
            setattr(kind, name, function)
    return kind


def described(value: Any) -> str:
    """Return a value in a few words: for an array its shape and span, such as "1201 × 3 array, -0.5 … 2"; for a short
    one its numbers."""
    match value:
        case np.ndarray():
            return _array(value)
        case bool() | None:
            return str(value)
        case int() | float() | np.generic():
            return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)
        case str() | Path():
            return shortened(repr(str(value)), 60)
        case Mapping():
            return f"{{{_items([repr(key) for key in value])}}}"
        case tuple() | list():
            if any(dataclasses.is_dataclass(item) or hasattr(type(item), "model_fields") for item in value):
                kinds = sorted({type(item).__name__ for item in value})
                return f"{len(value)} × {' or '.join(kinds)}"
            return f"({_items([described(item) for item in value])})"
    name = type(value).__name__
    plain = inspect.getattr_static(value, "__repr__", None) is object.__repr__
    if dataclasses.is_dataclass(value) or hasattr(type(value), "model_fields") or plain:
        return f"{name}(…)"
    return shortened(repr(value).replace("\n", " "), 60)


def html_table(title: str, rows: Sequence[tuple[str, ...]], heads: tuple[str, ...] = ()) -> str:
    """Return a table for a notebook."""

    def row(cells: tuple[str, ...], tag: str) -> str:
        shown = (f'<{tag} style="text-align: left">{html.escape(cell)}</{tag}>' for cell in cells)
        return f"<tr>{''.join(shown)}</tr>"

    lines = [row(heads, "th")] if heads else []
    return f"<b>{html.escape(title)}</b><table>{''.join([*lines, *(row(item, 'td') for item in rows)])}</table>"


def html_lines(lines: Iterable[str]) -> str:
    """Return lines of text for a notebook, with their columns."""
    return f"<pre>{html.escape(chr(10).join(lines))}</pre>"


def _array(value: Any) -> str:
    if value.ndim <= 1 and value.size <= _FEW:
        return (
            f"[{', '.join(described(item) for item in np.atleast_1d(value).tolist())}]"
            if value.ndim
            else described(value.item())
        )
    shape = " × ".join(map(str, value.shape))
    if value.dtype.kind not in "fiu" or not value.size:
        return f"{shape} array"
    if value.dtype.kind == "f":
        there = value[np.isfinite(value)]
        if not there.size:
            return f"{shape} array, no finite number"
        value = there
    return f"{shape} array, {value.min():.6g} … {value.max():.6g}"


def _items(texts: list[str]) -> str:
    return ", ".join([*texts[:_FEW], *([f"… {len(texts)} in all"] if len(texts) > _FEW else [])])


def _fields(item: Any) -> Iterator[tuple[str, str]]:
    for part in dataclasses.fields(item):
        if part.repr and not part.name.startswith("_"):
            yield part.name, described(getattr(item, part.name))


def _repr(self: Any) -> str:
    text = ", ".join(f"{name}={value}" for name, value in _fields(self))
    lines = textwrap.wrap(f"{type(self).__name__}({text})", _WIDTH, subsequent_indent="    ", break_long_words=False)
    if len(lines) > _LINES:
        lines = [*lines[: _LINES - 1], "    …)"]
    return "\n".join(lines)


def _html(self: Any) -> str:
    meanings = _meanings(type(self))
    return html_table(type(self).__name__, [(name, value, meanings.get(name, "")) for name, value in _fields(self)])


def _meanings(kind: type) -> dict[str, str]:
    """Return what the attributes of a class are, from its docstring."""
    texts: dict[str, str] = {}
    names: list[str] = []
    _, _, attributes = (inspect.getdoc(kind) or "").partition("Attributes:\n")
    for line in attributes.splitlines():
        if match := _NAME.match(line):
            names = match[1].split(", ")
            texts |= dict.fromkeys(names, match[2])
        elif not line.strip():
            break
        else:
            texts |= {name: f"{texts[name]} {line.strip()}" for name in names}
    return texts


Array = NDArray[np.float64]

BLOCK = 16384
"""Rows that are processed together: no temporary is as long as a run, and it stays in the cache of the processor."""


class Rows(Protocol):
    """Rows of numbers: an array, or an object that computes any block of them."""

    def __len__(self) -> int: ...
    def __getitem__(self, rows: slice, /) -> Array: ...


@dataclass(frozen=True)
class Computed:
    """Rows that are computed when they are written or drawn."""

    count: int  # their number
    rows: Callable[[slice], Array]  # returns a block of them

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, rows: slice, /) -> Array:
        return self.rows(rows)


def blocks(count: int) -> Iterator[slice]:
    """Yield rows in blocks; of no rows one empty block."""
    for start in range(0, max(count, 1), BLOCK):
        yield slice(start, min(start + BLOCK, count))


SATURATED, DROPPED, FROZEN = 1, 2, 4
"""Flags of a channel of a sample: limited to its range; not delivered; previous sample delivered again."""


@short_repr
@dataclass(frozen=True)
class ImuData:
    """Inertial increments over consecutive intervals, in the sensor block's forward-right-down axes.

    Attributes:
        time: edges of the intervals, (N+1,) s.
        dtheta: component-wise integral of the inertial angular rate over each interval, (N, 3) rad.
        dvel: component-wise integral of the specific force over each interval, (N, 3) m/s.
        flags: flags of each sample for the three gyros and the three accelerometers, (N, 6): 0 or a sum of SATURATED,
            DROPPED and FROZEN; None for sensors without limits and faults.
    """

    time: Array
    dtheta: Array
    dvel: Array
    flags: NDArray[np.uint8] | None = None

    def __len__(self) -> int:
        return len(self.dtheta)


@short_repr
@dataclass(frozen=True)
class NavState:
    """Position, velocity and attitude of the sensor block, at one time or at many.

    Attributes:
        latitude: geodetic latitude, () or (N,) rad.
        longitude: geodetic longitude, () or (N,) rad.
        height: height above the ellipsoid, () or (N,) m.
        velocity_ned: velocity relative to the Earth, (3,) or (N, 3) m/s.
        q_nb: attitude quaternion, scalar first, v_n = C_nb v_b, (4,) or (N, 4).
    """

    latitude: Array
    longitude: Array
    height: Array
    velocity_ned: Array
    q_nb: Array


@dataclass(frozen=True)
class SingularityEvent:
    """A passage of an attitude algorithm through its singular attitude.

    Attributes:
        start: time at which the algorithm came close to it, s.
        end: time at which it had left it, s.
        damage: rotation angle between the algorithm's attitude after the passage and that of a singularity-free
            algorithm from the same start on the same increments, rad.
        text: one sentence.
    """

    start: float
    end: float
    damage: float
    text: str


@short_repr
@dataclass(frozen=True)
class NavSolution:
    """A navigation solution at the edges of the IMU's intervals; the first row is the initial state.

    Attributes:
        time: (N+1,) s.
        latitude, longitude: (N+1,) rad.
        height: (N+1,) m.
        velocity_ned: (N+1, 3) m/s.
        q_nb: attitude quaternion, unit norm, (N+1, 4).
        defect: defect of the algorithm's own attitude variables: |norm - 1| for a quaternion, the largest element of
            |BᵀB - I| for a direction cosine matrix, 0 for Euler angles, (N+1,).
        algorithm: name of the attitude algorithm.
        events: passages through a singular attitude.
        azimuth: direction of the frame's x axis, clockwise from north, in a frame with its own azimuth, (N+1,)
            rad; None in other frames.
    """

    time: Array
    latitude: Array
    longitude: Array
    height: Array
    velocity_ned: Array
    q_nb: Array
    defect: Array
    algorithm: str = ""
    events: tuple[SingularityEvent, ...] = field(default=())
    azimuth: Array | None = None

    def state(self, index: int = -1) -> NavState:
        """Return the state at one row.

        Args:
            index: row number, the last one by default.

        Returns:
            The state at that row.
        """
        return NavState(
            self.latitude[index],
            self.longitude[index],
            self.height[index],
            self.velocity_ned[index],
            self.q_nb[index],
        )


@short_repr
@dataclass(frozen=True)
class Measurements:
    """Measurements of one aiding sensor: M measurements of one kind.

    | kind | value | sigma |
    |---|---|---|
    | "gnss-position" | latitude, longitude [rad], height [m] of the antenna | north, east, down [m] |
    | "gnss-velocity" | north, east, down [m/s] of the antenna | the same |
    | "baro-height" | height above the ellipsoid [m] | [m] |
    | "zero-velocity" | north, east, down [m/s], zero except for disturbances of the vehicle | the same |
    | "zero-rate" | rate relative to the Earth about the body's axes [rad/s], zero except for disturbances | the same |
    | "heading" | heading of the forward axis [rad] | [rad] |
    | "attitude" | q_nb, scalar first | about the body's axes [rad], three |
    | "earth-attitude" | q_eb, relative to Earth-fixed axes, scalar first | about the body's axes [rad], three |
    | "speed" | velocity along the forward axis, of the point at the lever arm [m/s] | [m/s] |
    | "baseline-heading" | heading of the line between two antennas, whose vector is the lever arm [rad] | [rad] |
    | "land-velocity" | right, down of a vehicle [m/s], zero; pitch and yaw of its axes in the block's [rad] | [m/s] |
    | "airspeed" | magnitude of the velocity through the air, of the point at the lever arm [m/s] | [m/s] |

    Attributes:
        kind: kind of measurement.
        time: times of validity, in order, (M,) s.
        arrival: times of arrival at the filter, not before `time`, (M,) s.
        value: (M, k).
        sigma: 1σ of each component that the filter assumes, (M, k), or (M, 3) for an attitude.
        lever_arm: from the sensor block to the sensor or its antenna, body axes, (3,) m.
        name: name of the sensor, which distinguishes two of one kind; the kind if not given.
        correlation: correlations of the errors of the components, (M, k, k) for the k of sigma; None if there are none.
    """

    kind: str
    time: Array
    arrival: Array
    value: Array
    sigma: Array
    lever_arm: Array = field(default_factory=lambda: np.zeros(3))
    name: str = ""
    correlation: Array | None = None

    def __len__(self) -> int:
        return len(self.time)

    @property
    def label(self) -> str:
        """Name of the sensor, or its kind if it has none."""
        return self.name or self.kind


def rows_of(state: NavState | NavSolution, rows: NDArray[np.intp] | slice | int) -> NavState:
    """Return some rows of states."""
    s = state
    return NavState(s.latitude[rows], s.longitude[rows], s.height[rows], s.velocity_ned[rows], s.q_nb[rows])


def solution_of(time: Array, state: NavState, algorithm: str = "") -> NavSolution:
    """Return a solution from states at some times."""
    s = state
    return NavSolution(time, s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb, np.zeros(len(time)), algorithm)


def measurements_at(measurements: Measurements, rows: NDArray[np.intp] | NDArray[np.bool_]) -> Measurements:
    """Return some of the measurements of a sensor, the same object for all of them."""
    m = measurements
    if rows.dtype == np.bool_ and rows.all():
        return m
    parts = {name: getattr(m, name)[rows] for name in ("time", "arrival", "value", "sigma")}
    return dataclasses.replace(m, **parts, correlation=None if m.correlation is None else m.correlation[rows])
