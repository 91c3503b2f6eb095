"""Coefficients of a spherical harmonic model of the Earth's gravitation, and the model that comes with the package."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError

EGM2008 = "egm2008"
SHIPPED_DEGREE = 120
"""Highest degree of the coefficients that come with the package."""
_FILE = Path(__file__).with_name("egm2008_120.npz")


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Fully normalised coefficients of a model of the Earth's gravitation.

    V = GM/r Σ (R/r)^n Σ P̄_nm(sin φ') (C̄_nm cos mλ + S̄_nm sin mλ), φ' the geocentric latitude, with the normalisation
    of geodesy: the mean square of every harmonic over the sphere is 1 (Heiskanen and Moritz, Physical Geodesy, 1967,
    sec. 1-14).

    Attributes:
        name: name of the model.
        gm: its gravitational parameter, m³/s².
        radius: its reference radius R, m.
        c, s: C̄_nm and S̄_nm, (degree + 1, degree + 1), 0 for m > n.
    """

    name: str
    gm: float
    radius: float
    c: Array
    s: Array

    @property
    def degree(self) -> int:
        """Highest degree and order."""
        return len(self.c) - 1

    def to_degree(self, degree: int) -> Coefficients:
        """Return the model cut off at a degree.

        Raises:
            InputError: the model does not have this degree; the message says which it has.
        """
        if not 2 <= degree <= self.degree:
            raise InputError(
                f"degree = {degree}: {self.name} has coefficients to degree {self.degree}; give 2 to {self.degree}."
            )
        part = slice(0, degree + 1)
        return self if degree == self.degree else replace(self, c=self.c[part, part], s=self.s[part, part])


@cache
def shipped() -> Coefficients:
    """Return EGM2008 to degree and order 120, the model that comes with the package.

    Returns:
        The model: tide-free, GM = 3.986004415e14 m³/s², R = 6378136.3 m (Pavlis, Holmes, Kenyon and Factor, The
        development and evaluation of the Earth Gravitational Model 2008, JGR 117, B04406, 2012).
    """
    with np.load(_FILE) as stored:
        degree = SHIPPED_DEGREE
        rows, columns = np.tril_indices(degree + 1)
        c, s = np.zeros((degree + 1, degree + 1)), np.zeros((degree + 1, degree + 1))
        c[rows, columns], s[rows, columns] = stored["c"], stored["s"]
        return Coefficients(EGM2008, float(stored["gm"]), float(stored["radius"]), c, s)
