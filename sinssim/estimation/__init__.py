"""The optional filter: the errors of inertial navigation estimated from aiding measurements, and proof of consistency.

estimate(imu, initial, measurements, model, *, covariance=None, loop="closed", rate_hz=10.0, gate=1e-4,
         smooth=False, history=False, algorithm="quaternion", gravity="normal", ellipsoid="wgs84") -> Estimate
"""

from sinssim.estimation.model import BLOCKS, Block, ErrorModel, error_model
from sinssim.estimation.result import Divergence, Estimate, History, Innovations, Smoothed, state_errors

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
    "state_errors",
]
