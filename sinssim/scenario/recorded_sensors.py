"""Recorded sensors of a scenario: `load_log`, and their errors that are states of the filter.

The errors have keys in [log] as those of emulated sensors.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from sinssim.errors import InputError
from sinssim.logs.log_files import other_units
from sinssim.logs.log_settings import Log
from sinssim.logs.recorded_log import RecordedLog, recorded_log
from sinssim.scenario.load import Overrides, as_scenario
from sinssim.scenario.schema import Scenario
from sinssim.sensors.aiding.gnss import Gnss
from sinssim.sensors.aiding_sensor import SensorState
from sinssim.units import PPM

if TYPE_CHECKING:
    from sinssim.logs.log_settings import LogOther
    from sinssim.scenario.filter_model import HasStates


def load_log(source: Scenario | str | Path, overrides: Overrides = ()) -> RecordedLog:
    """Load recorded sensors.

    Args:
        source: a scenario with [log], its TOML file or its name; or the recorded file of an inertial unit in one of the
            formats of `sinssim list formats`, alone.
        overrides: settings "key=value" of a scenario, as for `load_scenario`.

    Returns:
        Increments, measurements and reference, in the run's time.

    Raises:
        InputError: the scenario has no recorded sensors, a file cannot be read, samples are missing, or the files do
            not overlap in time.
    """
    if isinstance(source, str | Path) and Path(source).is_file() and Path(source).suffix != ".toml":
        if overrides:
            raise InputError(f"{source} is a log; overrides change a scenario, which describes logs.")
        return recorded_log(Log.model_validate({"imu": {"file": str(source)}}))
    scenario = as_scenario(source, overrides)
    if scenario.log is None:
        raise InputError(
            f"the scenario {scenario.name} has no recorded sensors: add the table [log], or give the file of an "
            "inertial unit."
        )
    return recorded_log(scenario.log, scenario.imu.mounting_deg)


@dataclass(frozen=True)
class RecordedOther:
    """The errors of a sensor of [[log.others]]."""

    section: LogOther  # its description

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
