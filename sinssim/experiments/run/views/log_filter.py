"""Logs a filter for the viewer: errors inside their bands, innovations, decisions of the gate, observability."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.experiments.run.filter_axes import EDGE, NAVIGATION, settled
from sinssim.recording import style
from sinssim.recording.scales import Rows, thinned
from sinssim.recording.streams import Computed
from sinssim.scales import suiting

if TYPE_CHECKING:
    from sinssim.estimation import Innovations
    from sinssim.recording.rerun.rrd import Recording
    from sinssim.simulation.aided.truth_comparison import Aided

_FREEDOM = 60
"""Degrees of freedom of each mean of the normalised innovations squared, or a multiple of it."""

_AXES = {"forward": "x", "right": "y", "down": "z"}


def draw_filter(recording: Recording, aided: Aided) -> dict[str, str]:
    """Record the diagnostics of a filter, below `filter/`."""
    estimate = aided.estimate
    k = thinned(len(estimate.time))
    time, labels = estimate.time[k], {"filter": "yes"}
    errors = aided.state_errors_at(k)
    bands = [("aided", time, errors, estimate.sigma[k])]
    if estimate.smoothed is not None and aided.smoothed_state_errors is not None:
        j = thinned(len(estimate.smoothed.time))
        bands.append(
            ("smoothed", estimate.smoothed.time[j], aided.smoothed_state_errors[j], estimate.smoothed.sigma[j])
        )
    if estimate.backward is not None and aided.backward_state_errors is not None:
        j = thinned(len(estimate.backward.time))
        bands.append(
            ("backward", estimate.backward.time[j], aided.backward_state_errors[j], estimate.backward.sigma[j])
        )
    for name, scale, components, sign in NAVIGATION:
        at = estimate.model.slices[name]
        for i, component in enumerate(components):
            unit, size = suiting(scale, *[3.0 * s[_settled(n, t), at.start + i] for n, t, _, s in bands])
            labels[f"filter_{component}"] = unit
            for kind, when, error, sigma in bands:
                one = (sign if i == 2 else 1.0) * error[:, at.start + i] / size
                _band(recording, f"filter/{component}/{kind}", when, one, 3.0 * sigma[:, at.start + i] / size, kind)
    if not aided.true_parameters_known:
        labels["parameters"] = "estimates [σ at the start]"
    _parameters(recording, aided, k)
    _shrinking(recording, aided, k)
    _innovations(recording, [i for i in estimate.innovations if len(i.time)])
    return labels


def _band(recording: Recording, entity: str, time: Array, error: Array, bound: Array, kind: str) -> None:
    """Draw an error with its expected band."""
    color = style.COLORS[kind]
    pale = style.COLORS["bound"] if kind == "aided" else style.tint(color)
    recording.series(
        entity,
        time,
        np.column_stack((bound, -bound, error)),
        [f"+3σ {kind}", f"−3σ {kind}", f"{kind} error"],
        colors=[pale, pale, color],
        widths=[1.2, 1.2, 1.8],
    )
    late = _settled(kind, time)
    shown = np.concatenate((bound[late], -bound[late], error[late]))
    recording.ranges[entity] = (float(np.nanmin(shown)), float(np.nanmax(shown)))


def _settled(kind: str, time: Array) -> slice:
    """Return the rows after the filter has settled."""
    return settled(kind, time, (float(time[0]), float(time[-1])))


def _parameters(recording: Recording, aided: Aided, rows: Rows) -> None:
    """Draw the errors of the parameter estimates in units of their σ: gyros and accelerometers by axis.

    Of recorded sensors, whose errors are not known, draw the estimates in units of σ at the start.
    """
    estimate = aided.estimate
    time = estimate.time[rows]
    for sensor in ("gyro", "accelerometer"):
        for block in estimate.model.blocks:
            if not block.name.startswith(f"{sensor} "):
                continue
            at = estimate.model.slices[block.name]
            known = np.flatnonzero(estimate.sigma[0, at] > 0.0)
            if not len(known):
                continue
            if aided.true_parameters_known:
                sigma = estimate.sigma[np.ix_(rows, at.start + known)]
                ratio = aided.block_error(block.name, rows)[:, known] / sigma
            else:
                ratio = estimate.parameters[block.name][rows][:, known] / estimate.sigma[0, at.start + known]
            names = [block.states[i] for i in known]
            axes = [style.COLORS[_AXES.get(name.rsplit(" ", 1)[1], name.rsplit(" ", 1)[1][0])] for name in names]
            where = f"filter/{sensor}/{block.name.removeprefix(sensor + ' ')}"
            recording.series(where, time, ratio, names, colors=axes, widths=1.2)
            _bounds(recording, f"filter/{sensor}/bounds", time, 3.0)


def _bounds(
    recording: Recording, entity: str, time: Array, high: float, low: float | None = None, name: str = "±3σ"
) -> None:
    """Draw two horizontal lines."""
    ends = time[[0, -1]]
    levels = np.tile([high, -high if low is None else low], (2, 1))
    grey = [style.COLORS["bound"]] * 2
    recording.series(entity, ends, levels, [name] * 2, colors=grey, widths=1.2)


def _shrinking(recording: Recording, aided: Aided, rows: Rows) -> None:
    """Draw the reduction of the standard deviations in decades; a line for each block."""
    estimate = aided.estimate
    blocks = [b for b in estimate.model.blocks if np.any(estimate.sigma[0, estimate.model.slices[b.name]] > 0.0)]
    for block, color in zip(blocks, style.colors([b.name for b in blocks]), strict=True):
        at = estimate.model.slices[block.name]
        some = at.start + np.flatnonzero(estimate.sigma[0, at] > 0.0)
        # the worst-known state of the block
        worst = (estimate.sigma[np.ix_(rows, some)] / estimate.sigma[0, some]).max(axis=1, keepdims=True)
        where = f"filter/shrinking/{block.name.replace(' ', '_')}"
        recording.series(where, estimate.time[rows], np.log10(worst), [block.name], colors=[color])


def _innovations(recording: Recording, sensors: Sequence[Innovations]) -> None:
    """Draw innovations in units of their σ, means of their squares, and accepted and rejected readings."""
    colors = style.colors([i.sensor for i in sensors])
    ends = np.array([min(i.time[0] for i in sensors), max(i.time[-1] for i in sensors)]) if sensors else np.zeros(2)
    for lane, (sensor, color) in enumerate(zip(sensors, colors, strict=True), start=1):
        names = [sensor.sensor, *[""] * (sensor.value.shape[1] - 1)]
        for key, which, paint, marker, size in (
            ("taken", sensor.accepted, color, "circle", 1.2),
            ("refused", ~sensor.accepted, style.COLORS["refused"], "cross", 4.0),
        ):
            rows = np.flatnonzero(which).astype(np.int32)
            if len(rows):
                time, ratio = Computed(partial(_times, sensor, rows)), Computed(partial(_ratio, sensor, rows))
                where = f"filter/innovations/{key}/{sensor.sensor}"
                recording.points(where, len(rows), time, ratio, names, paint, marker=marker, size=size)
                lanes = np.broadcast_to(float(lane), (len(rows), 1))
                where = f"filter/decisions/{key}/{sensor.sensor}"
                said = [sensor.sensor if key == "taken" else "rejected"]
                recording.points(where, len(rows), time, lanes, said, paint, marker=marker, size=1.6 * size)
        _squares(recording, sensor, color)
    if sensors:
        from scipy.stats import chi2

        _bounds(recording, "filter/innovations/bounds", ends, 3.0)
        low, high = (float(chi2.ppf(p, _FREEDOM)) / _FREEDOM for p in (0.025, 0.975))
        _bounds(recording, "filter/squares/bounds", ends, high, low, "95 % band")


def _times(sensor: Innovations, rows: NDArray[np.int32], block: slice) -> Array:
    """Return the times of a block of some of a sensor's innovations."""
    return sensor.time[rows[block]]


def _ratio(sensor: Innovations, rows: NDArray[np.int32], block: slice) -> Array:
    """Return a block of some of a sensor's innovations in units of their σ, within the limits of the plot."""
    some = rows[block]
    return np.asarray(np.clip(sensor.value[some] / sensor.sigma_at(some), -EDGE, EDGE))


def _squares(recording: Recording, sensor: Innovations, color: style.Rgb) -> None:
    """Draw means of the normalised innovations squared over `_FREEDOM` degrees of freedom; 1 is expected."""
    finite = np.isfinite(sensor.nis)
    known = slice(None) if finite.all() else finite  # no copy, if none is missing
    nis, time, size = sensor.nis[known], sensor.time[known], sensor.value.shape[1]
    each = max(1, _FREEDOM // size)
    count = len(nis) // each
    if count < 2:
        return
    mean = nis[: count * each].reshape(count, each).mean(axis=1) / size
    middle = time[: count * each].reshape(count, each).mean(axis=1)
    apart = np.diff(middle)
    mean[:-1][apart > 3.0 * np.median(apart)] = np.nan  # no line across an outage
    if np.isnan(mean).all():
        return
    where = f"filter/squares/{sensor.sensor}"
    recording.series(where, middle, np.minimum(mean, 5.0)[:, np.newaxis], [sensor.sensor], colors=[color], widths=1.5)
