"""The [imu] section of a scenario: grade, rate and place of the sensor block, and errors that differ from the grade.

An error that differs from run to run has a mean and a 1σ over all runs (M and σ of the ground-SINS paper):

- `gyro_bias_sigma_deg_h = 0.01` is the 1σ: the errors of the three axes are drawn about zero, each from its own seeded
  generator;
- `gyro_bias_deg_h = [0.01, 0.0, 0.0]` alone is the error itself on the forward, right and down axis; nothing is drawn;
- both together draw the errors about the given values.

If neither is given, the mean is zero and the 1σ that of the grade, or zero if grades do not define it. The random
walks, the quanta and the instabilities describe noise and have one value for the three axes. The value 0 switches an
error off; the draws of the other errors stay the same. `sinssim.sensors.imu.emulation` describes the errors and
their order.

The unit in a key may be another unit that datasheets use, for example `gyro_misalignment_mrad`,
`accel_bias_sigma_mg` or `accel_vrw_mps_sqrt_h`; `sinssim.sensors.imu.error_term_table` has the table.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.sensors.imu.datasheet_lines import ErrorTable
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import TERMS, of_triad
from sinssim.sensors.imu.faults import ImuFault
from sinssim.sensors.imu.generated_imu_keys import ImuKeys, TriadErrors
from sinssim.sensors.imu.grades import GradeName, find_grade
from sinssim.sensors.imu.imu_errors import ImuErrors, WarmUp, draw_triad
from sinssim.sensors.imu.laser_gyro import LaserGyros, NullShift
from sinssim.sensors.sensor_set_section import Gyros, Redundant, SensorSet
from sinssim.toml_section import LeverArm, Positive, Vector3
from sinssim.truth.motions.imu_rotation import Rotation

Celsius = Annotated[float, Field(ge=-500.0, le=500.0)]
Place = Annotated[float, Field(ge=-1e4, le=1e4)]
Places = tuple[Place, Place, Place]

_OVER = "relative to the temperature of the calibration"
_GIVEN_AND_SIGMA = tuple((term.key, term.sigma_key) for term in TERMS if term.drawn)
OF_THE_RING = {"gyro_arw": "random_walk", "gyro_quantum": "pulse_weight"}
_NONE = np.zeros(())


class _Block(ErrorTable):
    """Grade, rate, sensor set and place of a sensor block."""

    grade: GradeName = Field(
        default="laser-standard",
        description="a name from `sinssim list grades`, or the path of a grade's TOML file from the scenario's folder",
    )
    rate_hz: Annotated[float, Field(gt=0.0, le=1e5)] = Field(default=100.0, description="samples per second")
    output: Literal["increments", "mean-rates", "instantaneous-rates"] = Field(
        default="increments",
        description='output of each sample. "increments": integrals over the interval; "mean-rates": the integrals '
        'divided by the interval, as rate sensors with an integrating filter; "instantaneous-rates": values at the '
        "time stamps, which navigation integrates by the trapezoidal rule. Of rates, each reading is rounded to the "
        "quantum divided by the interval",
    )
    sensor_set: SensorSet = Gyros(type="gyros")
    lever_arm_m: LeverArm | None = Field(
        default=None,
        description="position of the sensor block relative to the centre of gravity, forward, right, down; default: "
        "that of the aircraft",
    )
    mounting_deg: Vector3 | None = Field(
        default=None,
        description="roll, pitch and yaw of the axes of the sensor block relative to the vehicle axes; default: those "
        "of the aircraft",
    )


def _of_set(*kinds: str) -> Callable[[Imu], bool]:
    """Return whether a block has one of some sets of sensors."""
    return lambda imu: imu.sensor_set.type in kinds


_REDUNDANT, _PLATFORM = _of_set("redundant"), _of_set("platform")
_WITHOUT_GYROS = _of_set("accelerometers", "attitude-sensor")


def _given_error(imu: Imu) -> tuple[str, str] | None:
    """Return the key of a given error with one number per axis, and the key of its 1σ."""
    return next((keys for keys in _GIVEN_AND_SIGMA if getattr(imu, keys[0]) is not None), None)


def _jitter(imu: Imu) -> int | None:
    """Return the number of the first jitter of the time stamps among the faults."""
    return next((number for number, fault in enumerate(imu.faults, start=1) if fault.type == "jitter"), None)


def _idle_on_platform(imu: Imu) -> tuple[int, str] | None:
    """Return number and name of the first fault without effect on a platform, where the gyros have no output."""
    for number, fault in enumerate(imu.faults, start=1):
        if fault.type == "jitter" or (fault.type != "bias-step" and fault.of_gyros):
            return number, f"{fault.type} " + ("of the time stamps" if fault.type == "jitter" else "of gyros")
    return None


class Imu(ImuKeys, _Block):
    """The sensor block (IMU): grade, rate, position and errors."""

    rules = (
        (lambda s: s.laser_gyro and s.changed("gyro_arw_deg_sqrt_h", "gyro_quantum_arcsec"),
         "{it} follows from the physics in laser_gyro, which is also given: keep one of them"),
        # output
        (lambda s: s.output != "increments" and not isinstance(s.sensor_set, Gyros),
         'output = "{s.output}" needs a block of three gyros and three accelerometers: remove it, or sensor_set.type = '
         '"{s.sensor_set.type}"'),
        (lambda s: s.output == "instantaneous-rates" and s.changed("accel_arms_mm", "accel_delay_ms", "rotation"),
         '{it} acts on the mean over an interval, but output = "{s.output}" gives values at the time stamps: remove '
         "one of them"),
        (lambda s: s.output == "instantaneous-rates" and _jitter(s),
         'faults.{it}: a jitter of the time stamps is not possible with output = "{s.output}"; remove it, or choose '
         '"mean-rates"'),
        # the set of sensors
        (lambda s: s.rotation and not isinstance(s.sensor_set, Gyros),
         "rotation needs a block of three gyros and three accelerometers: remove it, or sensor_set.type = "
         '"{s.sensor_set.type}"'),
        (lambda s: _REDUNDANT(s) and _given_error(s),
         '{it[0]} has one number per axis of a triad, but sensor_set.type = "redundant" has single sensors with random '
         "errors: give {it[1]}; a fault of type bias-step gives one sensor a bias"),
        (lambda s: _REDUNDANT(s) and s.changed("accel_arms_mm", "accel_delay_ms"),
         '{it} needs a block of two triads: remove it, or sensor_set.type = "redundant"'),
        (lambda s: _REDUNDANT(s) and s.laser_gyro and s.laser_gyro.gas_flow_mps,
         "laser_gyro.gas_flow_mps gives all gyros the same bias, which the monitoring of redundant sensors would find "
         'as a fault: remove it, or sensor_set.type = "redundant"'),
        (lambda s: _PLATFORM(s) and s.changed("accel_arms_mm"),
         'accel_arms_mm acts on the rotation of a block, and a platform hardly rotates: remove it, or sensor_set.type '
         '= "platform"'),
        (lambda s: _PLATFORM(s) and s.changed("accel_delay_ms"),
         'accel_delay_ms is not part of the model of a platform: remove it, or sensor_set.type = "platform"'),
        (lambda s: _PLATFORM(s) and s.laser_gyro,
         "laser_gyro describes laser gyros, which cannot be torqued: remove it, or sensor_set.type = "
         '"platform"'),
        (lambda s: _PLATFORM(s) and _idle_on_platform(s),
         "faults.{it[0]}: a {it[1]} has no effect on a platform, on which the output of the gyros is zero; gyros can "
         "have a bias-step, accelerometers any fault except jitter"),
        (lambda s: _WITHOUT_GYROS(s) and s.changed(*(name for name in type(s).model_fields if "gyro" in name)),
         '{it} is given, but sensor_set.type = "{s.sensor_set.type}" has no gyros: remove it'),
        (lambda s: s.sensor_set.type == "accelerometers" and _given_error(s),
         '{it[0]} has one number per axis of a triad, but sensor_set.type = "accelerometers" has six accelerometers '
         "with random errors: give {it[1]}"),
        (lambda s: _WITHOUT_GYROS(s) and s.changed("accel_arms_mm", "accel_delay_ms", "faults"),
         '{it} needs a block with gyros: remove it, or sensor_set.type = "{s.sensor_set.type}"'),
    )  # fmt: skip

    temperature_start_c: Celsius = Field(
        default=0.0, description=f"temperature of the sensor block at the start, {_OVER}"
    )
    temperature_steady_c: Celsius = Field(
        default=0.0, description=f"temperature of the sensor block after warm-up, {_OVER}"
    )
    warm_up_time_s: Positive = Field(default=600.0, description="time constant of the warm-up")
    accel_arms_mm: tuple[Places, Places, Places] = Field(
        default=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        description="positions of the three accelerometers in the sensor block, each forward, right, down (size "
        "effect)",
    )
    accel_delay_ms: float = Field(
        default=0.0,
        description="delay of the accelerometer data relative to the gyro data: the value for the time t is the "
        "specific force at t minus the delay; at most one interval; negative for a lead",
    )

    laser_gyro: LaserGyros | None = Field(
        default=None, description="physics of the gyros, which determines their random walk and pulse weight"
    )
    faults: tuple[ImuFault, ...] = Field(default=(), description="faults in the run")
    rotation: Rotation | None = Field(default=None, description="rotation of the IMU in the vehicle")

    @field_validator(*(fixed for fixed, _ in _GIVEN_AND_SIGMA), mode="before")
    @classmethod
    def _one_number_per_axis(cls, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, int | float):
            sigma = dict(_GIVEN_AND_SIGMA)[str(info.field_name)]
            raise ValueError(
                f"the error itself needs a list with one number per axis; the 1σ of a random error is {sigma}"
            )
        return value

    @model_validator(mode="after")
    def _values_fit_together(self) -> Self:
        if abs(self.accel_delay_ms) * 1e-3 * self.rate_hz > 1.0:
            raise ValueError(
                f"accel_delay_ms = {self.accel_delay_ms:g} exceeds one interval between samples; at rate_hz = "
                f"{self.rate_hz:g} its magnitude can be at most {1e3 / self.rate_hz:g}"
            )
        for number, fault in enumerate(self.faults, start=1):
            if fault.type == "jitter" and fault.sigma_ms * 1e-3 * self.rate_hz > 0.1:
                raise ValueError(
                    f"faults.{number}.sigma_ms = {fault.sigma_ms:g} would put the time stamps out of order; at "
                    f"rate_hz = {self.rate_hz:g} it can be at most {100.0 / self.rate_hz:g}, a tenth of the interval"
                )
        return self

    @model_validator(mode="after")
    def _can_turn(self) -> Self:
        if self.rotation is not None:
            self.rotation.check_rate(self.rate_hz)
        return self

    @model_validator(mode="after")
    def _faults_are_of_this_set(self) -> Self:
        redundant = self.sensor_set if isinstance(self.sensor_set, Redundant) else None
        count = None if redundant is None else len(redundant.axes)
        for number, fault in enumerate(self.faults, start=1):
            fault.check(f"faults.{number}", count)
        if redundant is None or count is None or redundant.mode != "exclude":
            return self
        for kind in ("gyro", "accel"):
            faulty = sorted(set().union(*(fault.sensors(kind) for fault in self.faults)))
            if len(faulty) > count - 3:
                raise ValueError(
                    f"faults: {len(faulty)} of the {count} sensors of the kind {kind!r} are faulty (numbers "
                    f"{', '.join(map(str, faulty))}), so that fewer than three sensors without a fault remain, which "
                    f"do not determine the motion; at most {count - 3} can be faulty with "
                    'sensor_set.monitoring = "exclude"'
                )
        return self

    @model_validator(mode="after")
    def _windows_are_long(self) -> Self:
        for number, window in enumerate(self.sensor_set.windows_s if isinstance(self.sensor_set, Redundant) else (), 1):
            if window * self.rate_hz < 1.5:
                raise ValueError(
                    f"sensor_set.windows_s.{number} = {window:g} is not longer than a sample, which is tested anyway; "
                    f"at rate_hz = {self.rate_hz:g} a window has at least {2.0 / self.rate_hz:g} s"
                )
        return self

    def stated(self, term: ErrorTerm) -> tuple[Array, Array]:
        """Return mean and standard deviation of one error over all runs, SI, in the shape of its field of
        `TriadErrors`, as given or of the grade: the given error, which is the mean over all runs, or the value of a
        noise, and the 1σ of the random error about it. Beside a given error the 1σ is zero unless it is given, too."""
        if self.laser_gyro is not None and term.name in OF_THE_RING:
            return np.asarray(getattr(self.laser_gyro.ring, OF_THE_RING[term.name])), _NONE
        of_grade = getattr(find_grade(self.grade), term.triad).of(term)
        given = getattr(self, term.key)
        if not term.drawn:
            return term.shaped(of_grade) if given is None else term.si(given), _NONE
        sigma = getattr(self, term.sigma_key)
        if sigma is None:
            spread = term.shaped(of_grade if given is None else 0.0)
        else:
            spread = term.si(sigma)
        return _NONE if given is None else term.si(given), spread

    @property
    def mean(self) -> ImuErrors:
        """The means of the errors over all runs, SI; a noise has none. Faults, arms and delay are not included."""
        mean: dict[str, dict[str, Any]] = {"gyro": {}, "accel": {}}
        for term in TERMS:
            if term.drawn:
                mean[term.triad][term.field] = np.zeros(term.shape) + self.stated(term)[0]
        gyro, accel = (TriadErrors(**fields) for fields in mean.values())
        return ImuErrors(gyro, accel, warm_up=self.warm_up, null_shift=self.null_shift)

    @property
    def sigma(self) -> ImuErrors:
        """The standard deviations of the errors of each sensor over all runs, and the values of its noises, SI."""
        sigma: dict[str, dict[str, Any]] = {"gyro": {}, "accel": {}}
        for term in TERMS:
            fixed, spread = self.stated(term)
            sigma[term.triad][term.field] = np.zeros(term.shape) + spread if term.drawn else float(fixed)
        gyro, accel = (TriadErrors(**fields) for fields in sigma.values())
        return ImuErrors(gyro, accel, warm_up=self.warm_up)

    @property
    def warm_up(self) -> WarmUp:
        """The temperature of the block over time."""
        return WarmUp(self.temperature_start_c, self.temperature_steady_c, self.warm_up_time_s)

    @property
    def null_shift(self) -> NullShift | None:
        """The null shift of the laser gyros; None without gas flow."""
        return None if self.laser_gyro is None else self.laser_gyro.null_shift

    def with_triads(self, gyro: TriadErrors, accel: TriadErrors) -> ImuErrors:
        """Return the errors of the block with given errors of the gyros and accelerometers and everything else, which
        is not random: arms, delay, temperature, faults and null shift, SI."""
        return ImuErrors(
            gyro,
            accel,
            np.array(self.accel_arms_mm) * 1e-3,
            self.accel_delay_ms * 1e-3,
            self.warm_up,
            tuple(fault.fault() for fault in self.faults),
            self.null_shift,
        )

    def require_gyros(self) -> None:
        """Raise InputError for a set of sensors other than three gyros and three accelerometers."""
        if self.sensor_set.type != "gyros":
            raise InputError(
                "a block of three gyros and three accelerometers is emulated; sensor_set.type = "
                f'"{self.sensor_set.type}" is another one.'
            )


def draw(imu: Imu, seed: int = 0) -> ImuErrors:
    """Return the errors of one run: given values plus errors drawn from the given 1σ or that of the grade.

    Args:
        imu: the sensor block.
        seed: the run's seed.

    Returns:
        The errors, SI.

    Raises:
        InputError: the seed cannot be used.
    """
    gyro, accel = (draw_triad(((t, *imu.stated(t)) for t in of_triad(kind)), seed) for kind in ("gyro", "accel"))
    return imu.with_triads(gyro, accel)
