"""A flight that follows its own navigator: where it was, and where a perfect navigator would have taken it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypedDict

import numpy as np

from sinssim.charts import PAIR, Axis, Chart, Charts, Line, over
from sinssim.data import Array, NavSolution, NavState
from sinssim.exhibits import Column, Item, Medium, Sentence, Table
from sinssim.experiments.run.run_result import Part
from sinssim.formatting import number_text
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.flight.guidance import AIDED, ENDED, Guided
from sinssim.truth.flight.legs.waypoint import WaypointLeg
from sinssim.units import DEG, fixed

if TYPE_CHECKING:
    from sinssim.experiments.run.summary_types import ErrorNumbers
    from sinssim.truth.trajectory import Trajectory

_RATE = 1.0
"""Rate of the comparison with the flight by the truth, Hz."""
_ENDS = re.compile(r"leg (\d+) \((\w+)\) ends")
_METRES = fixed("m")
_DISPLACED = ("along", "right", "up")


class Displacement(TypedDict):
    """Of the aircraft from where a perfect navigator would have taken it, at the end of a leg."""

    leg: str
    end_s: float
    navigation_error_m: float
    along_m: float
    right_m: float
    up_m: float
    horizontal_max_m: float


class Miss(TypedDict):
    """How a waypoint is passed by the true path, continued straight on from where the navigator has reached it."""

    waypoint: str
    time_s: float
    right_m: float
    left_to_go_m: float
    navigation_error_m: float


class GuidanceNumbers(TypedDict):
    """The entry of the summary."""

    source: str
    ended_early: str
    moved_m: list[float]
    in_sections: bool
    displacement_max_m: float
    displacement_end_m: float
    legs: list[Displacement]
    waypoints: list[Miss]


class Displaced(NamedTuple):
    """The displacement over time, (K,) s and (K, 3) m: along the path of a perfect navigator, to its right and up."""

    time: Array
    values: Array

    def at(self, time: float) -> Array:
        """Return the displacement at an instant, (3,) m."""
        return np.array([np.interp(time, self.time, column) for column in self.values.T])


@dataclass(frozen=True)
class Guidance(Part[GuidanceNumbers]):
    """The guidance of a flight by its navigator."""

    name, title = "guidance", "The flight by its navigator"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the flight follows its navigator."""
        return isinstance(run.truth, Truth) and run.truth.guided is not None

    @property
    def _guided(self) -> tuple[Guided, Trajectory]:
        truth = self.run.truth
        assert isinstance(truth, Truth)
        assert truth.guided is not None  # it belongs to the run
        return truth.guided, truth.trajectory

    @cached_property
    def displaced(self) -> Displaced:
        """The displacement by the errors of the navigator, as long as both flights last."""
        guided, path = self._guided
        end = min(path.end, guided.by_truth.end)
        time = np.append(np.arange(path.start, end, 1.0 / _RATE), end)
        return Displaced(time, _between(guided.by_truth.state(time), path.state(time), time, path))

    def numbers(self) -> GuidanceNumbers:
        """Return the displacement and the missed waypoints; those of a flight by the filter come with it."""
        guided, path = self._guided
        solution = self._solution()
        legs, waypoints, ended = [], [], ""
        time, values = self.displaced
        size, begin = np.linalg.norm(values[:, :2], axis=1), path.start
        for event in path.events:
            if event.text.startswith(ENDED):
                ended = event.text.removeprefix(ENDED)
            if match := _ENDS.fullmatch(event.text):
                along, right, up = self.displaced.at(event.time)
                within = size[(time >= begin - 1e-9) & (time <= event.time + 1e-9)]
                legs.append(
                    Displacement(
                        leg=f"{match[1]} {match[2]}", end_s=event.time,
                        navigation_error_m=_horizontal(path, solution, event.time),
                        along_m=along, right_m=right, up_m=up,
                        horizontal_max_m=float(within.max(initial=0.0)),
                    )
                )  # fmt: skip
                begin = event.time
                waypoints += self._missed(int(match[1]), event.time, solution)
        return GuidanceNumbers(
            source=guided.source, ended_early=ended, moved_m=list(guided.moved), in_sections=guided.in_sections,
            displacement_max_m=float(size.max()), displacement_end_m=float(size[-1]), legs=legs, waypoints=waypoints,
        )  # fmt: skip

    def with_filter(self) -> GuidanceNumbers:
        """Return the entry with the errors of the aided solution, if that guides the flight."""
        return self.numbers() if self._guided[0].source == AIDED else self.entry

    def _solution(self) -> NavSolution | None:
        """Return the solution that guides the flight, if it is there."""
        source = self._guided[0].source
        if source != AIDED:
            return self.run.solutions.get(source)
        return None if self.aided is None else self.aided.estimate.solution

    def _missed(self, number: int, time: float, solution: NavSolution | None) -> list[Miss]:
        """Return how the place at the end of a leg is missed; those before it within a route have no end of a leg."""
        flight, path = self.run.scenario.flight, self._guided[1]
        assert flight is not None
        leg = flight.legs[number - 1]
        if not isinstance(leg, WaypointLeg):
            return []
        last = len(leg.places()) - 1
        place, here = leg.places()[last], path.state(np.array([time]))
        target = NavState(
            np.array([place.latitude_deg * DEG]), np.array([place.longitude_deg * DEG]), here.height, here.velocity_ned,
            here.q_nb,
        )  # fmt: skip
        to_go, right, _ = _between(here, target, np.array([time]), path)[0]
        name = leg.label(last) or f"leg {number}"
        error = _horizontal(path, solution, time)
        return [Miss(waypoint=name, time_s=time, right_m=-right, left_to_go_m=to_go, navigation_error_m=error)]

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield where the flight went, for the console."""
        entry = self.entry
        yield Sentence(
            f"The flight follows {entry['source']}: at its end it is {number_text(entry['displacement_end_m'])} m from "
            f"where a perfect navigator would have taken it, at most {number_text(entry['displacement_max_m'])} m.",
            on=("console",),
        )
        yield from self._early(("console",))
        yield from self._tables(("console",))

    def exhibits(self) -> Iterator[Item]:
        """Yield the displacement by leg and over time, the waypoints, and how the loop was closed."""
        time, values = self.displaced
        x = over((float(time[0]), float(time[-1])))
        lines = tuple(
            Line(label=label, x=time, y=values[:, k], color=color)
            for k, (label, color) in enumerate(zip(_DISPLACED, ("x", "y", "z"), strict=True))
        )
        yield Sentence(f"The autopilot and the legs see the solution {self.entry['source']}. {_closing(self.entry)}")
        yield from self._early(("page",))
        yield from self._tables(("page",))
        chart = Chart(
            key="guidance/displacement", title="Displacement from the flight of a perfect navigator", x=x,
            y=Axis(units=_METRES, least=1e-3), marks=lines,
        )  # fmt: skip
        yield Charts("guidance", ((chart,),), (0.5 * PAIR[0], PAIR[1]), on=("page",))

    def _early(self, on: tuple[Medium, ...]) -> Iterator[Item]:
        if self.entry["ended_early"]:
            yield Sentence(f"The flight ends early: {self.entry['ended_early']}", "warning", on=on)

    def _tables(self, on: tuple[Medium, ...]) -> Iterator[Item]:
        heads = ("navigation error", *_DISPLACED, "largest")
        keys = ("navigation_error_m", "along_m", "right_m", "up_m", "horizontal_max_m")
        columns = (Column("leg", words=True), Column("end", fixed("s"), digits=4),
                   *(Column(head, _METRES, digits=3) for head in heads))  # fmt: skip
        rows = [(leg["leg"], leg["end_s"], *(leg[key] for key in keys)) for leg in self.entry["legs"]]  # type: ignore[literal-required]
        if rows:
            yield Table(columns, rows, title="Displacement from the flight of a perfect navigator", on=on)
        if self.entry["waypoints"]:
            columns = (Column("waypoint", words=True), Column("at", fixed("s"), digits=4),
                       Column("passed to the right by", _METRES, digits=3), Column("left to go", _METRES, digits=3),
                       Column("navigation error", _METRES, digits=3))  # fmt: skip
            rows = [(w["waypoint"], w["time_s"], w["right_m"], w["left_to_go_m"], w["navigation_error_m"])
                    for w in self.entry["waypoints"]]  # fmt: skip
            yield Table(columns, rows, title="Waypoints of the navigator on the true path", on=on)


def _closing(entry: GuidanceNumbers) -> str:
    """Describe how the loop was closed."""
    moved = entry["moved_m"]
    if entry["in_sections"]:
        return (
            f"The plan was flown in {len(moved)} sections, because a decision of the navigator turns with the path: "
            "each again with the errors of the navigator on the trial before, until that moved its path by at most "
            f"{number_text(max(moved))} m."
        )
    return (
        f"The plan was flown {len(moved) + 1} times, first by the true motion, then with the errors of the navigator "
        f"on the flight before, which moved the path by {', '.join(f'{number_text(value)} m' for value in moved)}."
    )


def _between(there: NavState, here: NavState, time: Array, path: Trajectory) -> Array:
    """Return the places `here` less those `there` along the velocity there, to its right and up, (K, 3) m."""
    place = NavSolution(time, here.latitude, here.longitude, here.height, here.velocity_ned, here.q_nb, 0.0 * time)
    north, east, down = navigation_error(there, place, path.ellipsoid).position_ned.T
    course = np.arctan2(there.velocity_ned[:, 1], there.velocity_ned[:, 0])
    c, s = np.cos(course), np.sin(course)
    return np.column_stack([c * north + s * east, c * east - s * north, -down])


def _horizontal(path: Trajectory, solution: NavSolution | None, time: float) -> float:
    """Return the horizontal error of a solution in its last row before an instant, m; NaN without it."""
    if solution is None or time < solution.time[0]:
        return float("nan")
    row = np.array([np.searchsorted(solution.time, time + 1e-9, side="right") - 1])
    at = solution.time[row]
    names = ("latitude", "longitude", "height", "velocity_ned", "q_nb", "defect")
    there = NavSolution(at, *(getattr(solution, name)[row] for name in names))
    return float(navigation_error(path.state(at), there, path.ellipsoid).horizontal[0])
