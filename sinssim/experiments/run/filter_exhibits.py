"""What a filter has to show."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.charts import PAIR, Axis, Chart, Charts, Color, Dots, Line, Mark, Rule, over
from sinssim.data import Array, Computed
from sinssim.estimation import Innovations
from sinssim.estimation.state_model import FLICKER
from sinssim.exhibits import Beside, Column, Item, Section, Sentence, Table
from sinssim.experiments.run.filter_remedies import what_to_try
from sinssim.experiments.run.filter_summary import detected, for_people, sentences, together
from sinssim.experiments.run.summary_types import ErrorNumbers, FilterNumbers, StateNumbers, Test
from sinssim.recording import style
from sinssim.recording.style import thinned
from sinssim.recording.track_map import Spread
from sinssim.units import ANGLE_SCALE, LENGTH_SCALE, SPEED_SCALE, Scale, fixed, number_text, signed, suiting

if TYPE_CHECKING:
    from sinssim.simulation.truth_comparison import Aided


EDGE = 6.0
"""Innovations beyond this many σ are drawn at the limit, so that the plot stays readable."""
SETTLED = 0.05
"""Fraction of a run after which the axes are fitted, because the initial errors are much larger than the later ones."""
THREE = (PAIR[0], 2.57)
"""Size of three charts side by side, inches."""

NAVIGATION: tuple[tuple[str, Scale, tuple[tuple[str, str], ...], float], ...] = (
    ("position", LENGTH_SCALE, (("position_north", "North position error"), ("position_east", "East position error"),
                                ("height", "Height error")), -1.0),
    ("velocity", SPEED_SCALE, (("velocity_north", "North velocity error"), ("velocity_east", "East velocity error"),
                               ("velocity_down", "Down velocity error")), 1.0),
    ("attitude", ANGLE_SCALE, (("tilt_north", "Tilt about north, φN"), ("tilt_east", "Tilt about east, φE"),
                               ("azimuth", "Azimuth misalignment, φD")), 1.0),
)  # fmt: skip
"""The blocks of navigation: scale, keys and titles of the components, and sign of the third (down to up)."""

_TESTS = {
    "NIS": "NIS",
    "whiteness": "whiteness",
    "slow part, 16 readings": "sums of 16",
    "slow part, 64 readings": "of 64",
    "slow part, 256 readings": "of 256",
}
"""The tests of the innovations, and their column heads."""

_ERRORS: tuple[tuple[str, str, str, float], ...] = (
    ("horizontal, final", "m", "final_horizontal_error_m", 1.0), ("rms", "", "rms_horizontal_error_m", 1.0),
    ("max", "", "max_horizontal_error_m", 1.0), ("height, max", "m", "max_height_error_m", 1.0),
    ("velocity, max", "m/s", "max_velocity_error_mps", 1.0),
    ("attitude, final", "arcmin", "final_attitude_error_arcsec", 60.0),
)  # fmt: skip
"""Errors of a solution: heads, units, keys in the summary, and size of the unit in that of the key."""

_TEST_NOTE = (
    "Each test: the statistic divided by its degrees of freedom, which is 1 for a correct filter, and its 95 % band. "
    "NIS: normalised innovation squared. Whiteness: their autocorrelation over 20 lags. Sums over 16, 64 and 256 "
    "measurements reveal a slow drift that the noise of single measurements hides. Optimistic: the noise is larger "
    "than the filter assumes; pessimistic: it is smaller; outliers: single measurements have large errors, and the "
    "others have smaller errors than assumed; coloured: the innovations are not white. A correct filter fails any of "
    "the tests of the innovations and of its errors in at most 1 % of runs."
)
_NEES_NOTE = (
    "NEES: normalised estimation error squared, mean over the run, with the band that contains 95 % of the runs of a "
    "correct filter; the band accounts for the slow change of the errors within a run. Noise: random increments of "
    "attitude, velocity and instability between epochs. Both tests need the truth; the second detects wrongly assumed "
    "noise even if the measurement noise hides it."
)


def filter_exhibits(
    aided: Aided, numbers: FilterNumbers, algorithms: Mapping[str, ErrorNumbers], span: tuple[float, float]
) -> Iterator[Item]:
    """Yield what a filter has to show, beside the errors of the inertial solutions, over the span of the run, s."""
    first, *others = sentences(numbers, diagnosed=False)  # the diagnosis has a section of its own
    yield Sentence(f"**{first}**", "" if numbers["divergence"] is None else "warning")
    yield from map(Sentence, others)
    yield _solutions(numbers, algorithms)
    faults = fault_marks(numbers, span)
    rows = band_charts(aided, span, [*outage_marks(aided), *faults])
    yield Charts("filter_bands", rows, (PAIR[0], len(rows) * THREE[1]))
    yield Section("Innovations", [_tests(numbers)])
    if "diagnosis" in numbers:
        yield Section("What to try", list(what_to_try(numbers["diagnosis"])))
    yield from innovation_charts(aided.estimate.innovations, span, faults)
    if not numbers.get("recorded"):
        yield Section("Errors against their covariance", list(_against_truth(numbers)))
    yield Section("Uncertainty of the states", list(_uncertainty(numbers)))
    yield from state_charts(aided, span)
    yield from (Sentence(f"- {finding}", on=("recording",)) for finding in numbers["findings"])


def _solutions(numbers: FilterNumbers, algorithms: Mapping[str, ErrorNumbers]) -> Table:
    """Return the errors of the aided and the inertial solutions."""
    filtered = {"aided": numbers["aided"], "backward": numbers.get("backward"), "smoothed": numbers.get("smoothed")}
    rows = [(name, name, errors) for name, errors in filtered.items() if errors]
    rows += [(f"inertial, {name}", name, errors) for name, errors in algorithms.items() if errors]
    heads = tuple(Column(head, fixed(unit) if unit else None) for head, unit, *_ in _ERRORS)
    cells = [
        (name, *(number_text(math.nan if (v := errors[key]) is None else v / size) for *_, key, size in _ERRORS))
        for name, _, errors in rows
    ]
    paint = style.colors([name for _, name, _ in rows])
    return Table((Column("solution", words=True), *heads), cells, on=("page",), colors=paint)


def _tests(numbers: FilterNumbers) -> Table:
    """Return the tests of the filter's innovations."""
    heads = (Column("sensor", words=True), Column("verdict", words=True), Column("accepted"),
             Column("rejected (expected)"), *(Column(head) for head in _TESTS.values()))  # fmt: skip
    rows = [
        (
            name, s["verdict"], str(s["taken"]), f"{s['refused']} ({number_text(s['refused_expected'], 2)})",
            *(_test(s["tests"].get(test), "\n") for test in _TESTS),
        )
        for name, s in numbers["sensors"].items()
    ]  # fmt: skip
    return Table(heads, rows, note=_TEST_NOTE, on=("page", "recording"))


def _against_truth(numbers: FilterNumbers) -> Iterator[Item]:
    """Yield the errors against their covariance."""
    states = [(name, str(test["states"]), _test(test)) for name, test in numbers["nees"].items()]
    noise = [(name, _test(test)) for name, test in numbers["noise"].items()]
    yield Beside([
        Table((Column("states", words=True), Column("number"), Column("NEES per state")), states),
        Table((Column("noise", words=True), Column("variance / assumed variance")), noise, note=_NEES_NOTE),
    ], on=("page", "recording"))  # fmt: skip


def _test(test: Test | None, between: str = " ") -> str:
    if test is None:
        return "–"
    value = number_text(test["value"])
    bold = value if test["lower_95"] <= test["value"] <= test["upper_95"] else f"**{value}**"
    return f"{bold}{between}({number_text(test['lower_95'])} … {number_text(test['upper_95'])})"


def _uncertainty(numbers: FilterNumbers) -> Iterator[Item]:
    """Yield the final uncertainty of every state, in two tables beside each other."""
    recorded = bool(numbers.get("recorded"))
    heads = (Column("state", words=True), Column("σ, start"), Column("σ, end"),
             Column(f"{'estimate' if recorded else 'error'}, end"), Column("σ reduced by"))  # fmt: skip
    rows = [_state(column, state, recorded) for column, state in numbers["states"].items()]
    half = (len(rows) + 1) // 2
    yield Beside([Table(heads, rows[:half]), Table(heads, rows[half:])], on=("page",))
    yield Table(heads, rows, on=("recording",))
    yield Sentence(
        "σ reduced by: ratio of σ at the start to σ at the end; bold if the state is observable. A state is observable "
        "if, without process noise, a deviation by the initial σ would change the measurements by ten times their "
        "noise, and if the filter at least halved σ.", "note", on=("page",),
    )  # fmt: skip


def _state(column: str, state: StateNumbers, recorded: bool) -> tuple[str, ...]:
    last = state["estimate_end"] if recorded else state["error_end"]
    name, unit, values = for_people(column, state["sigma_start"], state["sigma_end"], last)
    ratio, less = state["reduction"], "–"
    if ratio:
        less = f"{number_text(ratio)} ×" if ratio >= 0.9995 else f"{number_text(1.0 / ratio)} × larger"
    label = f"{name.replace('accelerometer', 'accel.')} [{unit}]"  # short: two tables share the page
    cells = (signed(v) if math.isfinite(v) else "–" for v in values)
    return label, *cells, f"**{less}**" if state.get("observable") else less


@dataclass(frozen=True, eq=False)
class _Errors:
    """The errors of a solution of the filter in its states, (K, n), with their 1σ, and the rows that the axes fit."""

    name: str
    time: Array
    error: Array
    sigma: Array
    fitted: slice


_ELLIPSES = 240
"""Most instants of which a map has the ellipse."""


def spread_of(aided: Aided) -> Spread | None:
    """Return the horizontal covariance that the filter states, for a map; None if its history was not kept."""
    history = aided.estimate.history
    if history is None:
        return None
    rows, first = thinned(len(history.time), _ELLIPSES), aided.estimate.model.slices["position"].start
    part = slice(first, first + 2)
    return Spread("aided", history.time[rows], history.covariance[rows][:, part, part])


def settled(kind: str, time: Array, span: tuple[float, float]) -> slice:
    """Return the rows of a solution, at (K,) s, after it has settled; the backward one begins at the end of the run."""
    least = SETTLED * (span[1] - span[0])
    if kind == "backward":
        return slice(0, int(np.searchsorted(time, span[1] - least, side="right")))
    return slice(int(np.searchsorted(time, span[0] + least)), None)


def _errors(aided: Aided, span: tuple[float, float]) -> Iterator[_Errors]:
    estimate = aided.estimate
    k = thinned(len(estimate.time))
    further = (("smoothed", estimate.smoothed, aided.smoothed_state_errors),
               ("backward", estimate.backward, aided.backward_state_errors))  # fmt: skip
    time = estimate.time[k]
    yield _Errors("aided", time, aided.state_errors_at(k), estimate.sigma[k], settled("aided", time, span))
    for name, solution, errors in further:
        if solution is not None and errors is not None:
            j = thinned(len(solution.time))
            time = solution.time[j]
            yield _Errors(name, time, errors[j], solution.sigma[j], settled(name, time, span))


def band_charts(aided: Aided, span: tuple[float, float], marks: Sequence[Rule]) -> tuple[tuple[Chart, ...], ...]:
    """Return every error of navigation with its expected band; the axes fit the errors after the filter has settled."""
    solutions = list(_errors(aided, span))
    rows = []
    for block, scale, components, sign in NAVIGATION:
        charts, start = [], aided.estimate.model.slices[block].start
        for i, (key, title) in enumerate(components):
            side, column = (sign if i == 2 else 1.0), start + i
            lines, within, bounds = list[Line](), list[Array](), list[Array]()
            for s in solutions:
                pale: Color = "bound" if s.name == "aided" else style.tint(style.COLORS[s.name])
                label, bound = "±3σ" if len(solutions) == 1 else f"±3σ, {s.name}", 3.0 * s.sigma[:, column]
                error = side * s.error[:, column]
                lines += [
                    Line(label=label, x=s.time, y=bound, color=pale, weight="thin"),
                    Line(x=s.time, y=-bound, color=pale, weight="thin"),
                    Line(label=s.name, x=s.time, y=error, color=s.name),
                ]
                bounds.append(bound[s.fitted])
                within += [bounds[-1], np.abs(error[s.fitted])]
            unit = suiting(scale, *bounds)
            largest = 1.05 * max((float(v[np.isfinite(v)].max(initial=0.0)) for v in within), default=0.0) or unit[1]
            y = Axis(units=fixed(*unit), low=-largest, high=largest)
            charts.append(Chart(key=f"filter/{key}", title=title, x=over(span), y=y, marks=(*marks, *lines)))
        rows.append(tuple(charts))
    return tuple(rows)


def outage_marks(aided: Aided) -> list[Rule]:
    """Return marks at the ends of gaps in the readings of ten intervals and a fiftieth of the run or more."""
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
    return [mark_at(time, text) for time, text in sorted(set(marks))]


def mark_at(time: float, text: str) -> Rule:
    """Return a dotted line at an instant of a plot over time."""
    return Rule(at=time, upright=True, text=text, dash=":")


def fault_marks(numbers: FilterNumbers, span: tuple[float, float]) -> list[Rule]:
    """Return marks at the ends of every jump and ramp of the satellites in a run over a span, s, and where the filter
    detects them."""
    marks = [(d["time_s"], detected(d).word) for d in numbers["detections"]]
    for fault in numbers["faults"]:
        marks.append((fault["from_s"], fault["kind"]))
        if fault["to_s"] < span[1] - 1.0:
            marks.append((fault["to_s"], f"{fault['kind']} ends"))
    return marks_of(marks, span)


def marks_of(moments: Iterable[tuple[float, str]], span: tuple[float, float]) -> list[Rule]:
    """Return marks at instants with their words in plots over a span, s."""
    return [mark_at(time, text) for time, text in together(moments, span)]


_FREEDOM = 60
"""Degrees of freedom of each mean of the normalised innovations squared, or a multiple of it."""


def innovation_charts(
    sensors: Sequence[Innovations], span: tuple[float, float], faults: Sequence[Rule] = ()
) -> Iterator[Charts]:
    """Yield innovations in units of their σ, and for the recording the decisions of the gate and means of squares."""
    from scipy.stats import chi2

    sensors = [sensor for sensor in sensors if np.isfinite(sensor.nis).any()]
    if not sensors:
        return
    paint, x = style.colors([sensor.sensor for sensor in sensors]), over(span)
    sigmas = Axis(units=fixed("σ"), low=-EDGE, high=EDGE, ticks=tuple(np.arange(-EDGE, EDGE + 1.0, 2.0)))
    bounds = (Rule(at=3.0, label="±3σ", color="bound"), Rule(at=-3.0, color="bound"))
    charts, decisions, squares = list[Chart](), list[Dots](), list[Mark]()
    for lane, (sensor, color) in enumerate(zip(sensors, paint, strict=True)):
        dots: list[Dots] = []
        for label, rows, paint_, size in _decided(sensor, color):
            time, *ratios = _over_sigma(sensor, rows)
            for i, ratio in enumerate(ratios):
                dots.append(Dots(label="" if i else label, x=time, y=ratio, color=paint_, size=size))
            name, place = sensor.sensor if label == "accepted" else label, np.broadcast_to(float(lane), len(rows))
            decisions.append(Dots(label=name, x=time, y=place, color=paint_, size=size))
        title = f"{sensor.sensor} innovations"
        marks: tuple[Mark, ...] = (*bounds, *faults, *dots)
        charts.append(Chart(key=f"filter/innovations/{sensor.sensor}", title=title, x=x, y=sigmas, marks=marks))
        squares += _squares(sensor, color)
    shown = tuple(tuple(charts[k : k + 3]) for k in range(0, len(charts), 3))
    yield Charts("innovations", shown, (PAIR[0], len(shown) * THREE[1]), widths=(1.0, 1.0, 1.0))
    names = Axis(names=tuple(sensor.sensor for sensor in sensors))
    low, high = (float(chi2.ppf(p, _FREEDOM)) / _FREEDOM for p in (0.025, 0.975))
    band = tuple(Rule(at=at, label="95 % band", color="bound") for at in (high, low))
    of_gate = Chart(
        key="filter/decisions", title="Measurements accepted, rejected", x=x, y=names, marks=tuple(decisions)
    )
    means = Chart(key="filter/squares", title="Mean NIS, per component", x=x, y=Axis(low=0.0), marks=(*band, *squares))
    yield Charts("gate", ((of_gate, means),), PAIR, on=("recording",))


def _over_sigma(sensor: Innovations, rows: NDArray[np.int32]) -> Iterator[Computed]:
    """Yield the times of some innovations, and each component in units of its σ, which are computed when drawn."""
    count = len(rows)

    def ratio(component: int, part: slice) -> Array:
        some = rows[part]
        over: Array = sensor.value[some, component] / sensor.sigma_at(some)[:, component]
        return over.clip(-EDGE, EDGE)

    yield Computed(count, lambda part: sensor.time[rows[part]])
    yield from (Computed(count, partial(ratio, i)) for i in range(sensor.value.shape[1]))


def _decided(sensor: Innovations, color: Color) -> Iterator[tuple[str, NDArray[np.int32], Color, float]]:
    """Yield the accepted and the rejected innovations: name, rows, colour and size of their dots."""
    known = np.isfinite(sensor.nis)
    for name, which, paint, size in (
        ("accepted", sensor.accepted, color, 1.2),
        ("rejected", ~sensor.accepted, "refused", 2.6),
    ):
        rows = np.flatnonzero(known & which).astype(np.int32)  # a day has millions
        if len(rows):
            yield name, rows, paint, size


def _squares(sensor: Innovations, color: Color) -> Iterator[Line]:
    """Yield means of the normalised innovations squared over `_FREEDOM` degrees of freedom; 1 is expected."""
    known = np.isfinite(sensor.nis)
    nis, time, size = sensor.nis[known], sensor.time[known], sensor.value.shape[1]
    each = max(1, _FREEDOM // size)
    count = len(nis) // each
    if count < 2:
        return
    mean = nis[: count * each].reshape(count, each).mean(axis=1) / size
    middle = time[: count * each].reshape(count, each).mean(axis=1)
    apart = np.diff(middle)
    mean[:-1][apart > 3.0 * np.median(apart)] = np.nan  # no line across an outage
    if not np.isnan(mean).all():
        yield Line(label=sensor.sensor, x=middle, y=np.minimum(mean, 5.0), color=color)


_AXES = {"forward": "x", "right": "y", "down": "z"}


def state_charts(aided: Aided, span: tuple[float, float]) -> Iterator[Charts]:
    """Yield the errors of the sensors' parameters in units of their σ, and the reduction of every block's σ.

    Of recorded sensors, whose errors are not known, the estimates in units of σ at the start.
    """
    estimate, x = aided.estimate, over(span)
    rows = thinned(len(estimate.time))
    what = "errors" if aided.true_parameters_known else "estimates, σ at the start"
    bounds = (Rule(at=3.0, label="±3σ", color="bound"), Rule(at=-3.0, color="bound"))
    charts = []
    for sensor, title in (("gyro", "Gyros"), ("accelerometer", "Accelerometers")):
        blocks = [block.name for block in estimate.model.blocks if block.name.startswith(f"{sensor} ")]
        blocks = [name for name in blocks if f" {FLICKER} " not in name]  # its processes have no true values
        lines = [line for name in blocks for line in _parameters(aided, name, rows)]
        if lines:
            y = Axis(units=fixed("σ"))
            charts.append(Chart(key=f"filter/{sensor}", title=f"{title}: {what}", x=x, y=y, marks=(*bounds, *lines)))
    known = [b.name for b in estimate.model.blocks if np.any(estimate.sigma[0, estimate.model.slices[b.name]] > 0.0)]
    shrinking = []
    for name, color in zip(known, style.colors(known), strict=True):
        at = estimate.model.slices[name]
        some = at.start + np.flatnonzero(estimate.sigma[0, at] > 0.0)
        # the worst-known state of the block
        worst = (estimate.sigma[np.ix_(rows, some)] / estimate.sigma[0, some]).max(axis=1)
        shrinking.append(Line(label=name, x=estimate.time[rows], y=worst, color=color))
    if shrinking:
        title = "Largest σ of each block, relative to its start"
        charts.append(Chart(key="filter/shrinking", title=title, x=x, y=Axis(log=True), marks=tuple(shrinking)))
    if charts:
        yield Charts("states", (tuple(charts),), PAIR, on=("recording",))


def _parameters(aided: Aided, name: str, rows: style.RowNumbers) -> Iterator[Line]:
    estimate = aided.estimate
    at = estimate.model.slices[name]
    known = np.flatnonzero(estimate.sigma[0, at] > 0.0)
    if not len(known):
        return
    if aided.true_parameters_known:
        ratio = aided.block_error(name, rows)[:, known] / estimate.sigma[np.ix_(rows, at.start + known)]
    else:
        ratio = estimate.parameters[name][rows][:, known] / estimate.sigma[0, at.start + known]
    block = next(block for block in estimate.model.blocks if block.name == name)
    for k, i in enumerate(known):
        axis = block.states[i].rsplit(" ", 1)[1]
        yield Line(label=block.states[i], x=estimate.time[rows], y=ratio[:, k], color=_AXES.get(axis, axis[0]),
                   weight="thin")  # fmt: skip
