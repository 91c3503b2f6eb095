"""Ensembles: many runs of one scenario, and the statistics of their errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.members import Member as Member
    from sinssim.experiments.ensembles.members import member as member
    from sinssim.experiments.ensembles.members import run_seed as run_seed
    from sinssim.experiments.ensembles.result import EnsembleResult as EnsembleResult
    from sinssim.experiments.ensembles.running.run import ensemble as ensemble

__getattr__, __dir__, __all__ = on_first_use(__name__)
