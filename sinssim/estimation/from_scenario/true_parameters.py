"""True values of the sensors' parameters that a filter estimates, at its epochs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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
            for k, (name, triad) in enumerate(triads.items()):
                bias = triad.bias + drifts[k][i]
                values[f"{name} bias"] = bias + flicker[k][i] if triad.flicker else bias
                values[f"{name} scale"] = triad.scale
                values[f"{name} misalignment"] = triad.misalignment[~np.eye(3, dtype=bool)]
                values[f"{name} instability"] = instabilities[k][i]
            found.append(values)
        return found

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
        errors = ImuErrors(alone(self._left.gyro), alone(self._left.accel), warm_up=self._left.warm_up)
        return emulate(ImuData(self._edges, none, none), errors, self._seed)


def _less(true: TriadErrors, known: TriadErrors) -> TriadErrors:
    return replace(true, **{field: getattr(true, field) - getattr(known, field) for field in _STATES})
