"""Navigation in a gravity field that the navigator knows, navigation.gravity_degree."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sinssim.data import ImuData, NavSolution
    from sinssim.simulation.setup import Setup
    from sinssim.strapdown.mechanization import Mechanization


def in_known_field(setup: Setup) -> Setup:
    """Compensate the increments for the known part of the gravity field.

    Returns:
        The setup; unchanged if the navigator knows normal gravity alone.
    """
    from sinssim.scenario.true_motion import known_field

    field = known_field(setup.scenario)
    if field is None:
        return setup
    from sinssim.strapdown.disturbance import navigate_in_field

    inner = setup.engine

    def engine(own: Setup, imu: ImuData, of: Mechanization) -> NavSolution:
        return navigate_in_field(imu, field, of.earth, lambda felt: inner(own, felt, of))

    return replace(setup, engine=engine)
