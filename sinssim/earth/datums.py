"""Geodetic datums: WGS-84 and PZ-90.11, and the transformation of seven parameters between them.

The transformation between WGS-84 and PZ-90.11 has the seven parameters of GOST 32453-2017 for WGS-84 (G1150). The EPSG
registry has them as two operations in turn, 7961 (WGS 84 (G1150) to PZ-90.02) and 7703 (PZ-90.02 to PZ-90.11), in the
same convention, that of rotated axes:

    r′ = Δ + (1 + m) (I − [ω×]) r

Another ellipsoid without a transformation of its own has its centre and axes in common with the datum that it is given
for: only latitude and height change.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import as_vectors
from sinssim.data import Array
from sinssim.errors import check_name
from sinssim.units import ARCSEC


class Helmert(NamedTuple):
    """Seven parameters of a transformation between Earth-fixed axes."""

    shift: tuple[float, float, float]  # Δ, m
    rotation: tuple[float, float, float]  # ω, the rotation of the axes, rad
    scale: float  # m


_MAS = 1e-3 * ARCSEC
TO_PZ_90_11 = Helmert((-0.013, 0.106, 0.022), (-2.30 * _MAS, 3.54 * _MAS, -4.21 * _MAS), -0.008e-6)
"""From WGS-84 (G1150) to PZ-90.11."""
DATUMS: dict[str, str] = {
    "wgs84": "World Geodetic System 1984 (G1150)",
    "pz-90.11": "Parametry Zemli 1990, realisation of 2011",
}
"""Datums by the name of their ellipsoid."""


def change_datum(r: ArrayLike, before: str, after: str) -> Array:
    """Return Earth-fixed positions in the axes of another datum.

    Args:
        r: positions, (..., 3) m.
        before: datum of the positions, one of `DATUMS`.
        after: the other datum.

    Returns:
        (..., 3) m.

    Raises:
        InputError: a datum is unknown, or the positions are not vectors.
    """
    for name in (before, after):
        check_name("datum", name, DATUMS)
    shape, rows = as_vectors(r)
    if before == after:
        return rows.reshape(*shape, 3)
    x, y, z = TO_PZ_90_11.rotation
    matrix = (1.0 + TO_PZ_90_11.scale) * np.array([[1.0, z, -y], [-z, 1.0, x], [y, -x, 1.0]])
    if after == "wgs84":
        return np.asarray(np.linalg.solve(matrix, (rows - TO_PZ_90_11.shift).T).T.reshape(*shape, 3), dtype=np.float64)
    return np.asarray(rows @ matrix.T + TO_PZ_90_11.shift).reshape(*shape, 3)
