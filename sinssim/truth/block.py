"""Navigation state of a sensor block from its motion in Earth-fixed coordinates."""

from __future__ import annotations

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.earth.models import Ellipsoid


def block_state(position: Array, velocity: Array, q_es: Array, ellipsoid: Ellipsoid) -> NavState:
    """Return geodetic position, north-east-down velocity and attitude.

    On the polar axis, north and east are those of the meridian of the returned longitude.

    Args:
        position: Earth-fixed position of the block, (..., 3) m.
        velocity: relative to the Earth, Earth-fixed axes, (..., 3) m/s.
        q_es: attitude of the block, v_e = C_es v_s, (..., 4).
    """
    latitude, longitude, height = earth.ecef_to_geodetic(position, ellipsoid)
    q_ne = rotation.conjugate(earth.q_en(latitude, longitude))
    return NavState(latitude, longitude, height, rotation.rotate(q_ne, velocity), rotation.multiply(q_ne, q_es))
