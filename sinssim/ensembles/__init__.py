"""Ensembles: many runs of one scenario, and the statistics of their errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.ensembles.members import Member, member, run_seed
    from sinssim.ensembles.result import EnsembleResult
    from sinssim.ensembles.running.run import ensemble

__all__ = ["EnsembleResult", "Member", "ensemble", "member", "run_seed"]

__getattr__, __dir__ = on_first_use(
    __name__,
    {
        "EnsembleResult": "sinssim.ensembles.result",
        "Member": "sinssim.ensembles.members",
        "ensemble": "sinssim.ensembles.running.run",
        "member": "sinssim.ensembles.members",
        "run_seed": "sinssim.ensembles.members",
    },
)
