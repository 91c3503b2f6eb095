"""The errors of recorded sensors that are states of the filter: their keys in [log] as those of emulated sensors."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sinssim.logs.files import other_units
from sinssim.sensors.aiding.base.sensor import SensorState
from sinssim.sensors.aiding.gnss import Gnss
from sinssim.units import PPM

if TYPE_CHECKING:
    from sinssim.logs.log import LogOther
    from sinssim.scenario import Scenario
    from sinssim.scenario.filter.filter_model import HasStates


@dataclass(frozen=True)
class RecordedOther:
    """The errors of a sensor of [[log.others]].

    Attributes:
        section: its description.
    """

    section: LogOther

    def states(self) -> Iterator[SensorState]:
        """Yield the states of its bias and its scale factor; of σ 0 if there is none."""
        s, bias = self.section, 0.0
        if s.bias_sigma is not None and s.bias_sigma.value is not None:
            bias = s.bias_sigma.value * other_units(s)[s.bias_sigma.unit]
        yield SensorState(f"{s.name} bias", (bias,), s.bias_correlation_time_s or math.inf)
        yield SensorState(f"{s.name} scale", (PPM * s.scale_sigma_ppm,))


def recorded_sensors(scenario: Scenario) -> tuple[HasStates, ...]:
    """Return descriptions of the errors of the recorded sensors, as the filter has them as states."""
    if scenario.log is None:
        return ()
    others = tuple(RecordedOther(other) for other in scenario.log.others)
    gnss = scenario.log.gnss
    if gnss is None:
        return others
    keys = (
        "lever_arm_sigma_m", "correlated_position_sigma_m", "correlated_height_sigma_m",
        "correlated_velocity_sigma_mps", "correlation_time_s", "time_offset_sigma_s", "velocity_delay_sigma_s",
    )  # fmt: skip
    satellites = Gnss(
        position="position" in gnss.use,
        velocity="velocity" in gnss.use,
        **{key: getattr(gnss, key) for key in keys},
    )
    return (satellites, *others)
