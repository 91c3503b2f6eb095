"""The errors of one sensor block in one run: what is fixed is taken, what varies from run to run is drawn."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field, replace

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.scenario.grades import CORRELATION_TIME, find_grade
from sinssim.scenario.imu import ImuSection
from sinssim.scenario.laser_gyro import LaserGyroSection
from sinssim.sensors.laser_gyro import LaserGyro
from sinssim.units import (
    ARCSEC,
    DEG_H,
    DEG_SQRT_H,
    PPM,
    PPM_PER_DEG2_S2,
    PPM_PER_DEG_S,
    UG,
    UG_PER_G2,
    UG_PER_G3,
)

_OFF_DIAGONAL = np.array([[0, 1], [0, 2], [1, 0], [1, 2], [2, 0], [2, 1]])  # xy, xz, yx, yz, zx, zy


@dataclass(frozen=True)
class TriadErrors:
    """The errors of three gyros or three accelerometers, SI; all zero unless given.

    Attributes:
        bias: ω₀ or a₀ of equation (2), (3,) rad/s or m/s².
        scale: relative scale-factor error, k or h of equation (2), (3,).
        misalignment: M, zero on its diagonal; M[i, j] is the small angle by which sensitive axis i is tilted
            towards the block's axis j, (3, 3) rad.
        quadratic: K₂ of the non-linearity x + K₂x² + K₃x³, x being the rate or specific force along the sensitive
            axis, (3,) s/rad or s²/m.
        cubic: its K₃, (3,) s²/rad² or s⁴/m².
        random_walk: angle or velocity random walk N, rad/√s or m/s/√s.
        quantum: weight of one pulse of the accumulated angle or velocity, 0 for none, rad or m/s.
        instability: 1σ of the bias instability, rad/s or m/s².
        correlation_time: correlation time of the bias instability, s.
    """

    bias: Array = field(default_factory=lambda: np.zeros(3))
    scale: Array = field(default_factory=lambda: np.zeros(3))
    misalignment: Array = field(default_factory=lambda: np.zeros((3, 3)))
    quadratic: Array = field(default_factory=lambda: np.zeros(3))
    cubic: Array = field(default_factory=lambda: np.zeros(3))
    random_walk: float = 0.0
    quantum: float = 0.0
    instability: float = 0.0
    correlation_time: float = CORRELATION_TIME


@dataclass(frozen=True)
class ImuErrors:
    """The errors of one sensor block in one run.

    Attributes:
        gyro: the three gyros.
        accel: the three accelerometers.
    """

    gyro: TriadErrors = field(default_factory=TriadErrors)
    accel: TriadErrors = field(default_factory=TriadErrors)


def term_generator(seed: int, term: str, axis: int) -> np.random.Generator:
    """Return the random generator that belongs to one axis of one error term and to nothing else.

    Args:
        seed: the run's seed, 0 or more.
        term: name of the error term, for example "gyro bias".
        axis: number of the axis (or of the angle, for misalignment).

    Returns:
        A generator in its initial state.

    Raises:
        InputError: the seed is not a whole number from 0 up.
    """
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise InputError(f"the seed {seed!r} cannot start a random generator; it must be a whole number, 0 or more.")
    key = zlib.crc32(term.encode())  # unlike hash(), the same in every process
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(int(seed), spawn_key=(key, axis))))


def draw(section: ImuSection, seed: int = 0) -> ImuErrors:
    """Return the errors of one run: fixed values as given, the others drawn from the section's or the grade's 1σ.

    Args:
        section: the [imu] section of a scenario.
        seed: the run's seed.

    Returns:
        The errors, SI.

    Raises:
        InputError: the seed cannot be used.
    """

    def turn_on(
        term: str, count: int, fixed: tuple[float, ...] | None, sigma: float | None, unit: float, of_grade: float
    ) -> Array:
        if fixed is not None:
            return np.array(fixed) * unit
        one_sigma = of_grade if sigma is None else sigma * unit
        return one_sigma * np.array([term_generator(seed, term, i).standard_normal() for i in range(count)])

    def noise(value: float | None, unit: float, of_grade: float) -> float:
        return of_grade if value is None else value * unit

    s, grade = section, find_grade(section.grade)
    gyro = TriadErrors(
        bias=turn_on("gyro bias", 3, s.gyro_bias_deg_h, s.gyro_bias_sigma_deg_h, DEG_H, grade.gyro.bias),
        scale=turn_on("gyro scale", 3, s.gyro_scale_ppm, s.gyro_scale_sigma_ppm, PPM, grade.gyro.scale),
        misalignment=_matrix(
            turn_on(
                "gyro misalignment",
                6,
                s.gyro_misalignment_arcsec,
                s.gyro_misalignment_sigma_arcsec,
                ARCSEC,
                grade.gyro.misalignment,
            )
        ),
        quadratic=turn_on(
            "gyro quadratic",
            3,
            s.gyro_quadratic_ppm_per_deg_s,
            s.gyro_quadratic_sigma_ppm_per_deg_s,
            PPM_PER_DEG_S,
            0.0,
        ),
        cubic=turn_on(
            "gyro cubic", 3, s.gyro_cubic_ppm_per_deg2_s2, s.gyro_cubic_sigma_ppm_per_deg2_s2, PPM_PER_DEG2_S2, 0.0
        ),
        random_walk=noise(s.gyro_arw_deg_sqrt_h, DEG_SQRT_H, grade.gyro.random_walk),
        quantum=(s.gyro_quantum_arcsec or 0.0) * ARCSEC,
        instability=noise(s.gyro_instability_deg_h, DEG_H, grade.gyro.instability),
        correlation_time=noise(s.gyro_correlation_time_s, 1.0, CORRELATION_TIME),
    )
    if s.laser_gyro is not None:
        ring = laser_gyro(s.laser_gyro)
        gyro = replace(gyro, random_walk=ring.random_walk, quantum=ring.pulse_weight)
    accel = TriadErrors(
        bias=turn_on("accel bias", 3, s.accel_bias_ug, s.accel_bias_sigma_ug, UG, grade.accel.bias),
        scale=turn_on("accel scale", 3, s.accel_scale_ppm, s.accel_scale_sigma_ppm, PPM, grade.accel.scale),
        misalignment=_matrix(
            turn_on(
                "accel misalignment",
                6,
                s.accel_misalignment_arcsec,
                s.accel_misalignment_sigma_arcsec,
                ARCSEC,
                grade.accel.misalignment,
            )
        ),
        quadratic=turn_on(
            "accel quadratic", 3, s.accel_quadratic_ug_per_g2, s.accel_quadratic_sigma_ug_per_g2, UG_PER_G2, 0.0
        ),
        cubic=turn_on("accel cubic", 3, s.accel_cubic_ug_per_g3, s.accel_cubic_sigma_ug_per_g3, UG_PER_G3, 0.0),
        random_walk=noise(s.accel_vrw_ug_sqrt_hz, UG, grade.accel.random_walk),
        quantum=s.accel_quantum_mm_s * 1e-3,
        instability=noise(s.accel_instability_ug, UG, grade.accel.instability),
        correlation_time=noise(s.accel_correlation_time_s, 1.0, CORRELATION_TIME),
    )
    return ImuErrors(gyro, accel)


def _matrix(angles: Array) -> Array:
    matrix = np.zeros((3, 3))
    matrix[_OFF_DIAGONAL[:, 0], _OFF_DIAGONAL[:, 1]] = angles
    return matrix


def laser_gyro(section: LaserGyroSection) -> LaserGyro:
    """Return the laser gyro that a scenario describes.

    Args:
        section: the [imu.laser_gyro] table.

    Returns:
        The gyro, SI.
    """
    return LaserGyro(
        section.perimeter_mm * 1e-3,
        section.area_mm2 * 1e-6,
        section.wavelength_nm * 1e-9,
        section.lock_in_deg_h * DEG_H,
        section.dither_amplitude_arcsec * ARCSEC,
        section.dither_frequency_hz,
    )
