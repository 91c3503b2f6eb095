"""Ensembles: many runs of one scenario, and the statistics of their errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.system import on_first_use

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.ensemble_plan import Member as Member
    from sinssim.experiments.ensembles.ensemble_plan import member as member
    from sinssim.experiments.ensembles.ensemble_plan import run_seed as run_seed
    from sinssim.experiments.ensembles.ensemble_result import EnsembleResult as EnsembleResult
    from sinssim.experiments.ensembles.ensemble_run import ensemble as ensemble

__getattr__, __dir__, __all__ = on_first_use(__name__)
