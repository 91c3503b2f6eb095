"""The true gravity field along the motion, [gravity]."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from sinssim.charts import PAIR, Axis, Chart, Charts, Line, over
from sinssim.exhibits import Item
from sinssim.experiments.run.part import Part
from sinssim.recording.store.streams import gravity_stream
from sinssim.recording.streams import Stream
from sinssim.scales import fixed
from sinssim.simulation.navigation import Navigated
from sinssim.simulation.truth import Truth
from sinssim.truth.gravity.disturbed import Disturbed
from sinssim.units import ARCSEC, MGAL

if TYPE_CHECKING:
    from sinssim.truth.gravity.values import GravityValues


@dataclass(frozen=True)
class TrueGravity(Part):
    """The gravity field of a run whose true field is not normal gravity."""

    name, place = "gravity", "motion"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the true field is not normal gravity."""
        return isinstance(run.truth, Truth) and isinstance(run.truth.trajectory, Disturbed)

    @property
    def _motion(self) -> Disturbed:
        assert isinstance(self.run.truth, Truth)
        assert isinstance(self.run.truth.trajectory, Disturbed)
        return self.run.truth.trajectory

    @cached_property
    def values(self) -> GravityValues:
        """The field along the motion."""
        from sinssim.truth.gravity.values import gravity_values

        return gravity_values(self._motion)

    def numbers(self) -> Mapping[str, Any]:
        """Return deflections and anomalies along the motion, for `summary.json`."""
        from sinssim.truth.gravity.values import gravity_numbers

        return gravity_numbers(self._motion)

    def streams(self) -> Iterator[Stream]:
        """Yield the field along the motion."""
        yield gravity_stream(self.values)

    def exhibits(self) -> Iterator[Item]:
        """Yield deflections and disturbance of gravity over time."""
        v = self.values
        x, arcsec, mgal = over((float(v.time[0]), float(v.time[-1]))), fixed("arcsec", ARCSEC), fixed("mGal", MGAL)
        deflections = (
            Line(label="ξ, north", x=v.time, y=v.xi, color="x"), Line(label="η, east", x=v.time, y=v.eta, color="y"),
        )  # fmt: skip
        down = (Line(label="gravity disturbance, down", x=v.time, y=v.disturbance, color="z"),)
        yield Charts("gravity", ((
            Chart(key="gravity/deflection", title="Deflection of the vertical", x=x,
                  y=Axis(units=arcsec, least=1e-3 * ARCSEC), marks=deflections),
            Chart(key="gravity/disturbance", title="Gravity beyond normal gravity", x=x,
                  y=Axis(units=mgal, least=1e-3 * MGAL), marks=down),
        ),), PAIR, on=("page",))  # fmt: skip
