"""The [isolator] table of a scenario: shock mounts between the airframe's vibration and the sensor block."""

from __future__ import annotations

from pydantic import Field

from sinssim.scenario.section import Positive, Section


class IsolatorSection(Section):
    """Shock mounts, which pass [[vibration]] on as a second-order system; the motion itself goes through unchanged."""

    linear_hz: Positive = Field(description="natural frequency in displacements")
    linear_damping: Positive = Field(default=0.2, description="of these, part of the critical damping")
    angular_hz: Positive = Field(description="natural frequency in turns")
    angular_damping: Positive = Field(default=0.2, description="of these, part of the critical damping")
