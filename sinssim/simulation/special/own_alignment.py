"""The alignment by which a run's inertial navigators start, [navigation.alignment]."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim.alignment.budget import expected_errors
from sinssim.alignment.own_start import aligned_state
from sinssim.earth.models import Ellipsoid, ellipsoid_by_name
from sinssim.errors import InputError, SinssimError

if TYPE_CHECKING:
    from sinssim.data import ImuData, NavState
    from sinssim.scenario import Scenario
    from sinssim.simulation.setup import Setup


def after_alignment(setup: Setup) -> Setup:
    """Align on the first increments, and navigate on the rest.

    Returns:
        The setup; unchanged without [navigation.alignment].

    Raises:
        InputError: as for `align_itself`.
    """
    section = setup.scenario.navigation
    if section.alignment is None:
        return setup
    own = ellipsoid_by_name(section.ellipsoid_over(setup.truth.ellipsoid.name))
    count, initial = align_itself(setup.scenario, setup.imu, setup.initial, own)
    height = setup.height[count:] if isinstance(setup.height, np.ndarray) else setup.height
    return replace(setup, imu=without_alignment(setup.imu, count), initial=initial, height=height)


def align_itself(scenario: Scenario, imu: ImuData, place: NavState, ellipsoid: Ellipsoid) -> tuple[int, NavState]:
    """Align on the first increments of a run.

    Args:
        place: latitude, longitude and height that the navigator is given; its attitude and velocity are not used.
        ellipsoid: the navigator's ellipsoid.

    Returns:
        Number of samples that the alignment takes, and the state after them.

    Raises:
        InputError: the run is too short, the vehicle moves, or the sensors do not determine the attitude.
    """
    section = scenario.navigation.alignment
    assert section is not None
    count = int(np.searchsorted(imu.time, imu.time[0] + section.duration_s - 1e-9))
    name = f"navigation.alignment.duration_s = {section.duration_s:g}"
    if count >= len(imu):
        raise InputError(
            f"{name}: the run lasts {imu.time[-1] - imu.time[0]:g} s, and navigation needs time after the alignment."
        )
    session = type(imu)(imu.time[: count + 1], imu.dtheta[:count], imu.dvel[:count])
    try:
        state, _ = aligned_state(
            session, place, section.method, expected_errors(scenario.imu), scenario.navigation.gravity, ellipsoid
        )
    except SinssimError as error:
        raise InputError(
            f'{name}, method = "{section.method}": the alignment ends at {session.time[-1]:.6g} s of the run without '
            f"a result: {error}"
        ) from error
    return count, state


def without_alignment(imu: ImuData, count: int) -> ImuData:
    """Return the increments after the alignment."""
    flags = None if imu.flags is None else imu.flags[count:]
    return type(imu)(imu.time[count:], imu.dtheta[count:], imu.dvel[count:], flags)
