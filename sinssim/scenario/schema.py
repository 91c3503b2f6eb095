"""The scenario: one run, described by the tables of its file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sinssim.logs.log import Log
from sinssim.scenario.sections.flight import FlightSection
from sinssim.scenario.sections.motion import MotionSection
from sinssim.scenario.sections.one_component import OneComponentSection
from sinssim.scenario.sections.truth import GreatCircleSection, ParkedSection
from sinssim.scenario.tables import Tables
from sinssim.system.short_repr import html_lines
from sinssim.truth.track.section import TrackSection
from sinssim.truth.turntable.section import TurntableSection
from sinssim.truth.vehicles.section import DriveSection, VoyageSection


class Scenario(Tables):
    """One run: a true motion, the IMU that measures it, and the algorithms that navigate with its measurements.

    Exactly one of `flight`, `parked`, `great_circle`, `motion`, `track`, `drive`, `voyage` and `turntable` gives the
    true motion, or `log` has recorded sensors, or `one_component` describes a run in a vertical plane, with its own
    sensors.
    """

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            name: str,
            flight: FlightSection | None = None,
            parked: ParkedSection | None = None,
            great_circle: GreatCircleSection | None = None,
            motion: MotionSection | None = None,
            track: TrackSection | None = None,
            drive: DriveSection | None = None,
            voyage: VoyageSection | None = None,
            turntable: TurntableSection | None = None,
            log: Log | None = None,
            one_component: OneComponentSection | None = None,
            **others: Any,
        ) -> None: ...

    def __repr__(self) -> str:
        given = {*self.model_fields_set, self.source.table} | ({"turntable"} if self.sequence is not None else set())
        there = [name for name in self.file_keys() if name in given and name != "name"]
        return f"Scenario({self.name}: {', '.join(there)}; print(scenario.to_toml()) shows all)"

    def _repr_html_(self) -> str:
        """Return the plan for a notebook, as `sinssim check` prints it."""
        from sinssim.scenario.summary import plan_lines

        return html_lines(plan_lines(self))
