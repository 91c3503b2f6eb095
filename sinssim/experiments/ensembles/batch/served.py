"""Which options the batch serves: `served`. What it does not serve is navigated run by run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.algorithms import REGISTRY
from sinssim.sensors.aiding.baro import Barometer
from sinssim.sensors.sets.sensor_set import Gyros

if TYPE_CHECKING:
    from sinssim.scenario import Scenario

FRAME = "level"
"""The frame that the batch serves."""


def served_algorithm(algorithm: str) -> str | None:
    """Return why the batch does not serve an attitude algorithm.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.

    Returns:
        A reason as a clause without a full stop; None if it serves it.
    """
    from sinssim.experiments.ensembles.batch.engines import variables_of
    from sinssim.strapdown.files import algorithm_file

    if not REGISTRY[algorithm].sample_by_sample:
        return f"{algorithm} advances by several samples at once"
    if hasattr(algorithm_file(algorithm), "turn_k"):
        return f"{algorithm} computes the body's turns in its own way"
    if REGISTRY[algorithm].variant.get("ORTHONORMAL", False):
        return f"{algorithm} iterates to the nearest rotation after each step"
    if variables_of(algorithm) is None:
        return f"{algorithm} has attitude variables of its own kind"
    return None


def served(scenario: Scenario) -> str | None:
    """Return why the batch does not serve a scenario.

    Returns:
        The first reason as a clause without a full stop, for example "it has a filter"; None if the batch serves it.
    """
    navigation, imu = scenario.navigation, scenario.imu
    if scenario.one_component is not None:
        return "it has one component"
    if scenario.filter is not None:
        return "it has a filter"
    if not isinstance(imu.sensor_set, Gyros):
        return f'imu.sensor_set.type = "{imu.sensor_set.type}"'
    if imu.output != "increments":
        return f'imu.output = "{imu.output}"'
    if scenario.compensation is not None:
        return "its inertial data are compensated by a calibration of each run"
    if scenario.vibration or scenario.motion is not None:
        return "its motion within a sample acts on the errors of each run"
    if scenario.gravity is not None and scenario.gravity.remainder is not None:
        return "the remainder of its gravity is drawn in each run"
    if navigation.gravity_degree is not None:
        return "its navigator compensates the disturbance of gravity along its own path"
    if imu.rotation is not None:
        return "its IMU rotates in the vehicle"
    if navigation.alignment is not None:
        return "each run aligns itself"
    if imu.faults:
        return "it has faults of the sensors"
    if navigation.frame != FRAME:
        return f'navigation.frame = "{navigation.frame}"'
    if navigation.rates_hz is not None:
        return "it has a three-rate schedule"
    altimeter = None if scenario.aiding is None else scenario.aiding.sensor(Barometer)
    if navigation.vertical == "baro-loop" and altimeter is not None:
        return "the barometer of its vertical channel has errors of each run"
    return next(filter(None, map(served_algorithm, navigation.algorithms)), None)
