"""The streams of a run: those of a run in memory, those of its filter, and those in further coordinates."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth, rotation
from sinssim.data import Array, Computed, Measurements, NavSolution, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.estimation import Block, Innovations
from sinssim.estimation.state_model import FLICKER
from sinssim.recording.streams import (
    Stream,
    Vector,
    error_stream,
    imu_stream,
    nav_stream,
    reference_stream,
    truth_stream,
)
from sinssim.scenario import Scenario
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.strapdown import motion_coordinates
from sinssim.strapdown.frames.route_pole import route_pole

if TYPE_CHECKING:
    from sinssim.estimation.filter_result import Rows
    from sinssim.experiments.run.run_result import Run
    from sinssim.simulation.truth_comparison import Aided


_AXES = {"north": "n", "east": "e", "forward": "x", "right": "y"}
_STREAM_UNITS = {
    "m": "m", "m/s": "mps", "rad": "rad", "rad/s": "radps", "m/s²": "mps2", "s": "s", "": "", "s/rad": "s_per_rad",
    "s²/m": "s2_per_m", "s²/rad²": "s2_per_rad2", "s⁴/m²": "s4_per_m2", "rad/s/(m/s²)": "radps_per_mps2",
}  # fmt: skip


def filter_streams(aided: Aided) -> list[Stream]:
    """Return the streams of an aided solution: solutions, errors, states with 1σ, readings with the decisions."""
    estimate = aided.estimate
    solution = estimate.solution
    streams = [
        nav_stream("aided", solution),
        error_stream("aided", aided.error_at, solution.time),
        _state_stream(aided),
    ]
    if estimate.smoothed is not None and aided.smoothed_error is not None:
        solution = estimate.smoothed.solution
        streams += [nav_stream("smoothed", solution), error_stream("smoothed", aided.smoothed_error.at, solution.time)]
    if estimate.backward is not None and aided.backward_error is not None:
        solution = estimate.backward.solution
        streams += [nav_stream("backward", solution), error_stream("backward", aided.backward_error.at, solution.time)]
    innovations = {i.sensor: i for i in estimate.innovations}
    streams += [_readings(s.measurements, innovations.get(s.measurements.label)) for s in aided.sensed]
    return streams


def state_columns(block: Block, kinds: dict[str, str]) -> tuple[str, ...]:
    """Return the names of the states of a block with their units, given the kinds of the aiding sensors by label."""
    stem = "phi" if block.name == "attitude" else block.name.replace(" ", "_").replace("-", "_")
    sensor = next((label for label in kinds if block.name.startswith(f"{label} ")), "")
    what = block.name.removeprefix(f"{sensor} ")
    kind = measurement_kind(kinds[sensor]) if sensor else None
    unit = _STREAM_UNITS[block.unit]
    if kind is not None and what == "bias":
        axes, unit = kind.axes, kind.unit
    elif kind is not None and what in kind.own_errors:
        axes, unit = kind.own_errors[what]
    elif kind is not None and what == "delay":
        axes, unit = ("",), "s"
    elif block.size == 1:
        axes = ("",)
    else:
        names = [state.rsplit(" ", 1)[1] for state in block.states]
        axes = tuple(_AXES.get(name, ("d" if "north" in names else "z") if name == "down" else name) for name in names)
    return tuple("_".join(part for part in (stem, axis, unit) if part) for axis in axes)


def _state_stream(aided: Aided) -> Stream:
    """Return the stream `filter`."""
    estimate = aided.estimate
    kinds = {s.measurements.label: s.measurements.kind for s in aided.sensed}
    vectors = []
    for block in estimate.model.blocks:
        columns, rows = state_columns(block, kinds), estimate.model.slices[block.name]
        name = block.name.replace(" ", "_").replace("-", "_")
        if block.name in estimate.parameters:
            vectors.append(Vector(name, columns, estimate.parameters[block.name]))
            errors = tuple(f"error_{column}" for column in columns)
            if aided.true_parameters_known and f" {FLICKER} " not in block.name:  # its sum alone has one
                error = Computed(len(estimate.time), partial(aided.block_error, block.name))
                vectors.append(Vector(f"error_{name}", errors, error))
        vectors.append(Vector(f"sigma_{name}", tuple(f"sigma_{column}" for column in columns), estimate.sigma[:, rows]))
    return Stream("filter", estimate.time, tuple(vectors))


def _readings(measurements: Measurements, innovations: Innovations | None) -> Stream:
    """Return the stream of one aiding sensor."""
    m, kind = measurements, measurement_kind(measurements.kind)
    ends = [f"_{axis}_{kind.unit}" if axis else f"_{kind.unit}" for axis in kind.axes]

    def named(stem: str) -> tuple[str, ...]:
        return tuple(stem + end for end in ends)

    vectors = [
        Vector("reading", kind.columns, m.value),
        Vector("sigma", named("sigma"), m.sigma),
        Vector("arrival", ("arrival_s",), m.arrival[:, np.newaxis]),
    ]
    if innovations is not None:
        i, before = innovations, len(m.time) - len(innovations.time)  # the filter may start after the first readings

        def gate(rows: Rows) -> Array:
            return np.column_stack((i.nis[rows], i.accepted[rows].astype(np.float64)))

        vectors += [
            Vector("innovation", named("innovation"), _later(before, len(m.time), np.nan, lambda rows: i.value[rows])),
            Vector("innovation_sigma", named("innovation_sigma"), _later(before, len(m.time), np.nan, i.sigma_at)),
            Vector("gate", ("nis", "accepted"), _later(before, len(m.time), (np.nan, 0.0), gate)),
        ]
    return Stream(f"aiding_{m.label.replace('-', '_')}", m.time, tuple(vectors))


def _later(before: int, count: int, without: ArrayLike, at: Callable[[Rows], Array]) -> Computed:
    """Return rows that follow some without values, from a function of their numbers."""
    if not before:
        return Computed(count, at)

    def rows_of(rows: slice) -> Array:
        number = np.arange(-before, count - before)[rows]
        known = at(number[number >= 0])
        return np.concatenate((np.broadcast_to(without, (len(number) - len(known), known.shape[1])), known))

    return Computed(count, rows_of)


Motion = NavState | NavSolution
Parts = Callable[[slice], tuple[Array, ...]]
"""Returns the vectors of a block of rows."""


@dataclass(frozen=True)
class CoordinateStreams:
    """Makes the streams of a run's motions in the coordinates that its scenario records."""

    names: tuple[str, ...]  # kinds of coordinates, see `sinssim.scenario.tables.COORDINATES`
    angles: str | None  # range of the heading, or "continuous"; None for no angles
    ellipsoid: Ellipsoid  # of the geodetic coordinates
    pole: Array  # pole of the route of conditional coordinates, Earth-fixed unit vector, (3,)
    start: tuple[float, float]  # latitude and longitude of the start of that route, rad
    epoch: float  # instant at which the inertial axes are the Earth's, s: the start of the run, for all motions of it

    def of(self, name: str, time: Array, motion: Motion) -> Iterator[Stream]:
        """Yield the streams of one motion at (N,) s, whose names end with its name, "truth" or the algorithm."""
        for kind in self.names:
            if kind == "frame" and getattr(motion, "azimuth", None) is None:
                continue  # the azimuth of a frame depends on the path, and only a solution has it
            columns, parts = self._coordinates(kind, time, motion)
            yield _stream(f"{kind.replace('-', '_').replace('.', '_')}_{name}", time, columns, parts)
        if self.angles is not None:
            yield self._angles_of(name, time, motion)

    def _coordinates(self, kind: str, time: Array, motion: Motion) -> tuple[dict[str, tuple[str, ...]], Parts]:
        """Return the columns of each vector, and the function that computes the vectors."""

        def rows_of(rows: slice) -> NavState:
            m = motion
            return NavState(m.latitude[rows], m.longitude[rows], m.height[rows], m.velocity_ned[rows], m.q_nb[rows])

        match kind:
            case "earth-fixed":
                return _cartesian("e"), lambda rows: tuple(
                    motion_coordinates.earth_fixed(rows_of(rows), self.ellipsoid)
                )
            case "inertial":
                return _cartesian("i"), lambda rows: tuple(
                    motion_coordinates.inertial(rows_of(rows), time[rows], self.ellipsoid, self.epoch)
                )
            case "frame":
                of_x = getattr(motion, "azimuth", np.zeros(0))
                return _LEVEL, lambda rows: _columns(*motion_coordinates.level_axes(rows_of(rows), of_x[rows]))
            case "conditional":
                return _CONDITIONAL, self._conditional(rows_of)
            case _:
                return {"position": ("latitude_rad", "longitude_rad", "height_m")}, lambda rows: (
                    self._on(kind, rows_of(rows)),
                )

    def _conditional(self, rows_of: Callable[[slice], NavState]) -> Parts:
        def parts(rows: slice) -> tuple[Array, ...]:
            coordinates = motion_coordinates.conditional(rows_of(rows), self.pole, self.start)
            return np.column_stack((coordinates.latitude, coordinates.longitude)), *_columns(*coordinates.axes)

        return parts

    def _on(self, name: str, motion: NavState) -> Array:
        """Return geodetic coordinates on another ellipsoid, in its datum if both have one, (N, 3)."""
        place = earth.geodetic_to_ecef(motion.latitude, motion.longitude, motion.height, self.ellipsoid)
        if name in earth.DATUMS and self.ellipsoid.name in earth.DATUMS:
            place = earth.change_datum(place, self.ellipsoid.name, name)
        return np.column_stack(earth.ecef_to_geodetic(place, earth.ellipsoid_by_name(name)))

    def _angles_of(self, name: str, time: Array, motion: Motion) -> Stream:
        """Return the stream of the Euler angles; continuous ones depend on all rows before."""
        assert self.angles is not None
        if self.angles == "continuous":
            angles = rotation.continuous_angles(motion.q_nb)
        else:
            roll, pitch, heading = rotation.euler_from_quaternion(motion.q_nb)
            angles = roll, pitch, rotation.heading_in(self.angles, heading)
        columns = ("roll_rad", "pitch_rad", "heading_rad")
        return Stream(f"angles_{name}", time, (Vector("angles", columns, np.column_stack(angles)),))


def _cartesian(axes: str) -> dict[str, tuple[str, ...]]:
    columns = {
        "position": tuple(f"{axis}_{axes}_m" for axis in "xyz"),
        "velocity": tuple(f"v{axis}_{axes}_mps" for axis in "xyz"),
        "attitude": tuple(f"q_{axes}b_{part}" for part in "wxyz"),
    }
    if axes == "i":
        columns["angles"] = ("about_x_i_rad", "about_y_i_rad", "about_z_i_rad")
    return columns


_LEVEL = {
    "azimuth": ("azimuth_of_x_rad",),
    "velocity": ("velocity_x_mps", "velocity_y_mps", "velocity_d_mps"),
    "heading": ("heading_from_x_rad",),
}
_CONDITIONAL = {"position": ("conditional_latitude_rad", "conditional_longitude_rad"), **_LEVEL}


def _columns(*vectors: Array) -> tuple[Array, ...]:
    """Return vectors with one-dimensional ones as columns."""
    return tuple(v if v.ndim > 1 else v[:, np.newaxis] for v in vectors)


def _stream(name: str, time: Array, columns: dict[str, tuple[str, ...]], parts: Parts) -> Stream:
    """Return a stream whose vectors are computed together, block by block."""
    # two threads write the vectors of a block, one after the other
    block = lru_cache(maxsize=2)(lambda start, stop: parts(slice(start, stop)))

    def part(number: int) -> Computed:
        return Computed(len(time), lambda rows: block(rows.start, rows.stop)[number])

    return Stream(name, time, tuple(Vector(key, names, part(i)) for i, (key, names) in enumerate(columns.items())))


def coordinate_streams(scenario: Scenario, ellipsoid: Ellipsoid, truth: NavState, epoch: float) -> CoordinateStreams:
    """Return what makes the streams in the coordinates that a scenario records, of a motion on an ellipsoid."""
    route = scenario.navigation.route_deg
    start = (float(truth.latitude[0]), float(truth.longitude[0]))
    pole = route_pole(None if route is None else tuple(np.radians(route)), *start, truth.velocity_ned[0])
    begin = start if route is None else (float(np.radians(route[0])), float(np.radians(route[1])))
    return CoordinateStreams(scenario.coordinates, scenario.output.angles, ellipsoid, pole, begin, epoch)


def streams_of_run(run: Run) -> Iterator[Stream]:
    """Yield the streams that a run in memory has."""
    truth = run.truth
    if isinstance(truth, Truth):
        yield truth_stream(truth.time, truth.state)
        yield imu_stream("ideal", truth.ideal)
    elif truth.reference is not None:
        yield reference_stream(truth.reference)
    yield imu_stream("measured", run.sensed.measured)
    for name, solution in run.solutions.items():
        yield nav_stream(name, solution)
        if name in run.errors:
            yield error_stream(name, run.errors[name].at, solution.time)
    if run.aided is not None:
        yield from filter_streams(run.aided)
