"""True values of the sensors' parameters that a filter estimates, at its epochs."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.estimation.model import crossing_time
from sinssim.sensors.imu.errors import ImuErrors, TriadErrors
from sinssim.sensors.sets.true_errors import TrueErrors

_STATES = ("bias", "scale", "misalignment", "bias_temperature")  # the parameters that a calibration changes


class InertialParameters:
    """True parameters of the inertial sensors of one run, less the calibrated part."""

    def __init__(self, errors: TrueErrors, edges: Array, seed: int) -> None:
        """Store the run's errors.

        Args:
            errors: the true errors of the sensors.
            edges: edges of the IMU's intervals, (N+1,) s.
            seed: the run's seed, which determines the noises that drive the drifts.
        """
        self._edges, self._seed = edges, seed
        self._left, known = errors.imu, errors.calibration
        if known is not None:
            self._left = replace(
                errors.imu, gyro=_less(errors.imu.gyro, known.gyro), accel=_less(errors.imu.accel, known.accel)
            )
        self._angles = cache(self._accumulated)  # emulated once, for filter and smoother

    def at(self, time: Array) -> dict[str, Array]:
        """Return the parameters by block of the filter.

        Args:
            time: epochs, (K,) s.

        Returns:
            Biases and instabilities, (3,) or (K, 3); scale factors, (3,), and misalignments, (6,).
        """
        drifts = self._mean(("rate_walk", "ramp", "bias_temperature"), time, 1.0)
        instabilities = self._mean(("instability", "correlation_time"), time, 0.0)
        values: dict[str, Array] = {}
        for k, (name, triad) in enumerate((("gyro", self._left.gyro), ("accelerometer", self._left.accel))):
            bias = triad.bias + drifts[k]
            if triad.flicker:  # the filter treats faster changes as noise
                bias = bias + self._mean(("flicker",), time, crossing_time(triad))[k]
            values[f"{name} bias"], values[f"{name} scale"] = bias, triad.scale
            values[f"{name} misalignment"] = triad.misalignment[~np.eye(3, dtype=bool)]
        return values | dict(zip(("gyro instability", "accelerometer instability"), instabilities, strict=True))

    def _mean(self, fields: tuple[str, ...], time: Array, window: float) -> tuple[Array, Array]:
        """Return the contribution of some errors to rates and specific forces, (K, 3) each, or zeros, (3,), if there
        are none.

        It is the mean over the last seconds before each epoch, over one sample at least.
        """
        triads = self._left.gyro, self._left.accel
        if not any(np.any(getattr(t, f)) for t in triads for f in fields if f != "correlation_time"):
            return np.zeros(3), np.zeros(3)
        edges = self._edges
        last = np.searchsorted(edges, time - 1e-9).clip(1, len(edges) - 1)
        first = np.searchsorted(edges, edges[last] - window - 1e-9).clip(0, last - 1)
        span = (edges[last] - edges[first])[:, np.newaxis]
        gyro, accel = self._angles(fields)
        return (gyro[last] - gyro[first]) / span, (accel[last] - accel[first]) / span

    def _accumulated(self, fields: tuple[str, ...]) -> tuple[Array, Array]:
        """Return the contribution of some errors to the increments, summed up to each edge, (N+1, 3) each.

        The emulator runs on zero motion with these errors alone. Its draws of a term do not depend on which other terms
        are switched on.
        """
        from sinssim.sensors.imu.emulate import emulate

        def alone(triad: TriadErrors) -> TriadErrors:
            return TriadErrors(**{field: getattr(triad, field) for field in fields})

        none = np.zeros((len(self._edges) - 1, 3))
        errors = ImuErrors(alone(self._left.gyro), alone(self._left.accel), warm_up=self._left.warm_up)
        drift = emulate(ImuData(self._edges, none, none), errors, self._seed)
        return _sums(drift.dtheta), _sums(drift.dvel)


def _sums(increments: Array) -> Array:
    return np.concatenate([np.zeros((1, 3)), np.cumsum(increments, axis=0)])


def _less(true: TriadErrors, known: TriadErrors) -> TriadErrors:
    return replace(true, **{field: getattr(true, field) - getattr(known, field) for field in _STATES})
