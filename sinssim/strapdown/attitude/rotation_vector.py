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
"""

from __future__ import annotations

from sinssim.data import Array
from sinssim.jit import inline
from sinssim.rotation.kernels import cross_k, rotation_series_k
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.increments.coning_sculling import bracket_k, velocity_increment_k
from sinssim.strapdown.increments.interval import BodyTurn

__all__ = ["COEFFICIENTS", "EDGE", "dcm_k", "quaternion_k", "start_k", "step_k", "turn_k"]

SAMPLES = 1
"""Samples of one update, 1…4."""
PREVIOUS = False
"""Whether the previous sample is used, too (with one sample)."""

COEFFICIENTS = (
    (0.0, 0.0, 0.0),
    (2 / 3, 0.0, 0.0),  # Ignagni 1990
    (27 / 40, 9 / 20, 0.0),  # Miller 1983
    (214 / 315, 46 / 105, 54 / 105),  # Ignagni 1996: (214, 92, 54)/105 over 3, 2 and 1 pairs
)
"""K_s of a pair of samples at distance s = 1, 2, 3, one row for each number of samples."""

PREVIOUS_COEFFICIENT = 1 / 12  # Ignagni 1990, Savage 1998: φ = Δθ + Δθ₋₁ × Δθ/12

EDGE = (
    (1.0, 0.0, 0.0, 0.0),
    (3.0, -1.0, 0.0, 0.0),
    (11 / 2, -7 / 2, 1.0, 0.0),
    (25 / 3, -23 / 3, 13 / 3, -1.0),
)
"""Weights of the samples, first to last, that give the update's length times the specific force at its start, from the
polynomial whose integrals over the samples are the increments; in reverse order, at its end."""


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
