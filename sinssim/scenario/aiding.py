"""The [aiding] section of a scenario: the sensors beside the inertial ones, and what is wrong with them.

An error that differs from run to run can be said in two ways, as for the inertial sensors: `bias_sigma_m = 10.0` is
the 1σ that it is drawn from, `bias_m = 10.0` the error itself. All noises are 1σ of each reading. The filter is told
the 1σ of the white noise, and the description of what its states can follow; `[filter]` may tell it otherwise.
"""

from __future__ import annotations

from typing import Annotated, Self, get_args

from pydantic import AfterValidator, Field, model_validator

from sinssim.scenario.grades import find_grade
from sinssim.scenario.section import NotNegative, Positive, Section


def _in_order(span: tuple[float, float]) -> tuple[float, float]:
    if not span[0] < span[1]:
        raise ValueError(f"from {span[0]:g} s to {span[1]:g} s is no time; the end must lie after the begin")
    return span


Span = Annotated[tuple[NotNegative, NotNegative], AfterValidator(_in_order)]
"""From, to: times of the run, s."""


_Arm = Annotated[float, Field(ge=-1000.0, le=1000.0)]
LeverArm = tuple[_Arm, _Arm, _Arm]
"""Forward, right, down, m: no vehicle is longer."""

Positive3 = tuple[Positive, Positive, Positive]


def _one_of(section: Section, fixed: str, sigma: str) -> None:
    """Refuse an error that is given and to be drawn at once."""
    if getattr(section, fixed) is not None and getattr(section, sigma):
        raise ValueError(f"{fixed} (the error) and {sigma} (1σ to draw it from) are both given: keep one of them")


class AidingSensor(Section):
    """What every aiding sensor has: a rate, a latency, and times without it."""

    rate_hz: Positive = Field(
        default=1.0, description="readings per second, at most the IMU's; the first one interval after the start"
    )
    latency_s: NotNegative = Field(default=0.0, description="time from a reading's validity until the filter gets it")
    outages_s: tuple[Span, ...] = Field(
        default=(), description="[from, to] of each time without readings; they may overlap"
    )


class _Fault(Section):
    from_s: NotNegative = Field(description="when it begins")
    to_s: Positive | None = Field(
        default=None, description="when it ends and the fixes are right again; default: never"
    )

    @model_validator(mode="after")
    def _lasts(self) -> Self:
        if self.to_s is not None:
            _in_order((self.from_s, self.to_s))
        return self

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        sizes = [name for name in type(self).model_fields if name not in _Fault.model_fields]
        if not any(getattr(self, name) for name in sizes):
            raise ValueError(f"{', '.join(sizes)} are all 0, so that nothing happens: give one of them")
        return self


class Jump(_Fault):
    """The fixes are off by a constant for a while."""

    north_m: float = Field(default=0.0, description="error to the north")
    east_m: float = Field(default=0.0, description="error to the east")
    up_m: float = Field(default=0.0, description="error upwards")


class Ramp(_Fault):
    """A spoofer draws the fixes away at a constant velocity, which the velocity fixes show too."""

    north_mps: float = Field(default=0.0, description="growth of the error to the north")
    east_mps: float = Field(default=0.0, description="growth of the error to the east")
    up_mps: float = Field(default=0.0, description="growth of the error upwards")


class GnssSection(AidingSensor):
    """A satellite receiver: position and velocity of its antenna."""

    position: bool = Field(default=True, description="whether it gives positions")
    velocity: bool = Field(default=True, description="whether it gives velocities")
    position_sigma_m: Positive = Field(default=1.5, description="white noise of north and east, each")
    height_sigma_m: Positive = Field(default=3.0, description="white noise of the height")
    velocity_sigma_mps: Positive = Field(default=0.05, description="white noise of each component of the velocity")
    correlated_position_sigma_m: NotNegative = Field(
        default=0.0, description="Gauss-Markov error of north and east, each (orbits, atmosphere)"
    )
    correlated_height_sigma_m: NotNegative = Field(default=0.0, description="Gauss-Markov error of the height")
    correlated_velocity_sigma_mps: NotNegative = Field(
        default=0.0, description="Gauss-Markov error of each component of the velocity"
    )
    correlation_time_s: Positive = Field(default=300.0, description="correlation time of these")
    lever_arm_m: LeverArm = Field(default=(0.0, 0.0, 0.0), description="antenna from the block: forward, right, down")
    lever_arm_sigma_m: NotNegative = Field(default=0.0, description="1σ of what each of these is told wrong")
    jumps: tuple[Jump, ...] = Field(default=(), description="constant errors for a while")
    ramps: tuple[Ramp, ...] = Field(default=(), description="errors that grow: spoofing")

    @model_validator(mode="after")
    def _gives_something(self) -> Self:
        if not (self.position or self.velocity):
            raise ValueError("position = false and velocity = false leave nothing that the receiver gives")
        return self


class BarometerSection(AidingSensor):
    """A barometric altimeter, which reads a height above the ellipsoid."""

    sigma_m: Positive = Field(default=1.0, description="white noise")
    bias_m: float = Field(default=0.0, description="constant error of which the filter is told nothing")
    bias_sigma_m: NotNegative = Field(default=10.0, description="1σ of the pressure field's error, Gauss-Markov")
    bias_correlation_time_s: Positive = Field(default=7200.0, description="correlation time of that")
    scale_ppm: float | None = Field(default=None, description="error in parts of the height: the error itself")
    scale_sigma_ppm: NotNegative = Field(default=0.0, description="1σ to draw it from")
    lag_s: NotNegative = Field(default=0.0, description="time constant of its first-order lag")

    @model_validator(mode="after")
    def _fixed_or_drawn(self) -> Self:
        _one_of(self, "scale_ppm", "scale_sigma_ppm")
        return self


class MagnetometerSection(AidingSensor):
    """A magnetic compass: the heading of the block, its declination taken off as well as that is known."""

    sigma_deg: Positive = Field(default=0.5, description="white noise")
    bias_deg: float | None = Field(default=None, description="error of declination and mounting: the error itself")
    bias_sigma_deg: NotNegative = Field(default=0.0, description="1σ to draw it from")
    deviation_sigma_deg: NotNegative = Field(
        default=0.0, description="1σ of each of the two coefficients of A sin ψ + B cos ψ (hard iron)"
    )

    @model_validator(mode="after")
    def _fixed_or_drawn(self) -> Self:
        _one_of(self, "bias_deg", "bias_sigma_deg")
        return self


class AirspeedSection(AidingSensor):
    """True airspeed along the block's forward axis, for a flight without satellites; the wind is unknown to it."""

    sigma_mps: Positive = Field(default=1.0, description="white noise")
    bias_mps: float | None = Field(default=None, description="constant error: the error itself")
    bias_sigma_mps: NotNegative = Field(default=0.0, description="1σ to draw it from")
    scale_ppm: float | None = Field(default=None, description="error in parts of the airspeed: the error itself")
    scale_sigma_ppm: NotNegative = Field(default=0.0, description="1σ to draw it from")
    lag_s: NotNegative = Field(default=0.0, description="time constant of its first-order lag")
    wind_sigma_mps: NotNegative = Field(
        default=10.0, description="1σ of the wind to the north, and east, for the filter"
    )
    wind_correlation_time_s: Positive = Field(default=1200.0, description="correlation time of it, for the filter")

    @model_validator(mode="after")
    def _fixed_or_drawn(self) -> Self:
        _one_of(self, "bias_mps", "bias_sigma_mps")
        _one_of(self, "scale_ppm", "scale_sigma_ppm")
        return self


class OdometerSection(AidingSensor):
    """The speed of a ground vehicle along the block's forward axis."""

    sigma_mps: Positive = Field(default=0.05, description="white noise")
    scale_ppm: float | None = Field(default=None, description="error in parts of the speed: the error itself")
    scale_sigma_ppm: NotNegative = Field(default=0.0, description="1σ to draw it from")
    lever_arm_m: LeverArm = Field(default=(0.0, 0.0, 0.0), description="wheel from the block: forward, right, down")

    @model_validator(mode="after")
    def _fixed_or_drawn(self) -> Self:
        _one_of(self, "scale_ppm", "scale_sigma_ppm")
        return self


class _Standstill(AidingSensor):
    during_s: tuple[Span, ...] | None = Field(
        default=None, description="[from, to] of each time that is taken for a stop; default: when it truly stands"
    )


class ZeroVelocitySection(_Standstill):
    """The knowledge that the vehicle stands: its velocity is zero but for what wind and engines shake it by."""

    sigma_mps: Positive = Field(default=0.01, description="of that shaking, each component")


class ZeroRateSection(_Standstill):
    """The knowledge that the vehicle does not turn: its rate is zero but for what wind and engines shake it by."""

    sigma_deg_h: Positive = Field(default=0.1, description="of that shaking, mean over a reading's interval, each axis")


class AttitudeSection(AidingSensor):
    """An attitude reference: the attitude of the block in the local level, with errors about its axes."""

    sigma_arcmin: Positive3 = Field(default=(6.0, 6.0, 18.0), description="white noise about forward, right and down")
    bias_sigma_arcmin: NotNegative = Field(default=0.0, description="1σ of its Gauss-Markov error about each axis")
    bias_correlation_time_s: Positive = Field(default=600.0, description="correlation time of that")


class StarTrackerSection(AidingSensor):
    """A star tracker: the attitude of the block among the stars."""

    sigma_arcsec: Positive3 = Field(default=(5.0, 5.0, 5.0), description="white noise about forward, right and down")
    bias_sigma_arcsec: NotNegative = Field(default=0.0, description="1σ of its mounting's error about each axis")


class MasterSection(AidingSensor):
    """A better inertial system on the same vehicle, which runs from the same start: transfer alignment."""

    grade: str = Field(default="laser-navigation", description="its sensors, see `sinssim list grades`")
    lever_arm_m: LeverArm = Field(default=(0.0, 0.0, 0.0), description="from the block to it: forward, right, down")
    velocity: bool = Field(default=True, description="whether its velocity is used")
    attitude: bool = Field(default=False, description="whether its attitude is used")
    velocity_sigma_mps: Positive = Field(default=0.05, description="white noise between the two: bending, vibration")
    velocity_drift_mps: NotNegative = Field(default=0.1, description="1σ that its own velocity errors may grow to")
    drift_time_s: Positive = Field(default=3600.0, description="correlation time of these, for the filter")
    attitude_sigma_arcmin: Positive = Field(default=1.0, description="white noise between the two, each axis")
    mounting_sigma_arcmin: NotNegative = Field(default=0.0, description="1σ of what they are mounted askew, each axis")

    @model_validator(mode="after")
    def _gives_something(self) -> Self:
        find_grade(self.grade)
        if not (self.velocity or self.attitude):
            raise ValueError("velocity = false and attitude = false leave nothing of the better system to use")
        return self


class AidingSection(Section):
    """What the filter corrects inertial navigation by: each table switches a sensor on."""

    gnss: GnssSection | None = None
    baro: BarometerSection | None = None
    magnetometer: MagnetometerSection | None = None
    airspeed: AirspeedSection | None = None
    odometer: OdometerSection | None = None
    zero_velocity: ZeroVelocitySection | None = None
    zero_rate: ZeroRateSection | None = None
    attitude: AttitudeSection | None = None
    star_tracker: StarTrackerSection | None = None
    master: MasterSection | None = None

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not any(getattr(self, name) is not None for name in type(self).model_fields):
            raise ValueError(f"it names no sensor; tables in it may be {', '.join(type(self).model_fields)}")
        return self


def sensors() -> dict[str, str]:
    """Return the tables of [aiding], and what each is.

    Returns:
        A sentence by name.
    """
    found = {}
    for name, field in AidingSection.model_fields.items():
        section = next(kind for kind in get_args(field.annotation) if kind is not type(None))
        found[name] = (section.__doc__ or "").split("\n")[0]
    return found
