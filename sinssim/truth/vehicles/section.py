"""The tables [drive] and [voyage] of a scenario: legs on the ground and on water, the road and the sea."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self, Union

from pydantic import Field, model_validator

from sinssim.section import Heading, Height, Latitude, Longitude, Section

_Lasting = Annotated[float, Field(gt=0.0, le=86_400.0)]
_Distance = Annotated[float, Field(gt=0.0, le=2e6)]
_Speed = Annotated[float, Field(gt=0.0, le=60.0)]
_Period = Annotated[float, Field(ge=0.2, le=60.0)]
_Damping = Annotated[float, Field(gt=0.0, lt=1.0)]

ROADS = {"A": 16e-6, "B": 64e-6, "C": 256e-6, "D": 1024e-6, "E": 4096e-6}
"""Classes of roads by ISO 8608: geometric mean of the spectral density of the height at 0.1 cycles/m, m³."""

SEA_STATES = (0.0, 0.05, 0.3, 0.875, 1.875, 3.25, 5.0, 7.5, 11.5, 14.0)
"""Significant height of the waves by sea state, the middle of its range in the WMO's code table 3700, m."""


class Stop(Section):
    """Brake to a standstill, and stand."""

    example: ClassVar[dict[str, Any]] = {"duration_s": 60.0}

    type: Literal["stop"]
    duration_s: _Lasting = Field(description="time at rest, after braking")


class Straight(Section):
    """Straight ahead on a constant heading; a change of speed is at its beginning."""

    example: ClassVar[dict[str, Any]] = {"distance_m": 2000.0, "speed_mps": 8.0}

    type: Literal["straight"]
    distance_m: _Distance | None = Field(default=None, description="way, including the change of speed")
    duration_s: _Lasting | None = Field(default=None, description="duration, including the change of speed")
    speed_mps: _Speed | None = Field(default=None, description="speed to reach; default: that of the leg before")

    @model_validator(mode="after")
    def _one_end(self) -> Self:
        if (self.distance_m is None) == (self.duration_s is None):
            raise ValueError("a straight leg ends after distance_m or after duration_s: give exactly one of them")
        return self


class Turn(Section):
    """A turn at constant speed, with a smooth beginning and end."""

    example: ClassVar[dict[str, Any]] = {"angle_deg": 90.0}

    type: Literal["turn"]
    angle_deg: float = Field(ge=-3600.0, le=3600.0, description="change of the heading, right positive")
    rate_deg_s: Annotated[float, Field(gt=0.0, le=60.0)] | None = Field(
        default=None, description="largest rate of the turn; default: that of lateral_mps2 of the table above"
    )

    @model_validator(mode="after")
    def _turns(self) -> Self:
        if self.angle_deg == 0.0:
            raise ValueError("angle_deg = 0 is no turn: give the change of the heading, right positive")
        return self


VehicleLeg = Annotated[Union[Straight, Turn, Stop], Field(discriminator="type")]  # noqa: UP007
"""One leg, selected by `type`."""


class VehicleSection(Section):
    """What [drive] and [voyage] have in common; the vehicle begins at rest."""

    latitude_deg: Latitude = Field(description="latitude of the start")
    longitude_deg: Longitude = Field(default=0.0, description="longitude of the start")
    altitude_m: Height = Field(default=0.0, description="height of the road or the sea above the ellipsoid")
    heading_deg: Heading = Field(default=0.0, description="heading at the start")
    legs: tuple[VehicleLeg, ...] = Field(min_length=1, description="the legs, in order")


class DriveSection(VehicleSection):
    """A land vehicle: legs on a level road, its roughness, and the suspension of the body.

    The road has the spectral density of ISO 8608, G(n) = G(0.1)·(n/0.1)⁻² over wave numbers n of 0.011 to 2.83
    cycles/m. Both tracks of the vehicle are alike: roughness moves the body in heave and pitch; it rolls in turns.
    """

    road: Literal["smooth", "A", "B", "C", "D", "E"] = Field(
        default="B", description="class of the road by ISO 8608, or smooth"
    )
    acceleration_mps2: Annotated[float, Field(gt=0.0, le=10.0)] = Field(
        default=1.0, description="mean acceleration and braking"
    )
    lateral_mps2: Annotated[float, Field(gt=0.0, le=10.0)] = Field(
        default=1.5, description="lateral acceleration of turns without a rate"
    )
    wheelbase_m: Annotated[float, Field(ge=0.5, le=30.0)] = Field(default=2.7, description="distance of the axles")
    suspension_hz: Annotated[float, Field(ge=0.3, le=10.0)] = Field(
        default=1.3, description="natural frequency of the body on its suspension, heave and pitch"
    )
    suspension_damping: _Damping = Field(default=0.3, description="its damping ratio")
    roll_deg_per_mps2: Annotated[float, Field(ge=0.0, le=5.0)] = Field(
        default=0.5, description="roll in turns, outwards, by lateral acceleration"
    )
    pitch_deg_per_mps2: Annotated[float, Field(ge=0.0, le=5.0)] = Field(
        default=0.3, description="pitch by acceleration, nose up"
    )


class VoyageSection(VehicleSection):
    """A ship: legs on the sea, long-crested waves of one direction, and the response of the hull.

    The waves have the spectrum of Bretschneider (ITTC, two parameters), which is that of Pierson and Moskowitz for the
    default period. Heave, surge and sway follow the waves, roll and pitch their slope across and along the hull, each
    as a damped oscillator. The ship meets the waves on its way, so that speed and heading change their frequency.
    """

    sea_state: Annotated[int, Field(ge=0, le=9)] = Field(
        default=3, description="sea state of the WMO, which gives the middle of its range of heights"
    )
    significant_height_m: Annotated[float, Field(ge=0.0, le=20.0)] | None = Field(
        default=None, description="significant height of the waves; default: that of sea_state"
    )
    peak_period_s: Annotated[float, Field(ge=1.0, le=30.0)] | None = Field(
        default=None, description="period of the spectrum's peak; default: that of Pierson and Moskowitz"
    )
    waves_towards_deg: Heading = Field(default=90.0, description="direction that the waves travel to")
    acceleration_mps2: Annotated[float, Field(gt=0.0, le=2.0)] = Field(
        default=0.05, description="mean acceleration and deceleration"
    )
    lateral_mps2: Annotated[float, Field(gt=0.0, le=2.0)] = Field(
        default=0.1, description="lateral acceleration of turns without a rate"
    )
    heel_deg_per_mps2: Annotated[float, Field(ge=0.0, le=30.0)] = Field(
        default=5.0, description="heel in turns, outwards, by lateral acceleration"
    )
    roll_period_s: _Period = Field(default=10.0, description="natural period of roll")
    roll_damping: _Damping = Field(default=0.1, description="damping ratio of roll")
    pitch_period_s: _Period = Field(default=6.0, description="natural period of pitch")
    pitch_damping: _Damping = Field(default=0.4, description="damping ratio of pitch")
    heave_period_s: _Period = Field(default=6.0, description="natural period of heave, surge and sway")
    heave_damping: _Damping = Field(default=0.4, description="their damping ratio")

    @property
    def height_m(self) -> float:
        """The significant height of the waves, m."""
        return SEA_STATES[self.sea_state] if self.significant_height_m is None else self.significant_height_m
