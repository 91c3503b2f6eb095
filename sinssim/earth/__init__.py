"""The Earth: ellipsoids, radii of curvature, geodetic, Earth-fixed and inertial coordinates, gravity."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.system import on_first_use

if TYPE_CHECKING:
    from sinssim.earth.datums import DATUMS as DATUMS
    from sinssim.earth.datums import change_datum as change_datum
    from sinssim.earth.ellipsoids import ELLIPSOIDS as ELLIPSOIDS
    from sinssim.earth.ellipsoids import GRAVITY_MODELS as GRAVITY_MODELS
    from sinssim.earth.ellipsoids import OMEGA_IE as OMEGA_IE
    from sinssim.earth.ellipsoids import WGS84 as WGS84
    from sinssim.earth.ellipsoids import Ellipsoid as Ellipsoid
    from sinssim.earth.ellipsoids import ellipsoid_by_name as ellipsoid_by_name
    from sinssim.earth.geodetic_coordinates import displaced as displaced
    from sinssim.earth.geodetic_coordinates import ecef_to_eci as ecef_to_eci
    from sinssim.earth.geodetic_coordinates import ecef_to_geodetic as ecef_to_geodetic
    from sinssim.earth.geodetic_coordinates import ecef_to_geodetic_k as ecef_to_geodetic_k
    from sinssim.earth.geodetic_coordinates import eci_to_ecef as eci_to_ecef
    from sinssim.earth.geodetic_coordinates import geodetic_to_ecef as geodetic_to_ecef
    from sinssim.earth.geodetic_coordinates import geodetic_to_ecef_k as geodetic_to_ecef_k
    from sinssim.earth.geodetic_coordinates import q_en as q_en
    from sinssim.earth.geodetic_coordinates import q_en_k as q_en_k
    from sinssim.earth.geodetic_coordinates import radii as radii
    from sinssim.earth.geodetic_coordinates import radii_k as radii_k
    from sinssim.earth.gravity import GRAVITY_NUMBERS as GRAVITY_NUMBERS
    from sinssim.earth.gravity import EarthParameters as EarthParameters
    from sinssim.earth.gravity import closed_gravity_k as closed_gravity_k
    from sinssim.earth.gravity import geodetic_sincos_k as geodetic_sincos_k
    from sinssim.earth.gravity import gravitation_ecef as gravitation_ecef
    from sinssim.earth.gravity import gravitation_ecef_k as gravitation_ecef_k
    from sinssim.earth.gravity import gravity_ned as gravity_ned
    from sinssim.earth.gravity import gravity_ned_k as gravity_ned_k
    from sinssim.earth.gravity import gravity_number as gravity_number
    from sinssim.earth.gravity import j2_gravitation_k as j2_gravitation_k
    from sinssim.earth.gravity import near_gravity_k as near_gravity_k
    from sinssim.earth.gravity import normal_gravitation_k as normal_gravitation_k
    from sinssim.earth.gravity import parameters as parameters
    from sinssim.earth.gravity import surface_gravity as surface_gravity

__getattr__, __dir__, __all__ = on_first_use(__name__)
