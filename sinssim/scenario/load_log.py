"""Loads recorded sensors by the scenario that describes them, or a file in a known format: `load_log`."""

from __future__ import annotations

from pathlib import Path

from sinssim.errors import InputError
from sinssim.logs.load import RecordedLog, recorded_log
from sinssim.logs.log import Log
from sinssim.scenario.load import Overrides, as_scenario
from sinssim.scenario.schema import Scenario


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
