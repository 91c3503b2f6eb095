"""The parameters of a calibration: their names, units, sizes, and the errors of a block that they stand for.

The model is that of the emulator (`sinssim.sensors.imu.emulation`, stages 1, 2 and 4): y = (1 + k)(u + M u) + b for
each triad, and the places of the accelerometers. The separate method refers all of it to the axes of the table's
positions. The systematic method has no such reference: a common rotation of all sensors changes nothing that it
observes. Its frame is that of the accelerometers: x along the sensitive axis of the forward accelerometer, and y in
the plane of the forward and the right one, so that the misalignments xy, xz and yz of the accelerometers are zero by
definition. The places of the accelerometers are those from the forward one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu import Imu
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.units import ARCSEC, DEG_H, PPM, UG

AXES = "xyz"
_PAIRS = ((0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1))
FIXED = ("accel misalignment xy", "accel misalignment xz", "accel misalignment yz")
"""Zero by the definition of the systematic method's frame."""
_USUAL = {
    ("gyro", "bias"): 0.01 * DEG_H, ("gyro", "scale"): 10 * PPM, ("gyro", "misalignment"): 5 * ARCSEC,
    ("accel", "bias"): 50 * UG, ("accel", "scale"): 50 * PPM, ("accel", "misalignment"): 5 * ARCSEC,
}  # fmt: skip
"""Sizes of the errors of a block whose grade has none: those of the grade laser-standard."""
_ARM = 0.01
"""Size of the places of accelerometers, m."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of a calibration."""

    triad: str  # "gyro" or "accel"
    field: str  # "bias", "scale", "misalignment" or "arm"
    row: int  # the sensitive axis, 0 to 2
    column: int  # the other axis of a misalignment, or the coordinate of a place; else the sensitive axis
    size: float  # 1σ of this error before the calibration, SI: the scale of what is observable

    @property
    def name(self) -> str:
        """Its name, for example "gyro misalignment xy"."""
        axes = AXES[self.row] if self.field in ("bias", "scale") else AXES[self.row] + AXES[self.column]
        return f"{self.triad} {self.field} {axes}"

    @property
    def unit(self) -> tuple[str, float]:
        """Its unit as people write it, and the size of the unit in SI."""
        if self.field == "bias":
            return ("deg/h", DEG_H) if self.triad == "gyro" else ("µg", UG)
        return {"scale": ("ppm", PPM), "misalignment": ("arcsec", ARCSEC), "arm": ("mm", 1e-3)}[self.field]


def parameters(imu: Imu, method: str, arms: bool = False) -> tuple[Parameter, ...]:
    """Return the parameters that a method estimates, with the places of the accelerometers if `arms`.

    Their sizes are the 1σ and the given errors of the sensor block.
    """
    chosen = []
    for triad in ("gyro", "accel"):
        for field in ("bias", "scale", "misalignment"):
            size = _size(imu, triad, field)
            for row, column in _PAIRS if field == "misalignment" else ((0, 0), (1, 1), (2, 2)):
                parameter = Parameter(triad, field, row, column, size)
                if method == "separate" or parameter.name not in FIXED:
                    chosen.append(parameter)
    if arms:
        size = max(_ARM, float(np.abs(imu.accel_arms_mm).max()) * 1e-3)
        chosen += [Parameter("accel", "arm", row, column, size) for row in (1, 2) for column in range(3)]
    return tuple(chosen)


def _size(imu: Imu, triad: str, field: str) -> float:
    (term,) = (term for term in TERMS if term.triad == triad and term.field == field)
    mean, sigma = imu.stated(term)
    off = ~np.eye(3, dtype=bool) if term.size == 6 else np.ones(3, dtype=bool)
    total = np.broadcast_to(mean, off.shape)[off] ** 2 + np.broadcast_to(sigma, off.shape)[off] ** 2
    return float(np.sqrt(np.mean(total))) or _USUAL[triad, field]


def errors_of(known: tuple[Parameter, ...], values: Array) -> ImuErrors:
    """Return the errors of a block from the values of parameters, (p,) SI; all others are zero."""
    parts: dict[str, dict[str, Any]] = {
        triad: {"bias": np.zeros(3), "scale": np.zeros(3), "misalignment": np.zeros((3, 3))}
        for triad in ("gyro", "accel")
    }
    arms = np.zeros((3, 3))
    for parameter, value in zip(known, values, strict=True):
        if parameter.field == "arm":
            arms[parameter.row, parameter.column] = value
        elif parameter.field == "misalignment":
            parts[parameter.triad]["misalignment"][parameter.row, parameter.column] = value
        else:
            parts[parameter.triad][parameter.field][parameter.row] = value
    return ImuErrors(TriadErrors(**parts["gyro"]), TriadErrors(**parts["accel"]), arms)


def values_of(known: tuple[Parameter, ...], errors: ImuErrors) -> Array:
    """Return the values of parameters, (p,) SI, from the errors of a block in the frame of the parameters."""
    values = []
    for parameter in known:
        if parameter.field == "arm":
            values.append(errors.arms[parameter.row, parameter.column] - errors.arms[0, parameter.column])
            continue
        value = getattr(errors.gyro if parameter.triad == "gyro" else errors.accel, parameter.field)
        values.append(
            value[parameter.row, parameter.column] if parameter.field == "misalignment" else value[parameter.row]
        )
    return np.array(values, dtype=np.float64)


def in_accelerometer_frame(errors: ImuErrors) -> tuple[ImuErrors, Array]:
    """Return the errors of a block in the frame of its accelerometers, and C, v_accelerometers = C v_block, (3, 3).

    In this frame the misalignments xy, xz and yz of the accelerometers are zero.
    """
    axes = np.eye(3) + errors.accel.misalignment
    if not np.linalg.det(axes) > 0.0:
        raise InputError("the sensitive axes of the accelerometers must span space.")
    # rows of C by Gram and Schmidt: x along the first sensitive axis, y in the plane of the first two
    q, r = np.linalg.qr(axes.T)
    turn = (q * np.sign(np.diag(r))).T

    def triad(errors_: TriadErrors) -> TriadErrors:
        whole = (1.0 + errors_.scale)[:, None] * (np.eye(3) + errors_.misalignment) @ turn.T
        scale = np.diag(whole)
        tilt = whole / scale[:, None]
        tilt[np.eye(3, dtype=bool)] = 0.0
        return replace(errors_, scale=scale - 1.0, misalignment=tilt)

    accel = triad(errors.accel)
    accel.misalignment[np.triu_indices(3)] = 0.0  # zero but for rounding
    return replace(errors, gyro=triad(errors.gyro), accel=accel, arms=errors.arms @ turn.T), turn
