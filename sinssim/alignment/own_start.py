"""The state from which a navigator starts after its own alignment on a vehicle at its place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sinssim import earth, rotation
from sinssim.alignment.base_motion import stillness
from sinssim.alignment.budget import Expected
from sinssim.alignment.determination import Determination, determine
from sinssim.alignment.disturbed import align_disturbed, inertial_curve
from sinssim.alignment.initial_conditions import initial_state
from sinssim.alignment.session import mean_readings
from sinssim.data import ImuData, NavState
from sinssim.earth.models import Ellipsoid
from sinssim.sensors.imu.errors import ImuErrors


def aligned_state(
    session: ImuData, place: NavState, method: str, expected: Expected, gravity: str, ellipsoid: Ellipsoid
) -> tuple[NavState, Determination]:
    """Align a vehicle at a known place, and return the state at the end of the session.

    Both methods take the plumb line for the vertical. Above the ellipsoid it differs from the normal, to which
    attitudes refer, by up to 0.17″ per km of height; the state is corrected for that.

    Args:
        session: increments of the alignment.
        place: known latitude, longitude and height.
        method: "quiet" for eq. (1), which needs a vehicle at rest; "disturbed" for the fit of gravity's cone, which
            allows a sway about the place.
        expected: expected errors of the sensor block.
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.

    Returns:
        The state, and what was determined. Its velocity is zero for "quiet", and that of the sway for "disturbed",
        which is what the fit leaves of the measured velocity.

    Raises:
        InputError: the vehicle moved, or the readings do not determine the attitude.
        RunError: the fit of the cone does not converge.
    """
    latitude, height = float(place.latitude), float(place.height)
    sway = None
    if method == "quiet":
        determination = determine(*mean_readings(session), expected.instrument_sigmas)
        stillness(session, Expected(ImuErrors(warm_up=expected.sigma.warm_up), expected.sigma)).require()
    else:
        aligned = align_disturbed(session, latitude)
        determination = aligned.determination
        # what the cone leaves of the velocity at the last instant, into the block's axes there
        last = rotation.conjugate(inertial_curve(session)[0][-1])
        sway = rotation.rotate(last, aligned.residual_velocity[-1])
    state = initial_state(determination, float(place.longitude), height, latitude)
    north, _, down = earth.gravity_ned(latitude, height, gravity, ellipsoid)
    to_normal = rotation.quaternion_from_rotation_vector((0.0, np.arctan2(north, down), 0.0))
    q_nb = rotation.multiply(to_normal, state.q_nb)
    velocity = state.velocity_ned if sway is None else rotation.rotate(q_nb, sway)
    return replace(state, q_nb=q_nb, velocity_ned=velocity), determination
