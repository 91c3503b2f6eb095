"""One run from end to end: fly, sense, navigate, compare, record."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.simulation.execute import run
    from sinssim.simulation.initial_error import initial_state_with_errors
    from sinssim.simulation.result import Run, RunResult
    from sinssim.simulation.stages import STAGES

__all__ = ["STAGES", "Run", "RunResult", "initial_state_with_errors", "run"]

__getattr__, __dir__ = on_first_use(
    __name__,
    {
        "STAGES": "sinssim.simulation.stages",
        "Run": "sinssim.simulation.result",
        "RunResult": "sinssim.simulation.result",
        "initial_state_with_errors": "sinssim.simulation.initial_error",
        "run": "sinssim.simulation.execute",
    },
)
