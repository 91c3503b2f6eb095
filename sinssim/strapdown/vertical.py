"""The vertical channel: pure inertial height runs away, so a reference may hold it.

The third-order baro loop (spec 06) pulls height and vertical velocity towards a height reference with the error
e = h − h_ref:  ḣ = −v_D − k₁e,  v̇_D = … + k₂e + k₃∫e dt,  k₁ = 3/τ,  k₂ = 3/τ² + 2g/R,  k₃ = 1/τ³.
"""

from __future__ import annotations

from sinssim.jit import inline

FREE, BARO_LOOP, HELD = 0, 1, 2
"""Vertical channels by number."""


@inline
def loop_gains_k(time_constant: float, gravity_down: float, k2: float) -> tuple[float, float, float]:
    """Gains k₁, k₂, k₃ of the baro loop; k2 is the curvature 1/(R₂+h) where it is used."""
    rate = 1.0 / time_constant
    return 3.0 * rate, 3.0 * rate * rate + 2.0 * gravity_down * k2, rate * rate * rate


@inline
def baro_loop_k(
    dt: float, gain1: float, gain2: float, gain3: float, loop_sum: float,
    h: float, h1: float, v_down1: float, reference: float, reference1: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Height, down velocity and k₃∫e dt at the end of an interval under the loop, second order in it.

    h is the height at the start, h1 and v_down1 the free ones at the end, reference and reference1 those of both ends.
    """
    e0 = h - reference
    e1 = h1 - dt * gain1 * e0 - reference1
    e = 0.5 * (e0 + e1)
    pull = dt * (gain2 * e + loop_sum + 0.5 * dt * gain3 * e)
    return h1 - dt * (gain1 * e + 0.5 * pull), v_down1 + pull, loop_sum + dt * gain3 * e
