"""Errors of the increments that a redundant set gives after the least-squares combination.

The combination of the readings y_i of m single sensors is x̂ = G y with G = (HᵀWH)⁻¹HᵀW, where W has 1 for a sensor in
use and 0 for an excluded one (`sinssim.sensors.sets.geometry`). Sensor i has the bias b_i, the scale-factor error k_i,
the tilts M_ij of its sensitive axis h_i towards the two axes a_ij perpendicular to it, and the noise n_i. The error of
x̂ is that of a triad with

    (1) bias G b,    noise G n,    matrix E = Σ_i g_i (k_i h_i + Σ_j M_ij a_ij)ᵀ,

where g_i is column i of G. The diagonal of E is the scale-factor error, and its other elements are the misalignment. If
all sensors have the same 1σ, the covariances are

    (2) σ_b² P,  P = G Gᵀ = (HᵀWH)⁻¹,    cov(vec E) = σ_k² S Sᵀ + σ_M² T Tᵀ

with the columns of S and T from (1). P = (3/m) I if HᵀH = (m/3) I, as for every predefined set. The bias after the
exclusion of a sensor differs from the bias before by (G' − G) b. As G'H = I, this change has the covariance
σ_b² (P' − P) and is independent of the bias before it: G (G' − G)ᵀ = (HᵀH)⁻¹ (G'H − GH)ᵀ = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from sinssim.data import Array
from sinssim.sensors.imu.errors import ImuErrors
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu import Imu
from sinssim.sensors.imu.terms import FIELDS, of_triad
from sinssim.sensors.sets.accelerometers import axes_about
from sinssim.sensors.sets.geometry import estimator
from sinssim.sensors.sets.sensor_set import Redundant

_NOISES = [term.field for term in of_triad("gyro") if term.source and not term.drawn]


def axes_of_values(directions: Array, size: int) -> list[Array]:
    """Return the axes j to which the values ij of a single sensor's error belong.

    Args:
        directions: sensitive axes, (m, 3). Each is axis i mod 3 of a block of its own, as `emulate_single_sensors` has.
        size: number of values of the error in a triad, as of `ErrorTerm`.

    Returns:
        Axes of all sensors, (m, 3), for each value of one sensor: its own for 3, the two others for 6, all three for 9.
    """
    blocks = np.stack([axes_about(row, i % 3) for i, row in enumerate(directions)])
    if size == 9:
        return list(blocks.swapaxes(0, 1))
    across = np.stack([np.delete(block, i % 3, axis=0) for i, block in enumerate(blocks)])
    return list(across.swapaxes(0, 1)) if size == 6 else [directions]


def maps(directions: Array, used: Array | None = None) -> dict[str, Array]:
    """Return the effects of the single sensors' errors on the combination, (1).

    Args:
        directions: sensitive axes, (m, 3).
        used: which sensors are in use, (m,); default: all.

    Returns:
        By field of `TriadErrors`, of errors that are linear in the inputs: (3, m) on the output of the combination for
        those that do not depend on the inputs; (9, m) or, with more values for a sensor, (9, 2m) or (9, 3m) on the
        matrix of its inputs, row by row.
    """
    gain = estimator(directions, None if used is None else np.asarray(used, dtype=np.float64))
    found = {}
    for field, term in FIELDS.items():
        if term.slopes is not None:
            constant, own, _, _ = term.slopes
            axes = [directions] if own else axes_of_values(directions, term.size)
            matrix = np.einsum("ai,kib->abik", gain, np.stack(axes)).reshape(9, -1)
            found[field] = gain if constant else matrix
    return found


def spread(directions: Array, used: Array | None = None) -> Array:
    """Return P of (2), the covariance of the combination for errors of unit variance, (3, 3).

    Args:
        directions: sensitive axes, (m, 3).
        used: which sensors are in use, (m,); default: all.
    """
    gain = maps(directions, used)["bias"]
    return np.asarray(gain @ gain.T)


def combined_errors(
    blocks: Sequence[ImuErrors], directions: Array, used: tuple[Array, Array] | None = None
) -> ImuErrors:
    """Return the errors of the triad that the combination is, (1).

    Args:
        blocks: errors of the single sensors in threes, as of `draw_single_sensors`.
        directions: sensitive axes, (m, 3).
        used: which gyros and which accelerometers are in use, (m,) each; default: all.

    Returns:
        The errors that are linear in the inputs; the mixed axes of one that changes with temperature are not included.
    """

    def triad(kind: Literal["gyro", "accel"], own: Array | None) -> TriadErrors:
        by_field = maps(directions, own)

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
        own, axis = getattr(getattr(blocks[i // 3], kind), field)[i % 3], i % 3
        rows.append(np.delete(own, axis) if FIELDS[field].size == 6 else np.atleast_1d(own))
    return np.array(rows)


def combined_sigma(sigma: ImuErrors, imu: Imu) -> ImuErrors:
    """Return the standard deviations of the combination from those of a single sensor, (2).

    Args:
        sigma: standard deviations of a triad's errors, equal for all sensors of a kind.
        imu: the sensor block.

    Returns:
        Those of the combination if the set is redundant, else the given ones. Noises, which have one number for the
        three axes, are multiplied by √(tr P/3), and non-linear errors by the root of the diagonal of P. The mixed axes
        of an error that changes with temperature are not included.
    """
    if not isinstance(imu.sensor_set, Redundant):
        return sigma
    by_field = maps(imu.sensor_set.axes)
    sizes = {field: np.linalg.norm(columns, axis=1) for field, columns in by_field.items()}
    mean = float(np.sqrt(np.mean(sizes["bias"] ** 2)))

    def triad(own: TriadErrors) -> TriadErrors:
        found: dict[str, Any] = {field: mean * getattr(own, field) for field in _NOISES}
        for field, term in FIELDS.items():
            value = getattr(own, field)
            if term.multiplies is None:
                continue
            if field not in sizes:
                found[field] = (sizes["bias"] if value.ndim == 1 else sizes["bias"][:, None]) * value
            elif len(sizes[field]) == 3:
                found[field] = sizes[field] * value
            else:
                found[field] = _in_shape(float(np.max(value)) * sizes[field].reshape(3, 3), field)
        matrix = np.hypot(*(float(np.max(getattr(own, f))) * sizes[f].reshape(3, 3) for f in ("scale", "misalignment")))
        scale = matrix.diagonal().copy()
        return replace(own, **found | {"scale": scale, "misalignment": matrix - np.diag(scale)})

    return replace(sigma, gyro=triad(sigma.gyro), accel=triad(sigma.accel))
