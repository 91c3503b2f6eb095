"""Gravity and gravitation over arrays, for the models of a scenario."""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import as_columns, as_vectors
from sinssim.data import Array
from sinssim.earth.ellipsoid_kernels import (
    GRAVITY_NUMBERS,
    EarthParameters,
    gravitation_ecef_k,
    gravity_ned_k,
    parameters,
)
from sinssim.earth.ellipsoids import GRAVITY_MODELS, WGS84, Ellipsoid
from sinssim.errors import check_name
from sinssim.jit import kernel


def gravity_number(model: str) -> int:
    """Return the number of a gravity model in the kernels.

    Args:
        model: one of `GRAVITY_MODELS`.

    Returns:
        Its number.

    Raises:
        InputError: the name is unknown; the message lists the known names.
    """
    check_name("gravity model", model, GRAVITY_MODELS)
    return GRAVITY_NUMBERS[model]


@kernel
def _gravity_rows(p: EarthParameters, model: int, latitude: Array, height: Array, out: Array) -> None:
    for i in range(latitude.shape[0]):
        s, c = sin(latitude[i]), cos(latitude[i])
        north, down = gravity_ned_k(p, model, s, c, p.a / sqrt(1.0 - p.e2 * s * s), height[i])
        out[i] = (north, 0.0, down)


@kernel
def _gravitation_rows(p: EarthParameters, model: int, r: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = gravitation_ecef_k(p, model, r[i, 0], r[i, 1], r[i, 2])


def surface_gravity(latitude: ArrayLike, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return normal gravity on the ellipsoid by Somigliana's formula.

    Args:
        latitude: geodetic, (...) rad.
        ellipsoid: reference ellipsoid.

    Returns:
        Gravity, (...) m/s².
    """
    return gravity_ned(latitude, 0.0, "somigliana", ellipsoid)[..., 2]


def gravity_ned(latitude: ArrayLike, height: ArrayLike, model: str = "normal", ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return gravity (gravitation plus centrifugal) in north-east-down axes.

    Args:
        latitude: geodetic, (...) rad.
        height: above the ellipsoid, (...) m.
        model: one of `GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.

    Returns:
        Gravity, (..., 3) m/s².

    Raises:
        InputError: the model is unknown.
    """
    shape, (lat, h) = as_columns(latitude, height)
    out = np.empty((len(lat), 3))
    _gravity_rows(parameters(ellipsoid), gravity_number(model), lat, h, out)
    return out.reshape(*shape, 3)


def gravitation_ecef(r: ArrayLike, model: str = "normal", ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return gravitation (gravity without the centrifugal part) in Earth-fixed axes.

    Args:
        r: Earth-fixed positions, (..., 3) m.
        model: one of `GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.

    Returns:
        Gravitation, (..., 3) m/s².

    Raises:
        InputError: the model is unknown.
    """
    shape, rows = as_vectors(r)
    out = np.empty_like(rows)
    _gravitation_rows(parameters(ellipsoid), gravity_number(model), rows, out)
    return out.reshape(*shape, 3)
