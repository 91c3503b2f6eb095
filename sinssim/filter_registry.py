"""The registry of filters, apart from their files, so that listing and checking them needs no filterpy.

A kind of the package has a row here and a class in `sinssim.estimation.unscented_cubature_ensemble`; a filter of a
project is a file of its folder `filters` with a class `Filter` (`docs/extending/filter.md`).
"""

from __future__ import annotations

from collections.abc import Mapping

from sinssim.system.registries import Sentences, entries

REGISTRY = entries(
    "filters",
    "filter",
    {
        "error-state": ("", "Kalman filter of the errors, to first order"),
        "invariant": ("", "left-invariant Kalman filter on SE₂(3)"),
        "unscented": ("", "Kalman filter by scaled unscented points through the nonlinear equations"),
        "cubature": ("", "Kalman filter by cubature points through the nonlinear equations"),
        "ensemble": ("", "ensemble of 200 members that move through the nonlinear equations"),
    },
)
"""All filters by name."""

KINDS: Mapping[str, str] = Sentences(REGISTRY)
"""All filters by name, with a description each."""

SHIPPED = tuple(REGISTRY.shipped)
"""The kinds of the package."""

LINEAR = ("error-state", "invariant")
"""Kinds whose covariance is moved by Φ, so that they can be smoothed."""

GRAVITY = "gravity disturbance"
"""The states of the gravity that the navigator does not know."""
