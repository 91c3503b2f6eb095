"""The [filter] section of a scenario: how the errors of inertial navigation are estimated from the aiding sensors."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from sinssim.errors import unknown_name
from sinssim.names import FILTER_STATES
from sinssim.scenario.section import Positive, Section

NAVIGATION_STATES = ("position", "velocity", "attitude")
LEAST_IN_MOTION_S = 45.0
"""Shortest alignment in motion: two windows of 20 s with fixes at their ends, and some time until the first fix, s."""


def _known(name: str) -> str:
    if name in NAVIGATION_STATES:
        raise ValueError(f"{name!r} is a state of every filter; states names errors of the inertial sensors")
    if name not in FILTER_STATES:
        raise unknown_name("block of states", name, FILTER_STATES)
    return name


Factor = Annotated[float, Field(ge=1e-3, le=1e3)]
StateBlock = Annotated[str, AfterValidator(_known)]


class InitialSigmaSection(Section):
    """1σ of the initial state that the filter is told; by default what [navigation.initial_error] draws and gives."""

    position_m: Positive | None = Field(default=None, description="of the position to the north, and east")
    height_m: Positive | None = Field(default=None, description="of the height")
    velocity_mps: Positive | None = Field(default=None, description="of each component of the velocity")
    tilt_arcmin: Positive | None = Field(default=None, description="of the tilt about north, and east")
    heading_arcmin: Positive | None = Field(default=None, description="of the turn about the vertical")


class FilterSection(Section):
    """A Kalman filter on the aiding sensors, told the truth about all noises unless a factor says otherwise."""

    states: tuple[StateBlock, ...] = Field(
        default=("gyro bias", "accelerometer bias"),
        description=f"errors of the inertial sensors that are states, of {', '.join(FILTER_STATES)}; those of aiding "
        "sensors come by themselves",
    )
    loop: Literal["closed", "open"] = Field(
        default="closed", description="errors fed back into engine and compensator, or fed forward"
    )
    rate_hz: float = Field(
        default=10.0,
        ge=1.0,
        description="prediction of the covariance, rounded to every so-manieth sample of the IMU, at most every one",
    )
    gate: float = Field(
        default=1e-4, ge=0.0, lt=1.0, description="part of the right readings that may be refused; 0 refuses nothing"
    )
    smooth: bool = Field(default=False, description="whether the solution is smoothed afterwards")
    alignment: Literal["at-rest", "in-motion"] = Field(
        default="at-rest",
        description="a coarse alignment by gravity and the Earth's rate on a vehicle that stands, or by the "
        "satellites' velocities on one that turns",
    )
    alignment_s: Positive | None = Field(
        default=None,
        description="how long it takes, default: there is none; the filter begins at its end, in motion at the first "
        "fix",
    )
    inertial_noise_factor: Factor = Field(
        default=1.0, description="the noise of gyros and accelerometers that the filter is told, in parts of the true"
    )
    measurement_noise_factor: Factor = Field(
        default=1.0, description="the noise of the aiding sensors that the filter is told, in parts of the true"
    )
    initial_sigma: InitialSigmaSection = Field(default=InitialSigmaSection())

    @model_validator(mode="after")
    def _alignment_lasts(self) -> Self:
        if self.alignment == "in-motion":
            if self.alignment_s is None:
                raise ValueError('alignment = "in-motion" needs alignment_s, a minute or two with turns in it')
            if self.alignment_s < LEAST_IN_MOTION_S:
                raise ValueError(
                    f"alignment_s = {self.alignment_s:g} must be at least {LEAST_IN_MOTION_S:g} for an alignment in "
                    "motion"
                )
        return self

    @model_validator(mode="after")
    def _states_once(self) -> Self:
        twice = sorted({name for name in self.states if self.states.count(name) > 1})
        if twice:
            raise ValueError(f"states names {twice[0]!r} twice; every block can be there once")
        return self
