"""Positions and attitudes in the local axes of robots: east, north, up from the true start; body forward-left-up."""

from __future__ import annotations

from sinssim import rotation
from sinssim.data import Array
from sinssim.logs.local_level import enu_about, level_turn, q_enu_flu, swapped
from sinssim.logs.writers.run_export import Content
from sinssim.units import DEG

LOCAL = (
    "Positions are east, north, up in the plane axes of the run's true start; attitudes from forward-left-up to these "
    "axes (REP 103)."
)


def origin_words(content: Content) -> str:
    """Return a sentence on the origin."""
    latitude, longitude, height = content.origin
    return f"Origin: latitude {latitude / DEG:.9f} deg, longitude {longitude / DEG:.9f} deg, height {height:.4f} m."


def pose(content: Content) -> tuple[Array, Array]:
    """Return position and attitude of the chosen solution.

    Args:
        content: what is written; its solution has an attitude.

    Returns:
        East, north, up, (N, 3) m, and quaternions from forward-left-up to the origin's axes, scalar first, (N, 4).
    """
    s = content.solution
    assert s.q_nb is not None
    position = enu_about(content.origin, s.latitude, s.longitude, s.height)
    return position, rotation.multiply(level_turn(content.origin, s.latitude, s.longitude), q_enu_flu(s.q_nb))


def velocity(content: Content) -> Array:
    """Return the velocity of the chosen solution in the origin's axes, east, north, up, (N, 3) m/s.

    Args:
        content: what is written; its solution has a velocity.
    """
    s = content.solution
    assert s.velocity_ned is not None
    return rotation.rotate(level_turn(content.origin, s.latitude, s.longitude), swapped(s.velocity_ned))
