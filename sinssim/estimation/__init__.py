"""The optional filter: estimates the errors of inertial navigation from aiding measurements and tests itself.

The entry point is `sinssim.estimation.estimate.estimate`. That module loads filterpy, which takes a while. The registry
of filters is here, so that listing and checking them needs no filterpy: a kind of the package has a row and a class in
`unscented_cubature_ensemble`; a filter of a project is a file of its folder `filters` with a class `Filter`
(`docs/extending/filter.md`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from sinssim.system import on_first_use
from sinssim.system.registries import Sentences, entries

if TYPE_CHECKING:
    from sinssim.estimation.filter_result import Divergence as Divergence
    from sinssim.estimation.filter_result import Estimate as Estimate
    from sinssim.estimation.filter_result import History as History
    from sinssim.estimation.filter_result import Innovations as Innovations
    from sinssim.estimation.filter_result import Smoothed as Smoothed
    from sinssim.estimation.filter_result import nominal_errors as nominal_errors
    from sinssim.estimation.filter_result import state_errors as state_errors
    from sinssim.estimation.state_model import BLOCKS as BLOCKS
    from sinssim.estimation.state_model import Block as Block
    from sinssim.estimation.state_model import ErrorModel as ErrorModel
    from sinssim.estimation.state_model import error_model as error_model

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

GATE = 1e-4
"""Fraction of correct measurements that the gate of a filter rejects, unless another is given."""

__getattr__, __dir__, __all__ = on_first_use(__name__)
