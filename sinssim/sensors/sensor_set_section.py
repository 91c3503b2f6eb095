"""The [imu.sensor_set] table: one of the textbook chapter's three sets (section 8.1), a redundant set, a platform.

The geometry of a redundant set of single-axis sensors is that of directions, least squares and parity.

m sensors with the sensitive axes h_i, the rows of H, read

    (1) y = H x + e

of a vector x, for example the angle increments of a sample. Weighted least squares estimate it by

    (2) x̂ = (Hᵀ W H)⁻¹ Hᵀ W y

With errors of the same variance σ² and without weights, the covariance of x̂ is σ² (HᵀH)⁻¹. As the trace of HᵀH is m,
the sum of its eigenvalues, and the harmonic mean of numbers is at most their arithmetic mean,

    (3) tr (HᵀH)⁻¹ ≥ 9/m, equal if and only if HᵀH = (m/3) I

What the readings say beyond x is the parity vector of m − 3 components,

    (4) p = V y,    V H = 0,    V Vᵀ = I,    VᵀV = I − H (HᵀH)⁻¹ Hᵀ

It does not depend on x. A fault f of sensor i adds f v_i to it, where v_i is column i of V.

Source: Sturza, Navigation System Integrity Monitoring Using Redundant Measurements, Navigation 35 (1988), pp. 483-501;
Pejsa, Optimum Skewed Redundant Inertial Navigators, AIAA Journal 12 (1974), pp. 899-902.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.toml_section import Duration, Keys, NotNegative, Positive, Section, Vector3

FEWEST, MOST = 4, 12
"""Number of sensors of one kind in a redundant set."""

_LENGTH = 1e-5  # by which the length of a direction may differ from 1
_RANK = 1e-6  # smallest singular value of H, relative to the largest


def _cone(count: int) -> Array:
    """Directions on a cone about the down axis whose half-angle has cos² = 1/3, 54.74°; the first leans forward."""
    around = 2.0 * math.pi * np.arange(count) / count
    across = math.sqrt(2.0 / 3.0)
    return np.column_stack((across * np.cos(around), across * np.sin(around), np.full(count, math.sqrt(1.0 / 3.0))))


def _dodecahedron() -> Array:
    """Normals of the six pairs of faces of a dodecahedron, 63.43° apart from each other."""
    golden = 0.5 * (1.0 + math.sqrt(5.0))
    near, far = 1.0 / math.sqrt(1.0 + golden**2), golden / math.sqrt(1.0 + golden**2)
    left = (near, 0.0, far), (far, near, 0.0), (0.0, far, near)
    right = (-near, 0.0, far), (far, -near, 0.0), (0.0, far, -near)
    return np.array([row for pair in zip(left, right, strict=True) for row in pair])


def _skewed_triads() -> Array:
    """The axes of the block, and these axes turned by 60° about the block's diagonal (1, 1, 1)."""
    turned = np.array([(2.0, 2.0, -1.0), (-1.0, 2.0, 2.0), (2.0, -1.0, 2.0)]) / 3.0
    return np.concatenate((np.eye(3), turned))


READY: dict[str, Array] = {
    "cone-4": _cone(4),
    "cone-5": _cone(5),
    "dodecahedron": _dodecahedron(),
    "skewed-triads": _skewed_triads(),
}
"""Sets by name, (m, 3). Each reaches the bound (3)."""


def checked_directions(directions: Sequence[Sequence[float]] | Array) -> Array:
    """Return directions as rows of H, (m, 3), unit vectors to rounding, after checking that they span space."""
    rows = np.asarray(directions, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 3 or not FEWEST <= len(rows) <= MOST:
        raise InputError(
            f"directions needs {FEWEST} to {MOST} unit vectors of three numbers; here it has the shape {rows.shape}. "
            "Three sensors have no redundancy."
        )
    for number, row in enumerate(rows, start=1):
        length = math.hypot(*row)
        if not abs(length - 1.0) <= _LENGTH:
            right = (
                "it has no direction"
                if not 1e-12 < length < 1e12
                else f"the unit vector along it is [{', '.join(f'{v:.7g}' for v in row / length)}]"
            )
            raise InputError(f"directions.{number} = {row.tolist()} has the length {length:.7g} instead of 1: {right}.")
    rows = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    sizes = np.linalg.svd(rows, compute_uv=False)
    if sizes[-1] < _RANK * sizes[0]:
        raise InputError(
            f"directions has the rank {int((sizes >= _RANK * sizes[0]).sum())}: all {len(rows)} lie in one plane, and "
            "no sensor measures the component perpendicular to it. The directions must span three dimensions."
        )
    return np.asarray(rows)


def along(rows: Array, axes: Array) -> Array:
    """Return the components of vectors, (N, k), along axes, (c, k): rows axesᵀ, (N, c).

    `einsum` sums in a fixed order on every machine, and does not wait for the threads of a linear-algebra library.
    """
    return np.asarray(np.einsum("nk,ck->nc", rows, axes))


def estimator(directions: Array, weights: Array | None = None) -> Array:
    """Return the matrix of the weighted least-squares estimate (2), (3, m). The weights are the diagonal of W, (m,),
    zero for a sensor that is not used, by default all 1."""
    weighted = directions if weights is None else directions * weights[:, np.newaxis]
    normal = directions.T @ weighted
    sizes = np.linalg.eigvalsh(normal)
    if not sizes[0] > _RANK**2 * sizes[-1]:
        raise InputError("the remaining sensors do not span three dimensions, so there is no estimate.")
    return np.asarray(np.linalg.solve(normal, weighted.T))


def parity_matrix(directions: Array) -> Array:
    """Return V of (4), (m − 3, m): an orthonormal basis of what is perpendicular to the columns of H; its signs and its
    rotation are a matter of choice."""
    return np.asarray(np.linalg.svd(directions)[0][:, 3:].T)


def dilution(directions: Array) -> float:
    """Return tr (HᵀH)⁻¹, the sum of the variances of the estimate for errors of unit variance, at least 9/m (3)."""
    return float(np.trace(np.linalg.inv(directions.T @ directions)))


def not_isolable(directions: Array) -> str:
    """Return why a fault of some sensor cannot be isolated, "" if every one can: a sensor whose fault is not seen at
    all, or two whose faults look alike."""
    columns = parity_matrix(directions).T
    sizes = np.linalg.norm(columns, axis=1)
    for i in range(len(columns)):
        if sizes[i] < _RANK:
            return f"without sensor {i + 1} the others lie in one plane, so that its fault is not seen"
    if len(directions) == FEWEST:
        return "four sensors detect a fault, but each of them could have caused it"
    for i in range(len(columns)):
        for j in range(i):
            if abs(columns[i] @ columns[j]) > (1.0 - _RANK) * sizes[i] * sizes[j]:
                return f"a fault of sensor {i + 1} looks like one of sensor {j + 1}"
    return ""


class Gyros(Section):
    """Three accelerometers and three gyros."""

    type: Literal["gyros"] = Field(description="the usual set, which is the second in the chapter")


class SixAccelerometers(Section):
    """Six accelerometers at the centres of the faces of a cube, without gyros; each has the errors of [imu]."""

    type: Literal["accelerometers"] = Field(description="the first set in the chapter")
    arm_m: Positive = Field(
        description="distance from the centre of the cube, which is the position of the sensor block, to each face"
    )


class AttitudeSensor(Section):
    """Three accelerometers and a sensor of the attitude in inertial space; the algorithm is "measured-attitude"."""

    type: Literal["attitude-sensor"] = Field(description="the third set in the chapter")
    bias_arcsec: Vector3 | None = Field(
        default=None,
        description="given error of the attitude reference, as a rotation vector in Earth-centred inertial axes",
    )
    bias_sigma_arcsec: NotNegative | None = Field(
        default=None, description="1σ of a random error, added to the given one; default: 0"
    )
    drift_deg_h: Vector3 | None = Field(default=None, description="given drift of this error, in the same axes")
    drift_sigma_deg_h: NotNegative | None = Field(
        default=None,
        description="1σ of a random drift, added to the given one; default: that of the gyro biases of the grade, or "
        "0 if drift_deg_h is given",
    )
    noise_arcsec: NotNegative = Field(
        default=0.0, description="1σ of each measurement about each axis of the sensor block"
    )


class Redundant(Section):
    """More than three single-axis gyros and accelerometers along the same directions, with mutual monitoring."""

    at_most_one = (Keys(("layout", "directions"), "the sensitive axes"),)

    type: Literal["redundant"] = Field(description="a set that tolerates the failure of a sensor")
    layout: Literal["cone-4", "cone-5", "dodecahedron", "skewed-triads"] | None = Field(
        default=None, description='predefined set; default: "dodecahedron", if no directions are given'
    )
    directions: tuple[Vector3, ...] | None = Field(
        default=None,
        description="4 to 12 unit vectors along the sensitive axes, each forward, right, down, instead of a "
        "predefined set; each is the direction of one gyro and of one accelerometer",
    )
    monitoring: Literal["none", "detect", "exclude"] | None = Field(
        default=None,
        description='"none": all sensors are used without monitoring; "detect": faults are reported; "exclude": a '
        'faulty sensor is isolated and excluded; default: "exclude", or "detect" if faults cannot be isolated',
    )
    windows_s: tuple[Duration, ...] = Field(
        default=(1.0, 10.0, 100.0),
        max_length=8,
        description="lengths of the sums that are tested in addition to each sample, to detect slowly growing faults; "
        "in ascending order",
    )
    false_alarm_probability: Annotated[float, Field(ge=1e-15, le=0.1)] = Field(
        default=1e-9, description="probability that a test reports a fault although there is none"
    )
    missed_detection_probability: Annotated[float, Field(ge=1e-9, le=0.5)] = Field(
        default=1e-3, description="probability that a test misses the smallest fault that the report states"
    )

    @property
    def axes(self) -> Array:
        """The sensitive axes, unit vectors, (m, 3)."""
        return READY[self.layout or "dodecahedron"] if self.directions is None else checked_directions(self.directions)

    @property
    def mode(self) -> Literal["none", "detect", "exclude"]:
        """What the monitoring does, with the default filled in."""
        return self.monitoring or ("detect" if not_isolable(self.axes) else "exclude")

    @model_validator(mode="after")
    def _one_set_of_directions(self) -> Self:
        axes = self.axes
        if self.monitoring == "exclude" and (why := not_isolable(axes)):
            more = ", or take five sensors or more" if len(axes) == FEWEST else ""
            raise ValueError(
                f'monitoring = "exclude" cannot find the faulty sensor of this set: {why}; give monitoring = '
                f'"detect"{more}'
            )
        for shorter, longer in pairwise(self.windows_s):
            if not shorter < longer:
                raise ValueError(f"windows_s = {list(self.windows_s)} must increase, each longer than the one before")
        return self


class Platform(Section):
    """Three gyros and three accelerometers on a gimballed platform; the algorithm is "platform". The gyros stabilise
    the platform in inertial space and torque it at the rates that the navigation algorithm commands."""

    type: Literal["platform"] = Field(
        description="a gyro-stabilised platform; the same sensors can also be used as a strapdown system"
    )
    torquer_scale_ppm: Vector3 | None = Field(
        default=None,
        description="relative errors of the torquing rates about the axes of the platform",
    )
    torquer_scale_sigma_ppm: NotNegative | None = Field(
        default=None,
        description="1σ of a random error, added to the given one; default: that of the scale factor of the gyros, or "
        "0 if torquer_scale_ppm is given",
    )
    pickoff_arcsec: Vector3 | None = Field(
        default=None, description="given errors of the measured gimbal angles roll, pitch and azimuth"
    )
    pickoff_sigma_arcsec: NotNegative | None = Field(
        default=None, description="1σ of a random error of each gimbal angle, added to the given one; default: 0"
    )
    pickoff_noise_arcsec: NotNegative = Field(default=0.0, description="1σ of each measurement of a gimbal angle")


SensorSet = Annotated[Gyros | SixAccelerometers | AttitudeSensor | Redundant | Platform, Field(discriminator="type")]
