"""What an attitude algorithm is told about one interval."""

from __future__ import annotations

from typing import NamedTuple


class Interval(NamedTuple):
    """The rotation of body and navigation frame over one interval.

    phi: the body's rotation vector relative to inertial space, in body axes (coning-compensated), rad.
    zeta: the navigation frame's rotation vector, in its own axes (north, east, down), rad.
    a1, a2, a3: the body's rate times the interval as a1 + a2 s + a3 s² over s ∈ [−½, ½], rad.
    u0, um, u1: the navigation frame's rate times the interval at its start, middle and end, rad.
    """

    phi_x: float
    phi_y: float
    phi_z: float
    zeta_n: float
    zeta_e: float
    zeta_d: float
    a1_x: float
    a1_y: float
    a1_z: float
    a2_x: float
    a2_y: float
    a2_z: float
    a3_x: float
    a3_y: float
    a3_z: float
    u0_n: float
    u0_e: float
    u0_d: float
    um_n: float
    um_e: float
    um_d: float
    u1_n: float
    u1_e: float
    u1_d: float
