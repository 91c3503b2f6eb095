"""The errors of a run's solutions: tables, plots, singular attitudes, verdicts on requirements."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from sinssim import units
from sinssim.charts import PAIR, WIDE, Axis, Chart, Charts, Dash, Line, Rule, over
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.earth.geodetic_coordinates import radii
from sinssim.earth.gravity import gravity_ned
from sinssim.errors import InputError, RunError
from sinssim.exhibits import EVERYWHERE, Column, Item, Sentence, Table
from sinssim.experiments.run.summary_types import (
    ErrorNumbers,
    FailureNumbers,
    LogNumbers,
    PassageNumbers,
    RequirementNumbers,
)
from sinssim.recording import style
from sinssim.recording.result import plain
from sinssim.scenario import Scenario
from sinssim.simulation.total_system_error import misses, path_column, path_values, pieces_of
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.statistics.requirements import BY_PATH, CIRCLES, COMPONENTS, MISS, Requirement, Verdict, first_exceeded
from sinssim.strapdown.navigation_error import NavError, known_error_numbers_of
from sinssim.units import (
    ANGLE_SCALE,
    HEIGHT_SCALE,
    LENGTH_SCALE,
    SPEED_SCALE,
    Scale,
    capital,
    fixed,
    number_text,
    suiting,
)

if TYPE_CHECKING:
    from sinssim.experiments.run.run_result import Reached, Run
    from sinssim.simulation.truth_comparison import Aided


_KINDS = ("final", "rms", "max")
_ON_CONSOLE = {*((kind, "horizontal") for kind in _KINDS), ("max", "height"), ("max", "velocity"), ("max", "attitude")}
"""Columns that the console shows."""
_MOST_MARKS, _MARKS_WITH_HALF = 12, 5
"""Largest number of marks at multiples of Schuler's period, and of periods in a run that has one at the half, too."""
_COLUMNS: tuple[tuple[str, str, Scale, float], ...] = (
    ("horizontal", "horizontal_error_m", LENGTH_SCALE, 1.0),
    ("height", "height_error_m", HEIGHT_SCALE, 1.0),
    ("velocity", "velocity_error_mps", SPEED_SCALE, 1.0),
    ("attitude", "attitude_error_arcsec", ANGLE_SCALE, units.ARCSEC),
)
"""Title, name in `summary.json` after "final_", "rms_", "max_", units, and the size of the summary's unit in SI."""


@dataclass(frozen=True)
class Compared:
    """Errors of solutions that belong to no run in memory, in the form in which those of a run are drawn."""

    time: Array  # first and last time, (2,) s
    errors: Mapping[str, NavError]  # by algorithm
    axes: str  # axes of the errors


def failure_exhibits(failures: Mapping[str, FailureNumbers]) -> Iterator[Item]:
    """Yield why algorithms have no result."""
    for name, why in failures.items():
        yield Sentence(f"{name} has no result: {why['text']}", on=("console",))
        yield Sentence(f"**{name} has no result.** {capital(why['text'])}", "warning", on=("page", "recording"))


def error_table(numbers: Mapping[str, ErrorNumbers], title: str = "", head: str = "algorithm") -> Table:
    """Return the errors of solutions, as in `summary.json`; the console shows some of the columns."""
    columns = [Column(head, words=True)]
    columns += [
        Column(kind, scale, on=EVERYWHERE if (kind, name) in _ON_CONSOLE else ("page", "recording"), group=name)
        for name, _, scale, _ in _COLUMNS for kind in _KINDS
    ]  # fmt: skip
    rows: list[list[str | float]] = [
        [name, *(_si(errors[f"{kind}_{key}"], size) for _, key, _, size in _COLUMNS for kind in _KINDS)]
        for name, errors in numbers.items()
    ]
    return Table(tuple(columns), rows, title=title, colors=style.colors(list(numbers)))


def _si(value: float | None, size: float) -> float:
    return math.nan if value is None else value * size


def known_numbers(error: NavError, span: tuple[float, float]) -> ErrorNumbers:
    """Return the statistics of the errors that are known within a span, s; None for quantities that never are."""
    rows = (error.time >= span[0] - 1e-6) & (error.time <= span[1] + 1e-6)
    numbers: ErrorNumbers = plain(known_error_numbers_of(lambda: [error.rows(np.flatnonzero(rows))]))
    return numbers


def note_on_errors(
    against: str = "truth",
    where: str = "summary.json; all samples: sinssim.load_streams, or sinssim export --to parquet",
) -> Sentence:
    """Return what the table of errors contains, and which files have all digits."""
    return Sentence(
        f"Solution minus {against}, in the local level of the latter. The final height error has a sign (positive: too "
        "high); all others are magnitudes. Attitude is the angle of the single rotation between computed and true "
        f"attitude. Full precision: {where}.", "note", on=("page",),
    )  # fmt: skip


class WithErrors(Protocol):
    """A run, or what has the errors of its solutions.

    Attributes:
        time: from the beginning to the end of the run, s.
        axes: axes of the errors, one of `sinssim.strapdown.frames.AXES`.
        errors: by algorithm; a kind of errors that is NaN throughout is not drawn.
    """

    @property
    def time(self) -> Array: ...
    @property
    def axes(self) -> str: ...
    @property
    def errors(self) -> Mapping[str, NavError]: ...


_DASHES: tuple[Dash, ...] = ("", "--", ":")
"""So that solutions with the same errors do not hide one another; more than three are all solid."""
_Plot = tuple[str, str, Scale, str, Callable[[NavError], Array]]
_HORIZONTAL: _Plot = ("horizontal", "Horizontal position error", LENGTH_SCALE, "horizontal", lambda e: e.horizontal)
_PLOTS: tuple[_Plot, ...] = (
    ("position_north", "North position error", LENGTH_SCALE, "horizontal", lambda e: e.position_ned[:, 0]),
    ("position_east", "East position error", LENGTH_SCALE, "horizontal", lambda e: e.position_ned[:, 1]),
    ("velocity_north", "North velocity error", SPEED_SCALE, "speed", lambda e: e.velocity_ned[:, 0]),
    ("velocity_east", "East velocity error", SPEED_SCALE, "speed", lambda e: e.velocity_ned[:, 1]),
    ("tilt_north", "Tilt about north, φN", ANGLE_SCALE, "tilt_east", lambda e: e.attitude[:, 0]),
    ("tilt_east", "Tilt about east, φE", ANGLE_SCALE, "tilt_north", lambda e: e.attitude[:, 1]),
    ("azimuth", "Azimuth misalignment, φD", ANGLE_SCALE, "azimuth", lambda e: e.attitude[:, 2]),
    ("height", "Height error (positive: too high)", HEIGHT_SCALE, "height", lambda e: e.height),
    ("speed", "Velocity error, magnitude", SPEED_SCALE, "speed", lambda e: e.speed),
    ("attitude", "Attitude error, angle", ANGLE_SCALE, "attitude", lambda e: e.angle),
)
"""The plots two by two: key, title, units, the plot whose unit it has, and the values."""
_DOWN: _Plot = ("velocity_down", "Down velocity error", SPEED_SCALE, "speed", lambda e: e.velocity_ned[:, 2])
"""Only in the recording."""
_MAGNITUDES = ("horizontal", "speed", "attitude")


def error_exhibits(run: WithErrors, period: float, *, apart: bool = True, magnitudes: bool = True) -> Iterator[Item]:
    """Yield the errors over time, with marks at multiples of Schuler's period, s; see `error_charts`."""
    span, marks = _schuler_marks(float(run.time[0]), float(run.time[-1]), period)
    yield from _explanation(period, span[1] - span[0])
    if run.axes == "transported":
        yield Sentence(_NEAR_A_POLE, "note")
    yield from error_charts(run, span, marks, apart=apart, magnitudes=magnitudes)


def error_charts(
    run: WithErrors, span: tuple[float, float], marks: Sequence[Rule] = (), *, apart: bool = True,
    magnitudes: bool = True,
) -> Iterator[Charts]:  # fmt: skip
    """Yield the errors over a span, s; `apart`, with the distance of the solutions from the first one; without
    `magnitudes`, only the components."""
    dashes = dict(zip(run.errors, _DASHES, strict=False)) if len(run.errors) <= len(_DASHES) else {}
    paint = _paint(run.errors)
    lines: dict[str, tuple[Line, ...]] = {}
    for key, *_, of in (_HORIZONTAL, *_PLOTS, _DOWN):
        values = ((name, error, of(error)) for name, error in run.errors.items())
        lines[key] = tuple(
            Line(label=name, x=error.time, y=rows, color=paint[name], dash=dashes.get(name, ""))
            for name, error, rows in values if not np.isnan(rows[0]) or not np.isnan(rows).all()
        )  # fmt: skip

    def chart(key: str, title: str, units: Scale, like: str, _: object = None) -> Chart:
        same = (like,) if like in _MAGNITUDES else (like, key)
        unit = suiting(units, *(line.upright for plot in same for line in lines[plot]))
        mile = [_mile_an_hour(span)] if key == "horizontal" and unit[0] != "mm" else []
        y = Axis(units=fixed(*unit), low=0.0 if key in _MAGNITUDES else None)
        return Chart(key=f"navigation/{key}", title=title, x=over(span), y=y, marks=(*mile, *lines[key], *marks))

    if magnitudes:
        yield Charts("horizontal", ((chart(*_HORIZONTAL),),), WIDE)
    charts = [chart(*plot) for plot in _PLOTS if lines[plot[0]] and (magnitudes or plot[0] not in _MAGNITUDES)]
    rows = tuple(tuple(charts[k : k + 2]) for k in range(0, len(charts), 2))
    yield Charts("errors", rows, (PAIR[0], PAIR[1] * len(rows)))
    if lines[_DOWN[0]]:
        yield Charts("down", ((chart(*_DOWN),),), PAIR, on=("recording",))
    if apart and len(run.errors) > 1:
        yield Charts("apart", ((_apart(run.errors, dashes, span, marks),),), WIDE)


def _paint(names: Iterable[str]) -> dict[str, style.Rgb]:
    """Return one colour for each solution, the same in every chart, also for names that the style does not know."""
    known = list(names)
    return dict(zip(known, style.colors(known), strict=True))


def schuler_period(truth: NavState, ellipsoid: Ellipsoid) -> float:
    """Return the period of the Schuler oscillation at the place of a run, s.

    It is 2π √(R/g) with the mean radius of curvature at the mean latitude and normal gravity at the mean height.
    """
    latitude, height = float(truth.latitude.mean()), float(truth.height.mean())
    r1, r2 = radii(latitude, ellipsoid)
    gravity = gravity_ned(latitude, height, "normal", ellipsoid)[2]
    return float(2.0 * np.pi * np.sqrt((np.sqrt(r1 * r2) + height) / gravity))


_NEAR_A_POLE = (
    "The run comes within 1° of a pole, where the direction of north depends on the position. Velocity and attitude "
    "are therefore compared without a rotation about the vertical. The components are along north and east of the "
    "solution’s place: they change their signs where it passes over the pole."
)
"""What the errors of a run near a pole are."""


def _schuler_marks(start: float, end: float, period: float) -> tuple[tuple[float, float], list[Rule]]:
    """Return the time axis of the error plots, and marks at half the Schuler period and at its multiples.

    A run of many periods has marks at twelve multiples at most, and none at the half.
    """
    # The mark at a whole period stays on the axis if the run ends just before it.
    span = (start, start + period if end < start + period < start + 1.02 * (end - start) else end)
    periods = int((span[1] - start) / period + 1e-9)
    step = -(-periods // _MOST_MARKS) or 1
    whole = range(step, periods + 1, step)
    texts = {float(k): f"T = {period / 60.0:.1f} min" if k == 1 else f"{k} T" for k in whole}
    if periods <= _MARKS_WITH_HALF and span[1] - start >= 0.5 * period * (1.0 - 1e-9):
        texts = {0.5: f"T/2 = {0.5 * period / 60.0:.1f} min", **texts}
    return span, [Rule(at=start + k * period, upright=True, text=text, dash=":") for k, text in texts.items()]


def _explanation(period: float, length: float) -> Iterator[Sentence]:
    """Explain the marks and the angles in the error plots."""
    if length < 0.5 * period * (1.0 - 1e-9):
        marks = "the run is shorter than half a period."
    elif length < (_MARKS_WITH_HALF + 1) * period:
        marks = "dotted lines mark it and its half."
    else:
        marks = "dotted lines mark its multiples."
    yield Sentence(
        f"The Schuler period T = 2π√(R/g) is {period / 60.0:.2f} min here; {marks} φ is the rotation vector of the "
        "error equations, q_{true} = q(φ) ⊗ q_{solution}, to first order C_{solution} = (I − [φ×]) C_{true}: φ_{N} and "
        "φ_{E} are tilts, and for a level vehicle −φ_{D} is the error of heading.", on=("page",),
    )  # fmt: skip


def _apart(
    errors: Mapping[str, NavError], dashes: Mapping[str, Dash], span: tuple[float, float], marks: Sequence[Rule]
) -> Chart:
    """Return the distance of each solution from the first one, which shows the errors of the algorithms alone."""
    # algorithms that take several samples per update have fewer rows: use the instants common to all
    time = min((error.time for error in errors.values()), key=len)
    time = time[np.unique(np.linspace(0, len(time) - 1, min(len(time), 8192)).round().astype(np.intp))]
    positions = {
        name: e.position_ned[np.searchsorted(e.time, time).clip(max=len(e.time) - 1)] for name, e in errors.items()
    }
    (first, base), *others = positions.items()
    paint = _paint(errors)
    lines = [
        Line(
            label=name, x=time, y=np.linalg.norm(position - base, axis=1), color=paint[name], dash=dashes.get(name, "")
        )
        for name, position in others
    ]
    title = f"Distance of {'the others' if len(lines) > 1 else lines[0].label} from {first}"
    y = Axis(units=LENGTH_SCALE, low=0.0)
    return Chart(key="navigation/apart", title=title, x=over(span), y=y, marks=(*lines, *marks))


def _mile_an_hour(span: tuple[float, float]) -> Line:
    ends = np.array(span)
    rate = (ends - span[0]) / 3600.0 * units.NAUTICAL_MILE
    return Line(label="1 nmi/h", x=ends, y=rate, color="reference", weight="thin", dash="--", counts=False)


def figure_charts(run: Run) -> Charts:
    """Return the horizontal, the velocity and the attitude error of each solution of a run over time."""
    errors: dict[str, NavError] = dict(run.errors)
    if run.aided is not None and run.aided.true_parameters_known:
        of_filter = {"aided": run.aided.error, "backward": run.aided.backward_error,
                     "smoothed": run.aided.smoothed_error}  # fmt: skip
        errors |= {name: filter_error for name, filter_error in of_filter.items() if filter_error is not None}
    if not errors:
        raise InputError(
            f"the run {run.scenario.name} has no solution in three dimensions with errors to draw; its report and its "
            "recording show what it has."
        )
    paint, charts = _paint(errors), list[tuple[Chart]]()
    for name, scale, of in (
        ("horizontal error", LENGTH_SCALE, "horizontal"), ("velocity error", SPEED_SCALE, "speed"),
        ("attitude error", ANGLE_SCALE, "angle"),
    ):  # fmt: skip
        lines = tuple(
            Line(
                label=label,
                x=error.time,
                y=getattr(error, of),
                color=paint[label],
                dash=_IN_FIGURE[k % len(_IN_FIGURE)],
            )
            for k, (label, error) in enumerate(errors.items())
        )
        largest = [float(np.nanmax(line.y)) for line in lines]
        y = Axis(label=name, units=scale, low=0.0)
        if (
            max(largest) > _FAR * min(largest) > 0.0
        ):  # an aided error beside an inertial one would be a line on the axis
            y = replace(y, log=True, low=min(float(np.nanmedian(line.y)) for line in lines) / 10.0)
        legend: Literal["inside", "none"] = "none" if charts else "inside"
        title = "" if charts else run.scenario.name
        charts.append((Chart(key=name, title=title, y=y, marks=lines, legend=legend),))
    return Charts("errors", tuple(charts), (8.0, 6.6), share="x")


_FAR = 20.0
"""Ratio of the largest errors of two solutions from which the scale of a figure is logarithmic."""
_IN_FIGURE: tuple[Dash, ...] = ("", "--", "-.", ":")


def passage_numbers(solutions: Mapping[str, NavSolution]) -> dict[str, list[PassageNumbers]]:
    """Return the passages through a singular attitude, for `summary.json`."""
    passages = {}
    for name, solution in solutions.items():
        if solution.events:
            passages[name] = [
                PassageNumbers(start_s=e.start, end_s=e.end, damage_arcsec=e.damage / units.ARCSEC, text=e.text)
                for e in solution.events
            ]
    return passages


def failure_numbers(failed: Mapping[str, RunError]) -> dict[str, FailureNumbers]:
    """Return which algorithms have no result, and why, for `summary.json`; an instant that is not known is None."""
    return {name: {"time_s": error.time, "text": str(error)} for name, error in failed.items()}


def singularity_exhibits(passages: Mapping[str, Sequence[PassageNumbers]]) -> Iterator[Item]:
    """Yield the passages through a singular attitude, by algorithm."""
    if not passages:
        yield Sentence("No algorithm passed through a singular attitude.", on=("page",))
        return
    rows = [
        (name, f"{event['start_s']:.2f}", f"{event['end_s']:.2f}", _si(event["damage_arcsec"], units.ARCSEC),
         event["text"].removeprefix(f"{name}: "))
        for name, events in passages.items() for event in events
    ]  # fmt: skip
    seconds = fixed("s")
    columns = (Column("algorithm", words=True), Column("from", seconds), Column("to", seconds),
               Column("damage", fixed("arcmin", units.ARCMIN)), Column("", words=True))  # fmt: skip
    yield Table(
        columns, rows, on=("page",),
        note="Damage: angle between the attitude of the algorithm after the passage and that of a singularity-free "
        "algorithm with the same increments.",
    )  # fmt: skip
    yield from (Sentence(event["text"], on=("console",)) for events in passages.values() for event in events)


def title_of_errors(log: LogNumbers | None) -> str:
    """Return what the table of errors shows."""
    if log is None:
        return "errors against the truth"
    if log["reference_file"] is not None:
        return f"errors against the reference {log['reference_file']}"
    return f"differences from {log['compared_with']}" if log["compared_with"] else "one solution, no reference"


def error_text(value: float | None) -> str:
    """Write four significant digits, if possible without an exponent: "0.01235", "1.2e-07"; "–" for None."""
    if value is None:
        return "–"
    if value == 0.0:
        return "0"
    if not math.isfinite(value) or not 1e-4 <= abs(value) < 1e9:
        return f"{value:.1e}"
    return f"{value:.{max(0, 3 - math.floor(math.log10(abs(value))))}f}"


_BEYOND = 2.0
"""Ratio of the rms error to the rms of the filter's own 1σ beyond which the filter is wrong, not the draw unlucky."""


_ROWS = 2000
"""Approximate number of rows of an inertial solution that are compared."""


def horizontal_of(errors: Mapping[str, NavError]) -> dict[str, tuple[Array, Array]]:
    """Return time and horizontal error of solutions at about `_ROWS` rows: s and m, by name."""
    some = {name: slice(None, None, max(len(error.time) // _ROWS, 1)) for name, error in errors.items()}
    return {name: (error.time[some[name]].copy(), error.horizontal[some[name]]) for name, error in errors.items()}


def worse_than_inertial(aided: Aided, inertial: Mapping[str, tuple[Array, Array]]) -> Iterator[str]:
    """Report inertial solutions, of `horizontal_of`, that are more accurate than the aided one in the same time."""
    time = aided.estimate.time
    if len(time) < 2:
        return
    aided_error = np.concatenate([error.horizontal for error in aided.error_blocks()])
    for name, (instant, horizontal) in inertial.items():
        squares = horizontal[(instant >= time[0]) & (instant <= time[-1])] ** 2
        if not np.isfinite(aided_error).any() or not np.isfinite(squares).any():
            continue
        rms, other = float(np.sqrt(np.nanmean(aided_error**2))), float(np.sqrt(np.nanmean(squares)))
        if rms <= other:
            continue
        sigma = float(np.sqrt(np.mean(np.sum(aided.estimate.sigma[:, :2] ** 2, axis=1))))
        why = (
            "The error is beyond what the filter states: its model is wrong."
            if rms > _BEYOND * sigma
            else "The error is within what the filter states, so that this may be the chance of one run; `sinssim "
            "ensemble` and `sinssim budget` compare both over all runs."
        )
        yield (
            f"From {time[0]:.0f} s to {time[-1]:.0f} s the aided solution is worse than {name}: its horizontal error "
            f"is {number_text(rms)} m (rms), that of {name} {number_text(other)} m. The filter's own 1σ is "
            f"{number_text(sigma)} m. {why}"
        )


def requirement_verdicts(reached: Reached, require: Iterable[Requirement]) -> list[Verdict]:
    """Judge requirements by one run, whose error counts as it is, where an ensemble has that of 95 % of its runs.

    The errors are those of the solution that an ensemble keeps.
    """
    navigated, truth = reached.navigated, reached.truth
    assert navigated is not None  # the run has navigated
    assert isinstance(truth, Truth)
    if reached.aided is not None:
        of_solution, solution = reached.aided.error_at(slice(None)), reached.aided.estimate.solution
    else:
        name = next(iter(navigated.errors))
        of_solution, solution = navigated.errors[name], navigated.solutions[name]
    path: dict[str, Array] = {}
    verdicts = []
    for requirement in require:
        if requirement.quantity == MISS:
            verdicts.append(_missed(requirement, reached.scenario, truth))
            continue
        if requirement.quantity in BY_PATH:
            time = np.append(np.arange(truth.time[0], truth.time[-1], 1.0), truth.time[-1])
            path = path or path_values(reached.scenario, truth, solution, time)
            values = np.abs(path[f"{requirement.quantity}_m"])
        else:
            time, values = of_solution.time, _judged_error(of_solution, requirement.quantity)
        verdicts.append(_verdict(requirement, time - truth.time[0], values))
    return verdicts


def _missed(requirement: Requirement, scenario: Scenario, truth: Truth) -> Verdict:
    """Judge the miss of a waypoint; undecided if the flight does not get there."""
    assert scenario.flight is not None  # it has waypoints
    column = path_column(scenario.flight, requirement)
    for miss in misses(scenario, truth, pieces_of(scenario, truth)):
        if column == f"miss_{miss.number}_m":
            return Verdict.certain(requirement, abs(miss.right), miss.time - float(truth.time[0]), None)
    return Verdict(requirement, "undecided", math.nan, math.nan, 1, None)


def _judged_error(error: NavError, quantity: str) -> Array:
    """Return the size of the error that a quantity limits, at the instants of a solution, SI."""
    if quantity in CIRCLES:
        return error.horizontal
    place = COMPONENTS.index(quantity)
    vector = (error.position_ned, error.velocity_ned, error.attitude)[place // 3]
    return np.abs(vector[:, place % 3])


def _verdict(requirement: Requirement, time: Array, values: Array) -> Verdict:
    """Judge a requirement by the errors of one run at some instants, s since its start."""
    known = np.isfinite(values)
    time, values = time[known], values[known]
    if requirement.quantity == "rate":
        time, values = time[time > 0.0], values[time > 0.0] / time[time > 0.0]
    if requirement.when == "at":
        requirement.check_within(float(time[-1]) if len(time) else 0.0)
    if not len(time):
        return Verdict(requirement, "undecided", math.nan, math.nan, 1, None)
    if requirement.when == "at":
        value, at = float(np.interp(requirement.time, time, values)), requirement.time
    else:
        row = len(time) - 1 if requirement.when == "end" else int(np.argmax(values))
        value, at = float(values[row]), float(time[row])
    return Verdict.certain(requirement, value, at, first_exceeded(requirement, time, values))


def requirement_numbers(verdict: Verdict) -> RequirementNumbers:
    """Return a verdict of one run for `summary.json`, with value and limit in the unit as written."""
    unit = verdict.in_unit
    return RequirementNumbers(
        requirement=unit.requirement, verdict=unit.verdict, value=unit.value, limit=unit.limit, unit=unit.unit,
        time_s=unit.time_s, exceeded_from_s=unit.exceeded_from_s,
    )  # fmt: skip


def requirement_sentences(numbers: Iterable[RequirementNumbers]) -> Iterator[Sentence]:
    """Yield the verdicts of one run in words."""
    for n in numbers:
        if n["value"] is None or math.isnan(n["value"]):
            yield Sentence(f"{n['requirement']}: undecided. This run has no such value.", "warning")
            continue
        since = "" if n["exceeded_from_s"] is None else f", exceeded from {n['exceeded_from_s']:.4g} s"
        text = f"{n['requirement']}: {'met' if n['verdict'] == 'met' else 'NOT MET'} in this run. The value is "
        text += f"{number_text(n['value'])} {n['unit']} at {n['time_s']:.6g} s{since}."
        yield Sentence(text, "" if n["verdict"] == "met" else "warning")
