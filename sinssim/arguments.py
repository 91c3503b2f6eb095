"""What a person may pass from Python, as numbers and arrays that the rest can rely on, or refused by name.

Arrays come back as doubles, contiguous and writeable: a kernel is compiled anew for every other kind of array.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, check_name, shortened

_WRITEABLE, _BROADCAST = 0x400, 1 << 31  # NPY_ARRAY_WRITEABLE and NPY_ARRAY_WARN_ON_WRITE of numpy's C interface


def numbers(name: str, values: Any) -> Array:
    """Return what was given as an array of doubles, of any shape.

    Args:
        name: what it is, for the message.
        values: a number, a list, a tuple or an array of numbers.

    Returns:
        The array, contiguous and writeable; the one that was given if it is so already.

    Raises:
        InputError: it is no array of numbers: None, text, ragged lists, masked or complex numbers, dates.
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
        # numpy would make NaN of None, and a number of "1"
        if array.dtype.kind == "O" and any(value is None or isinstance(value, str | bytes) for value in array.flat):
            raise TypeError("a value is None or text")
        array = np.asarray(array, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError) as error:
        shown = f" = {shortened(repr(values), 40)}" if values is None or isinstance(values, str) else ""
        raise InputError(f"{name}{shown} is no array of numbers: {shortened(str(error))}.") from error
    # by the number of the flags: numpy warns when the one of a view from broadcast_arrays is asked for by its name
    return array if array.flags.num & (_WRITEABLE | _BROADCAST) == _WRITEABLE else array.copy()


def doubles(name: str, values: Any) -> Array:
    """Return what was given as an array of doubles, of one axis at least; otherwise as `numbers`.

    Args:
        name: what it is, for the message.
        values: numbers.

    Returns:
        The array.

    Raises:
        InputError: it is no array of numbers.
    """
    return np.atleast_1d(numbers(name, values))


def number(name: str, value: Any, unit: str = "", *, low: float = -math.inf, high: float = math.inf) -> float:
    """Return what was given as one finite number.

    Args:
        name: what it is, for the message.
        value: an int, a float, or an array of no axis.
        unit: its unit, for the message.
        low, high: smallest and largest number that is right; 5e-324 for anything positive.

    Returns:
        The number.

    Raises:
        InputError: it is none, it is not finite, or it lies outside.
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
    """Return what was given as some finite numbers in a row.

    Args:
        name: what they are, for the message.
        values: the numbers.
        size: how many there must be.
        unit: their unit, for the message.

    Returns:
        (size,).

    Raises:
        InputError: they are not.
    """
    array = numbers(name, values)
    if array.shape != (size,) or not np.all(np.isfinite(array)):
        shown = shortened(str(array.tolist()), 60)
        raise InputError(f"{name} = {shown} must be {size} finite numbers{', ' + unit if unit else ''}.")
    return array


def quaternion(name: str, values: Any) -> Array:
    """Return what was given as a quaternion that can be normalised.

    Args:
        name: what it is, for the message.
        values: scalar first.

    Returns:
        (4,), not normalised.

    Raises:
        InputError: it is not four finite numbers, or all are zero.
    """
    array = vector(name, values, 4, "scalar first")
    if not 1e-6 < float(np.linalg.norm(array)) < 1e6:
        raise InputError(f"{name} = {array.tolist()} must be a quaternion of unit norm, scalar first.")
    return array


def check_kind(name: str, value: object, kind: type, like: str = "") -> None:
    """Raise if what was given is no object of a class.

    Args:
        name: what it is, for the message.
        value: what was given.
        kind: the class.
        like: how such an object is made, for the message; the name of the class by default.

    Raises:
        InputError: it is none.
    """
    if not isinstance(value, kind):
        raise InputError(f"{name} must be {like or kind.__name__}, not {shortened(repr(value))}.")


def names(name: str, kind: str, values: Iterable[str], known: Collection[str]) -> list[str]:
    """Return what was given as a list of known names.

    Args:
        name: what they are, for the message.
        kind: what each of them names, for the message.
        values: a list or tuple of names.
        known: all names that would be right.

    Returns:
        The names.

    Raises:
        InputError: it is no list of names, or one of them is not known.
    """
    if not isinstance(values, list | tuple):
        raise InputError(f"{name} = {shortened(repr(values), 40)} must be names in a list: {', '.join(known)}.")
    for value in values:
        check_name(kind, value, known)
    return list(values)
