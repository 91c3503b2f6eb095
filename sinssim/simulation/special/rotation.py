"""Navigation with an IMU that rotates in the vehicle, [imu.rotation]."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from sinssim.simulation.truth import Truth

if TYPE_CHECKING:
    from sinssim.data import ImuData, NavSolution
    from sinssim.simulation.setup import Setup
    from sinssim.strapdown.mechanization import Mechanization


def turned(setup: Setup) -> Setup:
    """Turn the initial state into the rotating IMU, and the solutions out of it by the readings of its encoders.

    Returns:
        The setup; unchanged for an IMU that does not rotate.
    """
    if setup.scenario.imu.rotation is None or not isinstance(setup.truth, Truth):
        return setup
    from sinssim.sensors.imu.encoder import encoders_of, turned_in

    block, time = setup.truth.block, setup.imu.time
    encoders = encoders_of(block, None if setup.errors is None else setup.errors.encoders, time)
    assert encoders is not None  # the block turns
    inner = setup.engine

    def engine(own: Setup, imu: ImuData, of: Mechanization) -> NavSolution:
        return encoders.turned_out(inner(own, imu, of))

    return replace(setup, initial=turned_in(setup.initial, block, float(time[0])), engine=engine)
