"""Errors of one inertial sensor block in one run: `ImuErrors`, drawn from a scenario's [imu] section."""

from __future__ import annotations

from dataclasses import dataclass, field, make_dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from sinssim.arguments import numbers
from sinssim.data import Array
from sinssim.scenario.sections.imu import ImuSection
from sinssim.scenario.sections.within_imu.faults import CHANNELS
from sinssim.scenario.sections.within_imu.faults import Fault as FaultSection
from sinssim.scenario.sections.within_imu.laser_gyro import LaserGyroSection
from sinssim.sensors.imu.datasheet import to_si
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.grade_file import TriadGrade
from sinssim.sensors.imu.grades import find_grade
from sinssim.sensors.imu.terms import FIELDS, SLOTS, of_triad
from sinssim.sensors.laser_gyro.gas_flow import NullShift
from sinssim.sensors.laser_gyro.ring import LaserGyro
from sinssim.system.short_repr import short_repr
from sinssim.units import ARCSEC, DEG, DEG_H, G0, PPM, UG

_OFF_DIAGONAL = ~np.eye(3, dtype=bool)
_NONE = np.zeros(())
FaultKind = Literal["dropout", "freeze", "spike", "bias-step", "saturation", "jitter"]
"""Kinds of faults."""

_OF_THE_RING = {"gyro_arw": "random_walk", "gyro_quantum": "pulse_weight"}


if TYPE_CHECKING:

    class TriadErrors:
        """See below; the names and shapes of the fields come from the table of terms."""

        __dataclass_fields__: ClassVar[dict[str, Any]]

        def __init__(self, **fields: Any) -> None:
            """Store the errors, SI."""

        def __getattr__(self, field: str) -> Any:
            """Return one error, SI."""

else:

    def _as_arrays(triad: TriadErrors) -> None:
        """Convert lists and integers to arrays and numbers of doubles, and refuse other objects by name."""
        for name in SLOTS:
            value = getattr(triad, name)
            if type(value) is float or (type(value) is np.ndarray and value.dtype == np.float64):
                continue
            array = numbers(f"TriadErrors: {name}", value)
            object.__setattr__(triad, name, float(array) if array.ndim == 0 else array)

    TriadErrors = make_dataclass(
        "TriadErrors",
        [(name, Any, field(default_factory=FIELDS[name].nothing)) for name in SLOTS],
        frozen=True,
        kw_only=True,
        namespace={
            "__module__": __name__,
            "__post_init__": _as_arrays,
            "__doc__": "The errors of three gyros or three accelerometers, SI; all zero unless given.\n\n"
            "`sinssim.sensors.imu.emulate` describes the effect of each.\n\nAttributes:\n"
            + "\n".join(f"    {name}: {FIELDS[name].about}" for name in SLOTS),
        },
    )


@dataclass(frozen=True)
class WarmUp:
    """Temperature of the block above that of its calibration: Θ∞ + (Θ₀ − Θ∞) exp(−t/τ), t from the first sample.

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
            Temperature above that of the calibration, (...) K.
        """
        return np.asarray(self.steady + (self.start - self.steady) * np.exp(-t / self.time_constant))


@dataclass(frozen=True)
class Fault:
    """A fault of the block.

    Attributes:
        kind: kind of the fault.
        start: its beginning, or the time of a spike, s.
        end: its end, s.
        amount: one value for each of the six channels, gyros first, (6,): addition to the rate or specific force by a
            step, rad/s or m/s²; addition to the increment by a spike, rad or m/s; range during a saturation, 0 for no
            change, rad/s or m/s²; 1 for a channel that drops out or freezes. For jitter, the first value is the 1σ of
            the time stamps, s.
    """

    kind: FaultKind
    start: float
    end: float
    amount: Array


@short_repr
@dataclass(frozen=True)
class ImuErrors:
    """The errors of one sensor block in one run.

    Attributes:
        gyro: the three gyros.
        accel: the three accelerometers.
        arms: places of the three accelerometers in the block, (3, 3) m, one row each.
        delay: lag of the accelerometers' outputs behind the gyros', s: the output for t is f(t − delay).
        warm_up: the temperature of the block.
        faults: the faults.
        null_shift: null shift of laser gyros as a function of temperature; None for no null shift.
    """

    gyro: TriadErrors = field(default_factory=TriadErrors)
    accel: TriadErrors = field(default_factory=TriadErrors)
    arms: Array = field(default_factory=lambda: np.zeros((3, 3)))
    delay: float = 0.0
    warm_up: WarmUp = field(default_factory=WarmUp)
    faults: tuple[Fault, ...] = ()
    null_shift: NullShift | None = None


def draw(section: ImuSection, seed: int = 0) -> ImuErrors:
    """Return the errors of one run: given values plus errors drawn from the section's or the grade's 1σ.

    Args:
        section: the [imu] section of a scenario.
        seed: the run's seed.

    Returns:
        The errors, SI.

    Raises:
        InputError: the seed cannot be used.
    """
    from sinssim.statistics.random_numbers import key

    key(seed)  # refuses an invalid seed
    return with_triads(section, _triad(section, "gyro", seed), _triad(section, "accel", seed))


def with_triads(section: ImuSection, gyro: TriadErrors, accel: TriadErrors) -> ImuErrors:
    """Return the errors of a block whose gyros and accelerometers have given errors.

    Args:
        section: the [imu] section of a scenario, for everything else, which is not random.
        gyro: errors of the three gyros.
        accel: errors of the three accelerometers.

    Returns:
        The errors, SI.
    """
    return ImuErrors(
        gyro,
        accel,
        np.array(section.accel_arms_mm) * 1e-3,
        section.accel_delay_ms * 1e-3,
        warm_up(section),
        tuple(fault(given) for given in section.faults),
        null_shift_of(section),
    )


def warm_up(section: ImuSection) -> WarmUp:
    """Return the temperature of the block described by a scenario.

    Args:
        section: the [imu] section of a scenario.

    Returns:
        The temperature over time.
    """
    return WarmUp(section.temperature_start_c, section.temperature_steady_c, section.warm_up_time_s)


def stated(section: ImuSection, term: ErrorTerm) -> tuple[Array, Array]:
    """Return mean and standard deviation of one error over all runs, from the section or its grade.

    Args:
        section: the [imu] section of a scenario.
        term: the error term.

    Returns:
        The given error, which is the mean over all runs, and the 1σ of the random error about it, SI, in the shape of
        its field of `TriadErrors`. Beside a given error the 1σ is zero unless it is given, too.
    """
    if section.laser_gyro is not None and term.name in _OF_THE_RING:
        return np.asarray(getattr(laser_gyro(section.laser_gyro), _OF_THE_RING[term.name])), _NONE
    grade: TriadGrade = getattr(find_grade(section.grade), term.triad)
    of_grade = grade.of(term)
    given = getattr(section, term.key)
    if not term.drawn:
        return np.asarray(of_grade if given is None else to_si(term.key, given)), _NONE
    sigma = getattr(section, term.sigma_key)
    mean = _NONE if given is None else _shaped(term, np.array([to_si(term.key, value) for value in given]))
    if sigma is None:
        spread = of_grade if given is None else 0.0
    else:
        spread = to_si(term.sigma_key, sigma)
    return mean, _shaped(term, np.full(term.size, spread))


def _shaped(term: ErrorTerm, values: Array) -> Array:
    """Arrange the values of one error in the shape of its field: (3,) or (3, 3)."""
    if term.size == 6:
        matrix = np.zeros((3, 3))
        matrix[_OFF_DIAGONAL] = values  # row by row: xy, xz, yx, yz, zx, zy
        return matrix
    return values.reshape(3, 3) if term.size == 9 else values


def _triad(section: ImuSection, triad: str, seed: int) -> TriadErrors:
    values: dict[str, Any] = {}
    for term in of_triad(triad):
        fixed, sigma = stated(section, term)
        value = fixed + sigma * _turn_on(seed, term) if np.any(sigma) else np.zeros_like(sigma) + fixed
        values[term.field] = value if term.drawn else float(value)
    return TriadErrors(**values)


def _turn_on(seed: int, term: ErrorTerm) -> Array:
    """Draw one number for each axis of a term, or each of its angles."""
    from sinssim.statistics.random_numbers import pairs

    which = ("gyro", "accel").index(term.triad)
    drawn = np.array([pairs(seed, term.field, axis, 1)[which, 0] for axis in range(term.size)])
    return _shaped(term, drawn)


def fault(section: FaultSection) -> Fault:
    """Return a fault described by a scenario.

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
        amount[[CHANNELS.index(channel) for channel in section.channels or CHANNELS]] = 1.0
    return Fault(section.type, section.from_s, np.inf if section.to_s is None else section.to_s, amount)


def laser_gyro(section: LaserGyroSection) -> LaserGyro:
    """Return the laser gyro described by a scenario.

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


def null_shift_of(section: ImuSection) -> NullShift | None:
    """Return the null shift of the laser gyros described by a scenario.

    Args:
        section: the [imu] section of a scenario.

    Returns:
        The null shift, SI; None without gas flow.
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
