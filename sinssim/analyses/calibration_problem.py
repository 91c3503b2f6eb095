"""A calibration to compute: its inputs, its parameters, and their least squares.

The assumed noise is white noise, bias instability, and quantisation.

Parameters. The model is that of the emulator (`sinssim.sensors.imu.emulation`, stages 1, 2 and 4): y = (1 + k)(u + M u)
+ b for each triad, and the places of the accelerometers. The separate method refers all of it to the axes of the
table's positions. The systematic method has no such reference: a common rotation of all sensors changes nothing that it
observes. Its frame is that of the accelerometers: x along the sensitive axis of the forward accelerometer, and y in the
plane of the forward and the right one, so that the misalignments xy, xz and yz of the accelerometers are zero by
definition. The places of the accelerometers are those from the forward one.

Least squares. The observations are whitened: r = A d + B n + ν with ν of unit covariance. d are the corrections of the
parameters, n nuisances with unit covariance, such as the errors of the table. The nuisances are eliminated exactly:
with the rows [B; I] of observations and prior knowledge, Q an orthonormal basis of what is orthogonal to them gives Qᵀr
= QᵀA d + ν'. The columns of QᵀA are multiplied by the sizes s of the parameters, their 1σ before the calibration:

    QᵀA diag(s) = U diag(λ) Vᵀ

A direction v_k of the scaled parameters is then determined to 1/λ_k of its size. Directions with λ_k < 1 are called not
observable: the observations say less about them than the data sheet. They are set to zero, and their size is in the
covariance s V diag(1/λ² or 1) Vᵀ s.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.analyses.turntable_dwells import Dwells
from sinssim.data import Array, ImuData
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.scenario.schema import Scenario
from sinssim.scenario.tables import CalibrationSection
from sinssim.scenario.true_motion import mounting
from sinssim.sensors.imu.compensation import compensate_checked
from sinssim.sensors.imu.error_term_table import TERMS, of_triad
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.statistics.chi_square import mean_square_band
from sinssim.truth.motions.turntable import Turntable
from sinssim.units import ARCSEC, DEG, DEG_H, PPM, UG

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
    bias, scale, misalignment = np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 3, 3))
    arms = np.zeros((3, 3))
    for parameter, value in zip(known, values, strict=True):
        triad, row = ("gyro", "accel").index(parameter.triad), parameter.row
        if parameter.field == "arm":
            arms[row, parameter.column] = value
        elif parameter.field == "misalignment":
            misalignment[triad, row, parameter.column] = value
        else:
            (bias if parameter.field == "bias" else scale)[triad, row] = value
    gyro, accel = (TriadErrors(bias=bias[k], scale=scale[k], misalignment=misalignment[k]) for k in (0, 1))
    return ImuErrors(gyro, accel, arms)


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


OBSERVABLE = 1.0
"""Least singular value of an observable direction."""
_SHARE = 0.01
"""Squared share in directions that are not observable from which a parameter counts as not observable."""
_FIT = 0.999
"""Probability of the band in which the residuals are expected."""
_NAMED = 0.1
"""Coefficient, relative to the largest, from which a parameter is named in a combination."""


@dataclass(frozen=True)
class Solution:
    """A solution of the least squares."""

    correction: Array  # d, (p,) SI
    covariance: Array  # of the parameters, (p, p) SI
    singular: Array  # λ, in falling order, (p,)
    directions: Array  # V, one column each, in sizes of the parameters, (p, p)
    rank: int  # number of directions that are observable
    observable: NDArray[np.bool_]  # whether each parameter is determined, (p,)
    chi_square: float  # sum of the squares of the remaining residuals
    degrees: int  # their degrees of freedom

    @property
    def fit(self) -> Literal["", "small", "large"]:
        """Whether the residuals are smaller or larger than the stated noise explains; "" if they fit it."""
        if self.degrees <= 0:
            return ""
        ratio, band = self.chi_square / self.degrees, mean_square_band(self.degrees, _FIT)
        return "large" if ratio > band.high else "small" if ratio < band.low else ""


def solve(r: Array, a: Array, b: Array, prior: Array, size: Array, values: Array, final: bool = True) -> Solution:
    """Solve the whitened observations r = A d + B n for the parameters' correction d, and the nuisances n in their 1σ.

    With q nuisances and p parameters, r is (m,), A (m, p) and B (m, q). `prior` are the residuals of the nuisances'
    prior knowledge, less their current values, (q,); `size` and `values` are those of the parameters, (p,) SI. In the
    `final` solution, observable directions are free and the others zero. Otherwise the sizes are prior knowledge of all
    parameters: the steps of an iteration then cannot run away, and no direction changes sides between them.
    """
    m, p = a.shape
    q = b.shape[1]
    rest, scaled = r, a * size
    if q:
        whole, _ = np.linalg.qr(np.vstack([b, np.eye(q)]))
        rows = np.concatenate([r, prior])
        columns = np.vstack([scaled, np.zeros((q, p))])
        rest = rows - whole @ (whole.T @ rows)
        scaled = columns - whole @ (whole.T @ columns)
    u, singular, vt = np.linalg.svd(scaled, full_matrices=False)
    if len(singular) < p:  # fewer observations than parameters
        _, _, vt = np.linalg.svd(scaled, full_matrices=True)
        singular, u = np.append(singular, np.zeros(p - len(singular))), np.pad(u, ((0, 0), (0, p - u.shape[1])))
    seen = singular >= OBSERVABLE
    inverse = np.where(seen, 1.0 / np.where(seen, singular, 1.0), 0.0)
    now = vt @ (values / size)
    if final:
        along = np.where(seen, inverse * (u.T @ rest), -now)
    else:
        along = (singular * (u.T @ rest) - now) / (singular**2 + 1.0)
    spread = vt.T * np.where(seen, inverse, 1.0)
    left = rest - scaled @ (vt.T @ along)
    share = np.sum(vt[~seen] ** 2, axis=0)
    return Solution(
        size * (vt.T @ along),
        (size[:, None] * (spread @ spread.T)) * size,
        singular,
        vt.T,
        int(np.count_nonzero(seen)),
        share < _SHARE,
        float(left @ left),
        m - int(np.count_nonzero(seen)),
    )


def nuisances(r: Array, b: Array, prior: Array) -> Array:
    """Return the nuisances' corrections, (q,) in their 1σ, by the residuals r after the parameters' correction."""
    corrections, *_ = np.linalg.lstsq(np.vstack([b, np.eye(b.shape[1])]), np.concatenate([r, prior]), rcond=None)
    return np.asarray(corrections)


def unobservable(solution: Solution, names: list[str]) -> list[str]:
    """Name what the observations do not determine.

    One text stands for each direction: a parameter, or a combination such as "accel bias x + 0.7 gyro scale y", in
    which each parameter is in units of its size.
    """
    lost = solution.directions[:, solution.rank :].T
    # a basis with as few parameters in each direction as there can be: Gauss and Jordan with the largest pivot
    texts, rows, done = [], lost.copy(), 0
    while done < len(rows):
        k, j = np.unravel_index(np.argmax(np.abs(rows[done:])), rows[done:].shape)
        rows[[done, done + int(k)]] = rows[[done + int(k), done]]
        rows[done] /= rows[done, j]
        for other in range(len(rows)):
            if other != done:
                rows[other] -= rows[other, j] * rows[done]
        done += 1
    for row in rows:
        row = row / np.abs(row).max()
        pairs = [(value, name) for value, name in zip(row, names, strict=True) if abs(value) >= _NAMED]
        terms = sorted(pairs, key=lambda term: -abs(term[0]))
        words = ""
        for value, name in terms:
            factor = "" if round(abs(value), 1) == 1.0 else f"{abs(value):.1f} "
            sign = " − " if value * terms[0][0] < 0.0 else " + "
            words += (sign if words else "") + factor + name
        texts.append(words)
    order = {name: number for number, name in enumerate(names)}
    return sorted(texts, key=lambda words: min(place for name, place in order.items() if name in words))


@dataclass(frozen=True)
class TriadNoise:
    """The noise of three sensors, each with the same figures."""

    white: float  # random walk N of the integral, rad/√s or m/s/√s
    instability: float  # 1σ of the bias instability, rad/s or m/s²
    correlation_time: float  # its correlation time, s
    quantum: float  # weight of a pulse, rad or m/s
    untold: tuple[str, ...]  # names of the noises that the scenario has and the calibration does not model


def noise_of(imu: Imu, triad: str) -> TriadNoise:
    """Return the noise of the sensors of a triad, "gyro" or "accel"."""
    sigma: TriadErrors = getattr(imu.sigma, triad)
    untold = tuple(
        term.label for term in of_triad(triad) if term.field in ("flicker", "rate_walk") and getattr(sigma, term.field)
    )
    return TriadNoise(sigma.random_walk, sigma.instability, sigma.correlation_time, sigma.quantum, untold)


def covariance_of_integrals(noise: TriadNoise, spans: Array, floor: float) -> Array:
    """Return the covariance of the integrals of one sensor over separate spans, (K, 2) s; (K, K) rad² or m²/s².

    The white noise gives N²T. The instability, of covariance σ² e^(−|t−u|/τ), gives for two spans with begin a and end
    b the double integral σ²τ² (1 − e^(−T₁/τ)) (1 − e^(−T₂/τ)) e^(−(a₂−b₁)/τ) for b₁ ≤ a₂, and 2σ²τ² (T/τ − 1 +
    e^(−T/τ)) for the same span. The integral between two readings of a counter has Q²/6. The square of `floor` is added
    against an observation without any noise.
    """
    length = spans[:, 1] - spans[:, 0]
    covariance = np.diag(noise.white**2 * length + noise.quantum**2 / 6.0 + floor**2)
    if noise.instability > 0.0:
        tau, power = noise.correlation_time, (noise.instability * noise.correlation_time) ** 2
        variance = 2.0 * power * (length / tau + np.expm1(-length / tau))
        gap = spans[None, :, 0] - spans[:, None, 1]  # from the end of the first to the beginning of the second
        decay = np.exp(-np.maximum(gap, gap.T) / tau)
        lost = -np.expm1(-length / tau)
        mixed = power * lost[:, None] * lost[None, :] * decay
        np.fill_diagonal(mixed, variance)
        covariance = covariance + mixed
    return covariance


@dataclass(frozen=True)
class Task:
    """A calibration to compute."""

    imu: ImuData  # the readings, from the beginning of the sequence
    dwells: Dwells  # samples of the dwells
    attitude: Array  # nominal attitudes q_nb in the positions, (P, 4)
    axis: Array  # nominal axes of the turns in the block's axes, unit vectors, (P − 1, 3)
    angle: Array  # their angles, (P − 1,) rad
    force: Array  # specific force of a standing block, north-east-down, (3,) m/s²
    earth_rate: Array  # the Earth's rate, north-east-down, (3,) rad/s
    gyro: TriadNoise
    accel: TriadNoise  # gyro, accel: noise
    known: tuple[Parameter, ...]  # the parameters to estimate
    section: CalibrationSection  # the [calibration] table
    position_sigma: float
    tilt_sigma: float  # position_sigma, tilt_sigma: assumed accuracy of the table, rad

    @property
    def size(self) -> Array:
        """Sizes of the parameters, (p,) SI."""
        return np.array([parameter.size for parameter in self.known])

    def compensated(self, values: Array) -> ImuData:
        """Return the readings compensated by values of the parameters, (p,) SI."""
        return compensate_checked(replace(self.imu, flags=None), errors_of(self.known, values))


@dataclass(frozen=True)
class Estimate:
    """What a method finds."""

    values: Array  # values of the parameters, (p,) SI
    solution: Solution  # the last linear solution: covariance and observability
    iterations: int  # number of linear solutions
    residual_gyro: Array
    """Residuals of the gyros by position and by turn, in the order of time, as mean rates, (K, 3) rad/s; of the
    systematic method (0, 3).
    """
    residual_accel: Array
    """Residuals of the accelerometers by position, as mean specific forces, (P, 3) m/s²; of the systematic method those
    of the velocity, m/s.
    """
    normalised: Array  # all residuals in units of their 1σ, in the order of time
    tilt: Array | None = None  # estimated tilt of the base, (3,) rad; None of the systematic method


def make_task(scenario: Scenario, section: CalibrationSection, imu: ImuData, dwells: Dwells) -> Task:
    """Return the calibration that a scenario describes."""
    table = scenario.turntable
    assert table is not None  # checked by the caller
    attitude, axis, angle = nominal(table, mounting(scenario).q_bs)
    latitude, height = np.radians(table.latitude_deg), table.altitude_m
    ellipsoid = ELLIPSOIDS[scenario.truth.ellipsoid]
    rate = ellipsoid.omega * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    force = -earth.gravity_ned(latitude, height, scenario.truth.gravity, ellipsoid)
    given = bool(np.any(scenario.imu.accel_arms_mm))
    arms = section.method == "systematic" and (given if section.arms is None else section.arms)
    position = table.position_sigma_arcsec if section.position_sigma_arcsec is None else section.position_sigma_arcsec
    tilt = table.tilt_sigma_arcsec if section.tilt_sigma_arcsec is None else section.tilt_sigma_arcsec
    return Task(
        imu,
        dwells,
        attitude,
        axis,
        angle,
        np.asarray(force, dtype=np.float64).reshape(3),
        rate,
        noise_of(scenario.imu, "gyro"),
        noise_of(scenario.imu, "accel"),
        parameters(scenario.imu, section.method, arms),
        section,
        position * ARCSEC,
        tilt * ARCSEC,
    )


def nominal(table: Turntable, q_bs: Array) -> tuple[Array, Array, Array]:
    """Return the nominal sequence of a table with the sensor block mounted by `q_bs`.

    Attitudes q_ns of the block in the positions, (P, 4); axes of the turns in its axes, (P − 1, 3); angles, (P − 1,)
    rad.
    """
    q = [table.start_attitude]
    axes, angles = [], []
    for turn in table.all_turns:
        unit = np.array(turn.axis) / np.linalg.norm(turn.axis)
        angle = turn.angle_deg * DEG
        q.append(rotation.multiply(q[-1], rotation.quaternion_from_rotation_vector(angle * unit)))
        axes.append(rotation.rotate(rotation.conjugate(q_bs), unit))
        angles.append(angle)
    return rotation.multiply(np.array(q), q_bs), np.array(axes).reshape(-1, 3), np.array(angles)
