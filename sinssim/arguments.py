"""Checks arguments of public functions and converts them to numbers and arrays.

Arrays are returned as doubles, contiguous and writeable, because a kernel is compiled anew for every other kind of
array.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, check_name, shortened

_AXES = 32  # numpy broadcasts no more
_WRITEABLE, _BROADCAST = 0x400, 1 << 31  # NPY_ARRAY_WRITEABLE and NPY_ARRAY_WARN_ON_WRITE of numpy's C interface


def numbers(name: str, values: Any) -> Array:
    """Convert an argument to an array of doubles of any shape.

    Args:
        values: a number, a list, a tuple or an array of numbers.

    Returns:
        The array, contiguous and writeable; the argument itself if it already is.

    Raises:
        InputError: the argument is not an array of numbers, but for example None, text, ragged lists, masked or complex
            numbers, or dates.
    """
    if isinstance(values, np.ma.MaskedArray):
        if np.ma.is_masked(values):
            raise InputError(f"{name} is a masked array with values masked out; fill them or leave them out.")
        values = values.data
    try:
        if isinstance(values, list | tuple) and any(value is np.ma.masked for value in values):
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
    """Convert an argument to an array of doubles with at least one axis; otherwise like `numbers`.

    Raises:
        InputError: the argument is not an array of numbers.
    """
    return np.atleast_1d(numbers(name, values))


def number(name: str, value: Any, unit: str = "", *, low: float = -math.inf, high: float = math.inf) -> float:
    """Convert an argument to one finite number.

    Args:
        value: an int, a float, or an array without axes.
        low, high: smallest and largest allowed number; 5e-324 for any positive number.

    Raises:
        InputError: the argument is not a number, not finite, or out of range.
    """
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
    """Convert an argument to a vector of finite numbers.

    Returns:
        (size,).

    Raises:
        InputError: the argument is not such a vector.
    """
    array = numbers(name, values)
    if array.shape != (size,) or not np.all(np.isfinite(array)):
        shown = shortened(str(array.tolist()), 60)
        raise InputError(f"{name} = {shown} must be {size} finite numbers{', ' + unit if unit else ''}.")
    return array


def quaternion(name: str, values: Any) -> Array:
    """Convert an argument to a quaternion that can be normalised.

    Returns:
        (4,), not normalised.

    Raises:
        InputError: the argument is not four finite numbers, or all are zero.
    """
    array = vector(name, values, 4, "scalar first")
    if not 1e-6 < float(np.linalg.norm(array)) < 1e6:
        raise InputError(f"{name} = {array.tolist()} must be a quaternion of unit norm, scalar first.")
    return array


def check_kind(name: str, value: object, kind: type, like: str = "") -> None:
    """Raise if an argument is not an instance of a class.

    Args:
        like: description of such an object, for the message; by default the name of the class.

    Raises:
        InputError: it is not an instance.
    """
    if not isinstance(value, kind):
        raise InputError(f"{name} must be {like or kind.__name__}, not {shortened(repr(value))}.")


def names(name: str, kind: str, values: Iterable[str], known: Collection[str]) -> list[str]:
    """Convert an argument to a list of known names.

    Raises:
        InputError: the argument is not a list of names, or a name is unknown.
    """
    if not isinstance(values, list | tuple):
        raise InputError(f"{name} = {shortened(repr(values), 40)} must be a list of names: {', '.join(known)}.")
    for value in values:
        check_name(kind, value, known)
    return list(values)
