"""The Earth: ellipsoids, radii of curvature, geodetic, Earth-fixed and inertial coordinates, gravity."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.earth.coordinates import (
        displaced,
        ecef_to_eci,
        ecef_to_geodetic,
        eci_to_ecef,
        geodetic_to_ecef,
        q_en,
        radii,
    )
    from sinssim.earth.datums import DATUMS, change_datum
    from sinssim.earth.gravity import gravitation_ecef, gravity_ned, gravity_number, surface_gravity
    from sinssim.earth.kernels import (
        GRAVITY_NUMBERS,
        EarthParameters,
        closed_gravity_k,
        ecef_to_geodetic_k,
        geodetic_sincos_k,
        geodetic_to_ecef_k,
        gravitation_ecef_k,
        gravity_ned_k,
        j2_gravitation_k,
        near_gravity_k,
        normal_gravitation_k,
        parameters,
        q_en_k,
        radii_k,
    )
    from sinssim.earth.models import ELLIPSOIDS, GRAVITY_MODELS, OMEGA_IE, WGS84, Ellipsoid, ellipsoid_by_name

__all__ = [
    "DATUMS",
    "ELLIPSOIDS",
    "GRAVITY_MODELS",
    "GRAVITY_NUMBERS",
    "OMEGA_IE",
    "WGS84",
    "EarthParameters",
    "Ellipsoid",
    "change_datum",
    "closed_gravity_k",
    "displaced",
    "ecef_to_eci",
    "ecef_to_geodetic",
    "ecef_to_geodetic_k",
    "eci_to_ecef",
    "ellipsoid_by_name",
    "geodetic_sincos_k",
    "geodetic_to_ecef",
    "geodetic_to_ecef_k",
    "gravitation_ecef",
    "gravitation_ecef_k",
    "gravity_ned",
    "gravity_ned_k",
    "gravity_number",
    "j2_gravitation_k",
    "near_gravity_k",
    "normal_gravitation_k",
    "parameters",
    "q_en",
    "q_en_k",
    "radii",
    "radii_k",
    "surface_gravity",
]

__getattr__, __dir__ = on_first_use(
    __name__,
    {
        "DATUMS": "sinssim.earth.datums",
        "ELLIPSOIDS": "sinssim.earth.models",
        "EarthParameters": "sinssim.earth.kernels",
        "Ellipsoid": "sinssim.earth.models",
        "GRAVITY_MODELS": "sinssim.earth.models",
        "GRAVITY_NUMBERS": "sinssim.earth.kernels",
        "OMEGA_IE": "sinssim.earth.models",
        "WGS84": "sinssim.earth.models",
        "change_datum": "sinssim.earth.datums",
        "closed_gravity_k": "sinssim.earth.kernels",
        "displaced": "sinssim.earth.coordinates",
        "ecef_to_eci": "sinssim.earth.coordinates",
        "ecef_to_geodetic": "sinssim.earth.coordinates",
        "ecef_to_geodetic_k": "sinssim.earth.kernels",
        "eci_to_ecef": "sinssim.earth.coordinates",
        "ellipsoid_by_name": "sinssim.earth.models",
        "geodetic_sincos_k": "sinssim.earth.kernels",
        "geodetic_to_ecef": "sinssim.earth.coordinates",
        "geodetic_to_ecef_k": "sinssim.earth.kernels",
        "gravitation_ecef": "sinssim.earth.gravity",
        "gravitation_ecef_k": "sinssim.earth.kernels",
        "gravity_ned": "sinssim.earth.gravity",
        "gravity_ned_k": "sinssim.earth.kernels",
        "gravity_number": "sinssim.earth.gravity",
        "j2_gravitation_k": "sinssim.earth.kernels",
        "near_gravity_k": "sinssim.earth.kernels",
        "normal_gravitation_k": "sinssim.earth.kernels",
        "parameters": "sinssim.earth.kernels",
        "q_en": "sinssim.earth.coordinates",
        "q_en_k": "sinssim.earth.kernels",
        "radii": "sinssim.earth.coordinates",
        "radii_k": "sinssim.earth.kernels",
        "surface_gravity": "sinssim.earth.gravity",
    },
)
