"""Checks of the arguments of public functions: numbers, arrays, increments of an IMU, times and initial states.

Arrays are returned as doubles, contiguous and writeable, because a kernel is compiled anew for every other kind of
array.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Iterable
from typing import Any

import numpy as np

from sinssim.data import Array, ImuData, NavState
from sinssim.errors import InputError, check_name, shortened

_AXES = 32  # numpy broadcasts no more
_CONTIGUOUS, _WRITEABLE, _BROADCAST = 0x1, 0x400, 1 << 31
# NPY_ARRAY_C_CONTIGUOUS, NPY_ARRAY_WRITEABLE and NPY_ARRAY_WARN_ON_WRITE of numpy's C interface
_DOUBLE = np.dtype(np.float64)


def numbers(name: str, values: Any) -> Array:
    """Return an argument as a contiguous writeable array of doubles; one that is such an array is returned itself."""
    if (  # by far the most frequent case
        type(values) is np.ndarray
        and values.dtype is _DOUBLE
        and values.ndim <= _AXES
        and values.flags.num & (_CONTIGUOUS | _WRITEABLE | _BROADCAST) == _CONTIGUOUS | _WRITEABLE
    ):
        return values
    masked = sys.modules.get("numpy.ma")  # nothing is masked before it is loaded
    if masked is not None and isinstance(values, masked.MaskedArray):
        if masked.is_masked(values):
            raise InputError(f"{name} is a masked array with values masked out; fill them or leave them out.")
        values = values.data
    try:
        if masked is not None and isinstance(values, list | tuple) and any(v is masked.masked for v in values):
            raise TypeError("a value is masked out")
        array = np.asarray(values)
        if array.dtype.kind not in "iufO":
            what = {"b": "true and false", "c": "complex numbers", "U": "text", "S": "text", "V": "records"}
            raise TypeError(f"it holds {what.get(array.dtype.kind, 'dates or times')}")
        # numpy would convert None to NaN, and "1" to a number
        if array.dtype.kind == "O" and any(value is None or isinstance(value, str | bytes) for value in array.flat):
            raise TypeError("a value is None or text")
        array = np.asarray(array, dtype=np.float64, order="C")
        if array.ndim > _AXES:
            raise ValueError(f"it has {array.ndim} axes, more than {_AXES}")
    except (TypeError, ValueError, OverflowError) as error:
        shown = f" = {shortened(repr(values), 40)}" if values is None or isinstance(values, str) else ""
        raise InputError(f"{name}{shown} is not an array of numbers: {shortened(str(error))}.") from error
    # by the number of the flags, because numpy warns if the flag of a view from broadcast_arrays is read by name
    return array if array.flags.num & (_WRITEABLE | _BROADCAST) == _WRITEABLE else array.copy()


def doubles(name: str, values: Any) -> Array:
    """Convert an argument to an array of doubles with at least one axis; otherwise like `numbers`."""
    return np.atleast_1d(numbers(name, values))


def number(name: str, value: Any, unit: str = "", *, low: float = -math.inf, high: float = math.inf) -> float:
    """Return an argument as one finite number between `low` and `high`; a low of 5e-324 asks for a positive one."""
    try:
        array = numbers(name, value)
    except InputError:
        array = np.array([])
    if array.shape == () and math.isfinite(array) and low <= array <= high:
        return float(array)
    wanted = "one finite number"
    if low == 5e-324:
        wanted = "one positive number" + (f" of at most {high:g}" if high < math.inf else "")
    elif low > -math.inf or high < math.inf:
        wanted += f" from {low:g} to {high:g}" if high < math.inf else f" of at least {low:g}"
    raise InputError(f"{name} = {shortened(repr(value), 40)} must be {wanted}{', ' + unit if unit else ''}.")


POSITIVE = 5e-324
"""The smallest positive number, for `number`."""


def vector(name: str, values: Any, size: int, unit: str = "") -> Array:
    """Convert an argument to a vector of finite numbers; return (size,)."""
    array = numbers(name, values)
    if array.shape != (size,) or not np.all(np.isfinite(array)):
        shown = shortened(str(array.tolist()), 60)
        raise InputError(f"{name} = {shown} must be {size} finite numbers{', ' + unit if unit else ''}.")
    return array


def quaternion(name: str, values: Any) -> Array:
    """Convert an argument to a quaternion that can be normalised; return (4,), not normalised."""
    array = vector(name, values, 4, "scalar first")
    if not 1e-6 < float(np.linalg.norm(array)) < 1e6:
        raise InputError(f"{name} = {array.tolist()} must be a quaternion of unit norm, scalar first.")
    return array


def check_kind(name: str, value: object, kind: type, like: str = "") -> None:
    """Raise if an argument is not an instance of a class; `like` describes such an object in the message."""
    if not isinstance(value, kind):
        raise InputError(f"{name} must be {like or kind.__name__}, not {shortened(repr(value))}.")


def names(name: str, kind: str, values: Iterable[str], known: Collection[str]) -> list[str]:
    """Convert an argument to a list of known names."""
    if not isinstance(values, list | tuple):
        raise InputError(f"{name} = {shortened(repr(values), 40)} must be a list of names: {', '.join(known)}.")
    for value in values:
        check_name(kind, value, known)
    return list(values)


GAP = 5.0
"""Ratio to the typical interval above which an interval counts as a gap with missing samples."""

_BLOCK = 65536  # rows per block, to avoid a temporary as long as the data


def first_not_finite(array: Array) -> int | None:
    """Return the first row of an array (N, …) with a NaN or an infinity, None if there is none."""
    for start in range(0, len(array), _BLOCK):
        block = array[start : start + _BLOCK]
        with np.errstate(invalid="ignore", over="ignore"):  # +∞ and −∞ in one block, or sums beyond the range
            total = float(np.sum(block))
        if not math.isfinite(total) and not np.all(np.isfinite(block)):
            finite = np.isfinite(block).reshape(len(block), -1).all(axis=1)
            return start + int(np.argmin(finite))
    return None


def checked_increments(imu: ImuData) -> tuple[Array, Array, Array]:
    """Check increments, and return them as contiguous arrays of doubles: edges of the intervals, (N+1,) s, angle
    increments, (N, 3) rad, velocity increments, (N, 3) m/s."""
    if not isinstance(imu, ImuData):
        raise InputError(f"imu must be ImuData(time, dtheta, dvel), not {shortened(repr(imu))}.")
    time, dtheta, dvel = (doubles(f"imu.{name}", getattr(imu, name)) for name in ("time", "dtheta", "dvel"))
    n = len(dtheta)
    if n < 1 or dtheta.shape != (n, 3) or dvel.shape != (n, 3) or time.shape != (n + 1,):
        raise InputError(
            f"IMU data of shapes time {time.shape}, dtheta {dtheta.shape}, dvel {dvel.shape} do not belong together: "
            "N intervals (N ≥ 1) have N+1 edges in time and (N, 3) values in dtheta and dvel."
        )
    check_finite("imu.time", time, "s")
    check_finite("imu.dtheta", dtheta, "rad", time)
    check_finite("imu.dvel", dvel, "m/s", time)
    check_increasing("imu.time", time)
    gap = longest_gap(time)
    if gap is not None:
        row, typical = gap
        raise InputError(
            f"imu.time: samples are missing for {time[row + 1] - time[row]:.6g} s from time[{row}] = "
            f"{time[row]:.9g} s on; usual intervals are {typical:.6g} s. The motion in the gap "
            "is unknown: use the part before or after the gap, or fill the gap."
        )
    return time, dtheta, dvel


def checked_imu(imu: ImuData) -> ImuData:
    """Check increments, and return them with contiguous arrays of doubles; if they are such arrays, the same object."""
    time, dtheta, dvel = checked_increments(imu)
    if time is imu.time and dtheta is imu.dtheta and dvel is imu.dvel:
        return imu
    return ImuData(time, dtheta, dvel, imu.flags)


def longest_gap(time: Array) -> tuple[int, float] | None:
    """Return the number of the longest interval and the typical length, s, where samples are missing.

    None if no interval is longer than `GAP` typical ones. The edges increase, (N+1,) s.
    """
    steps = np.diff(time)
    longest = int(np.argmax(steps))
    if steps[longest] <= GAP * np.min(steps):
        return None
    typical = float(np.median(steps))
    return (longest, typical) if steps[longest] > GAP * typical else None


def check_finite(name: str, array: Array, unit: str, ends: Array | None = None) -> None:
    """Raise if an array (N, …) has a NaN or an infinity; `ends` are the edges of its intervals, (N+1,) s, if its rows
    are intervals."""
    row = first_not_finite(array)
    if row is not None:
        raise InputError(
            f"{name}[{row}] = {array[row]} {unit} is not a finite number"
            + ("." if ends is None else f" (interval ending at t = {ends[row + 1]:.6f} s).")
            + " Fill the gaps of a log before using it: every sample is needed."
        )


def check_increasing(name: str, time: Array) -> None:
    """Raise if finite times, (N+1,) s, do not increase."""
    for start in range(0, len(time) - 1, _BLOCK):
        steps = np.diff(time[start : start + _BLOCK + 1])
        if not np.min(steps) > 0.0:
            row = start + int(np.argmin(steps > 0.0))
            raise InputError(
                f"{name} must increase: time[{row}] = {time[row]:.9g} s is followed by time[{row + 1}] = "
                f"{time[row + 1]:.9g} s."
            )


def checked_initial(initial: NavState) -> tuple[float, float, float, Array, Array]:
    """Check the initial state of navigation: latitude and longitude, rad, height, m, velocity, (3,) m/s, and attitude,
    (4,), of unit norm."""
    if not isinstance(initial, NavState):
        raise InputError(
            "initial must be NavState(latitude, longitude, height, velocity_ned, q_nb), not "
            f"{shortened(repr(initial))}."
        )
    values = {
        name: number(f"initial.{name}", getattr(initial, name), "rad for angles, m for height")
        for name in ("latitude", "longitude", "height")
    }
    velocity = vector("initial.velocity_ned", initial.velocity_ned, 3, "m/s")
    q = doubles("initial.q_nb", initial.q_nb)
    if q.shape != (4,) or not np.all(np.isfinite(q)) or abs(np.linalg.norm(q) - 1.0) > 1e-6:
        raise InputError(f"initial.q_nb = {q} must be a unit quaternion of four finite numbers, scalar first.")
    if abs(values["latitude"]) > math.pi / 2:
        raise InputError(f"initial.latitude = {values['latitude']} rad lies outside ±π/2; radians are expected.")
    return values["latitude"], values["longitude"], values["height"], velocity, q / np.linalg.norm(q)


def not_finite_in(height: Array, velocity: Array, q_nb: Array) -> tuple[str, int] | None:
    """Return the quantity of a solution and the first row at which it is not finite, None if there is none.

    Height (N+1,) m, velocity (N+1, 3) m/s, q_nb (N+1, 4).
    """
    for name, array in (("height", height), ("velocity", velocity), ("attitude", q_nb)):
        row = first_not_finite(array)
        if row is not None:
            return name, row
    return None


def as_columns(*values: Any) -> tuple[tuple[int, ...], list[Array]]:
    """Return the common shape of arrays that are broadcast against each other, and each as a new array of one axis."""
    given = [numbers("the array", value) for value in values]
    try:
        arrays = np.broadcast_arrays(*given)
    except ValueError as error:
        shapes = ", ".join(str(value.shape) for value in given)
        raise InputError(f"arrays of the shapes {shapes} do not fit together.") from error
    # copies, because numpy warns if numba asks whether a broadcast view of one element is writeable
    return arrays[0].shape, [array.copy().reshape(-1) for array in arrays]


def as_vectors(r: Any) -> tuple[tuple[int, ...], Array]:
    """Return the shape of an array of vectors without their axis, and the vectors, (N, 3)."""
    array = numbers("the array of vectors", r)
    if array.shape[-1:] != (3,):
        raise InputError(f"expected vectors of 3 components in the last axis, got an array of shape {array.shape}.")
    return array.shape[:-1], np.ascontiguousarray(array).reshape(-1, 3)
