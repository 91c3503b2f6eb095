"""What σ of a single sensor's summed readings includes: every error that a scenario's [imu] states.

Over a window of length T that starts at t₀, one sensor's sum of increments has the variance

    s² = N²T + Q²/6 + 2σ_b²τ(T − τ(1 − e^(−T/τ))) + B² T² var + K²(t₀T² + T³/3) + Σ_k (σ_k Δφ_k)²

The first terms are noise: random walk N, two roundings to the quantum Q, instability, flicker (with the variance of a
mean of flicker) and rate random walk. The last ones are the errors that are constant in a run: each is the product of a
number drawn with σ_k and of a known input Δφ_k, for example T for the bias, the accumulated angle along the sensitive
axis for the scale factor, and those along two axes perpendicular to it for the misalignment. They follow from the
least-squares estimate of the motion, because the true motion is not known to the monitor.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu import Imu
from sinssim.sensors.imu.terms import CORRELATION_TIME, of_triad
from sinssim.sensors.noise.flicker import variance_of_mean
from sinssim.sensors.sets.accelerometers import axes_about
from sinssim.sensors.sets.geometry import along

_ROUNDING = 1e-12
"""1σ of the arithmetic's rounding, relative to the largest increment; without any error it is all there is."""


@dataclass(frozen=True)
class Inputs:
    """What acts on the sensors of one kind, as the set itself estimates it.

    Attributes:
        start: time of the edges since the first one, (N+1,) s.
        own: increments of what the sensors measure, (N, 3) rad or m/s.
        force: velocity increments, (N, 3) m/s.
    """

    start: Array
    own: Array
    force: Array


def accumulated_inputs(imu: Imu, kind: str, directions: Array, inputs: Inputs) -> tuple[Array, Array]:
    """Return the inputs of the errors that are constant in a run, and their 1σ.

    Args:
        imu: the sensor block.
        kind: "gyro" or "accel".
        directions: sensitive axes, (m, 3).
        inputs: estimated motion.

    Returns:
        Accumulated inputs, (N+1, B), and coefficients, (K, m, B): the K-th error of sensor i over a window is normal
        with the standard deviation |Σ_b coefficients_kib Δ inputs_b|.

    Raises:
        InputError: an error is stated of which the test does not know the input.
    """
    own = getattr(imu.sigma, kind)
    spreads = {term.field: float(np.max(getattr(own, term.field))) for term in of_triad(kind) if term.drawn}
    found: dict[str, Array] = {}
    features: list[tuple[str, Array]] = []
    for field, sigma in spreads.items():
        if sigma:
            for name, columns, coefficients in _features(field, imu, directions, inputs):
                found.setdefault(name, columns)
                features.append((name, sigma * coefficients))
    place, begin = {}, 0
    for name, columns in found.items():
        place[name] = slice(begin, begin + columns.shape[1])
        begin += columns.shape[1]
    base = np.zeros((len(inputs.start), begin))
    for name, columns in found.items():
        np.cumsum(columns, axis=0, out=base[1:, place[name]])
    matrix = np.zeros((len(features), len(directions), begin))
    for number, (name, coefficients) in enumerate(features):
        matrix[number, :, place[name]] = coefficients
    return base, matrix


def _features(field: str, imu: Imu, directions: Array, inputs: Inputs) -> Iterator[tuple[str, Array, Array]]:
    """Yield the inputs of one error: name, increments (N, c), and factors (m, c)."""
    count = len(directions)
    dt = np.diff(inputs.start)[:, np.newaxis]
    middle = inputs.start[:-1, np.newaxis] + 0.5 * dt
    own = along(inputs.own, directions) if field in ("asymmetry", "quadratic", "cubic", "cross_axis") else np.empty(0)
    across = [np.array([axes_about(row, 0)[j] for row in directions]) for j in (1, 2)]
    one, each = np.ones((count, 1)), np.eye(count)
    match field:
        case "bias":
            yield "time", dt, one
        case "scale":
            yield "own", inputs.own, directions
        case "misalignment":
            for axes in across:
                yield "own", inputs.own, axes
        case "asymmetry":
            yield "magnitude", 0.5 * np.abs(own), each
        case "quadratic":
            yield "square", own**2 / dt, each
        case "cubic":
            yield "cube", own**3 / dt**2, each
        case "cross_axis":
            for j, axes in enumerate(across):
                yield f"product {j}", own * along(inputs.own, axes) / dt, each
        case "g_sensitivity":
            for row in np.eye(3):
                yield "force", inputs.force, np.tile(row, (count, 1))
        case "bias_temperature":
            yield "warmth", imu.warm_up.temperature(middle) * dt, one
        case "scale_temperature":
            yield "warm own", imu.warm_up.temperature(middle) * inputs.own, directions
        case "ramp":
            yield "ramp", middle * dt, one
        case _:
            raise InputError(
                f"the monitoring of a redundant set does not know the effect of the error {field!r}: set its 1σ to 0, "
                'or sensor_set.monitoring = "none".'
            )


def noise_variance(imu: Imu, kind: str, counts: Array, largest: float) -> Array:
    """Return the variance of the noise of one sensor's readings, summed over windows.

    Args:
        imu: the sensor block.
        kind: "gyro" or "accel".
        counts: samples of each window, (W,).
        largest: largest increment of a sensor, rad or m/s, for the rounding of the arithmetic.

    Returns:
        Variance of a window at the start, and its growth per second of a later start, (W, 2).
    """
    own: TriadErrors = getattr(imu.sigma, kind)
    span = counts / imu.rate_hz
    variance = own.random_walk**2 * span + own.quantum**2 / 6.0
    tau = own.correlation_time or CORRELATION_TIME
    variance = variance + 2.0 * own.instability**2 * tau * (span + tau * np.expm1(-span / tau))
    variance = variance + own.flicker**2 * span**2 * variance_of_mean(counts)
    variance = variance + own.rate_walk**2 * span**3 / 3.0
    variance = variance + (_ROUNDING * max(largest, 1e-30)) ** 2 * counts
    return np.column_stack((variance, own.rate_walk**2 * span**2))
