"""True values of the sensors' parameters that a filter estimates, at its epochs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.estimation.model import crossing_time
from sinssim.sensors.imu.errors import ImuErrors
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.sets.accelerometers import APART
from sinssim.sensors.sets.combination import combined_errors
from sinssim.sensors.sets.monitor import combine
from sinssim.sensors.sets.sensor_set import Redundant, SensorSet
from sinssim.sensors.sets.true_errors import TrueErrors

_STATES = ("bias", "scale", "misalignment", "bias_temperature")  # the parameters that a calibration changes


class InertialParameters:
    """True parameters of the inertial sensors of one run, less the calibrated part."""

    def __init__(
        self,
        errors: TrueErrors,
        edges: Array,
        seed: int,
        section: SensorSet | None = None,
        used: tuple[Array, Array] | None = None,
    ) -> None:
        """Store the run's errors.

        Args:
            edges: edges of the IMU's intervals, (N+1,) s.
            seed: the run's seed, which determines the noises that drive the drifts.
            section: the set of sensors; default: three gyros and three accelerometers.
            used: whether each gyro and each accelerometer of a redundant set is in use, (N, m) each; default: all.
        """
        self._edges, self._seed, self._used = edges, seed, used
        self._left = _remaining(errors.imu, errors.calibration)
        self._axes = section.axes if isinstance(section, Redundant) else None
        known = errors.single_calibrations or (None,) * len(errors.single_sensors)
        self._blocks = tuple(map(_remaining, errors.single_sensors, known))

    def at(self, *times: Array) -> list[dict[str, Array]]:
        """Return the parameters by block of the filter.

        Each error is emulated once for all times, and what is emulated is not kept.

        Args:
            *times: epochs of the filter, of the smoother and so on, (K,) s each.

        Returns:
            For each of the times: biases and instabilities, (3,) or (K, 3); scale factors, (3,), and misalignments,
            (6,).
        """
        triads = {"gyro": self._left.gyro, "accelerometer": self._left.accel}
        # the filter treats faster changes of flicker as noise
        crossing = [crossing_time(triad) if triad.flicker else 0.0 for triad in triads.values()]
        drifts = self._means(("rate_walk", "ramp", "bias_temperature"), times, (1.0, 1.0))
        instabilities = self._means(("instability", "correlation_time"), times, (0.0, 0.0))
        flicker = self._means(("flicker",), times, crossing)
        found: list[dict[str, Array]] = []
        for i in range(len(times)):
            values: dict[str, Array] = {}
            constant = self._constant(times[i])
            for k, (name, triad) in enumerate(triads.items()):
                bias = constant[k][0] + drifts[k][i]
                values[f"{name} bias"] = bias + flicker[k][i] if triad.flicker else bias
                values[f"{name} scale"] = constant[k][1]
                values[f"{name} misalignment"] = constant[k][2][..., ~np.eye(3, dtype=bool)]
                values[f"{name} instability"] = instabilities[k][i]
            found.append(values)
        return found

    def _constant(self, times: Array) -> list[tuple[Array, Array, Array]]:
        """Return bias, scale factor and misalignment of gyros and accelerometers; in a row for each time, (K, …), if
        the combination of a redundant set changes."""
        if self._axes is None or self._used is None:
            every = self._left if self._axes is None else combined_errors(self._blocks, self._axes)
            return [(triad.bias, triad.scale, triad.misalignment) for triad in (every.gyro, every.accel)]
        last = np.searchsorted(self._edges, times - 1e-9).clip(1, len(self._edges) - 1) - 1
        rows = np.concatenate([one[last] for one in self._used], axis=1)
        kinds, which = np.unique(rows, axis=0, return_inverse=True)
        count = len(self._axes)
        found = [combined_errors(self._blocks, self._axes, (one[:count], one[count:])) for one in kinds]

        def rows_of(triads: list[TriadErrors]) -> tuple[Array, Array, Array]:
            bias, scale, tilt = (np.array([getattr(one, name) for one in triads])[which] for name in _STATES[:3])
            return bias, scale, tilt

        return [rows_of([one.gyro for one in found]), rows_of([one.accel for one in found])]

    def _means(
        self, fields: tuple[str, ...], times: Sequence[Array], windows: Sequence[float]
    ) -> tuple[list[Array], list[Array]]:
        """Return the contribution of some errors to rates and specific forces, (K, 3) for each of the times, or zeros,
        (3,), if there are none.

        It is the mean over the last seconds before each epoch, over one sample at least. There is one window, s, for
        each triad.
        """
        triads = self._left.gyro, self._left.accel
        if not any(np.any(getattr(t, f)) for t in triads for f in fields if f != "correlation_time"):
            return [np.zeros(3)] * len(times), [np.zeros(3)] * len(times)
        edges, drift = self._edges, self._emulated(fields)

        def means(increments: Array, window: float) -> list[Array]:
            sums, found = np.concatenate([np.zeros((1, 3)), np.cumsum(increments, axis=0)]), []
            for time in times:
                last = np.searchsorted(edges, time - 1e-9).clip(1, len(edges) - 1)
                first = np.searchsorted(edges, edges[last] - window - 1e-9).clip(0, last - 1)
                found.append((sums[last] - sums[first]) / (edges[last] - edges[first])[:, np.newaxis])
            return found

        return means(drift.dtheta, windows[0]), means(drift.dvel, windows[1])

    def _emulated(self, fields: tuple[str, ...]) -> ImuData:
        """Return the contribution of some errors to the increments.

        The emulator runs on zero motion with these errors alone. Its draws of a term do not depend on which other terms
        are switched on.
        """
        from sinssim.sensors.imu.emulate import emulate

        def alone(triad: TriadErrors) -> TriadErrors:
            return TriadErrors(**{field: getattr(triad, field) for field in fields})

        none = np.zeros((len(self._edges) - 1, 3))
        read = [
            emulate(
                ImuData(self._edges, none, none),
                ImuErrors(alone(block.gyro), alone(block.accel), warm_up=block.warm_up),
                self._seed + number * APART,
            )
            for number, block in enumerate(self._blocks or (self._left,))
        ]
        if self._axes is None:
            return read[0]
        count, used = len(self._axes), self._used or (None, None)
        singles = (np.hstack([getattr(one, name) for one in read])[:, :count] for name in ("dtheta", "dvel"))
        dtheta, dvel = (combine(rows, self._axes, own) for rows, own in zip(singles, used, strict=True))
        return ImuData(self._edges, dtheta, dvel)


def _remaining(true: ImuErrors, known: ImuErrors | None) -> ImuErrors:
    """Return the errors less the calibrated part of those that can be states."""
    if known is None:
        return true
    return replace(true, gyro=_less(true.gyro, known.gyro), accel=_less(true.accel, known.accel))


def _less(true: TriadErrors, known: TriadErrors) -> TriadErrors:
    return replace(true, **{field: getattr(true, field) - getattr(known, field) for field in _STATES})
