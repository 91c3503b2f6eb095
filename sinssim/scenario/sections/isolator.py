"""The [isolator] table of a scenario: shock mounts between the airframe's vibration and the sensor block."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sinssim.section import Frequency, Section

Damping = Annotated[float, Field(ge=1e-6, le=1e3)]
"""Limits of the damping ratio: below, resonance grows without bound; above, the mount is rigid."""


class IsolatorSection(Section):
    """Shock mounts, which transmit [[vibration]] as a second-order system; the motion itself is unchanged."""

    linear_hz: Frequency = Field(description="natural frequency in translation")
    linear_damping: Damping = Field(default=0.2, description="damping ratio in translation")
    angular_hz: Frequency = Field(description="natural frequency in rotation")
    angular_damping: Damping = Field(default=0.2, description="damping ratio in rotation")
