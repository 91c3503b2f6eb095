"""Errors of a redundant set: of the least-squares combination, and the variance of a single sensor's readings.

The combination of the readings y_i of m single sensors is x̂ = G y with G = (HᵀWH)⁻¹HᵀW, where W has 1 for a sensor in
use and 0 for an excluded one (`sinssim.sensors.sensor_set_section`). Sensor i has the bias b_i, the scale-factor
error k_i, the tilts M_ij of its sensitive axis h_i towards the two axes a_ij perpendicular to it, and the noise n_i.
The error of x̂ is that of a triad with

    (1) bias G b,    noise G n,    matrix E = Σ_i g_i (k_i h_i + Σ_j M_ij a_ij)ᵀ,

where g_i is column i of G. The diagonal of E is the scale-factor error, and its other elements are the misalignment. If
all sensors have the same 1σ, the covariances are

    (2) σ_b² P,  P = G Gᵀ = (HᵀWH)⁻¹,    cov(vec E) = σ_k² S Sᵀ + σ_M² T Tᵀ

with the columns of S and T from (1). P = (3/m) I if HᵀH = (m/3) I, as for every predefined set. The bias after the
exclusion of a sensor differs from the bias before by (G' − G) b. As G'H = I, this change has the covariance
σ_b² (P' − P) and is independent of the bias before it: G (G' − G)ᵀ = (HᵀH)⁻¹ (G'H − GH)ᵀ = 0.

Over a window of length T that starts at t₀, one sensor's sum of increments has the variance

    s² = N²T + Q²/6 + 2σ_b²τ(T − τ(1 − e^(−T/τ))) + B² T² var + K²(t₀T² + T³/3) + Σ_k (σ_k Δφ_k)²

The first terms are noise: random walk N, two roundings to the quantum Q, instability, flicker (with the variance of a
mean of flicker) and rate random walk. The last ones are the errors that are constant in a run: each is the product of a
number drawn with σ_k and of a known input Δφ_k, for example T for the bias, the accumulated angle along the sensitive
axis for the scale factor, and those along two axes perpendicular to it for the misalignment. They follow from the
least-squares estimate of the motion, because the true motion is not known to the monitor.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from sinssim.data import Array
from sinssim.sensors.flicker import variance_of_mean
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import CORRELATION_TIME, FIELDS, of_triad
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_section import Redundant, along, estimator
from sinssim.sensors.single_sensors import axes_about

_NOISES = [term.field for term in of_triad("gyro") if term.source and not term.drawn]


def axes_of_values(directions: Array, size: int) -> list[Array]:
    """Return the axes of all sensors, (m, 3), for each value that one sensor has of an error: its own for 3 values in a
    triad, the two others for 6, all three for 9. Sensitive axis i is axis i mod 3 of a block of its own, as
    `emulate_single_sensors` has."""
    blocks = np.stack([axes_about(row, i % 3) for i, row in enumerate(directions)])
    if size == 9:
        return list(blocks.swapaxes(0, 1))
    across = np.stack([np.delete(block, i % 3, axis=0) for i, block in enumerate(blocks)])
    return list(across.swapaxes(0, 1)) if size == 6 else [directions]


def maps(directions: Array, used: Array | None = None) -> dict[str, Array]:
    """Return the effects of the single sensors' errors on the combination, (1), by field of `TriadErrors`, for errors
    that are linear in the inputs.

    An effect is (3, m) on the output of the combination for an error that does not depend on the inputs; (9, m) or,
    with more values for a sensor, (9, 2m) or (9, 3m) on the matrix of its inputs, row by row.
    """
    gain = estimator(directions, None if used is None else np.asarray(used, dtype=np.float64))
    effects = {}
    for field, term in FIELDS.items():
        if term.slopes is not None:
            constant, sensitive_slope, _, _ = term.slopes
            axes = [directions] if sensitive_slope else axes_of_values(directions, term.size)
            matrix = np.einsum("ai,kib->abik", gain, np.stack(axes)).reshape(9, -1)
            effects[field] = gain if constant else matrix
    return effects


def spread(directions: Array, used: Array | None = None) -> Array:
    """Return P of (2), the covariance of the combination for errors of unit variance, (3, 3)."""
    gain = maps(directions, used)["bias"]
    return np.asarray(gain @ gain.T)


def combined_errors(
    blocks: Sequence[ImuErrors], directions: Array, used: tuple[Array, Array] | None = None
) -> ImuErrors:
    """Return the errors, linear in the inputs, of the triad that the combination is, (1). The mixed axes of an error
    that changes with temperature are not included. `blocks` are as of `draw_single_sensors`; `used` are the gyros and
    the accelerometers in use, (m,) each, by default all."""

    def triad(kind: Literal["gyro", "accel"], reading: Array | None) -> TriadErrors:
        by_field = maps(directions, reading)

        def combined(field: str) -> Array:
            return np.asarray(by_field[field] @ _of_sensors(blocks, kind, field, len(directions)).ravel())

        matrix = (combined("scale") + combined("misalignment")).reshape(3, 3)
        fields: dict[str, Any] = {}
        for field in by_field:
            of_field = combined(field)
            fields[field] = of_field if len(of_field) == 3 else _in_shape(of_field.reshape(3, 3), field)
        scale = matrix.diagonal().copy()
        return TriadErrors(**fields | {"scale": scale, "misalignment": matrix - np.diag(scale)})

    gyros, accels = (None, None) if used is None else used
    return ImuErrors(triad("gyro", gyros), triad("accel", accels), warm_up=blocks[0].warm_up)


def _in_shape(matrix: Array, field: str) -> Array:
    """Return the part of a matrix, (3, 3), that a field of `TriadErrors` can have."""
    return matrix if len(FIELDS[field].shape) == 2 else matrix.diagonal().copy()


def _of_sensors(blocks: Sequence[ImuErrors], kind: str, field: str, count: int) -> Array:
    """Return one error of all single sensors, (m, 1), (m, 2) across the axis, or (m, 3) along the block's axes."""
    rows = []
    for i in range(count):
        values, axis = getattr(getattr(blocks[i // 3], kind), field)[i % 3], i % 3
        rows.append(np.delete(values, axis) if FIELDS[field].size == 6 else np.atleast_1d(values))
    return np.array(rows)


def combined_sigma(sigma: ImuErrors, imu: Imu) -> ImuErrors:
    """Return the standard deviations of the combination from those of a single sensor, (2); the given ones if the set
    is not redundant. Noises, which have one number for the three axes, are multiplied by √(tr P/3), and non-linear
    errors by the root of the diagonal of P. The mixed axes of an error that changes with temperature are not
    included."""
    if not isinstance(imu.sensor_set, Redundant):
        return sigma
    by_field = maps(imu.sensor_set.axes)
    sizes = {field: np.linalg.norm(columns, axis=1) for field, columns in by_field.items()}
    mean = float(np.sqrt(np.mean(sizes["bias"] ** 2)))

    def triad(triad_errors: TriadErrors) -> TriadErrors:
        fields: dict[str, Any] = {field: mean * getattr(triad_errors, field) for field in _NOISES}
        for field, term in FIELDS.items():
            value = getattr(triad_errors, field)
            if term.multiplies is None:
                continue
            if field not in sizes:
                fields[field] = (sizes["bias"] if value.ndim == 1 else sizes["bias"][:, None]) * value
            elif len(sizes[field]) == 3:
                fields[field] = sizes[field] * value
            else:
                fields[field] = _in_shape(float(np.max(value)) * sizes[field].reshape(3, 3), field)
        parts = (float(np.max(getattr(triad_errors, f))) * sizes[f].reshape(3, 3) for f in ("scale", "misalignment"))
        matrix = np.hypot(*parts)
        scale = matrix.diagonal().copy()
        return replace(triad_errors, **fields | {"scale": scale, "misalignment": matrix - np.diag(scale)})

    return replace(sigma, gyro=triad(sigma.gyro), accel=triad(sigma.accel))


_ROUNDING = 1e-12
"""1σ of the arithmetic's rounding, relative to the largest increment; without any error it is all there is."""


@dataclass(frozen=True)
class Inputs:
    """What acts on the sensors of one kind, as the set itself estimates it."""

    start: Array  # time of the edges since the first one, (N+1,) s
    sensed: Array  # increments of what the sensors measure, (N, 3) rad or m/s
    force: Array  # velocity increments, (N, 3) m/s


def accumulated_inputs(imu: Imu, kind: str, directions: Array, inputs: Inputs) -> tuple[Array, Array]:
    """Return the accumulated inputs of the errors that are constant in a run, (N+1, B), and their coefficients, (K, m,
    B): the K-th error of sensor i over a window is normal with the standard deviation |Σ_b coefficients_kib Δ
    inputs_b|."""
    column_sets: list[Array] = []
    features: list[tuple[int, Array]] = []
    for term, sigma in getattr(imu.sigma, kind).acting:
        for columns, coefficients in _features(term, imu, directions, inputs):
            same = [n for n, other in enumerate(column_sets) if np.array_equal(other, columns)]
            column_sets += [] if same else [columns]
            features.append((same[0] if same else len(column_sets) - 1, float(np.max(sigma)) * coefficients))
    ends = np.cumsum([0, *(columns.shape[1] for columns in column_sets)])
    place = [slice(*pair) for pair in pairwise(ends)]
    base = np.zeros((len(inputs.start), ends[-1]))
    for columns, where in zip(column_sets, place, strict=True):
        np.cumsum(columns, axis=0, out=base[1:, where])
    matrix = np.zeros((len(features), len(directions), ends[-1]))
    for number, (which, coefficients) in enumerate(features):
        matrix[number, :, place[which]] = coefficients
    return base, matrix


def _features(term: ErrorTerm, imu: Imu, directions: Array, inputs: Inputs) -> Iterator[tuple[Array, Array]]:
    """Yield the inputs of each value that one sensor has of an error: increments (N, c), and factors (m, c)."""
    assert term.multiplies is not None
    dt = np.diff(inputs.start)[:, np.newaxis]
    middle = inputs.start[:-1, np.newaxis] + 0.5 * dt
    warmth = imu.warm_up.temperature(middle)
    for axes in axes_of_values(directions, term.size):
        if term.slopes is None:
            sensitive_input, across, force = (
                along(inputs.sensed, directions),
                along(inputs.sensed, axes),
                along(inputs.force, axes),
            )
            yield dt * term.multiplies(sensitive_input / dt, across / dt, force / dt, warmth, middle), np.eye(len(axes))
            continue
        motions = (dt, inputs.sensed, inputs.sensed, inputs.force)
        towards = (np.ones((len(axes), 1)), directions, axes, axes)
        for slope, factor, motion, rows in zip(
            term.slopes, term.factors(warmth, middle), motions, towards, strict=True
        ):
            if slope:
                yield factor * motion, rows


def noise_variance(imu: Imu, kind: str, counts: Array, largest: float) -> Array:
    """Return the variance of the noise of one sensor's readings summed over windows, at the start, and its growth per
    second of a later start, (W, 2). The largest increment of a sensor, rad or m/s, gives the rounding of the
    arithmetic."""
    noise: TriadErrors = getattr(imu.sigma, kind)
    span = counts / imu.rate_hz
    variance = noise.random_walk**2 * span + noise.quantum**2 / 6.0
    tau = noise.correlation_time or CORRELATION_TIME
    variance = variance + 2.0 * noise.instability**2 * tau * (span + tau * np.expm1(-span / tau))
    variance = variance + noise.flicker**2 * span**2 * variance_of_mean(counts)
    variance = variance + noise.rate_walk**2 * span**3 / 3.0
    variance = variance + (_ROUNDING * max(largest, 1e-30)) ** 2 * counts
    return np.column_stack((variance, noise.rate_walk**2 * span**2))
