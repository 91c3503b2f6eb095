"""Attitude by the rotation vector of n samples, with classical coning and sculling compensation.

One update spans n samples, and the solution has a row at the end of each update. For the increments Δθᵢ, Δvᵢ of its
samples and the coefficients K of their pairs,

    φ = Σ Δθᵢ + Σ_{i<j} K_{j−i} Δθᵢ × Δθⱼ                                 coning (Miller 1983)
    ν = Σ Δvᵢ + Σ_{i<j} K_{j−i} (Δθᵢ × Δvⱼ + Δvᵢ × Δθⱼ)                    sculling

with the same coefficients in both: a coning algorithm whose products Δθ × Δθ are replaced by Δθ × Δv + Δv × Δθ is the
sculling algorithm of the same order (Roscoe 2001). The rotation of Δv by the change of attitude is compensated exactly,
Δv = J(φ) ν (Savage 1998, part 2). The attitude is the quaternion, advanced by the exact rotation φ.

The coefficients minimise the drift under pure coning, α²Ω (Ωh)²ⁿ n!/(2ⁿ⁺¹ (2n+1)!!) for samples of length h, and α²Ω
(Ωh)⁴/60 for one sample with the previous one. Under pure coning only the distance s between the samples of a pair
matters, and in the literature one product Δθ_{n−s} × Δθ_n represents all pairs at that distance (Ignagni 1996). Here
its coefficient is distributed equally over the n − s pairs, as by Miller: symmetry in time preserves the fourth order
in manoeuvres, where the compressed form has the third.

- Miller, R. B., "A new strapdown attitude algorithm", J. Guidance 6 (1983) 287: three samples.
- Ignagni, M. B., "Optimal strapdown attitude integration algorithms", J. Guidance 13 (1990) 363: two samples, and one
  with the previous one; "Efficient class of optimized coning compensation algorithms", J. Guidance 19 (1996) 424: four.
- Ignagni, M. B., "Duality of optimal strapdown sculling and coning compensation algorithms", Navigation 45 (1998) 85;
  Roscoe, K. M., "Equivalency between strapdown inertial navigation coning and sculling integrals/algorithms",
  J. Guidance 24 (2001) 201: from coning to sculling.
- Savage, P. G., "Strapdown inertial navigation integration algorithm design", J. Guidance 21 (1998) 19 and 208.

Drift under pure coning. A coning body with the half-angle α and the rate Ω has the increments

    Δθᵢ = (2 sin α sin ½x) e((i + ½)x) − 2 sin²½α x k,   x = Ωh,   e(φ) = (−sin φ, cos φ, 0)

about the cone's axis k, and the rotation vector of each update is the previous one rotated by nx about k. With the
coefficients K of pairs at a distance s it is φ = P e(½nx) + Q k,

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

from sinssim.data import Array
from sinssim.jit import inline
from sinssim.rotation.quaternions import cross_k, rotation_series_k
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.coning_sculling import (
    COEFFICIENTS,
    EDGE,
    PREVIOUS_COEFFICIENT,
    BodyTurn,
    bracket_k,
    velocity_increment_k,
)

__all__ = ["COEFFICIENTS", "EDGE", "dcm_k", "quaternion_k", "start_k", "step_k", "turn_k"]

SAMPLES = 1
"""Samples of one update, 1…4."""
PREVIOUS = False
"""Whether the previous sample is used, too (with one sample)."""


@inline
def turn_k(dtheta: Array, dvel: Array, weights: Array, uniform: bool, k: int) -> BodyTurn:
    """Rotation of the body in update k, with the samples k n … k n + n − 1."""
    first = SAMPLES * k
    px, py, pz, nx, ny, nz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    fsx, fsy, fsz, fex, fey, fez = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(SAMPLES):
        a, e, g = first + i, EDGE[SAMPLES - 1][i], EDGE[SAMPLES - 1][SAMPLES - 1 - i]
        px, py, pz = px + dtheta[a, 0], py + dtheta[a, 1], pz + dtheta[a, 2]
        nx, ny, nz = nx + dvel[a, 0], ny + dvel[a, 1], nz + dvel[a, 2]
        fsx, fsy, fsz = fsx + e * dvel[a, 0], fsy + e * dvel[a, 1], fsz + e * dvel[a, 2]
        fex, fey, fez = fex + g * dvel[a, 0], fey + g * dvel[a, 1], fez + g * dvel[a, 2]
    tx, ty, tz = px, py, pz
    for i in range(SAMPLES):
        # Σ_j K Δ_j first: one bracket for each i
        a = first + i
        sx, sy, sz, su, sv, sw = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(i + 1, SAMPLES):
            b, c = first + j, COEFFICIENTS[SAMPLES - 1][j - i - 1]
            sx, sy, sz = sx + c * dtheta[b, 0], sy + c * dtheta[b, 1], sz + c * dtheta[b, 2]
            su, sv, sw = su + c * dvel[b, 0], sv + c * dvel[b, 1], sw + c * dvel[b, 2]
        ux, uy, uz, uu, uv, uw = bracket_k(
            dtheta[a, 0], dtheta[a, 1], dtheta[a, 2], dvel[a, 0], dvel[a, 1], dvel[a, 2], sx, sy, sz, su, sv, sw
        )
        px, py, pz, nx, ny, nz = px + ux, py + uy, pz + uz, nx + uu, ny + uv, nz + uw
    if PREVIOUS:
        # The first sample has no predecessor; the bracket with the next sample is equal to the third order.
        a = first - 1 if first > 0 else 0
        b = min(a + 1, dtheta.shape[0] - 1)
        ux, uy, uz, uu, uv, uw = bracket_k(
            dtheta[a, 0], dtheta[a, 1], dtheta[a, 2], dvel[a, 0], dvel[a, 1], dvel[a, 2],
            dtheta[b, 0], dtheta[b, 1], dtheta[b, 2], dvel[b, 0], dvel[b, 1], dvel[b, 2],
        )  # fmt: skip
        c = PREVIOUS_COEFFICIENT
        px, py, pz, nx, ny, nz = px + c * ux, py + c * uy, pz + c * uz, nx + c * uu, ny + c * uv, nz + c * uw
        hx, hy, hz = 0.5 * (dvel[b, 0] - dvel[a, 0]), 0.5 * (dvel[b, 1] - dvel[a, 1]), 0.5 * (dvel[b, 2] - dvel[a, 2])
        fsx, fsy, fsz, fex, fey, fez = fsx - hx, fsy - hy, fsz - hz, fex + hx, fey + hy, fez + hz
    _, j1, j2 = rotation_series_k(px * px + py * py + pz * pz)
    dvx, dvy, dvz = velocity_increment_k(px, py, pz, nx, ny, nz, j1, j2)
    ax, ay, az = cross_k(px, py, pz, fex, fey, fez)
    bx, by, bz = cross_k(px, py, pz, ax, ay, az)
    return BodyTurn(
        px, py, pz, dvx, dvy, dvz, fsx, fsy, fsz, fex + ax + 0.5 * bx, fey + ay + 0.5 * by, fez + az + 0.5 * bz,
        tx, ty, tz, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, tx, ty, tz,
    )  # fmt: skip


def leading_drift_under_coning(
    samples: int, half_angle: float, rate: float, interval: float, previous: bool = False
) -> float:
    """Return the magnitude of the drift by the leading term of its series, α²Ω (Ωh)²ⁿ n!/(2ⁿ⁺¹ (2n+1)!!), rad/s.

    n samples, `half_angle` α in rad, `rate` Ω in rad/s, `interval` h in s; for one sample with the previous one it is
    α²Ω (Ωh)⁴/60.
    """
    x = rate * interval
    if previous:
        return half_angle**2 * rate * x**4 / 60.0
    law = factorial(samples) / (2.0 ** (samples + 1) * prod(range(1, 2 * samples + 2, 2)))
    return half_angle**2 * rate * float(x ** (2 * samples)) * law


def drift_under_coning(samples: int, half_angle: float, rate: float, interval: float, previous: bool = False) -> float:
    """Return the exact drift about the cone's axis, rad/s, positive in the direction of the coning motion.

    The arguments are those of `leading_drift_under_coning`.
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
