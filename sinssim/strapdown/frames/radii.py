"""Radii of curvature with the eccentricity or the height dropped, in place of the functions of the engines.

    exact                  1/(R₁+h), 1/(R₂+h)
    spherical              1/(a+h),  1/(a+h)     e² dropped: R₁ = R₂ = a
    no-height              1/R₁,     1/R₂        h dropped
    spherical-no-height    1/a,      1/a         both dropped

The engines have the exact and the simplified radii (8.16). Each form here is compiled into engines of its own, so that
those are as fast as without them. Gravity keeps e² and h: it has simplifications of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import Any

from sinssim.earth.kernels import EarthParameters, gravity_ned_k, radii_k
from sinssim.jit import free_inline, strict_inline, with_constants

SPHERICAL, NO_HEIGHT = False, False
"""What a form drops: e², and the height. The copies of the functions below have other values."""

_FORMS = {
    "spherical": {"SPHERICAL": True, "NO_HEIGHT": False},
    "no-height": {"SPHERICAL": False, "NO_HEIGHT": True},
    "spherical-no-height": {"SPHERICAL": True, "NO_HEIGHT": True},
}


@strict_inline
def curvatures_k(p: EarthParameters, simplified: bool, s: float, h: float) -> tuple[float, float, float]:
    """1/(R₁+h), 1/(R₂+h) and R₂, which is that of gravity and exact; as in `level`."""
    r1, r2 = radii_k(p, s)
    x1, x2 = (p.a, p.a) if SPHERICAL else (r1, r2)
    if not NO_HEIGHT:
        x1, x2 = x1 + h, x2 + h
    return 1.0 / x1, 1.0 / x2, r2


@free_inline
def earth_k(
    p: EarthParameters, gravity: int, simplified: bool, kx: float, ky: float, kz: float, h: float
) -> tuple[float, float, float, float]:
    """1/(R₂+h), κ, gravity along k_h per unit of it, gravity down; as in `azimuth`. κ = 0 on a sphere."""
    s = -kz
    c = sqrt(kx * kx + ky * ky)
    k1, k2, r2 = curvatures_k(p, simplified, s, h)
    north, down = gravity_ned_k(p, gravity, s, c, r2, h)
    along = north / c if c > 0.0 else 0.0  # north gravity is proportional to cos φ
    if SPHERICAL:
        return k2, 0.0, along, down
    return k2, p.e2 * r2 / (1.0 - p.e2 * s * s) * k2 * k1, along, down


def _of(form: str) -> dict[str, Callable[..., Any]]:
    suffix = form.replace("-", "_")
    curvatures = with_constants(curvatures_k, f"curvatures_k_{suffix}", **_FORMS[form])
    return {
        "curvatures_k": curvatures,
        "earth_k": with_constants(earth_k, f"earth_k_{suffix}", **_FORMS[form], curvatures_k=curvatures),
    }


FORMS: dict[str, dict[str, Callable[..., Any]]] = {form: _of(form) for form in _FORMS}
"""The functions of a form by their names in the engines."""
