"""The optional filter: the errors of inertial navigation estimated from aiding measurements, and proof of consistency.

`sinssim.estimation.estimate.estimate` does it; that module loads filterpy, which takes a while.
"""

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
