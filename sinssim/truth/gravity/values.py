"""Deflections, anomaly, undulation and height above mean sea level along a motion, as geodesy gives them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sinssim import earth
from sinssim.data import Array
from sinssim.truth.gravity.disturbed import Disturbed
from sinssim.units import ARCSEC, MGAL

STEP = 1.0
"""Interval between rows, s."""


@dataclass(frozen=True)
class GravityValues:
    """The true field along a motion, model and remainder together.

    Attributes:
        time: (K,) s.
        xi, eta: deflection of the vertical to the north and to the east, (K,) rad.
        disturbance: gravity disturbance, down, (K,) m/s².
        anomaly: gravity anomaly, (K,) m/s².
        undulation: height of the model's geoid above the ellipsoid, (K,) m; None without a model.
        altitude_msl: height above it, (K,) m; None without a model.
    """

    time: Array
    xi: Array
    eta: Array
    disturbance: Array
    anomaly: Array
    undulation: Array | None
    altitude_msl: Array | None


def gravity_values(motion: Disturbed) -> GravityValues:
    """Return the true field along a motion, once a second."""
    count = max(1, int((motion.end - motion.start) / STEP + 1e-9))
    time: Array = motion.start + STEP * np.arange(count + 1, dtype=np.float64)
    time = time[time <= motion.end]
    s = motion.state(time)
    ned = motion.disturbance_ned(time, s)
    gamma = np.hypot.reduce(earth.gravity_ned(s.latitude, s.height, motion.gravity, motion.ellipsoid), axis=1)
    anomaly: Array = ned[:, 2]
    undulation: Array | None = None
    altitude: Array | None = None
    if motion.field is not None:
        r = earth.geodetic_to_ecef(s.latitude, s.longitude, s.height, motion.ellipsoid)
        potential = motion.field.potential_and_gradient(r)[0]
        anomaly = anomaly - 2.0 * potential / np.linalg.norm(r, axis=1)
        undulation = motion.field.undulation(s.latitude, s.longitude)
        altitude = s.height - undulation
    xi, eta = (np.asarray(-ned[:, k] / gamma, dtype=np.float64) for k in range(2))
    return GravityValues(time, xi, eta, ned[:, 2], anomaly, undulation, altitude)


def gravity_numbers(motion: Disturbed) -> dict[str, Any]:
    """Return the numbers of the true field for a run's summary.

    Returns:
        Model and degree, root mean squares and largest values along the motion, and the error of the spline.
    """
    v, along, field = gravity_values(motion), motion.along, motion.field
    found: dict[str, Any] = {"model": "normal" if field is None else field.name}
    if field is not None and along is not None:
        found |= {"degree": field.degree, "evaluations": along.evaluations}
        found["interpolation_error_mgal"] = along.error / MGAL
    for name, values, unit in (
        ("xi_arcsec", v.xi, ARCSEC), ("eta_arcsec", v.eta, ARCSEC), ("disturbance_mgal", v.disturbance, MGAL),
    ):  # fmt: skip
        found[f"rms_{name}"] = float(np.sqrt(np.mean(values**2))) / unit
        found[f"max_{name}"] = float(np.abs(values).max()) / unit
    return found
