"""Recorded sensors, [log]: what their solutions are compared with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sinssim.experiments.run.part import Part
from sinssim.simulation.navigation import Navigated
from sinssim.simulation.truth import RecordedMotion


@dataclass(frozen=True)
class Log(Part):
    """The recording of a run on recorded sensors."""

    name = "log"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the sensors are recorded."""
        return isinstance(run.truth, RecordedMotion)

    def numbers(self) -> Mapping[str, Any]:
        """Return what is known of the recording, for `summary.json`."""
        motion = self.run.truth
        assert isinstance(motion, RecordedMotion)
        log, reference = motion.prepared.log, motion.reference
        return {
            "reference_file": None if log.reference is None else log.reference.name,
            "compared_with": None if reference is None else reference.name,
            "knows": [] if reference is None else list(reference.knows),
            "notes": [*log.notes, motion.prepared.start.words],
            "time_0_gps_s": None if log.zero is None else round(log.zero.seconds + log.zero.fraction, 6),
        }
