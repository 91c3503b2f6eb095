"""Quaternion advanced by Cayley's transform (1 + ¼φ)(1 − ¼φ)⁻¹ of the rotation vector φ of each interval.

The step needs no sine and no cosine and keeps the norm. It turns by 4 atan(φ/4) = φ − φ³/48 + …, a little too little.
docs/extending/algorithm.md of sinssim says what the four functions of an algorithm do.
"""

from __future__ import annotations

from sinssim.jit import inline
from sinssim.rotation.quaternions import Quaternion, multiply_k
from sinssim.strapdown.attitude.quaternion import Attitude, dcm_k, quaternion_k, start_k
from sinssim.strapdown.coning_sculling import BodyTurn, FrameTurn

__all__ = ["Attitude", "dcm_k", "quaternion_k", "start_k", "step_k"]


@inline
def cayley_k(x: float, y: float, z: float) -> Quaternion:
    """(1 + ¼φ)(1 − ¼φ)⁻¹, a unit quaternion for every φ."""
    square = 0.0625 * (x * x + y * y + z * z)
    scale = 1.0 / (1.0 + square)
    return scale * (1.0 - square), 0.5 * scale * x, 0.5 * scale * y, 0.5 * scale * z


@inline
def step_k(attitude: Quaternion, body: BodyTurn, frame: FrameTurn) -> Quaternion:
    """Attitude one interval later: the body turns by φ, the navigation frame by ζ."""
    p0, p1, p2, p3 = cayley_k(body.phi_x, body.phi_y, body.phi_z)
    z0, z1, z2, z3 = cayley_k(-frame.zeta_x, -frame.zeta_y, -frame.zeta_z)
    a0, a1, a2, a3 = multiply_k(attitude[0], attitude[1], attitude[2], attitude[3], p0, p1, p2, p3)
    return multiply_k(z0, z1, z2, z3, a0, a1, a2, a3)
