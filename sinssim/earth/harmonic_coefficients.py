"""Coefficients of spherical harmonic models of gravitation: EGM2008, ICGEM files (.gfc), and the omitted degrees.

An ICGEM file has a header of keys and values, a line that begins with `end_of_head`, and a line `gfc n m C S …` for
every degree and order (Ince et al., ICGEM – 15 years of successful collection and distribution of global gravitational
models, Earth System Science Data 11, 647-674, 2019).

The size of the field beyond a degree follows from the anomaly degree variances of Tscherning and Rapp,

    c_n = A (n − 1)/((n − 2)(n + B)) s^(n+2),   A = 425.28 mGal², B = 24, s = 0.999617

(Closed covariance expressions for gravity anomalies, geoid undulations, and deflections of the vertical implied by
anomaly degree variance models, Report 208, Department of Geodetic Science, Ohio State University, 1974). The covariance
of anomalies at a distance ψ is Σ c_n P_n(cos ψ); for the degrees here P_n(cos ψ) = J₀((n + ½)ψ).
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from sinssim.data import Array
from sinssim.earth.ellipsoids import MEAN_GRAVITY, MEAN_RADIUS
from sinssim.errors import InputError, shortened
from sinssim.system.files import read_text
from sinssim.units import MGAL

EGM2008 = "egm2008"
SHIPPED_DEGREE = 120
"""Highest degree of the coefficients that come with the package."""
_FILE = Path(__file__).with_name("egm2008_120.npz")


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Fully normalised coefficients of a model of the Earth's gravitation.

    V = GM/r Σ (R/r)^n Σ P̄_nm(sin φ') (C̄_nm cos mλ + S̄_nm sin mλ), φ' the geocentric latitude, with the normalisation
    of geodesy: the mean square of every harmonic over the sphere is 1 (Heiskanen and Moritz, Physical Geodesy, 1967,
    sec. 1-14)."""

    name: str  # name of the model
    gm: float  # its gravitational parameter, m³/s²
    radius: float  # its reference radius R, m
    # C̄_nm and S̄_nm, (degree + 1, degree + 1), 0 for m > n
    c: Array
    s: Array

    @property
    def degree(self) -> int:
        """Highest degree and order."""
        return len(self.c) - 1

    def to_degree(self, degree: int) -> Coefficients:
        """Return the model cut off at a degree."""
        if not 2 <= degree <= self.degree:
            raise InputError(
                f"degree = {degree}: {self.name} has coefficients to degree {self.degree}; give 2 to {self.degree}."
            )
        part = slice(0, degree + 1)
        return self if degree == self.degree else replace(self, c=self.c[part, part], s=self.s[part, part])


@cache
def shipped() -> Coefficients:
    """Return EGM2008 to degree and order 120, the model that comes with the package.

    It is tide-free, with GM = 3.986004415e14 m³/s² and R = 6378136.3 m (Pavlis, Holmes, Kenyon and Factor, The
    development and evaluation of the Earth Gravitational Model 2008, JGR 117, B04406, 2012).
    """
    with np.load(_FILE) as stored:
        degree = SHIPPED_DEGREE
        rows, columns = np.tril_indices(degree + 1)
        c, s = np.zeros((degree + 1, degree + 1)), np.zeros((degree + 1, degree + 1))
        c[rows, columns], s[rows, columns] = stored["c"], stored["s"]
        return Coefficients(EGM2008, float(stored["gm"]), float(stored["radius"]), c, s)


_NORMALISED = -4.8417e-4
"""C̄20 of the Earth, fully normalised; unnormalised it is √5 times this."""
_VARYING = ("gfct", "trnd", "dot", "acos", "asin")
"""Lines of models that vary with time."""
MOST_DEGREE = 2190
"""Highest degree at which the recursion keeps its precision at every latitude, see `synthesis`."""


def read_icgem(path: str | os.PathLike[str], degree: int | None = None) -> Coefficients:
    """Read the coefficients of a gravity model from an ICGEM file up to a degree, by default all that the file has."""
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
    """Return `read_icgem`, from memory if the file is unchanged since."""
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


_A, _B, _S = 425.28, 24.0, 0.999617
_MOST = 40_000
"""Highest degree of the sums: s^n is 2e-7 there."""


class Omission(NamedTuple):
    """Size of the field beyond a degree."""

    deflection: float  # 1σ of each component of the deflection, rad
    anomaly: float  # 1σ of the anomaly, m/s²
    distance: float  # distance at which the correlation of anomalies is 1/e, m


def degree_variances(degree: int, height: float = 0.0) -> tuple[Array, Array]:
    """Return the degrees beyond one, 2 or more, and the variances of the gravity anomaly of each, which fall with the
    height h above the ellipsoid as (R/(R + h))^(2n+4)."""
    n = np.arange(max(degree, 2) + 1.0, _MOST + 1.0)
    fall = np.exp((n + 2.0) * (np.log(_S) - 2.0 * np.log1p(max(height, 0.0) / MEAN_RADIUS)))
    return n, _A * (n - 1.0) / ((n - 2.0) * (n + _B)) * fall * MGAL**2


@cache
def omission(degree: int, height: float = 0.0) -> Omission:
    """Return the size of the field at a height beyond the degree that is known, 2 for normal gravity: standard
    deviations and correlation distance. The variance of deflections of degree n is n(n + 1)/(n − 1)² c_n/γ², one half
    of it for each component."""
    from scipy.optimize import brentq
    from scipy.special import j0

    n, c = degree_variances(degree, height)
    total = float(c.sum())
    deflection = float(np.sqrt(0.5 * np.sum(n * (n + 1.0) / (n - 1.0) ** 2 * c))) / MEAN_GRAVITY

    def beyond(angle: float) -> float:
        return float(np.sum(c * j0((n + 0.5) * angle))) / total - math.exp(-1.0)

    high = 1e-5
    while beyond(high) > 0.0:
        high *= 1.5
    angle = brentq(beyond, 0.0, high, xtol=1e-9)
    return Omission(deflection, float(np.sqrt(total)), MEAN_RADIUS * angle)
