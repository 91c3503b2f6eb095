"""One run from end to end: fly, sense, navigate, compare, record."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.simulation.execute import run as run
    from sinssim.simulation.initial_error import initial_state_with_errors as initial_state_with_errors
    from sinssim.simulation.result import Run as Run
    from sinssim.simulation.result import RunResult as RunResult
    from sinssim.simulation.stages import STAGES as STAGES

__getattr__, __dir__, __all__ = on_first_use(__name__)
