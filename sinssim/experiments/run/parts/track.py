"""The fit of the true motion to a recorded or planned track, [track]."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sinssim.experiments.run.part import Part
from sinssim.simulation.navigation import Navigated


@dataclass(frozen=True)
class Track(Part):
    """The track of a run."""

    name = "track"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the true motion is made from a track."""
        return run.scenario.track is not None

    def numbers(self) -> Mapping[str, Any]:
        """Return how far the motion passes from the track, for `summary.json`."""
        from sinssim.truth.track.fit import fit_numbers

        scenario = self.run.scenario
        assert scenario.track is not None
        return fit_numbers(scenario.track.prepared(scenario.truth).fit)
