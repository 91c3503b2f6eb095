"""What the truth of some runs is made from.

The fit of the motion to a recorded or planned track, [track], and the true gravity field along it, [gravity].
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sinssim.charts import PAIR, Axis, Chart, Charts, Line, over
from sinssim.exhibits import Column, Item, Section, Sentence, Table
from sinssim.experiments.run.run_result import Part
from sinssim.formatting import number_text
from sinssim.recording.result import Json
from sinssim.recording.streams import Stream, gravity_stream
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.truth.true_gravity_disturbance import Disturbed
from sinssim.units import ARCSEC, DEG, MGAL, fixed

if TYPE_CHECKING:
    from sinssim.experiments.run.summary_types import ErrorNumbers
    from sinssim.truth.track.track_curve import TrackFit
    from sinssim.truth.true_gravity_disturbance import GravityValues


@dataclass(frozen=True)
class Track(Part[Mapping[str, Json]]):
    """The track of a run."""

    name, place = "track", "motion"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the true motion is made from a track."""
        return run.scenario.track is not None

    @property
    def fit(self) -> TrackFit:
        """How the curve fits the track's samples."""
        scenario = self.run.scenario
        assert scenario.track is not None
        return scenario.track.prepared(scenario.truth).fit

    def numbers(self) -> Mapping[str, Json]:
        """Return how far the motion passes from the track, for `summary.json`."""
        from sinssim.truth.track.track_curve import fit_numbers

        return fit_numbers(self.fit)

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield how the curve fits the samples, and what is assumed."""
        from sinssim.truth.track.track_curve import fit_sentences

        yield from (Sentence(sentence, on=("console",)) for sentence in fit_sentences(self.fit))

    def exhibits(self) -> Iterator[Item]:
        """Yield the source of the curve, and the quality of the fit."""
        from sinssim.truth.track.track_curve import ANGLE, HORIZONTAL, VERTICAL, fit_lines

        track, fit, truth = self.run.scenario.track, self.fit, self.run.truth
        assert track is not None
        assert isinstance(truth, Truth)
        planned, title = bool(track.waypoints), "planned route" if track.waypoints else "recorded track"
        facts = [("made from", track.what), ("vehicle", track.vehicle), *fit_lines(fit)]
        items: list[Item] = [
            *(Sentence(sentence, "warning") for sentence in fit.warnings),
            Table((Column(title, words=True), Column("", words=True)), facts),
            *(Sentence(sentence, "note") for sentence in fit.notes),
        ]
        channels, x = truth.trajectory.channels, over((truth.trajectory.start, truth.trajectory.end))
        if not planned and HORIZONTAL in channels:
            lines = tuple(
                Line(label=label, x=channels[name].time, y=channels[name].values, color=color)
                for label, name, color in (("horizontal", HORIZONTAL, "y"), ("vertical, up", VERTICAL, "z"))
            )
            charts = [Chart(key="track/distance", title="Distance of the curve from the samples", x=x,
                            y=Axis(units=fixed("m"), least=1e-3), marks=lines)]  # fmt: skip
            if ANGLE in channels:
                angle = Line(label="angle", x=channels[ANGLE].time, y=channels[ANGLE].values, color="x")
                charts.append(Chart(key="track/angle", title="Angle from the recorded attitude", x=x,
                                    y=Axis(units=fixed("deg", DEG), least=1e-4 * DEG), marks=(angle,)))  # fmt: skip
            size = (0.5 * PAIR[0] * len(charts), PAIR[1])
            items.append(Charts("track", (tuple(charts),), size, on=("page",)))
        yield Section(f"The {title}", items)


@dataclass(frozen=True)
class TrueGravity(Part[Mapping[str, Json]]):
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
        from sinssim.truth.true_gravity_disturbance import gravity_values

        return gravity_values(self._motion)

    def numbers(self) -> Mapping[str, Json]:
        """Return deflections and anomalies along the motion, for `summary.json`."""
        from sinssim.truth.true_gravity_disturbance import gravity_numbers

        return gravity_numbers(self._motion)

    def streams(self) -> Iterator[Stream]:
        """Yield the field along the motion."""
        yield gravity_stream(self.values)

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield the size of the field along the motion, and the part of it that the navigator knows."""
        v, degree = self.values, self.run.scenario.navigation.gravity_degree
        north, east, down = (number_text(float(np.sqrt(np.mean(a**2)))) for a in (
            v.xi / ARCSEC, v.eta / ARCSEC, v.disturbance / MGAL
        ))  # fmt: skip
        known = "normal gravity alone" if degree is None else f"the field to degree {degree}"
        yield Sentence(
            f"True gravity along the motion: deflection of the vertical {north} arcsec to the north and {east} arcsec "
            f"to the east, disturbance {down} mGal, rms; the navigator knows {known}.", on=("console",),
        )  # fmt: skip

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
