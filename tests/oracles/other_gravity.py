"""Gravity formulas and Earth constants of other programs, as their sources state them; north and down components."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

A = 6378137.0


def psins(latitude: Array, height: float) -> tuple[Array, Array]:
    """Return the formula of ethupdate.m and glvf.m of PSINS, (north, down) m/s²."""
    f, rate, g0 = 1 / 298.257, 7.2921151467e-5, 9.7803267715
    m = A * rate**2 / g0
    beta, beta1 = 2.5 * m - f - 17 / 14 * m * f, (5 * m * f - f**2) / 8
    s = np.sin(latitude)
    ratio = height / (A * (1 - f * s**2))
    surface = g0 * (1 + beta * s**2 - beta1 * np.sin(2 * latitude) ** 2)
    return np.zeros_like(latitude), surface * (1 - 2 * ratio - 5 * ratio**2)


def navego(latitude: Array, height: float) -> tuple[Array, Array]:
    """Return the formula of gravity.m of NaveGo, (north, down) m/s²."""
    e2 = 0.0818191908425**2
    root = 1 - e2 * np.sin(latitude) ** 2
    radius = np.sqrt(A / np.sqrt(root) * A * (1 - e2) / root**1.5)
    surface = 9.780318 * (1 + 5.3024e-3 * np.sin(latitude) ** 2 - 5.9e-6 * np.sin(2 * latitude) ** 2)
    return np.zeros_like(latitude), surface / (1 + height / radius) ** 2


def gnss_ins_sim(latitude: Array, height: float) -> tuple[Array, Array]:
    """Return the formula of geoparams.py of gnss-ins-sim, (north, down) m/s²."""
    f, m = 1 / 298.257223563, 0.00344978650684
    s2 = np.sin(latitude) ** 2
    surface = 9.7803253359 * (1 + 0.00193185265241 * s2) / np.sqrt(1 - 0.0818191908426215**2 * s2)
    factor = 1 - 2 / A * (1 + f + m - 2 * f * s2) * height + 3 * height**2 / A**2
    return np.zeros_like(latitude), surface * factor


EARTH: dict[str, dict[str, Any]] = {
    "psins": {"gravity": psins, "flattening": 1 / 298.257, "earth_rate": 7.2921151467e-5},
    "navego": {
        "gravity": navego,
        "flattening": 1 - np.sqrt(1 - 0.0818191908425**2),
        "earth_rate": 7.2921155e-5,
    },
    "gnss-ins-sim": {"gravity": gnss_ins_sim},
}
"""Arguments of `STurn`: the Earth on which the motion is flown is that of the program."""
