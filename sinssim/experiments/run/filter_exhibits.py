"""The filter of a run in report and recording.

Errors inside their bands, consistency, innovations, decisions of the gate, observability, estimated sensor errors.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.experiments.run.filter_diagnosis import what_to_try
from sinssim.experiments.run.filter_summary import for_people, sentences
from sinssim.formatting import number_text, signed
from sinssim.recording import style
from sinssim.recording.report import page, svg_plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.svg_plot import Line, Mark
from sinssim.recording.stream_tables import Computed
from sinssim.recording.style import RowNumbers, thinned
from sinssim.units import ANGLE_SCALE, LENGTH_SCALE, SPEED_SCALE, Scale, suiting

if TYPE_CHECKING:
    from sinssim.estimation import Innovations
    from sinssim.recording.rerun.rrd import Recording
    from sinssim.simulation.truth_comparison import Aided


EDGE = 6.0
"""Innovations beyond this many σ are drawn at the limit, so that the plot stays readable."""
SETTLED = 0.05
"""Fraction of a run after which the axes are fitted, because the initial errors are much larger than the later ones."""

NAVIGATION: tuple[tuple[str, Scale, tuple[str, str, str], float], ...] = (
    ("position", LENGTH_SCALE, ("position_north", "position_east", "height"), -1.0),
    ("velocity", SPEED_SCALE, ("velocity_north", "velocity_east", "velocity_down"), 1.0),
    ("attitude", ANGLE_SCALE, ("tilt_north", "tilt_east", "azimuth"), 1.0),
)
"""The blocks of navigation: scale, names of the components, and sign of the third (down to up)."""


def settled(kind: str, time: Array, span: tuple[float, float]) -> slice:
    """Return the rows of a solution after the filter has settled, to which the axes are fitted.

    Args:
        kind: name of the solution; the backward one begins at the end of the run.
        time: (K,) s.
        span: first and last instant of the run, s.
    """
    least = SETTLED * (span[1] - span[0])
    if kind == "backward":
        return slice(0, int(np.searchsorted(time, span[1] - least, side="right")))
    return slice(int(np.searchsorted(time, span[0] + least)), None)


STYLE = """
.three { display: grid; grid-template-columns: repeat(3, minmax(0, 1fr)); gap: 1.2rem 1.4rem; align-items: start; }
@media screen and (max-width: 820px) { .three { grid-template-columns: minmax(0, 1fr); } }
"""

_TESTS = {
    "NIS": "NIS",
    "whiteness": "whiteness",
    "slow part, 16 readings": "sums of 16",
    "slow part, 64 readings": "of 64",
    "slow part, 256 readings": "of 256",
}
"""The tests of the innovations, and their column heads."""

_ERRORS = (
    "final_horizontal_error_m", "rms_horizontal_error_m", "max_horizontal_error_m", "max_height_error_m",
    "max_velocity_error_mps", "final_attitude_error_arcsec",
)  # fmt: skip
"""Errors of a solution: heads, and keys in the summary."""

_WIDTH, _HEIGHT = 376, 150
"""Width of one of three drawings side by side, px."""

_DOTS = 1500
"""Approximate maximum number of dots of one kind in a drawing."""

_TITLES = {
    "position_north": "North position error",
    "position_east": "East position error",
    "height": "Height error",
    "velocity_north": "North velocity error",
    "velocity_east": "East velocity error",
    "velocity_down": "Down velocity error",
    "tilt_north": "Tilt about north, φN",
    "tilt_east": "Tilt about east, φE",
    "azimuth": "Azimuth misalignment, φD",
}


def filter_section(aided: Aided, summary: Mapping[str, Any], span: tuple[float, float]) -> Iterator[str]:
    """Yield the report's section on the filter.

    Args:
        summary: contents of `summary.json`.
        span: beginning and end of the run, s.
    """
    numbers = summary["filter"]
    first, *others = sentences({**numbers, "diagnosis": {}})  # it has a section of its own
    broken = ' class="broken"' if numbers["divergence"] is not None else ""
    yield f"<p{broken}><strong>{words(first)}</strong></p>" + "".join(f"<p>{words(other)}</p>" for other in others)
    yield _solutions(summary)
    marks = [*outage_marks(aided), *fault_marks(numbers, span[1])]
    yield f'<div class="three">{"".join(_bands(aided, span, marks))}</div>'
    yield from _tests(numbers)
    yield from what_to_try(numbers)
    yield f'<div class="three">{"".join(_innovation_plots(aided, span))}</div>'
    yield from _learned(numbers)


def _solutions(summary: Mapping[str, Any]) -> str:
    """Return a table of the errors of the aided and the inertial solutions."""
    own = {name: summary["filter"].get(name) for name in ("aided", "backward", "smoothed")}
    found = {**own, **{f"inertial, {name}": n for name, n in summary["algorithms"].items()}}
    heads = ("solution", "horizontal, final [m]", "rms", "max", "height, max [m]", "velocity, max [m/s]")
    colors = style.colors([name.removeprefix("inertial, ") for name in found])
    lines = []
    for (name, s), color in zip(found.items(), colors, strict=True):
        if s:
            values = [math.nan if s[key] is None else s[key] for key in _ERRORS]
            values[-1] /= 60.0
            lines.append((page.swatch(style.css(color)) + words(name), *map(number_text, values)))
    return table((*heads, "attitude, final [arcmin]"), lines)


def _tests(numbers: Mapping[str, Any]) -> Iterator[str]:
    """Yield the tests of the filter's innovations."""
    yield "<h3>Innovations</h3>"
    yield table(
        ("sensor", "verdict", "accepted", "rejected (expected)", *_TESTS.values()),
        [
            (
                words(name),
                f'<td class="name">{words(s["verdict"])}</td>',
                str(s["taken"]),
                f"{s['refused']} ({number_text(s['refused_expected'], 2)})",
                *(_test(s["tests"].get(test), "<br>") for test in _TESTS),
            )
            for name, s in numbers["sensors"].items()
        ],
    )
    yield (
        '<p class="note">Each test: the statistic divided by its degrees of freedom, which is 1 for a correct filter, '
        "and its 95 % band. "
        "NIS: normalised innovation squared. Whiteness: their autocorrelation over 20 lags. Sums over 16, 64 and 256 "
        "measurements reveal a slow drift that the noise of single measurements hides. Optimistic: the noise is "
        "larger than the filter assumes; pessimistic: it is smaller; outliers: single measurements have large errors, "
        "and the others have smaller errors than assumed; coloured: the innovations are not white. A correct filter "
        "fails any of the tests of the innovations and of its errors in at most 1 % of runs.</p>"
    )


def _learned(numbers: Mapping[str, Any]) -> Iterator[str]:
    """Yield the errors against their covariance, and the final uncertainty of every state."""
    recorded = bool(numbers.get("recorded"))
    if not recorded:
        yield from _against_truth(numbers)
    yield "<h3>Uncertainty of the states</h3>"
    last = "estimate" if recorded else "error"
    lines = []
    for column, s in numbers["states"].items():
        name, unit, values = for_people(column, s["sigma_start"], s["sigma_end"], s[f"{last}_end"])
        ratio = s["reduction"]
        less = "–"
        if ratio:
            less = f"{number_text(ratio)} ×" if ratio >= 0.9995 else f"{number_text(1.0 / ratio)} × larger"
        less = f"<strong>{less}</strong>" if s.get("observable") else less
        label = words(f"{name.replace('accelerometer', 'accel.')} [{unit}]")  # short: two tables share the page
        lines.append((label, *(signed(v) if v == v else "–" for v in values), less))
    heads = ("state", "σ, start", "σ, end", f"{last}, end", "σ reduced by")
    half = (len(lines) + 1) // 2
    yield f'<div class="pair">{table(heads, lines[:half])}{table(heads, lines[half:])}</div>'
    yield (
        '<p class="note">σ reduced by: ratio of σ at the start to σ at the end; bold if the state is observable. A '
        "state is observable if, without process noise, a deviation by the initial σ would change the measurements by "
        "ten times their noise, and if the filter at least halved σ.</p>"
    )


def _against_truth(numbers: Mapping[str, Any]) -> Iterator[str]:
    """Yield the errors against their covariance."""
    yield "<h3>Errors against their covariance</h3>"
    nees = table(
        ("states", "number", "NEES per state"),
        [(words(name), str(s["states"]), _test(s)) for name, s in numbers["nees"].items()],
    )
    noise = table(("noise", "variance / assumed variance"), [(words(n), _test(s)) for n, s in numbers["noise"].items()])
    yield (
        f'<div class="pair">{nees}<div>{noise}<p class="note">NEES: normalised estimation error squared, '
        "mean over the run, with the band that contains 95 % of the runs of a correct filter; the band accounts for "
        "the slow change of the errors within a run."
        " Noise: random increments of attitude, velocity and instability between epochs. Both tests need the truth; "
        "the second detects wrongly assumed noise even if the measurement noise hides it.</p></div></div>"
    )


def _test(test: Mapping[str, float] | None, between: str = " ") -> str:
    if test is None:
        return "–"
    bad = not test["lower_95"] <= test["value"] <= test["upper_95"]
    value = f"<strong>{number_text(test['value'])}</strong>" if bad else number_text(test["value"])
    return f"{value}{between}({number_text(test['lower_95'])} … {number_text(test['upper_95'])})"


def _bands(aided: Aided, span: tuple[float, float], marks: Sequence[Mark]) -> Iterator[str]:
    """Draw every error of navigation with its expected band."""
    estimate = aided.estimate
    k = thinned(len(estimate.time))
    for name, scale, components, sign in NAVIGATION:
        at, own = estimate.model.slices[name], aided.block_error(name, k)
        for i, component in enumerate(components):
            side, column = (sign if i == 2 else 1.0), at.start + i
            kinds: list[tuple[str, Array, Array, Array]] = [
                ("aided", estimate.time[k], own[:, i], estimate.sigma[k, column])
            ]
            if estimate.smoothed is not None and aided.smoothed_state_errors is not None:
                s, j = estimate.smoothed, thinned(len(estimate.smoothed.time))
                kinds.append(("smoothed", s.time[j], aided.smoothed_state_errors[j, column], s.sigma[j, column]))
            if estimate.backward is not None and aided.backward_state_errors is not None:
                back, j = estimate.backward, thinned(len(estimate.backward.time))
                kinds.append(("backward", back.time[j], aided.backward_state_errors[j, column], back.sigma[j, column]))
            fitted = [settled(name, t, span) for name, t, _, _ in kinds]
            unit, size = suiting(scale, *[3.0 * k[3][rows] for k, rows in zip(kinds, fitted, strict=True)])
            lines = []
            for (kind, time, error, sigma), rows in zip(kinds, fitted, strict=True):
                color = style.css(style.COLORS[kind])
                pale = style.css(style.COLORS["bound"] if kind == "aided" else style.tint(style.COLORS[kind]))
                for label, values, paint, width in (
                    ("±3σ" if len(kinds) == 1 else f"±3σ, {kind}", 3.0 * sigma, pale, 1.0),
                    ("", -3.0 * sigma, pale, 1.0),
                    (kind, side * error, color, 1.4),
                ):
                    # the axis fits the errors after the filter has settled
                    for part in (slice(0, rows.start), slice(rows.stop, None) if rows.stop else slice(0, 0)):
                        lines.append(Line("", time[part], values[part], paint, width, "", size, reference=True))
                    lines.append(Line(label, time[rows], values[rows], paint, width, "", size))
            yield svg_plot.plot(_TITLES[component], unit, lines, span, marks=marks, width=_WIDTH, height=_HEIGHT)


def outage_marks(aided: Aided) -> list[Mark]:
    """Return marks at the beginning and the end of every long gap in the readings of a sensor.

    Args:
        aided: the aided solution with the readings of its sensors.

    Returns:
        Marks in order of time; a long gap is at least ten intervals and a fiftieth of the run.
    """
    marks = []
    for sensor in aided.sensed:
        time, every = sensor.measurements.time, sensor.time
        if len(time) < 2 or len(every) < 2:
            continue
        gaps = np.diff(time)
        least = max(10.0 * float(every[1] - every[0]), 0.02 * float(every[-1] - every[0]))
        for k in np.flatnonzero(gaps > least):
            label = sensor.measurements.label.partition("-")[0].replace("gnss", "GNSS")
            marks += [(float(time[k]), f"no {label}"), (float(time[k + 1]), f"{label} again")]
    return [Mark(time, text) for time, text in sorted(set(marks))]


def fault_marks(numbers: Mapping[str, Any], end: float) -> list[Mark]:
    """Return marks at the beginning and the end of every jump and ramp of the satellites.

    Args:
        numbers: the summary's entry on the filter.
        end: end of the run, s.
    """
    marks = []
    for fault in numbers["faults"]:
        marks.append(Mark(fault["from_s"], fault["kind"]))
        if fault["to_s"] < end - 1.0:
            marks.append(Mark(fault["to_s"], f"{fault['kind']} ends"))
    return marks


def _innovation_plots(aided: Aided, span: tuple[float, float]) -> Iterator[str]:
    """Draw each sensor's innovations in units of their σ, rejected ones in red."""
    ends = np.array(span)
    grey = style.css(style.COLORS["bound"])
    for sensor in aided.estimate.innovations:
        looked = np.isfinite(sensor.nis)
        if not looked.any():
            continue
        size = sensor.value.shape[1]
        lines = [Line("±3σ", ends, np.full(2, 3.0), grey, 1.0), Line("", ends, np.full(2, -3.0), grey, 1.0)]
        for name, which, kind, dots in (
            ("accepted", looked & sensor.accepted, "aided", 1.6),
            ("rejected", looked & ~sensor.accepted, "refused", 2.6),
        ):
            rows = np.flatnonzero(which)
            rows = rows[:: max(1, len(rows) * size // _DOTS)]
            if len(rows):
                values = np.clip((sensor.value[rows] / sensor.sigma_at(rows)).ravel(), -EDGE, EDGE)
                time = np.repeat(sensor.time[rows], size)
                lines.append(Line(name, time, values, style.css(style.COLORS[kind]), dots=dots))
        yield svg_plot.plot(
            f"{sensor.sensor} innovations", "σ", lines, span, axis=(-EDGE, EDGE, 2.0), width=_WIDTH, height=_HEIGHT
        )


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
    _record_innovations(recording, [i for i in estimate.innovations if len(i.time)])
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


def _parameters(recording: Recording, aided: Aided, rows: RowNumbers) -> None:
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


def _shrinking(recording: Recording, aided: Aided, rows: RowNumbers) -> None:
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


def _record_innovations(recording: Recording, sensors: Sequence[Innovations]) -> None:
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
