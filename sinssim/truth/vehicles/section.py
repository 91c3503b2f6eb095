"""The tables [drive] and [voyage] of a scenario: legs on the ground and on water, the road and the sea."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self, Union

from pydantic import Field, model_validator

from sinssim.section import Heading, Height, Keys, Latitude, Longitude, Section, Source

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
    """Brake to a standstill and remain at rest."""

    example: ClassVar[dict[str, Any]] = {"duration_s": 60.0}

    type: Literal["stop"]
    duration_s: _Lasting = Field(description="time at rest, after braking")


class Straight(Section):
    """Straight ahead on a constant heading; the speed changes at the beginning of the leg."""

    example: ClassVar[dict[str, Any]] = {"distance_m": 2000.0, "speed_mps": 8.0}
    exactly_one = (Keys(("distance_m", "duration_s"), "a straight leg ends after distance_m or after duration_s"),)

    type: Literal["straight"]
    distance_m: _Distance | None = Field(default=None, description="distance, including the change of speed")
    duration_s: _Lasting | None = Field(default=None, description="duration, including the change of speed")
    speed_mps: _Speed | None = Field(default=None, description="target speed; default: that of the previous leg")


class Turn(Section):
    """A turn at constant speed, with a smooth beginning and end."""

    example: ClassVar[dict[str, Any]] = {"angle_deg": 90.0}

    type: Literal["turn"]
    angle_deg: float = Field(ge=-3600.0, le=3600.0, description="change of the heading, right positive")
    rate_deg_s: Annotated[float, Field(gt=0.0, le=60.0)] | None = Field(
        default=None, description="largest rate of the turn; default: the rate that follows from lateral_mps2"
    )

    @model_validator(mode="after")
    def _turns(self) -> Self:
        if self.angle_deg == 0.0:
            raise ValueError("angle_deg = 0 is not a turn: give the change of the heading, right positive")
        return self


VehicleLeg = Annotated[Union[Straight, Turn, Stop], Field(discriminator="type")]  # noqa: UP007
"""One leg, selected by `type`."""


class VehicleSection(Source):
    """What [drive] and [voyage] have in common; the vehicle begins at rest."""

    travels: ClassVar[bool] = True

    latitude_deg: Latitude = Field(description="latitude of the start")
    longitude_deg: Longitude = Field(default=0.0, description="longitude of the start")
    altitude_m: Height = Field(default=0.0, description="height of the road or the sea above the ellipsoid")
    heading_deg: Heading = Field(default=0.0, description="heading at the start")
    legs: tuple[VehicleLeg, ...] = Field(min_length=1, description="the legs, in order")


class DriveSection(VehicleSection):
    """A land vehicle: legs on a level road, the roughness of the road, and the suspension of the body. The road has the
    spectral density of ISO 8608, G(n) = G(0.1)·(n/0.1)⁻² for wave numbers n of 0.011 to 2.83 cycles/m. The left and the
    right wheels follow the same profile, so the roughness causes heave and pitch. The body rolls in turns.
    """

    table: ClassVar[str] = "drive"

    road: Literal["smooth", "A", "B", "C", "D", "E"] = Field(
        default="B", description="road class of ISO 8608, or smooth"
    )
    acceleration_mps2: Annotated[float, Field(gt=0.0, le=10.0)] = Field(
        default=1.0, description="mean acceleration and braking"
    )
    lateral_mps2: Annotated[float, Field(gt=0.0, le=10.0)] = Field(
        default=1.5, description="lateral acceleration in turns for which no rate is given"
    )
    wheelbase_m: Annotated[float, Field(ge=0.5, le=30.0)] = Field(default=2.7, description="distance between the axles")
    suspension_hz: Annotated[float, Field(ge=0.3, le=10.0)] = Field(
        default=1.3, description="natural frequency of the body on its suspension, heave and pitch"
    )
    suspension_damping: _Damping = Field(default=0.3, description="damping ratio of the suspension")
    roll_deg_per_mps2: Annotated[float, Field(ge=0.0, le=5.0)] = Field(
        default=0.5, description="outward roll in turns per lateral acceleration"
    )
    pitch_deg_per_mps2: Annotated[float, Field(ge=0.0, le=5.0)] = Field(
        default=0.3, description="pitch per acceleration, nose up positive"
    )


class VoyageSection(VehicleSection):
    """A ship: legs on the sea, long-crested waves of one direction, and the response of the hull. The waves have the
    two-parameter Bretschneider spectrum (ITTC), which is the Pierson-Moskowitz spectrum for the default period. Heave,
    surge and sway follow the waves, and roll and pitch follow the wave slope across and along the hull, each as a
    damped oscillator. The frequency of encounter depends on the speed and the heading.
    """

    table: ClassVar[str] = "voyage"

    sea_state: Annotated[int, Field(ge=0, le=9)] = Field(
        default=3, description="WMO sea state; the wave height is the middle of its range"
    )
    significant_height_m: Annotated[float, Field(ge=0.0, le=20.0)] | None = Field(
        default=None, description="significant wave height; default: that of sea_state"
    )
    peak_period_s: Annotated[float, Field(ge=1.0, le=30.0)] | None = Field(
        default=None, description="peak period of the spectrum; default: that of the Pierson-Moskowitz spectrum"
    )
    waves_towards_deg: Heading = Field(default=90.0, description="direction towards which the waves travel")
    acceleration_mps2: Annotated[float, Field(gt=0.0, le=2.0)] = Field(
        default=0.05, description="mean acceleration and deceleration"
    )
    lateral_mps2: Annotated[float, Field(gt=0.0, le=2.0)] = Field(
        default=0.1, description="lateral acceleration in turns for which no rate is given"
    )
    heel_deg_per_mps2: Annotated[float, Field(ge=0.0, le=30.0)] = Field(
        default=5.0, description="outward heel in turns per lateral acceleration"
    )
    roll_period_s: _Period = Field(default=10.0, description="natural period of roll")
    roll_damping: _Damping = Field(default=0.1, description="damping ratio of roll")
    pitch_period_s: _Period = Field(default=6.0, description="natural period of pitch")
    pitch_damping: _Damping = Field(default=0.4, description="damping ratio of pitch")
    heave_period_s: _Period = Field(default=6.0, description="natural period of heave, surge and sway")
    heave_damping: _Damping = Field(default=0.4, description="damping ratio of heave, surge and sway")

    @property
    def height_m(self) -> float:
        """The significant height of the waves, m."""
        return SEA_STATES[self.sea_state] if self.significant_height_m is None else self.significant_height_m
