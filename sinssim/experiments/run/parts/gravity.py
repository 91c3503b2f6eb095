"""The true gravity field along the motion, [gravity]."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sinssim.experiments.run.part import Part
from sinssim.simulation.navigation import Navigated
from sinssim.simulation.truth import Truth
from sinssim.truth.gravity.disturbed import Disturbed


@dataclass(frozen=True)
class TrueGravity(Part):
    """The gravity field of a run whose true field is not normal gravity."""

    name = "gravity"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the true field is not normal gravity."""
        return isinstance(run.truth, Truth) and isinstance(run.truth.trajectory, Disturbed)

    def numbers(self) -> Mapping[str, Any]:
        """Return deflections and anomalies along the motion, for `summary.json`."""
        from sinssim.truth.gravity.values import gravity_numbers

        assert isinstance(self.run.truth, Truth)
        assert isinstance(self.run.truth.trajectory, Disturbed)
        return gravity_numbers(self.run.truth.trajectory)
