"""The fit of the true motion to a recorded or planned track, [track]."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sinssim.charts import PAIR, Axis, Chart, Charts, Line, over
from sinssim.exhibits import Column, Item, Section, Sentence, Table
from sinssim.experiments.run.part import Part
from sinssim.scales import fixed
from sinssim.simulation.navigation import Navigated
from sinssim.simulation.truth import Truth
from sinssim.units import DEG

if TYPE_CHECKING:
    from sinssim.truth.track.fit import TrackFit


@dataclass(frozen=True)
class Track(Part):
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

    def numbers(self) -> Mapping[str, Any]:
        """Return how far the motion passes from the track, for `summary.json`."""
        from sinssim.truth.track.fit import fit_numbers

        return fit_numbers(self.fit)

    def brief(self, algorithms: Mapping[str, Mapping[str, Any]]) -> Iterator[Item]:
        """Yield how the curve fits the samples, and what is assumed."""
        from sinssim.truth.track.fit import fit_sentences

        yield from (Sentence(sentence, on=("console",)) for sentence in fit_sentences(self.fit))

    def exhibits(self) -> Iterator[Item]:
        """Yield the source of the curve, and the quality of the fit."""
        from sinssim.truth.track.fit import ANGLE, HORIZONTAL, VERTICAL, fit_lines

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
