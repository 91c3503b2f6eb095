"""The optional filter: estimates the errors of inertial navigation from aiding measurements and tests itself.

The entry point is `sinssim.estimation.estimate.estimate`. That module loads filterpy, which takes a while.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.estimation.model import BLOCKS as BLOCKS
    from sinssim.estimation.model import Block as Block
    from sinssim.estimation.model import ErrorModel as ErrorModel
    from sinssim.estimation.model import error_model as error_model
    from sinssim.estimation.result import Divergence as Divergence
    from sinssim.estimation.result import Estimate as Estimate
    from sinssim.estimation.result import History as History
    from sinssim.estimation.result import Innovations as Innovations
    from sinssim.estimation.result import Smoothed as Smoothed
    from sinssim.estimation.result import nominal_errors as nominal_errors
    from sinssim.estimation.result import state_errors as state_errors

__getattr__, __dir__, __all__ = on_first_use(__name__)
