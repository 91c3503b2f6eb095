"""True airspeed: |u|, u = v + C (ω × l) − w with the wind w, residual u/|u| · (the velocity residual − δw).

It is the magnitude of the velocity through the air, independent of the angles of attack and sideslip, as a pitot tube
measures it. The wind has states to the north and east. A vertical wind, which hardly affects the airspeed in level
flight, has none.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sinssim.data import Array
from sinssim.estimation.measurements.kind import Comparison, MeasurementKind
from sinssim.estimation.measurements.velocity import point_velocity


class Airspeed(MeasurementKind):
    """Magnitude of the velocity through the air, of the point at the lever arm [m/s]."""

    columns = ("airspeed_mps",)
    axes = ("",)
    unit = "mps"
    rounding = "accelerometers"
    of_north = True
    own_errors: ClassVar = {"wind": (("n", "e"), "mps")}
    diagnosed: ClassVar = {"bias": 30.0, "scale": 0.3, "wind": 30.0}

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare with the magnitude of the velocity less the known wind; see the base."""
        states = at.states("wind")
        wind = np.zeros(3) if states is None else np.append(at.known("wind"), 0.0)
        through_air, h = point_velocity(at, wind, None)
        if states is not None:
            h[:, :2, states] = np.eye(2)  # true wind minus known wind, as for all parameters of a reading
        speed = np.linalg.norm(through_air, axis=1, keepdims=True)
        # at rest in still air the magnitude has no derivative: forward airflow is assumed
        ahead = np.divide(through_air, speed, out=at.c_nb[:, :, 0].copy(), where=speed > 0.0)
        return speed - value, ahead[:, None] @ h
