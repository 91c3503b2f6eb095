"""Directions at places on the ellipsoid."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array


def verticals(latitude: Array, longitude: Array) -> Array:
    """Return the upward normals of the ellipsoid at places, (N, 3)."""
    return np.column_stack(
        (np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude))
    )
