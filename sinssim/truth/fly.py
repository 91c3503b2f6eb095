"""From a scenario to its truth: the source that it names, with the sensor block where and how it is mounted."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sinssim.earth_models import ELLIPSOIDS

if TYPE_CHECKING:
    from sinssim.data import Array
    from sinssim.scenario.schema import Scenario
    from sinssim.scenario.section import Vector3
    from sinssim.truth.trajectory import Trajectory

_NOWHERE = (0.0, 0.0, 0.0)


def fly(scenario: Scenario, progress: Callable[[float], None] | None = None) -> Trajectory:
    """Return the true motion of a scenario's sensor block.

    Args:
        scenario: names the source of truth: [flight], [parked] or [great_circle].
        progress: called with the part of a flight that is flown, 0…1.

    Returns:
        The motion of the block on its lever arm and in its mounting: those of [imu], else the aircraft's, else
        none.

    Raises:
        RunError: a flight that cannot be flown; the message names the leg.
        InputError: no such aircraft, or a source of truth that cannot be.
    """
    from sinssim.rotation import quaternion_from_euler

    imu = scenario.imu
    ellipsoid, gravity = ELLIPSOIDS[scenario.truth.ellipsoid], scenario.truth.gravity
    if scenario.flight is not None:
        from sinssim.scenario.aircraft import load_aircraft
        from sinssim.truth.cache import cached_flight
        from sinssim.truth.curve import Curve

        log = cached_flight(scenario.flight, scenario.seed, progress)
        own = load_aircraft(scenario.flight.aircraft).mounting
        return Curve(
            log.time,
            log.position_ecef,
            log.q_eb,
            own.lever_arm_m if imu.lever_arm_m is None else imu.lever_arm_m,
            _mounting(own.angles_deg if imu.mounting_deg is None else imu.mounting_deg),
            gravity,
            ellipsoid,
            log.events,
            log.channels,
        )

    lever_arm, q_bs = imu.lever_arm_m or _NOWHERE, _mounting(imu.mounting_deg or _NOWHERE)
    if scenario.parked is not None:
        from sinssim.truth.parked import Parked

        parked = scenario.parked
        return Parked(
            np.radians(parked.latitude_deg),
            np.radians(parked.longitude_deg),
            parked.altitude_m,
            quaternion_from_euler(*np.radians([parked.roll_deg, parked.pitch_deg, parked.heading_deg])),
            parked.duration_s,
            lever_arm,
            q_bs,
            gravity,
            ellipsoid,
        )

    from sinssim.truth.great_circle import GreatCircle

    circle = scenario.great_circle
    assert circle is not None  # the scenario has exactly one source of truth
    return GreatCircle(
        np.radians(circle.latitude_deg),
        np.radians(circle.longitude_deg),
        circle.altitude_m,
        np.radians(circle.course_deg),
        circle.speed_mps,
        circle.duration_s,
        lever_arm,
        q_bs,
        gravity,
        ellipsoid,
    )


def _mounting(angles_deg: Vector3) -> Array:
    """Return q_bs of the block's roll, pitch and yaw in the vehicle."""
    from sinssim.rotation import quaternion_from_euler

    return quaternion_from_euler(*np.radians(angles_deg))
