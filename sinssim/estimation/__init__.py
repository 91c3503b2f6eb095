"""The optional filter: estimates the errors of inertial navigation from aiding measurements and tests itself.

The entry point is `sinssim.estimation.estimate.estimate`. That module loads filterpy, which takes a while.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.estimation.model import BLOCKS, Block, ErrorModel, error_model
    from sinssim.estimation.result import (
        Divergence,
        Estimate,
        History,
        Innovations,
        Smoothed,
        nominal_errors,
        state_errors,
    )

__all__ = [
    "BLOCKS",
    "Block",
    "Divergence",
    "ErrorModel",
    "Estimate",
    "History",
    "Innovations",
    "Smoothed",
    "error_model",
    "nominal_errors",
    "state_errors",
]

__getattr__, __dir__ = on_first_use(
    __name__,
    {
        "BLOCKS": "sinssim.estimation.model",
        "Block": "sinssim.estimation.model",
        "Divergence": "sinssim.estimation.result",
        "ErrorModel": "sinssim.estimation.model",
        "Estimate": "sinssim.estimation.result",
        "History": "sinssim.estimation.result",
        "Innovations": "sinssim.estimation.result",
        "Smoothed": "sinssim.estimation.result",
        "error_model": "sinssim.estimation.model",
        "nominal_errors": "sinssim.estimation.result",
        "state_errors": "sinssim.estimation.result",
    },
)
