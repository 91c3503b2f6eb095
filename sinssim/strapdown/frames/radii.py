"""Radii of curvature with the eccentricity or the height dropped, beside the exact ones and those of (8.16).

    exact                  1/(R₁+h), 1/(R₂+h)
    spherical              1/(a+h),  1/(a+h)     e² dropped: R₁ = R₂ = a
    no-height              1/R₁,     1/R₂        h dropped
    spherical-no-height    1/a,      1/a         both dropped

Each form is compiled into engines of its own, so that the others are as fast as without it. Gravity keeps e² and h: it
has simplifications of its own.
"""

from __future__ import annotations

from sinssim.earth.kernels import EarthParameters, radii_k
from sinssim.jit import inline

SPHERICAL, NO_HEIGHT = False, False
"""What a form drops: e², and the height. Engines of other forms are bound to other values."""

FORMS = {
    "spherical": {"SPHERICAL": True},
    "no-height": {"NO_HEIGHT": True},
    "spherical-no-height": {"SPHERICAL": True, "NO_HEIGHT": True},
}
"""The values by form."""


@inline
def distances_k(p: EarthParameters, s: float, h: float) -> tuple[float, float, float, float]:
    """R₁+h and R₂+h in the form, and the exact R₁ and R₂; s is the sine of the latitude."""
    r1, r2 = radii_k(p, s)
    x1, x2 = (p.a, p.a) if SPHERICAL else (r1, r2)
    return (x1, x2, r1, r2) if NO_HEIGHT else (x1 + h, x2 + h, r1, r2)


@inline
def curvatures_k(p: EarthParameters, simplified: bool, s: float, h: float) -> tuple[float, float, float]:
    """1/(R₁+h), 1/(R₂+h) and R₂, which is that of gravity and exact; s is the sine of the latitude."""
    x1, x2, _, r2 = distances_k(p, s, h)
    if simplified:  # (8.16)
        x = h / p.a
        return (1.0 + p.e2 * (1.0 - 1.5 * s * s) - x) / p.a, (1.0 - 0.5 * p.e2 * s * s - x) / p.a, r2
    inverse = 1.0 / (x1 * x2)
    return x2 * inverse, x1 * inverse, r2
