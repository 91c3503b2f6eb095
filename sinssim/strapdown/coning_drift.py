"""Drift of the rotation-vector algorithms under pure coning: the leading term and the exact value.

A coning body with the half-angle α and the rate Ω has the increments

    Δθᵢ = (2 sin α sin ½x) e((i + ½)x) − 2 sin²½α x k,   x = Ωh,   e(φ) = (−sin φ, cos φ, 0)

about the cone's axis k, and the rotation vector of each update is the previous one rotated by nx about k. With the
coefficients K of pairs at a distance s (see `rotation_vector`) it is φ = P e(½nx) + Q k,

    P = 2 sin α sin ½nx + 8 sin α sin²½α x Σ K_s sin ½sx sin ½(n−s)x
    Q = −2 sin²½α nx + 4 sin²α sin²½x Σ (n−s) K_s sin sx

so that N updates rotate the body by (q(φ) ∘ q(nx k))ᴺ up to a constant. The true rotation is nx about a tilted axis.
The computed rotation is nx + δ, cos ½(nx + δ) = cos ½φ cos ½nx − Q/φ sin ½φ sin ½nx, and the drift is Ω δ/(nx). Its
series begins

    −α²Ω L x²ⁿ (1 − b x² + …) + α⁴Ω (c x⁴ − d x⁶ + …),   L = n!/(2ⁿ⁺¹ (2n+1)!!)

The second part is a floor due to triple products, which pairs do not compensate.

    samples   L        b      c       d            leading term alone to 3 %
    1         1/12     1/20   –       –            x < 0.778
    1p        1/60     5/42   1/160   1/576        x < 0.504
    2         1/60     5/42   1/60    1/36         x < 0.504
    3         1/280    7/36   1/160   71/320       α = 1°: 0.108 < x < 0.479
    4         1/1260   3/11   1/140   9341/7560    α = 0.1°: 0.279 < x < 0.430; α = 1°: nowhere below x = 0.87

(1p: one sample with the previous one; the first floor of one sample is sin²α for α².)
"""

from __future__ import annotations

from math import asin, cos, factorial, hypot, prod, sin

from sinssim.strapdown.attitude.rotation_vector import COEFFICIENTS, PREVIOUS_COEFFICIENT


def leading_term(samples: int, half_angle: float, rate: float, interval: float, previous: bool = False) -> float:
    """Return the drift by the leading term of its series, α²Ω (Ωh)²ⁿ n!/(2ⁿ⁺¹ (2n+1)!!).

    Args:
        samples: number n of samples in an update, 1…4.
        half_angle: α, rad.
        rate: Ω, rad/s.
        interval: h from sample to sample, s.
        previous: whether one sample is used with the previous one, α²Ω (Ωh)⁴/60.

    Returns:
        Magnitude of the drift, rad/s.
    """
    x = rate * interval
    if previous:
        return half_angle**2 * rate * x**4 / 60.0
    law = factorial(samples) / (2.0 ** (samples + 1) * prod(range(1, 2 * samples + 2, 2)))
    return half_angle**2 * rate * float(x ** (2 * samples)) * law


def drift(samples: int, half_angle: float, rate: float, interval: float, previous: bool = False) -> float:
    """Return the exact drift.

    Args:
        samples: number n of samples in an update, 1…4.
        half_angle: α, rad.
        rate: Ω, rad/s.
        interval: h from sample to sample, s.
        previous: whether one sample is used with the previous one.

    Returns:
        Drift about the cone's axis, rad/s, positive in the direction of the coning motion.
    """
    n, x = samples, rate * interval
    half = 2.0 * sin(0.5 * half_angle) ** 2  # 1 − cos α
    s, across = sin(half_angle), 2.0 * sin(half_angle) * sin(0.5 * x)
    along = -half * n * x
    sideways = 2.0 * s * sin(0.5 * n * x)
    if previous:  # the cross product of the pair is at the samples' common edge, half a sample before the middle
        along += across**2 * PREVIOUS_COEFFICIENT * sin(x)
        pair = 4.0 * s * half * x * PREVIOUS_COEFFICIENT * sin(0.5 * x) ** 2
        sideways = hypot(sideways + pair * cos(0.5 * x), pair * sin(0.5 * x))
    for distance, k in enumerate(COEFFICIENTS[n - 1][: n - 1], start=1):
        along += across**2 * (n - distance) * k * sin(distance * x)
        sideways += 4.0 * s * half * x * k * sin(0.5 * distance * x) * sin(0.5 * (n - distance) * x)
    turn = hypot(sideways, along)
    # cos ½(nx + δ) − cos ½nx without cancellation
    change = -2.0 * cos(0.5 * n * x) * sin(0.25 * turn) ** 2 - along / turn * sin(0.5 * turn) * sin(0.5 * n * x)
    more = 0.0
    for _ in range(3):
        more = -4.0 * asin(0.5 * change / sin(0.5 * n * x + 0.25 * more))
    return rate * more / (n * x)
