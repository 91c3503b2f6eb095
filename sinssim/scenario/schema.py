"""The scenario: one run, described by the tables of its file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self

from pydantic import model_validator

from sinssim.logs.log import Log
from sinssim.logs.track.track import Track
from sinssim.scenario.dependencies import check_dependencies
from sinssim.scenario.tables import Tables
from sinssim.system.short_repr import html_lines
from sinssim.truth.flight.flight import Flight
from sinssim.truth.motions.closed_forms import AnyClosedForm
from sinssim.truth.motions.great_circle import GreatCircleFlight
from sinssim.truth.motions.parked import ParkedVehicle
from sinssim.truth.turntable.turntable import Turntable
from sinssim.truth.vehicles.drive import Drive
from sinssim.truth.vehicles.voyage import Voyage
from sinssim.truth.vertical_plane import OneComponent


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
            flight: Flight | None = None,
            parked: ParkedVehicle | None = None,
            great_circle: GreatCircleFlight | None = None,
            motion: AnyClosedForm | None = None,
            track: Track | None = None,
            drive: Drive | None = None,
            voyage: Voyage | None = None,
            turntable: Turntable | None = None,
            log: Log | None = None,
            one_component: OneComponent | None = None,
            **others: Any,
        ) -> None: ...

    @model_validator(mode="after")
    def _tables_fit_together(self) -> Self:
        check_dependencies(self)
        return self

    def __repr__(self) -> str:
        given = {*self.model_fields_set, self.source.table} | ({"turntable"} if self.sequence is not None else set())
        there = [name for name in self.file_keys() if name in given and name != "name"]
        return f"Scenario({self.name}: {', '.join(there)}; print(scenario.to_toml()) shows all)"

    def _repr_html_(self) -> str:
        """Return the plan for a notebook, as `sinssim check` prints it."""
        from sinssim.scenario.summary import plan_lines

        return html_lines(plan_lines(self))
