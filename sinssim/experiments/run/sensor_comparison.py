"""Readings of a run's sensors against the truth, before and after compensation: means and sums of their errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from sinssim import rotation
from sinssim.charts import PAIR, Axis, Chart, Charts, Color, Line, Rule, Weight, over
from sinssim.data import Array, ImuData
from sinssim.exhibits import Medium
from sinssim.recording import style
from sinssim.recording.style import thinned
from sinssim.simulation.truth_stage import Truth
from sinssim.system.short_repr import short_repr
from sinssim.units import ANGLE_SCALE, DEG, DEG_H, SPEED_SCALE, UG, Scale, fixed, suiting

if TYPE_CHECKING:
    from sinssim.sensors.sets.sensor_readings import Readings
    from sinssim.simulation.sensed_stage import Sensed


AXES = ("x", "y", "z")
RECORDED_ROWS = 8001
"""Number of instants between which a recording has mean readings: no more than it shows without thinning."""
_Units = tuple[Scale, tuple[str, float], tuple[str, float]]
_GYRO: _Units = (ANGLE_SCALE, ("deg/h", DEG_H), ("deg/s", DEG))
_ACCEL: _Units = (SPEED_SCALE, ("µg", UG), ("m/s²", 1.0))
"""Units of sums of errors, of errors, and of readings."""
READINGS = {"gyro": "inertial angular rate", "accel": "specific force", "single": "specific force along each axis",
            "single_gyro": "angular rate", "single_accel": "specific force"}  # fmt: skip
"""What the sensors of a kind read."""


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
    """Return the readings of a simulated run by kind of sensor; nothing for a run that ended before them."""
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
    rate, force = "Gyros", "Accelerometers"

    def kind(key: str, title: str, units: _Units, read: Array, true: Array, after: Array | None) -> SensorComparison:
        single = key.startswith("single")
        names = tuple(str(i) for i in range(1, read.shape[1] + 1)) if single else AXES
        left = None if after is None else _total(after, true)
        sums, drift, reading = units
        return SensorComparison(key, title, names, time, _total(read, true), left, sums, drift, true, read, reading)

    if readings.single is not None and perfect.single is not None:
        rate, force = "Angular rate from the single gyros", "Specific force from the single accelerometers"
        read, true, rest = readings.single, perfect.single, readings.single_compensated
        after = (None, None) if rest is None else (rest.dtheta, rest.dvel)
        yield kind("single_gyro", "Single gyros", _GYRO, read.dtheta, true.dtheta, after[0])
        yield kind("single_accel", "Single accelerometers", _ACCEL, read.dvel, true.dvel, after[1])
    if readings.accelerometers is not None and perfect.accelerometers is not None:
        rate, force = "Angular rate from the accelerometers", "Specific force from the accelerometers"
        yield kind("single", "Single accelerometers", _ACCEL, readings.accelerometers, perfect.accelerometers, None)
    if readings.attitude is not None and perfect.attitude is not None:
        off = rotation.multiply(readings.attitude, rotation.conjugate(perfect.attitude))
        error = rotation.rotation_vector_from_quaternion(off)
        title = "Attitude sensor, inertial axes"
        yield SensorComparison("attitude", title, AXES, time, error, None, ANGLE_SCALE, _GYRO[1])
    else:
        yield kind("gyro", rate, _GYRO, imu.dtheta, ideal.dtheta, None if compensated is None else compensated.dtheta)
    yield kind("accel", force, _ACCEL, imu.dvel, ideal.dvel, None if compensated is None else compensated.dvel)


def _total(read: Array, true: Array) -> Array:
    """Return the accumulated errors at every edge."""
    return np.concatenate((np.zeros((1, read.shape[1])), np.cumsum(read - true, axis=0)))


def comparison_charts(kinds: Sequence[SensorComparison]) -> Iterator[Charts]:
    """Yield the readings and the errors of each kind, gyros to the left of accelerometers."""
    by_key = {kind.key: kind for kind in kinds}
    pairs = (("single",), ("single_gyro", "single_accel"), ("gyro", "attitude", "accel"))
    for keys in pairs:
        columns = [list(_errors(by_key[key])) for key in keys if key in by_key]
        if len(columns) == 1:
            rows = [tuple(columns[0])]
        else:
            rows = [tuple(chart for chart in row if chart is not None) for row in zip_longest(*columns)]
        if rows:
            yield Charts(f"{keys[0]}_errors", tuple(rows), (PAIR[0], len(rows) * PAIR[1]))
    read = tuple((_readings(kind),) for kind in kinds if kind.measured is not None)
    if read:
        yield Charts("readings", read, (PAIR[0], len(read) * PAIR[1]), on=("recording",))


def _errors(kind: SensorComparison) -> Iterator[Chart]:
    """Yield the mean and the accumulated errors of a kind of sensor.

    The error after compensation is drawn over the measured one, which is wide and pale.
    """
    unit, paint = suiting(kind.sums, kind.error), style.colors(kind.names)
    lines: list[tuple[Array, Sequence[Color], Weight, str]] = [(kind.error, paint, "line", "")]
    if kind.left is not None:
        pale = [style.tint(color) for color in paint]
        lines = [(kind.error, pale, "wide", " measured"), (kind.left, paint, "line", " compensated")]

    def chart(key: str, title: str, unit: tuple[str, float], values: Sequence[tuple[Array, Array]]) -> Chart:
        drawn = tuple(
            Line(label=f"{name}{word}", x=time, y=rows[:, i], color=colors[i], weight=weight)
            for (time, rows), (_, colors, weight, word) in zip(values, lines, strict=False)
            for i, name in enumerate(kind.names)
        )
        return _chart(kind, key, title, unit, drawn)

    means = [kind.averaged(error) for error, *_ in lines]
    if len(means[0][0]):
        of_mean = unit if kind.measured is None else kind.drift
        yield chart("error", f"error, mean over {kind.window:g} s", of_mean, means)
    what = "error of each measurement" if kind.measured is None else "error, accumulated"
    yield chart("sum", what, unit, [(kind.time, error) for error, *_ in lines])
    if kind.left is not None:
        rest = tuple(
            Line(label=name, x=kind.time, y=kind.left[:, i], color=paint[i]) for i, name in enumerate(kind.names)
        )
        unit = suiting(kind.sums, kind.left)
        yield _chart(kind, "left", "error after compensation, accumulated", unit, rest)


def _chart(kind: SensorComparison, key: str, title: str, unit: tuple[str, float], lines: tuple[Line, ...]) -> Chart:
    span = over((float(kind.time[0]), float(kind.time[-1])))
    return Chart(
        key=f"sensors/{kind.key}/{key}", title=f"{kind.title}: {title}", x=span, y=Axis(units=fixed(*unit)), marks=lines
    )


def _readings(kind: SensorComparison) -> Chart:
    """Return what sensors measured over what ideal ones would have, wide and pale."""
    assert kind.ideal is not None
    assert kind.measured is not None
    paint = style.colors(kind.names)
    lines = [
        line
        for word, increments, colors, weight in (
            ("ideal", kind.ideal, [style.tint(color) for color in paint], "wide"),
            ("measured", kind.measured, paint, "line"),
        )
        for line in mean_lines(kind.time, increments, [f"{name} {word}" for name in kind.names], colors, weight)  # type: ignore[arg-type]
    ]
    return _chart(kind, "reading", READINGS[kind.key], kind.reading, tuple(lines))


def mean_lines(
    time: Array,
    increments: Array,
    names: Sequence[str],
    colors: Sequence[Color],
    weight: Weight = "line",
    most: int = RECORDED_ROWS,
) -> Iterator[Line]:
    """Yield mean rates between some of the instants: sums of whole increments, without aliasing.

    Args:
        time: edges of the samples, (N+1,) s.
        increments: (N, k).
        most: number of instants.
    """
    edges = thinned(len(time), most)
    sums = np.add.reduceat(increments, edges[:-1], axis=0)
    means = sums / np.diff(time[edges])[:, np.newaxis]
    for i, (name, color) in enumerate(zip(names, colors, strict=True)):
        yield Line(label=name, x=time[edges[1:]], y=means[:, i], color=color, weight=weight)


def recorded_readings(imu: ImuData, marks: Sequence[Rule] = ()) -> Iterator[Charts]:
    """Yield what a recorded inertial unit sensed: on a page every reading, in a recording the means between a few."""
    x, paint = over((float(imu.time[0]), float(imu.time[-1]))), style.colors(AXES)
    kinds = (("gyro", "Inertial angular rate", imu.dtheta, _GYRO), ("accel", "Specific force", imu.dvel, _ACCEL))
    media: tuple[tuple[Medium, int], ...] = (("page", len(imu.time)), ("recording", RECORDED_ROWS))
    for medium, most in media:
        charts = tuple(
            Chart(key=f"sensors/{key}/reading", title=title, x=x, y=Axis(units=fixed(*units[2])),
                  marks=(*marks, *mean_lines(imu.time, increments, AXES, paint, "thin", most)))
            for key, title, increments, units in kinds
        )  # fmt: skip
        yield Charts("readings", (charts,), PAIR, on=(medium,))
