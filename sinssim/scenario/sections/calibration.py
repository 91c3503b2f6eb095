"""The [calibration] table: how errors are estimated from a sequence on a turntable."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sinssim.section import Moment, Section

_Error = Annotated[float, Field(ge=0.0, le=36_000.0)]


class CalibrationSection(Section):
    """Settings of `sinssim calibrate`, which estimates the sensor errors from the sequence of [turntable]."""

    method: Literal["separate", "systematic"] = Field(
        default="systematic",
        description="separate: from means in known positions and integrals over known turns; systematic: from the "
        "navigation errors during the sequence",
    )
    use: Literal["positions", "positions-and-rates"] = Field(
        default="positions-and-rates",
        description="data of the separate method: only the positions, or also the turns between them",
    )
    arms: bool | None = Field(
        default=None,
        description="whether the systematic method estimates the positions of the accelerometers; default: if "
        "imu.accel_arms_mm is not zero",
    )
    interval_s: float = Field(
        default=1.0, ge=0.01, le=60.0, description="systematic: time between two observations of the velocity"
    )
    velocity_sigma_mm_s: float = Field(
        default=0.01,
        ge=1e-6,
        le=1e3,
        description="systematic: 1σ of the velocity of the stationary IMU, due to the sway of the base",
    )
    attitude_sigma_deg: float = Field(
        default=10.0, ge=1e-3, le=30.0, description="systematic: 1σ of the nominal heading of the first position"
    )
    position_sigma_arcsec: _Error | None = Field(
        default=None, description="separate: assumed accuracy of the table's positions; default: that of [turntable]"
    )
    tilt_sigma_arcsec: _Error | None = Field(
        default=None, description="separate: assumed tilt of the table's base; default: that of [turntable]"
    )
    dwells_s: tuple[tuple[Moment, Moment], ...] = Field(
        default=(),
        description="for a log: start and end of each dwell; default: the intervals in which the gyros sense no "
        "rotation",
    )

    @model_validator(mode="after")
    def _dwells_are_in_order(self) -> Self:
        last = 0.0
        for number, (begin, end) in enumerate(self.dwells_s, start=1):
            if not last <= begin < end:
                raise ValueError(
                    f"dwells_s: dwell {number} from {begin:g} s to {end:g} s must begin after {last:g} s and end after "
                    "its beginning"
                )
            last = end
        return self
