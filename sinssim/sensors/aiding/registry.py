"""The registries of aiding sensors and of kinds of measurement.

Adding a sensor takes a file beside this one and a line in `SENSORS`; see `docs/extending/aiding-sensor.md`. Adding a
kind of measurement takes a file under `sinssim/estimation/measurements/` and a line in `KINDS`; see
`docs/extending/measurement-kind.md`.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TypeVar

import sinssim
from sinssim.errors import InputError
from sinssim.system.own_content.registry import Registry

_T = TypeVar("_T")

SENSORS: Registry[str] = Registry("aiding", "aiding sensor", {
    "gnss": "gnss.GnssSection",
    "baro": "barometer.BarometerSection",
    "magnetometer": "magnetometer.MagnetometerSection",
    "airspeed": "airspeed.AirspeedSection",
    "odometer": "odometer.OdometerSection",
    "zero_velocity": "standstill.ZeroVelocitySection",
    "zero_rate": "standstill.ZeroRateSection",
    "attitude": "attitude_reference.AttitudeSection",
    "star_tracker": "star_tracker.StarTrackerSection",
    "master": "master.MasterSection",
    "dual_antenna": "dual_antenna.DualAntennaSection",
    "land_vehicle": "land_vehicle.LandVehicleSection",
})  # fmt: skip
"""File and class of each sensor, by its table in [aiding]."""

KINDS: Registry[str | type] = Registry("kinds", "kind of measurement", {
    "gnss-position": "position.GnssPosition",
    "gnss-velocity": "velocity.GnssVelocity",
    "baro-height": "height.BaroHeight",
    "zero-velocity": "velocity.ZeroVelocity",
    "zero-rate": "rate.ZeroRate",
    "heading": "heading.Heading",
    "attitude": "attitude.LevelAttitude",
    "earth-attitude": "attitude.EarthAttitude",
    "speed": "speed.Speed",
    "airspeed": "airspeed.Airspeed",
    "land-velocity": "land_velocity.LandVelocity",
    "baseline-heading": "heading.BaselineHeading",
})  # fmt: skip
"""File and class of each kind of measurement, by `Measurements.kind`; the class itself of a kind outside the package,
which the file of a sensor brings under its own name."""


def load_class(package: str, entry: str, base: type[_T]) -> type[_T]:
    """Load the class of an entry.

    Args:
        package: package of the file, for example "sinssim.sensors.aiding".
        entry: file and class, for example "gnss.GnssSection".
        base: required base class.

    Returns:
        The class.

    Raises:
        InputError: the file is missing or invalid, or has no such class; the message names its path.
    """
    module, _, name = entry.rpartition(".")
    path = Path(sinssim.__file__).parent.joinpath(*package.split(".")[1:], *module.split(".")).with_suffix(".py")
    try:
        found = getattr(importlib.import_module(f"{package}.{module}"), name)
    except Exception as error:  # any error of an invalid file
        raise InputError(f"{path} cannot be used: {type(error).__name__}: {error}") from error
    if not (isinstance(found, type) and issubclass(found, base)):
        raise InputError(f"{path} cannot be used: {name} must be a class that derives from {base.__name__}.")
    if not (found.__doc__ or "").strip():
        raise InputError(f"{path} cannot be used: {name} needs a docstring, whose first line describes it.")
    return found
