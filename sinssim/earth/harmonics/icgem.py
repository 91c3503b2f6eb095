"""Reads the coefficients of a gravity model from a file in the format of the ICGEM (.gfc).

The format: a header of keys and values, a line that begins with `end_of_head`, and a line `gfc n m C S …` for every
degree and order (Ince et al., ICGEM – 15 years of successful collection and distribution of global gravitational
models, Earth System Science Data 11, 647-674, 2019).
"""

from __future__ import annotations

import math
import os
from functools import lru_cache
from pathlib import Path
from typing import NoReturn

import numpy as np

from sinssim.data import Array
from sinssim.earth.harmonics.coefficients import Coefficients
from sinssim.errors import InputError, shortened
from sinssim.system.user_file import read_text

_NORMALISED = -4.8417e-4
"""C̄20 of the Earth, fully normalised; unnormalised it is √5 times this."""
_VARYING = ("gfct", "trnd", "dot", "acos", "asin")
"""Lines of models that vary with time."""
MOST_DEGREE = 2190
"""Highest degree at which the recursion keeps its precision at every latitude, see `synthesis`."""


def read_icgem(path: str | os.PathLike[str], degree: int | None = None) -> Coefficients:
    """Read the coefficients of a gravity model from an ICGEM file.

    Args:
        degree: highest degree that is wanted; by default all that the file holds.

    Raises:
        InputError: the file cannot be read, has another normalisation or a varying model, is cut short, or does not
            hold the degree; the message names file, line and key.
    """
    file = Path(path)
    try:
        text = read_text(file, encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"{file}: the coefficients of gravity cannot be read: {error.strerror or error}.") from error
    head, _, body = text.partition("end_of_head")
    if not body:
        _refuse(file, 'there is no line "end_of_head": not an ICGEM file of a gravity model, or it is truncated')
    keys = _header(head)
    holds = int(_number(file, keys, "max_degree"))
    if keys.get("norm", "fully_normalized") != "fully_normalized":
        _refuse(file, f"norm is {shortened(keys['norm'])!r}; the coefficients must be fully_normalized")
    wanted = holds if degree is None else degree
    if not 2 <= wanted <= min(holds, MOST_DEGREE):
        raise InputError(
            f"{file}: degree = {wanted}, but the file holds max_degree = {holds}; give 2 to {min(holds, MOST_DEGREE)}."
        )
    c, s = _coefficients(file, body, head.count("\n") + 1, wanted)
    if not abs(c[2, 0] / _NORMALISED - 1.0) < 0.01:
        _refuse(
            file,
            f"C20 is {c[2, 0]:.6g}; fully normalised it is {_NORMALISED:.5g} for the Earth: the coefficients have "
            "another normalisation, or belong to another body",
        )
    gm, radius = _number(file, keys, "earth_gravity_constant"), _number(file, keys, "radius")
    if not (3.9e14 < gm < 4.1e14 and 6.3e6 < radius < 6.5e6):
        _refuse(
            file,
            f"earth_gravity_constant = {gm:g} and radius = {radius:g} are not those of the Earth in m³/s² and m, "
            "3.986e14 and 6.378e6",
        )
    return Coefficients(keys.get("modelname", file.stem), gm, radius, c, s)


def known_icgem(path: str, degree: int | None = None) -> Coefficients:
    """Return `read_icgem`, from memory if the file is unchanged since.

    Raises:
        InputError: as for `read_icgem`.
    """
    try:
        about = os.stat(path)
    except OSError:
        return read_icgem(path, degree)
    return _kept(path, degree, about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=4)
def _kept(path: str, degree: int | None, changed: int, size: int) -> Coefficients:
    return read_icgem(path, degree)


def _refuse(file: Path, why: str) -> NoReturn:
    raise InputError(f"{file}: {why}.")


def _header(head: str) -> dict[str, str]:
    parts = (line.split() for line in head.splitlines())
    return {words[0]: words[1] for words in parts if len(words) >= 2}


def _float(word: str) -> float:
    return float(word.replace("d", "e").replace("D", "e"))


def _number(file: Path, keys: dict[str, str], key: str) -> float:
    if key not in keys:
        _refuse(file, f"the header has no {key}")
    try:
        value = _float(keys[key])
    except ValueError:
        _refuse(file, f"{key} = {shortened(keys[key])!r} in the header is not a number")
    return value


def _coefficients(file: Path, body: str, before: int, degree: int) -> tuple[Array, Array]:
    """Return C and S, (degree + 1, degree + 1); `before` is the number of lines before the body."""
    c, s = np.full((degree + 1, degree + 1), np.nan), np.zeros((degree + 1, degree + 1))
    c[0, 0], c[1, :2] = 1.0, 0.0  # may be left out: the mass, and the centre of mass at the origin
    for number, line in enumerate(body.splitlines(), start=before):
        words = line.split()
        if not words or words[0] not in ("gfc", *_VARYING):
            continue
        if words[0] != "gfc":
            _refuse(file, f'line {number}: "{words[0]}" belongs to a model that varies with time; only "gfc" is used')
        try:
            n, m, of_c, of_s = int(words[1]), int(words[2]), _float(words[3]), _float(words[4])
        except (ValueError, IndexError):
            _refuse(file, f'line {number}: "{shortened(line.strip())}" is not "gfc degree order C S": is it truncated?')
        if not (0 <= m <= n and math.isfinite(of_c) and math.isfinite(of_s)):
            _refuse(file, f"line {number}: degree {n}, order {m}, C = {of_c}, S = {of_s} are impossible")
        if n <= degree:
            c[n, m], s[n, m] = of_c, of_s
    rows, columns = np.tril_indices(degree + 1)
    missing = np.flatnonzero(np.isnan(c[rows, columns]))
    if len(missing):
        first = missing[0]
        _refuse(
            file,
            f"the coefficient of degree {rows[first]} and order {columns[first]} is missing, with {len(missing) - 1} "
            f"others up to degree {degree}: the file is truncated",
        )
    return np.tril(np.nan_to_num(c)), s
