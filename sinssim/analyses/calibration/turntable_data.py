"""The inputs of a calibration: measurements, dwells, the nominal sequence, the place, noise and parameters.

Dwells are found from the sequence, from given times, or by the gyros. The assumed noise is white noise, bias
instability, and quantisation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sinssim import earth, rotation
from sinssim.analyses.calibration.least_squares import Solution
from sinssim.analyses.calibration.parameters import Parameter, errors_of, parameters
from sinssim.data import Array, ImuData
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.errors import InputError
from sinssim.scenario.schema import Scenario
from sinssim.scenario.tables import CalibrationSection
from sinssim.scenario.true_motion import mounting
from sinssim.sensors.imu.compensation import compensate_checked
from sinssim.sensors.imu.error_term_table import of_triad
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu import Imu
from sinssim.truth.motions.turntable import Turntable
from sinssim.units import ARCSEC, DEG

_WINDOW = 0.5
"""Length of the windows in which a standing block is looked for, s."""
_STILL = 0.1
"""Largest mean rate of a standing block, in parts of the slowest turn."""
_MARGIN = 1.0
"""Time left out at both ends of a dwell that was found, s."""
_SHORTEST = 3.0
"""Shortest dwell that is found, s."""
_LEAST = 3
"""Fewest samples of a dwell."""


@dataclass(frozen=True)
class Dwells:
    """The samples of the dwells: all samples between two of them belong to a turn."""

    rows: Array  # first sample of each dwell, and the first after it, (P, 2)

    @property
    def turns(self) -> Array:
        """First sample of each turn, and the first after it, (P − 1, 2)."""
        return np.column_stack([self.rows[:-1, 1], self.rows[1:, 0]])

    def seconds(self, time: Array) -> Array:
        """Return beginning and end of each dwell, (P, 2) s."""
        return np.asarray(time[self.rows])


def planned(section: Turntable, time: Array) -> Dwells:
    """Return the dwells at the times of the sequence; `time` are the edges of the samples since its beginning, s."""
    return between(section.dwells, time, "turntable.dwell_s")


def between(spans: tuple[tuple[float, float], ...], time: Array, key: str) -> Dwells:
    """Return the samples of given dwells, `spans` in s; `key` names them in a scenario, for messages."""
    rows = []
    slack = 1e-6 * float(time[1] - time[0])
    for number, (begin, end) in enumerate(spans, start=1):
        if begin < time[0] - slack or end > time[-1] + float(time[1] - time[0]):
            raise InputError(
                f"{key}: dwell {number} from {begin:g} s to {end:g} s lies outside the data, which last from "
                f"{time[0]:g} s to {time[-1]:g} s."
            )
        first, last = int(np.searchsorted(time, begin - slack)), int(np.searchsorted(time, end + slack, "right")) - 1
        if last - first < _LEAST:
            raise InputError(
                f"{key}: dwell {number} lasts {end - begin:g} s and has {max(last - first, 0)} samples of "
                f"{time[1] - time[0]:g} s; it needs at least {_LEAST}."
            )
        rows.append((first, last))
    return Dwells(np.array(rows, dtype=np.intp))


def detected(imu: ImuData, section: Turntable) -> Dwells:
    """Return the dwells of a log: spans in which the gyros stand still, as many as the sequence has."""
    interval = float(np.median(np.diff(imu.time)))
    size = max(round(_WINDOW / interval), 1)
    count = len(imu) // size
    mean = np.add.reduceat(imu.dtheta[: count * size], np.arange(0, count * size, size)) / (size * interval)
    slowest = min((turn.rate_deg_s or section.rate_deg_s) * DEG for turn in section.all_turns)
    still = np.linalg.norm(mean - np.median(mean, axis=0), axis=1) < _STILL * slowest
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    margin = round(_MARGIN / interval)
    rows = [(a * size + margin, b * size - margin) for a, b in edges.reshape(-1, 2)]
    rows = [(a, b) for a, b in rows if (b - a) * interval >= _SHORTEST]
    wanted = len(section.dwells)
    if not rows:
        raise InputError(
            f"the log has no spans at rest of {_SHORTEST + 2.0 * _MARGIN:g} s: the mean rate of no such span is below "
            f"{_STILL * slowest / DEG:g}°/s, a tenth of the slowest turn. Give calibration.dwells_s, or the log of a "
            "sequence with dwells."
        )
    if len(rows) != wanted:
        raise InputError(
            f"the log has {len(rows)} spans at rest, but the sequence of [turntable] has {wanted} dwells. Give the "
            f"sequence that was run, or the times of the dwells in calibration.dwells_s; found: {_listed(rows, imu)}."
        )
    return Dwells(np.array(rows, dtype=np.intp))


def _listed(rows: list[tuple[int, int]], imu: ImuData) -> str:
    words = [f"{imu.time[a]:.0f}-{imu.time[b]:.0f} s" for a, b in rows[:8]]
    return ", ".join(words) + (", …" if len(rows) > 8 else "")


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
    """What a method finds.

    Attributes:
        values: values of the parameters, (p,) SI.
        solution: the last linear solution: covariance and observability.
        iterations: number of linear solutions.
        residual_gyro: residuals of the gyros by position and by turn, in the order of time, as mean rates, (K, 3)
            rad/s; of the systematic method (0, 3).
        residual_accel: residuals of the accelerometers by position, as mean specific forces, (P, 3) m/s²; of the
            systematic method those of the velocity, m/s.
        normalised: all residuals in units of their 1σ, in the order of time.
        tilt: estimated tilt of the base, (3,) rad; None of the systematic method.
    """

    values: Array
    solution: Solution
    iterations: int
    residual_gyro: Array
    residual_accel: Array
    normalised: Array
    tilt: Array | None = None


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
