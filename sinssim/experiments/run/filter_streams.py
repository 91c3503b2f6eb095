"""The streams of a filter: solutions, states with their 1σ, and every reading with the decision on it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from sinssim.recording.stream_columns import error_stream, nav_stream
from sinssim.recording.stream_tables import Computed, Stream, Vector
from sinssim.sensors.aiding_registry import measurement_kind

if TYPE_CHECKING:
    from sinssim.data import Array, Measurements
    from sinssim.estimation import Block, Innovations
    from sinssim.estimation.filter_result import Rows
    from sinssim.simulation.truth_comparison import Aided


_AXES = {"north": "n", "east": "e", "forward": "x", "right": "y"}
_STREAM_UNITS = {"m": "m", "m/s": "mps", "rad": "rad", "rad/s": "radps", "m/s²": "mps2", "s": "s", "": ""}


def filter_streams(aided: Aided) -> list[Stream]:
    """Return all streams of an aided solution.

    Returns:
        `nav_aided`, `error_aided`, the same for the smoothed and the backward solution if there are any, `filter` with
        1σ of all states, estimates of the sensors' parameters and their errors, and `aiding_<sensor>` with every
        reading and the decision on it.
    """
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
    """Return the column names of a block's states, each with its unit.

    Args:
        kinds: kind of measurement of each aiding sensor, by its label.

    Returns:
        Names such as "gyro_bias_x_radps"; "phi_n_rad", … for the attitude.
    """
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
            if aided.true_parameters_known:
                vectors.append(Vector(f"error_{name}", errors, Computed(partial(aided.block_error, block.name))))
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
        return Computed(at)

    def rows_of(rows: slice) -> Array:
        number = np.arange(-before, count - before)[rows]
        known = at(number[number >= 0])
        return np.concatenate((np.broadcast_to(without, (len(number) - len(known), known.shape[1])), known))

    return Computed(rows_of)
