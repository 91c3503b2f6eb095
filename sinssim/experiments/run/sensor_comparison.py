"""Readings of each kind of sensor against the truth, before and after compensation, for view and report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sinssim import rotation, units
from sinssim.data import Array, ImuData
from sinssim.scales import ANGLES, SPEEDS, Scale
from sinssim.simulation.truth import Truth
from sinssim.system.short_repr import short_repr

if TYPE_CHECKING:
    from sinssim.sensors.sets.reading import Readings
    from sinssim.simulation.sensed import Sensed

AXES = ("x", "y", "z")


@short_repr
@dataclass(frozen=True)
class SensorComparison:
    """Readings of one kind of sensor against the truth, along a run.

    Attributes:
        key: key in entities and labels: "gyro", "accel", "single", "single_gyro", "single_accel" or "attitude".
        title: name of the kind.
        names: k names of the lines: axes, or numbers.
        time: edges of the samples, (N+1,) s.
        error: accumulated errors of the sensors, (N+1, k) rad or m/s; for an attitude sensor, the error itself.
        left: the same after compensation, None without compensation.
        sums: units of both.
        drift: unit of their rate of change, and its size in SI.
        ideal, measured: increments, (N, k); None for an attitude sensor, which has none.
        reading: unit of their mean rates, and its size in SI.
    """

    key: str
    title: str
    names: tuple[str, ...]
    time: Array
    error: Array
    left: Array | None
    sums: Scale
    drift: tuple[str, float]
    ideal: Array | None = None
    measured: Array | None = None
    reading: tuple[str, float] = ("", 1.0)

    @property
    def window(self) -> float:
        """Averaging time of the errors, s, such that a run has a few hundred means."""
        duration = float(self.time[-1] - self.time[0])
        return next((w for w in (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0) if w >= duration / 200.0), 120.0)

    def averaged(self, error: Array) -> tuple[Array, Array]:
        """Return the mean error of the readings over each window.

        Args:
            error: `error` or `left`, (N+1, k).

        Returns:
            End of each window, (M,) s, and means, (M, k), in rad/s or m/s²; in rad for an attitude sensor. M is 0 for a
            run shorter than a window.
        """
        ends = np.arange(self.time[0], self.time[-1] + 1e-9, self.window)
        edges = np.unique(np.searchsorted(self.time, ends - 1e-6 * self.window))  # whatever the rounding of the ends
        time = self.time[edges]
        if self.measured is None:
            readings = np.diff(edges)[:, np.newaxis]
            return time[1:], np.add.reduceat(error[: edges[-1]], edges[:-1], axis=0) / readings
        return time[1:], np.diff(error[edges], axis=0) / np.diff(time)[:, np.newaxis]


def sensor_comparisons(sensed: Sensed | None) -> tuple[SensorComparison, ...]:
    """Return the readings of a simulated run by kind of sensor, as drawn in the report and the views.

    Args:
        sensed: what the sensors read; None for a run that ended before.
    """
    if sensed is None or not isinstance(sensed.truth, Truth):
        return ()
    return tuple(compare_sensors(sensed.readings, sensed.perfect, sensed.truth.ideal, sensed.readings.compensated))


def compare_sensors(
    readings: Readings, perfect: Readings, ideal: ImuData, compensated: ImuData | None
) -> Iterator[SensorComparison]:
    """Compare the readings of each kind of sensor with those of perfect sensors.

    Args:
        compensated: compensated increments, None without a calibration.
    """
    time, imu = ideal.time, readings.imu
    drift, ug = ("deg/h", units.DEG_H), ("µg", units.UG)
    deg_s, titles = ("deg/s", units.DEG), ["Gyros", "Accelerometers"]
    if readings.single is not None and perfect.single is not None:
        names = tuple(str(i) for i in range(1, readings.single.dtheta.shape[1] + 1))
        titles = ["Angular rate from the single gyros", "Specific force from the single accelerometers"]
        after = readings.single_compensated
        true, read = perfect.single.dtheta, readings.single.dtheta
        error, left = _total(read, true), None if after is None else _total(after.dtheta, true)
        yield SensorComparison(
            "single_gyro", "Single gyros", names, time, error, left, ANGLES, drift, true, read, deg_s
        )
        true, read = perfect.single.dvel, readings.single.dvel
        error, left = _total(read, true), None if after is None else _total(after.dvel, true)
        yield SensorComparison(
            "single_accel", "Single accelerometers", names, time, error, left, SPEEDS, ug, true, read, ("m/s²", 1.0)
        )
    if readings.accelerometers is not None and perfect.accelerometers is not None:
        names = tuple(str(i) for i in range(1, readings.accelerometers.shape[1] + 1))
        true, read = perfect.accelerometers, readings.accelerometers
        yield SensorComparison(
            "single",
            "Single accelerometers",
            names,
            time,
            _total(read, true),
            None,
            SPEEDS,
            ug,
            true,
            read,
            ("m/s²", 1.0),
        )
    if readings.attitude is not None and perfect.attitude is not None:
        off = rotation.multiply(readings.attitude, rotation.conjugate(perfect.attitude))
        error = rotation.rotation_vector_from_quaternion(off)
        yield SensorComparison("attitude", "Attitude sensor, inertial axes", AXES, time, error, None, ANGLES, drift)
    else:
        title = titles[0] if readings.accelerometers is None else "Angular rate from the accelerometers"
        left = None if compensated is None else _total(compensated.dtheta, ideal.dtheta)
        error = _total(imu.dtheta, ideal.dtheta)
        yield SensorComparison("gyro", title, AXES, time, error, left, ANGLES, drift, ideal.dtheta, imu.dtheta, deg_s)
    title = titles[1] if readings.accelerometers is None else "Specific force from the accelerometers"
    left = None if compensated is None else _total(compensated.dvel, ideal.dvel)
    error = _total(imu.dvel, ideal.dvel)
    yield SensorComparison("accel", title, AXES, time, error, left, SPEEDS, ug, ideal.dvel, imu.dvel, ("m/s²", 1.0))


def _total(read: Array, true: Array) -> Array:
    """Return the accumulated errors at every edge."""
    return np.concatenate((np.zeros((1, read.shape[1])), np.cumsum(read - true, axis=0)))
