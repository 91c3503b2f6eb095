"""A flight and its plan: where a perfect navigator would have taken it, and how far it is from its planned path."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from sinssim.charts import PAIR, Axis, Chart, Charts, Line, Mark, over
from sinssim.data import Array, NavSolution, NavState, rows_of, solution_of
from sinssim.exhibits import Column, Item, Medium, Sentence, Table
from sinssim.experiments.run.filter_exhibits import marks_of
from sinssim.experiments.run.filter_summary import Moment, detections, moments, places_of
from sinssim.experiments.run.parts.phases import phases_of
from sinssim.experiments.run.run_result import DrawnPath, Part
from sinssim.experiments.run.summary_types import ErrorNumbers
from sinssim.recording.streams import Stream, Vector
from sinssim.recording.style import thinned
from sinssim.recording.track_map import NOTE, Track, track_map
from sinssim.simulation.guided_passes import air_sensors
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.total_system_error import (
    AXES,
    WITHIN,
    Ending,
    PathErrors,
    Piece,
    containments,
    corridor_edges,
    ending,
    has_path,
    misses,
    path_errors,
    pieces_of,
    size_of,
)
from sinssim.simulation.total_system_error import Miss as Missed
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.guidance import AIDED, ENDED, TRUTH, Guided
from sinssim.truth.trajectory import Trajectory
from sinssim.units import LENGTH_SCALE, NAUTICAL_MILE, fixed, listed, number_text, signed

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
    """The entry of the summary; `seen`: whose airspeed and height the autopilot sees: "sensor", "solution", "true"."""

    source: str
    seen: dict[str, str]
    ended_early: str
    end: Ending
    moved_m: list[float]
    left_m: float
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
        truth = _flown(self.run)
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
        solution = _solution(self, guided.source)
        legs, ended = [], ""
        scenario, truth = self.run.scenario, _flown(self.run)
        waypoints = [self._missed(miss, solution) for miss in misses(scenario, truth, pieces_of(scenario, truth))]
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
        return GuidanceNumbers(
            source=guided.source, seen=self._seen(), ended_early=ended,
            end=ending(_plan(self.run), path), moved_m=list(guided.moved),
            left_m=guided.left, in_sections=guided.in_sections,
            displacement_max_m=float(size.max()), displacement_end_m=float(size[-1]), legs=legs, waypoints=waypoints,
        )  # fmt: skip

    def _seen(self) -> dict[str, str]:
        """Return whose airspeed and height the autopilot sees."""
        flight, sensors = _plan(self.run), air_sensors(self.run.scenario)
        height = "solution" if "height" in flight.guidance.quantities else "true"
        return {"airspeed": "true", "height": height} | dict.fromkeys(sensors, "sensor")

    def with_filter(self) -> GuidanceNumbers:
        """Return the entry with the errors of the aided solution, if that guides the flight."""
        return self.numbers() if self._guided[0].source == AIDED else self.entry

    def _missed(self, miss: Missed, solution: NavSolution | None) -> Miss:
        """Return how a waypoint is missed, with the error of the navigator there."""
        error = _horizontal(self._guided[1], solution, miss.time)
        return Miss(waypoint=miss.name, time_s=miss.time, right_m=miss.right, left_to_go_m=miss.to_go,
                    navigation_error_m=error)  # fmt: skip

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield where the flight went, for the console."""
        entry = self.entry
        air = " with perfect air data" if "sensor" in entry["seen"].values() else ""
        yield Sentence(
            f"The flight follows {entry['source']}: at its end it is {number_text(entry['displacement_end_m'])} m from "
            f"where a perfect navigator{air} would have taken it, at most "
            f"{number_text(entry['displacement_max_m'])} m. {_air_words(entry)}",
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
        yield Sentence(
            f"The autopilot and the legs see the solution {self.entry['source']}. {_air_words(self.entry)} "
            f"{_closing(self.entry)}"
        )
        yield from self._early(("page",))
        yield from self._tables(("page",))
        chart = Chart(
            key="guidance/displacement", title="Displacement from the flight of a perfect navigator", x=x,
            y=Axis(units=_METRES, least=1e-3), marks=lines,
        )  # fmt: skip
        yield Charts("guidance", ((chart,),), (0.5 * PAIR[0], PAIR[1]), on=("page",))

    def _early(self, on: tuple[Medium, ...]) -> Iterator[Item]:
        if not self.entry["ended_early"]:
            return
        end = self.entry["end"]
        place = f"{end['latitude_deg']:.4f}°, {end['longitude_deg']:.4f}°, {end['height_m']:.0f} m high"
        if end["threshold_m"] is not None:
            place += f", {number_text(end['threshold_m'])} m from the threshold of the runway"
        yield Sentence(
            f"The flight ends early, at {end['time_s']:.1f} s, in {self.entry['ended_early']}. It is then at {place}, "
            f"sinking at {end['descent_mps']:.1f} m/s.",
            "warning", on=on,
        )  # fmt: skip

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


_AIR_WORDS = {
    "airspeed": {"true": "true", "sensor": "that of [aiding.airspeed]"},
    "height": {"true": "true", "sensor": "that of [aiding.baro]", "solution": "that of the solution"},
}


def _air_words(entry: GuidanceNumbers) -> str:
    """Say whose airspeed and height the autopilot sees."""
    airspeed, height = (_AIR_WORDS[name][entry["seen"][name]] for name in ("airspeed", "height"))
    return f"Its airspeed is {airspeed}, its height {height}."


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
        f"on the flight before, which moved the path by {', '.join(f'{number_text(value)} m' for value in moved)}. "
        f"It is {number_text(entry['left_m'])} m from that of the closed loop, or nearer."
    )


Sizes = dict[str, str | float | None]
"""Root mean square, 95 % and largest of the three errors by axis: `tse_across_95_m` and so on."""


class Outside(TypedDict):
    """The corridor of a required navigation performance on a leg; the first time outside is None if there is none."""

    leg: str
    rnp: float
    judged_s: float
    within: float
    exceeded_s: float | None


class PathNumbers(TypedDict):
    """The entry of the summary: the three errors by leg, by phase and of the flight; with a flight by the truth the
    navigation errors of its solutions."""

    source: str
    legs: list[Sizes]
    phases: list[Sizes]
    flight: Sizes
    solutions: dict[str, Sizes]
    corridors: list[Outside]


_COLUMNS = (("TSE", "across", "95"), ("TSE", "across", "max"), ("TSE", "vertical", "max"),
            ("NSE", "across", "95"), ("NSE", "along", "95"), ("NSE", "vertical", "95"),
            ("FTE", "across", "95"), ("FTE", "vertical", "95"))  # fmt: skip
_HEADS = {"95": " 95 %", "max": " largest"}
_PATH_NOTE = (
    "TSE: total system error, truth minus planned path. NSE: navigation system error, solution minus truth. FTE: "
    "flight technical error, solution minus planned path. TSE = FTE − NSE. Across: to the right. A plan has no "
    "schedule: along the path the FTE is zero. 95 %: not exceeded in 95 % of the time."
)


@dataclass(frozen=True)
class OffPath(Part[PathNumbers]):
    """The distance of a flight from its planned path."""

    name, title = "planned_path", "The planned path"
    kept: dict[bool, PathErrors] = field(default_factory=dict, compare=False, repr=False)
    """The errors without and with the aided solution, as `on` hands them on: small, but of a solution that is not."""

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the flight is told by its planned path."""
        return isinstance(run.truth, Truth) and has_path(run.scenario)

    @property
    def after_filter(self) -> bool:
        return self._source == AIDED

    @property
    def _source(self) -> str:
        guided = _flown(self.run).guided
        return TRUTH if guided is None else guided.source

    @cached_property
    def pieces(self) -> list[Piece]:
        """The planned path while it is flown."""
        return pieces_of(self.run.scenario, _flown(self.run))

    @property
    def errors(self) -> PathErrors:
        """The errors of the flight by its navigator, or by the truth."""
        known = self._source == AIDED and self.aided is not None
        if known not in self.kept:
            solution = _solution(self, self._source)
            self.kept[known] = path_errors(self.run.scenario, _flown(self.run), self.pieces, solution)
        return self.kept[known]

    def numbers(self) -> PathNumbers:
        """Return the errors by leg and phase; those of the aided solution come with it."""
        errors, path = self.errors, _flown(self.run).trajectory
        legs = [{"leg": self._leg(number), **_sizes(errors, errors.leg == number)}
                for number in dict.fromkeys(piece.leg for piece in self.pieces)]  # fmt: skip
        phases = [{"phase": phase.name, **_sizes(errors, (errors.time >= phase.start) & (errors.time < phase.end))}
                  for phase in phases_of(path.events)]  # fmt: skip
        return PathNumbers(
            source=self._source, legs=legs, phases=phases, flight=_sizes(errors, errors.leg >= 0),
            solutions={} if self._source != TRUTH else {n: self._size_of(s) for n, s in self.run.solutions.items()},
            corridors=[Outside(leg=self._leg(number), rnp=rnp, judged_s=lasts, within=within, exceeded_s=exceeded)
                       for number, rnp, lasts, within, exceeded in containments(_plan(self.run), errors)],
        )  # fmt: skip

    def _size_of(self, solution: NavSolution) -> Sizes:
        """Return the navigation errors of a solution of a flight by the truth."""
        errors = path_errors(self.run.scenario, _flown(self.run), self.pieces, solution)
        return _sizes(errors, errors.leg >= 0, ("nse",))

    def with_filter(self) -> PathNumbers:
        """Return the entry with the errors of the aided solution, if that guides the flight."""
        if self._source == AIDED:
            return self.numbers()
        if self._source == TRUTH and self.aided is not None:
            sizes = self._size_of(self.aided.estimate.solution)
            return {**self.entry, "solutions": {**self.entry["solutions"], AIDED: sizes}}
        return self.entry

    def _leg(self, number: int) -> str:
        return f"{number + 1} {_plan(self.run).legs[number].type}"

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield whether the corridors are kept, and the errors by leg for the console."""
        yield from self._verdicts()
        yield self._table(("console",))
        for time, _, text in self._faults():
            row = int(np.searchsorted(self.errors.time, time))
            if row < len(self.errors.time) and np.isfinite(self.errors.tse[row, 0]):
                total, navigation = (signed(float(of[row, 0])) for of in (self.errors.tse, self.errors.nse))
                yield Sentence(f"At {time:g} s ({text}): across the planned path TSE {total} m, NSE {navigation} m.")

    def _verdicts(self) -> Iterator[Sentence]:
        """Yield a sentence for each required navigation performance."""
        for rnp in sorted({c["rnp"] for c in self.entry["corridors"]}):
            legs = [c for c in self.entry["corridors"] if c["rnp"] == rnp]
            within = float(np.average([c["within"] for c in legs], weights=[c["judged_s"] for c in legs]))
            out = [c for c in legs if c["exceeded_s"] is not None]
            first = f"; first outside at {out[0]['exceeded_s']:g} s, on leg {out[0]['leg']}" if out else ""
            worst = min(legs, key=lambda c: c["within"])
            on = f" On leg {worst['leg']} it is {100.0 * worst['within']:.3g} %." if len(legs) > 1 and out else ""
            met = all(c["within"] >= WITHIN for c in legs)
            yield Sentence(
                f"RNP {rnp:g} is {'met' if met else 'NOT met'}: the true path is within {rnp:g} nmi of the planned one "
                f"{100.0 * within:.4g} % of the time (95 % on every leg are needed){first}.{on}",
                "" if met else "warning",
            )

    def _table(self, on: tuple[Medium, ...], of: Literal["leg", "phase"] = "leg") -> Table:
        """Return the errors by leg with the corridors, or by phase."""
        corridors = {c["leg"]: c for c in self.entry["corridors"]} if of == "leg" else {}
        columns = [Column(of, words=True)]
        columns += [Column(f"{axis}{_HEADS[what]}", _METRES, digits=3, group=name) for name, axis, what in _COLUMNS]
        rows: list[list[str | float]] = []
        for part in [*self.entry["legs" if of == "leg" else "phases"], {**self.entry["flight"], of: "flight, all"}]:
            values = (part[f"{name.lower()}_{axis}_{what}_m"] for name, axis, what in _COLUMNS)
            row = [str(part[of]), *(math.nan if value is None else value for value in values)]
            if corridors:
                c = corridors.get(str(part[of]))
                row += ["", "", ""] if c is None else [
                    f"{c['rnp']:g}", f"{100.0 * c['within']:.4g} %",
                    "–" if c["exceeded_s"] is None else f"{c['exceeded_s']:.4g} s"]  # fmt: skip
            rows.append(row)
        if corridors:
            columns += [Column("RNP", words=True), Column("within", words=True), Column("first outside", words=True)]
        note = _PATH_NOTE if of == "leg" else ""
        return Table(tuple(columns), rows, title=f"Distance from the planned path by {of}", note=note, on=on)

    def exhibits(self) -> Iterator[Item]:
        """Yield the verdicts, the errors by leg and over time, and the map of the three paths."""
        yield from self._verdicts()
        yield self._table(("page",))
        if self.entry["phases"]:
            yield self._table(("page",), "phase")
        planned = {piece.leg for piece in self.pieces}
        if without := [self._leg(n) for n in range(len(_plan(self.run).legs)) if n not in planned]:
            yield Sentence(f"Without a planned path in space: leg {listed(without)}.", "note", on=("page",))
        if self.entry["solutions"]:
            yield Sentence(
                "The flight follows the true motion: its NSE is zero. Those of its solutions are:", on=("page",)
            )
            keys = [(axis, what) for axis in AXES for what in ("95", "max")]
            columns = (Column("solution", words=True),
                       *(Column(f"{axis}{_HEADS[what]}", _METRES, digits=3) for axis, what in keys))  # fmt: skip
            rows = [(name, *(math.nan if (v := sizes[f"nse_{axis}_{what}_m"]) is None else v for axis, what in keys))
                    for name, sizes in self.entry["solutions"].items()]  # fmt: skip
            yield Table(columns, rows, title="Navigation system errors", on=("page",))
        yield self._map()
        yield Charts("planned_path", (tuple(self._charts()),), PAIR)

    def _charts(self) -> Iterator[Chart]:
        """Yield the three errors over time, across with the corridors, and above."""
        errors = self.errors
        x = over((float(errors.time[0]), float(errors.time[-1])))
        lines = {"TSE": errors.tse} if self._source == TRUTH else {
            "FTE": errors.fte, "NSE": errors.nse, "TSE": errors.tse}  # fmt: skip
        for column, key, title in ((0, "across", "Across the planned path, to its right"),
                                   (2, "vertical", "Above the planned path")):  # fmt: skip
            marks: list[Mark] = [
                Line(label=name, x=errors.time, y=values[:, column], color=name.lower())
                for name, values in lines.items()
            ]
            marks += marks_of([(time, word) for time, word, _ in self._faults()], (errors.time[0], errors.time[-1]))
            yield Chart(key=f"planned_path/{key}", title=title, x=x, y=Axis(units=LENGTH_SCALE, least=1e-3),
                        marks=(*marks, *(self._limits() if column == 0 else ())))  # fmt: skip

    def _faults(self) -> list[Moment]:
        """Return when forged fixes begin and are detected, once the filter has run."""
        times = [] if self.aided is None else detections(self.aided.estimate.innovations)
        path = _flown(self.run).trajectory
        return moments(self.run.scenario, times, (path.start, path.end))

    def _limits(self) -> Iterator[Line]:
        """Yield the edges of the corridors over time; far ones do not widen the chart."""
        errors, size, labelled = self.errors, size_of(self.errors.tse[:, 0]), set[float]()
        for number in dict.fromkeys(piece.leg for piece in self.pieces):
            rnp, ends = _plan(self.run).rnp_of(number), errors.time[errors.leg == number][[0, -1]]
            for side in () if rnp is None else (-1.0, 1.0):
                assert rnp is not None
                near = size is not None and rnp * NAUTICAL_MILE < 4.0 * size.largest
                edge = np.full(2, side * rnp * NAUTICAL_MILE)
                label = "" if rnp in labelled else f"RNP {rnp:g}"
                yield Line(label=label, x=ends, y=edge, color="corridor", dash="--", counts=near)
                labelled.add(rnp)

    def _map(self) -> Charts:
        """Return the map of the planned, the believed and the true path, with the corridors."""
        truth, errors = _flown(self.run), self.errors
        tracks = [Track.of("true", truth.time, truth.state, "truth")]
        solution, named = _solution(self, self._source), set[float]()
        if solution is not None:
            tracks.append(Track.of("believed", solution.time, solution, self._source))
        there = np.isfinite(errors.planned[:, 0])
        latitude, longitude, _ = errors.planned[there].T
        tracks.append(Track("planned", errors.time[there], latitude, longitude, "planned"))
        for rnp, latitude, longitude, _ in corridor_edges(_plan(self.run), self.pieces):
            tracks.append(Track("" if rnp in named else f"RNP {rnp:g}", latitude, latitude, longitude, "corridor"))
            named.add(rnp)
        places = [(_missed_words(m), m.latitude, m.longitude) for m in self._missed()]
        places += places_of(self._faults(), truth.trajectory).named
        return track_map(tracks, truth.ellipsoid, places=places, note=NOTE.format("true"))

    def _missed(self) -> list[Missed]:
        return misses(self.run.scenario, _flown(self.run), self.pieces)

    def paths(self) -> Iterator[DrawnPath]:
        """Yield the planned and the believed path, the corridors, and the waypoints with their miss."""
        errors, path = self.errors, _flown(self.run).trajectory
        latitude, longitude, height = errors.planned.T
        true = path.state(errors.time)
        yield DrawnPath("planned", latitude, longitude, np.where(np.isfinite(height), height, true.height), "planned")
        if (s := _solution(self, self._source)) is not None:
            rows = thinned(len(s.time))
            yield DrawnPath("believed", s.latitude[rows], s.longitude[rows], s.height[rows], self._source)
        for number, (_, latitude, longitude, height) in enumerate(corridor_edges(_plan(self.run), self.pieces)):
            yield DrawnPath(f"corridor/{number}", latitude, longitude, height, "corridor")
        if missed := self._missed():
            at = path.state(np.array([m.time for m in missed])).height
            places = (np.array([m.latitude for m in missed]), np.array([m.longitude for m in missed]), at)
            yield DrawnPath("waypoints", *places, "planned", tuple(map(_missed_words, missed)))

    def streams(self) -> Iterator[Stream]:
        """Yield the errors once a second, and the planned place beside the true one."""
        errors = self.errors
        vectors = [
            Vector(name, tuple(f"{name}_{axis}_m" for axis in AXES), values)
            for name, values in (("tse", errors.tse), ("nse", errors.nse), ("fte", errors.fte))
        ]
        columns = ("planned_latitude_rad", "planned_longitude_rad", "planned_height_m")
        yield Stream("planned_path", errors.time, (*vectors, Vector("planned", columns, errors.planned)))


def _plan(run: Navigated) -> FlightPlan:
    assert run.scenario.flight is not None  # it belongs to the run
    return run.scenario.flight


def _flown(run: Navigated) -> Truth:
    assert isinstance(run.truth, Truth)  # a flight is simulated
    return run.truth


def _solution(part: Guidance | OffPath, source: str) -> NavSolution | None:
    """Return the solution that guides a flight, if it is there."""
    if source != AIDED:
        return part.run.solutions.get(source)
    return None if part.aided is None else part.aided.estimate.solution


def _missed_words(miss: Missed) -> str:
    return f"{miss.name} ({number_text(abs(miss.right))} m {'right' if miss.right > 0.0 else 'left'})"


def _sizes(errors: PathErrors, rows: NDArray[np.bool_], names: tuple[str, ...] = ("tse", "nse", "fte")) -> Sizes:
    """Return how large errors are in some rows."""
    numbers: Sizes = {}
    for name in names:
        for column, axis in enumerate(AXES):
            size = size_of(getattr(errors, name)[rows, column])
            for k, what in enumerate(("rms", "95", "max")):
                numbers[f"{name}_{axis}_{what}_m"] = None if size is None else size[k]
    return numbers


def _between(there: NavState, here: NavState, time: Array, path: Trajectory) -> Array:
    """Return the places `here` less those `there` along the velocity there, to its right and up, (K, 3) m."""
    place = solution_of(time, here)
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
    there = solution_of(at, rows_of(solution, row))
    return float(navigation_error(path.state(at), there, path.ellipsoid).horizontal[0])
