"""Converts lines of data sheets to SI: splits keys into error term and unit."""

from __future__ import annotations

import math
from collections.abc import Collection
from functools import cache
from typing import Any, NamedTuple

from sinssim.errors import InputError
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.terms import TERMS

_BY_NAME = {term.name: term for term in TERMS}


class DatasheetLine(NamedTuple):
    """One line of a datasheet.

    Attributes:
        term: the error term.
        sigma: whether the line gives the 1σ of a random error instead of the error itself.
        factor: size of its unit in SI.
    """

    term: ErrorTerm
    sigma: bool
    factor: float


@cache
def line(key: str) -> DatasheetLine | None:
    """Split a key into error term and unit.

    Args:
        key: quantity and unit, for example "gyro_arw_deg_sqrt_h" or "accel_bias_sigma_mg".

    Returns:
        The line; None if it is not the key of an error term.

    Raises:
        InputError: the quantity is known but the unit is not; the message lists the units.
    """
    for name in sorted(_BY_NAME, key=len, reverse=True):  # gyro_bias_temperature before gyro_bias
        if key.startswith(f"{name}_"):
            term, unit = _BY_NAME[name], key.removeprefix(f"{name}_")
            sigma = term.drawn and unit.startswith("sigma_")
            unit = unit.removeprefix("sigma_") if sigma else unit
            if unit not in term.units:
                raise InputError(f"{name} cannot be given in {unit!r}; known units: {', '.join(term.units)}.")
            return DatasheetLine(term, sigma, term.units[unit])
    return None


def to_si(key: str, value: float) -> float:
    """Convert a number of a data sheet to SI.

    Args:
        key: quantity and unit as in a scenario, for example "accel_vrw_mps_sqrt_h".
        value: the number in the data sheet.

    Returns:
        The number in SI, as in `TriadErrors`.

    Raises:
        InputError: the quantity or the unit is not known, or the number is not finite; the message lists the known
            ones.
    """
    stated = line(key)
    if stated is None:
        raise InputError(f"unknown quantity in {key!r}; known: {', '.join(_BY_NAME)}, each followed by a unit.")
    if not math.isfinite(value):
        raise InputError(f"{key} = {value} is not a finite number.")
    return value * stated.factor


def not_absurd(key: str, value: Any) -> Any:
    """Refuse an absurdly large error.

    Args:
        key: quantity and unit as in a scenario.
        value: a number, several, or None.

    Returns:
        The value.

    Raises:
        ValueError: the error is too large.
    """
    stated = line(key)
    if stated is not None and value is not None:
        most = stated.term.most
        for number in value if isinstance(value, tuple) else (value,):
            if not abs(number) <= most:
                raise ValueError(
                    f"{number:g} is larger than that of any sensor; its magnitude must be at most {most:g}"
                )
    return value


def in_scenario_units(data: Any, known: Collection[str]) -> Any:
    """Convert errors in other units to the keys and units of scenarios.

    Args:
        data: a table of a scenario; anything else is returned unchanged.
        known: keys of the table. A key with an unknown unit stays unchanged, and the schema refuses it.

    Returns:
        The table.

    Raises:
        ValueError: an error is given twice, in two units.
    """
    if not isinstance(data, dict):
        return data
    converted: dict[str, Any] = {}
    for key, value in data.items():
        try:
            stated = None if key in known else line(key)
        except InputError:
            stated = None
        if stated is not None:
            term = stated.term
            key = term.sigma_key if stated.sigma else term.key
            value = _times(value, stated.factor / term.unit)
        if key in converted:
            raise ValueError(f"{key} is given twice, in two units: keep one of them")
        converted[key] = value
    return converted


def _times(value: Any, factor: float) -> Any:
    """Multiply numbers at any depth; other values stay unchanged, and the schema refuses them."""
    if isinstance(value, list | tuple):
        return tuple(_times(item, factor) for item in value)
    return value * factor if isinstance(value, int | float) and not isinstance(value, bool) else value
