"""The errors of one sensor block in one run: what is fixed is taken, what varies from run to run is drawn."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from sinssim.data import Array
from sinssim.scenario.datasheet import QUANTITIES, Quantity, to_si
from sinssim.scenario.faults import CHANNELS
from sinssim.scenario.faults import Fault as FaultSection
from sinssim.scenario.grades import CORRELATION_TIME, TriadGrade, find_grade
from sinssim.scenario.imu import ImuSection
from sinssim.scenario.laser_gyro import LaserGyroSection
from sinssim.sensors.laser_gyro import LaserGyro
from sinssim.sensors.null_shift import NullShift
from sinssim.units import ARCSEC, DEG, DEG_H, G0, PPM, UG

_OFF_DIAGONAL = ~np.eye(3, dtype=bool)
_NONE = np.zeros(())
FaultKind = Literal["dropout", "freeze", "spike", "bias-step", "saturation", "jitter"]
"""What can go wrong."""

_OF_THE_RING = {"gyro_arw": "random_walk", "gyro_quantum": "pulse_weight"}


@dataclass(frozen=True)
class TriadErrors:
    """The errors of three gyros or three accelerometers, SI; all zero unless given.

    What each does is written in `sinssim.sensors.emulate`.

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
        asymmetry: κ, relative scale factor of positive inputs less that of negative ones, (3,).
        cross_axis: C, zero on its diagonal; C[i, j] times the product of the inputs along sensitive axis i and the
            block's axis j is the error of sensor i, (3, 3) s/rad or s²/m.
        g_sensitivity: G of gyros, bias of gyro i per specific force along the block's axis j, (3, 3) rad/s per m/s²;
            accelerometers have none.
        bias_temperature: β, bias per degree over the temperature of the calibration, (3,) rad/s/K or m/s²/K.
        scale_temperature: k′, relative scale-factor error per degree, (3,) 1/K.
        ramp: R, growth of the bias, (3,) rad/s² or m/s³.
        rate_walk: rate random walk K, rad/s/√s or m/s²/√s.
        flicker: B of the flicker bias instability, rad/s or m/s².
        limit: range, both ways, 0 for none, rad/s or m/s².
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
    asymmetry: Array = field(default_factory=lambda: np.zeros(3))
    cross_axis: Array = field(default_factory=lambda: np.zeros((3, 3)))
    g_sensitivity: Array = field(default_factory=lambda: np.zeros((3, 3)))
    bias_temperature: Array = field(default_factory=lambda: np.zeros(3))
    scale_temperature: Array = field(default_factory=lambda: np.zeros(3))
    ramp: Array = field(default_factory=lambda: np.zeros(3))
    rate_walk: float = 0.0
    flicker: float = 0.0
    limit: float = 0.0


@dataclass(frozen=True)
class WarmUp:
    """Temperature of the block over that of its calibration: Θ∞ + (Θ₀ − Θ∞) exp(−t/τ), t from the first sample.

    Attributes:
        start: Θ₀, K.
        steady: Θ∞, K.
        time_constant: τ, s.
    """

    start: float = 0.0
    steady: float = 0.0
    time_constant: float = 600.0

    def temperature(self, t: Array) -> Array:
        """Return Θ.

        Args:
            t: time since the first sample, (...) s.

        Returns:
            Over the temperature of the calibration, (...) K.
        """
        return np.asarray(self.steady + (self.start - self.steady) * np.exp(-t / self.time_constant))


@dataclass(frozen=True)
class Fault:
    """Something that goes wrong with the block.

    Attributes:
        kind: what goes wrong.
        start: when it begins, of a spike when it is, s.
        end: when it ends, s.
        amount: of the six channels, gyros first, (6,): what a step adds to the rate or specific force, rad/s or m/s²;
            what a spike adds to the increment, rad or m/s; the range that a saturation leaves, 0 for no change,
            rad/s or m/s²; 1 for a channel that drops out or freezes. Of jitter the first holds the 1σ of the stamps, s.
    """

    kind: FaultKind
    start: float
    end: float
    amount: Array


@dataclass(frozen=True)
class ImuErrors:
    """The errors of one sensor block in one run.

    Attributes:
        gyro: the three gyros.
        accel: the three accelerometers.
        arms: places of the three accelerometers in the block, (3, 3) m, a row each.
        delay: how much later than the gyros the accelerometers sample, s.
        warm_up: the temperature.
        faults: what goes wrong.
        null_shift: of laser gyros, with the temperature; None for none.
    """

    gyro: TriadErrors = field(default_factory=TriadErrors)
    accel: TriadErrors = field(default_factory=TriadErrors)
    arms: Array = field(default_factory=lambda: np.zeros((3, 3)))
    delay: float = 0.0
    warm_up: WarmUp = field(default_factory=WarmUp)
    faults: tuple[Fault, ...] = ()
    null_shift: NullShift | None = None


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
    from sinssim.sensors.random_numbers import key

    key(seed)  # refuses what is none
    return ImuErrors(
        _triad(section, "gyro", seed),
        _triad(section, "accel", seed),
        np.array(section.accel_arms_mm) * 1e-3,
        section.accel_delay_ms * 1e-3,
        warm_up(section),
        tuple(fault(given) for given in section.faults),
        null_shift(section),
    )


def warm_up(section: ImuSection) -> WarmUp:
    """Return the temperature of the block that a scenario describes.

    Args:
        section: the [imu] section of a scenario.

    Returns:
        The temperature's course.
    """
    return WarmUp(section.temperature_start_c, section.temperature_steady_c, section.warm_up_time_s)


def stated(section: ImuSection, quantity: Quantity) -> tuple[Array, Array]:
    """Return mean and standard deviation of one error over all runs, as the section says or else its grade.

    Args:
        section: the [imu] section of a scenario.
        quantity: which error.

    Returns:
        The error itself where it is fixed, and its 1σ where it is drawn, SI, in the shape of its field of
        `TriadErrors`; the other of the two is zero.
    """
    if section.laser_gyro is not None and quantity.name in _OF_THE_RING:
        return np.asarray(getattr(laser_gyro(section.laser_gyro), _OF_THE_RING[quantity.name])), _NONE
    grade: TriadGrade = getattr(find_grade(section.grade), quantity.triad)
    of_grade = getattr(grade, quantity.field, CORRELATION_TIME if quantity.field == "correlation_time" else 0.0)
    given = getattr(section, quantity.key)
    if not quantity.drawn:
        return np.asarray(of_grade if given is None else to_si(quantity.key, given)), _NONE
    if given is not None:
        return _shaped(quantity, np.array([to_si(quantity.key, value) for value in given])), _NONE
    sigma = getattr(section, quantity.sigma_key)
    spread = of_grade if sigma is None else to_si(quantity.sigma_key, sigma)
    return _NONE, _shaped(quantity, np.full(quantity.size, spread))


def _shaped(quantity: Quantity, values: Array) -> Array:
    """Put the numbers of one error into the shape of its field: (3,) or (3, 3)."""
    if quantity.size == 6:
        matrix = np.zeros((3, 3))
        matrix[_OFF_DIAGONAL] = values  # row by row: xy, xz, yx, yz, zx, zy
        return matrix
    return values.reshape(3, 3) if quantity.size == 9 else values


def _triad(section: ImuSection, triad: str, seed: int) -> TriadErrors:
    found: dict[str, Any] = {}
    for quantity in QUANTITIES:
        if quantity.triad == triad:
            fixed, sigma = stated(section, quantity)
            value = sigma * _turn_on(seed, quantity) if np.any(sigma) else np.zeros_like(sigma) + fixed
            found[quantity.field] = value if quantity.drawn else float(value)
    return TriadErrors(**found)


def _turn_on(seed: int, quantity: Quantity) -> Array:
    """Draw one number for each axis of a term, or each of its angles."""
    from sinssim.sensors.random_numbers import pairs

    which = ("gyro", "accel").index(quantity.triad)
    drawn = np.array([pairs(seed, quantity.field, axis, 1)[which, 0] for axis in range(quantity.size)])
    return _shaped(quantity, drawn)


def fault(section: FaultSection) -> Fault:
    """Return a fault that a scenario describes.

    Args:
        section: one of [[imu.faults]].

    Returns:
        The fault, SI.
    """
    none = (0.0, 0.0, 0.0)
    if section.type == "spike":
        amount = np.array([*(section.gyro_arcsec or none), *(section.accel_mm_s or none)])
        return Fault("spike", section.at_s, section.at_s, amount * ([ARCSEC] * 3 + [1e-3] * 3))
    amount = np.zeros(6)
    if section.type == "bias-step":
        amount = np.array([*(section.gyro_deg_h or none), *(section.accel_ug or none)]) * ([DEG_H] * 3 + [UG] * 3)
    elif section.type == "saturation":
        amount[:3], amount[3:] = (section.gyro_deg_s or 0.0) * DEG, (section.accel_g or 0.0) * G0
    elif section.type == "jitter":
        amount[0] = section.sigma_ms * 1e-3
    else:
        amount[[CHANNELS.index(channel) for channel in section.channels]] = 1.0
    return Fault(section.type, section.from_s, np.inf if section.to_s is None else section.to_s, amount)


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


def null_shift(section: ImuSection) -> NullShift | None:
    """Return the null shift of the laser gyros that a scenario describes.

    Args:
        section: the [imu] section of a scenario.

    Returns:
        The null shift, SI; None where no gas flows.
    """
    ring = section.laser_gyro
    if ring is None or not ring.gas_flow_mps:
        return None
    return NullShift(
        laser_gyro(ring),
        ring.gain_percent * 1e-2,
        ring.gas_flow_mps,
        ring.thermal_speed_mps,
        ring.expansion_ppm_per_c * PPM,
        ring.path_control,
    )
