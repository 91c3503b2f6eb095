"""The optional filter: estimates the errors of inertial navigation from aiding measurements and tests itself.

The entry point is `sinssim.estimation.estimate.estimate`. That module loads filterpy, which takes a while.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.system import on_first_use

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

__getattr__, __dir__, __all__ = on_first_use(__name__)
