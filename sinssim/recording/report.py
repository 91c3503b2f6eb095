"""The report of one run: a page for a person, with its drawings in it, that opens in any browser and prints."""

from __future__ import annotations

import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import rotation, units
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth import Ellipsoid, gravity_ned, radii
from sinssim.nav_error import NavError
from sinssim.recording import page, plot, style
from sinssim.recording.filter_report import STYLE as FILTER_STYLE
from sinssim.recording.filter_report import filter_section
from sinssim.recording.page import number, signed, table, words
from sinssim.recording.plot import Line, Mark
from sinssim.recording.report_sensors import sensor_errors
from sinssim.recording.scales import ANGLES, LENGTHS, SPEEDS, Scale, suiting
from sinssim.recording.sensed import Sensed
from sinssim.recording.summary import flagged_words, processor
from sinssim.recording.track import STYLE as TRACK_STYLE
from sinssim.recording.track import degrees, draw_map
from sinssim.scenario.summary import given, sensor_words

if TYPE_CHECKING:
    from sinssim.aided import Aided
    from sinssim.scenario import Scenario
    from sinssim.truth.trajectory import Trajectory

_STYLE = f"""{plot.STYLE}{TRACK_STYLE}{FILTER_STYLE}
.pair {{ display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 1.2rem 1.4rem; align-items: start; }}
.pair > div > table:first-child, .pair .wide:first-child table {{ margin-top: 0; }}
.pair > div td.text {{ min-width: 9rem; }}
@media screen and (max-width: 820px) {{ .pair {{ grid-template-columns: minmax(0, 1fr); }} }}
pre {{ background: var(--head); padding: .8rem 1rem; font-size: .78rem; line-height: 1.45; columns: 3 19rem;
  white-space: pre-wrap; overflow-wrap: anywhere; }}
.broken {{ border-left: 5px solid #b03a00; padding: .4rem 1rem; max-width: none; background: var(--head); }}
th.group {{ text-align: center; }} .first {{ border-left: 1px solid var(--line); }}
@media print {{ .errors table, .events table {{ font-size: 7.5pt; }} .errors th, .errors td {{ padding: .1rem .3rem; }}
  pre {{ font-size: 7pt; columns: 2; }} }}
"""

_KINDS = ("final", "rms", "max")
_DIGITS = 4
_TABLES = (
    (
        ("horizontal [m]", "horizontal_error_m", 1.0),
        ("horizontal [nmi]", "horizontal_error_m", units.NAUTICAL_MILE),
        ("height [m]", "height_error_m", 1.0),
    ),
    (
        ("velocity [m/s]", "velocity_error_mps", 1.0),
        ("attitude [arcmin]", "attitude_error_arcsec", 60.0),
        ("attitude [arcsec]", "attitude_error_arcsec", 1.0),
    ),
)
"""Columns: title, name in `summary.json` after "final_", "rms_", "max_", and the unit's size in the summary's."""


@dataclass
class Material:
    """What there is of a run to report; it grows while the run goes on, and may stop growing when it breaks off.

    Attributes:
        scenario: what is run.
        trajectory: the true motion.
        time: (N,) s.
        truth: true states at those times.
        solutions: by algorithm.
        errors: by algorithm.
        sensed: what the sensors read, by kinds of sensors.
        aided: of a scenario with a filter.
    """

    scenario: Scenario
    trajectory: Trajectory | None = None
    time: Array = field(default_factory=lambda: np.empty(0))
    truth: NavState | None = None
    solutions: Mapping[str, NavSolution] = field(default_factory=dict)
    errors: Mapping[str, NavError] = field(default_factory=dict)
    sensed: Sequence[Sensed] = ()
    aided: Aided | None = None


def run_report(run: Material, summary: Mapping[str, Any]) -> str:
    """Return the report of a run.

    Args:
        run: what there is of it.
        summary: what `summary.json` holds.

    Returns:
        An HTML page that refers to nothing outside itself.
    """
    scenario = run.scenario
    body = [f"<h1>{words(scenario.name)}</h1>", f'<p class="lead">{words(scenario.description)}</p>']
    if summary["status"] != "finished":
        body.append(f'<p class="broken"><strong>The run {_ended(summary)}</strong> {words(summary["message"])}</p>')
    body.append("".join(f"<p>{words(sentence)}</p>" for sentence in _in_short(scenario, summary)))
    if run.trajectory is not None and run.truth is not None:
        body += ["<h2>Flight</h2>", *_flight(run, run.trajectory, run.truth)]
    body += ["<h2>Sensor errors of this run</h2>", *sensor_errors(scenario, run.sensed)]
    if "algorithms" in summary and run.trajectory is not None and run.truth is not None:
        body += ["<h2>Navigation errors</h2>", *map(_failure, summary["failures"].items())]
        body += _numbers(summary["algorithms"])
        body += _error_plots(run, schuler_period(run.truth, run.trajectory.ellipsoid))
        body += ["<h2>Singular attitudes</h2>", _singularities(summary["singularities"])]
    if run.aided is not None and "filter" in summary:
        span = (float(run.time[0]), float(run.time[-1]))
        body += ["<h2>The aided solution</h2>", *filter_section(run.aided, summary, span)]
    body += ["<h2>How it was made</h2>", *_made(scenario, summary)]
    body += ["<h2>Scenario</h2>", f"<pre>{page.verbatim(scenario.to_toml().strip())}</pre>"]
    return page.page(f"{scenario.name}: run", body, _STYLE)


def schuler_period(truth: NavState, ellipsoid: Ellipsoid) -> float:
    """Return the period of the Schuler oscillation where a run took place.

    Args:
        truth: true states, N rows.
        ellipsoid: reference ellipsoid.

    Returns:
        2π √(R/g) with the mean radius of curvature at the mean latitude and normal gravity at the mean height, s.
    """
    latitude, height = float(truth.latitude.mean()), float(truth.height.mean())
    r1, r2 = radii(latitude, ellipsoid)
    gravity = gravity_ned(latitude, height, "normal", ellipsoid)[2]
    return float(2.0 * np.pi * np.sqrt((np.sqrt(r1 * r2) + height) / gravity))


def _ended(summary: Mapping[str, Any]) -> str:
    return "was interrupted; this is what there was." if summary["status"] == "interrupted" else "failed."


def _in_short(scenario: Scenario, summary: Mapping[str, Any]) -> Iterator[str]:
    """Say the result in a sentence or two."""
    if not summary.get("algorithms"):
        return
    numbers = {name: n for name, n in summary["algorithms"].items() if name not in summary["failures"]}
    duration, navigation = summary["end_s"] - summary["start_s"], scenario.navigation
    yield (
        f"Inertial unit {scenario.imu.grade} ({sensor_words(scenario.imu)}), {scenario.imu.rate_hz:g} Hz, seed "
        f"{scenario.seed}; navigation for "
        f"{_clock(duration)} in the frame “{navigation.frame}”, vertical channel “{navigation.vertical}”."
    )
    if flags := flagged_words(summary["flagged_samples"], round(duration * scenario.imu.rate_hz)):
        yield flags
    if summary["failures"]:
        yield f"No result by {', '.join(summary['failures'])}, for the reason that stands with the navigation errors."
    if not numbers:
        return
    finals = [n["final_horizontal_error_m"] for n in numbers.values()]
    greatest = [n["max_horizontal_error_m"] for n in numbers.values()]
    if len(numbers) == 1:
        yield f"Horizontal error: {_length(finals[0])} at the end, {_length(greatest[0])} at most."
        yield from _with_filter(summary)
        return
    alike = all(max(values) - min(values) < 5e-4 * max(values) for values in (finals, greatest))
    if alike:
        whose = "all algorithms"
        end, most = _length(finals[0]), _length(greatest[0])
    else:
        order = np.argsort(greatest)
        names = list(numbers)
        whose = f"{names[order[0]]} (the least) to {names[order[-1]]} (the greatest)"
        end, most = (f"{_length(v[order[0]])} to {_length(v[order[-1]])}" for v in (finals, greatest))
    apart = _length(max(finals) - min(finals), False)
    yield (
        f"Horizontal error of {whose}: {end} at the end, {most} at most. The algorithms’ errors at the end differ by "
        f"up to {apart}."
    )
    yield from _with_filter(summary)


def _with_filter(summary: Mapping[str, Any]) -> Iterator[str]:
    """Say how far the aided solution is off."""
    aided = summary.get("filter", {}).get("aided")
    if aided is not None:
        end, most = (_length(aided[f"{when}_horizontal_error_m"], False) for when in ("final", "max"))
        yield f"With the aiding sensors and the filter: {end} at the end, {most} at most."


def _length(metres: float, miles: bool = True) -> str:
    if not np.isfinite(metres):
        return "not a number"
    text = f"{number(metres, 4)} m" if metres > 0.5 else f"{number(metres * 1e3)} mm"
    return f"{text} ({metres / units.NAUTICAL_MILE:.3f} nmi)" if miles and abs(metres) > 10.0 else text


def _clock(seconds: float) -> str:
    unit, size = plot.time_unit(seconds)
    return f"{seconds / size:.4g} {unit}"


def _css(name: str) -> str:
    return page.css(style.COLORS[name])


# The flight


def _flight(run: Material, trajectory: Trajectory, truth: NavState) -> Iterator[str]:
    time, velocity = run.time, truth.velocity_ned
    roll, pitch, heading = (angle / units.DEG for angle in rotation.euler_from_quaternion(truth.q_nb))
    heading = heading % 360.0
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    distance = float(np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time)))
    names = list(run.solutions)
    colors = [
        page.css(style.tint(style.COLORS["truth"])) if names else _css("truth"),
        *map(page.css, style.colors(names)),
    ]
    chart = draw_map(time, truth, run.solutions, colors, trajectory.ellipsoid)
    facts = [
        ("duration", _clock(float(time[-1] - time[0]))),
        ("way over ground (∫ ground speed dt)", f"{distance / 1e3:.3f} km"),
        ("start", _place(truth, 0)),
        ("end", _place(truth, -1)),
        ("height above the ellipsoid", _between(truth.height, 1, "m")),
        ("ground speed", _between(speed, 1, "m/s")),
        ("vertical speed, up", _between(-velocity[:, 2], 1, "m/s")),
        ("roll", _between(roll, 1, "°")),
        ("pitch", _between(pitch, 1, "°")),
        ("gravity, ellipsoid", f"{trajectory.gravity}, {trajectory.ellipsoid.name}"),
    ]
    facts += [(kind, words(text)) for kind, text in _source(run.scenario)]
    listed = table(
        ("true motion of the sensor block", ""), [(words(k), f'<td class="text">{v}</td>') for k, v in facts]
    )
    yield (
        f'<div class="pair"><div>{chart}<p class="note">Azimuthal equidistant about the middle of the true '
        "track, whose east and north the axes have; dotted: meridians and parallels.</p></div>"
        f"<div>{listed}</div></div>"
    )
    legs, others = _legs(run.scenario, trajectory)
    marks = [Mark(begin, str(i + 1), faint=True) for i, (_, _, begin, _) in enumerate(legs)]
    green, orange, blue = _css("y"), _css("x"), _css("z")
    span = (float(time[0]), float(time[-1]))
    speeds = [Line("ground speed", time, speed, green)]
    airspeed = trajectory.channels.get("airspeed_mps")
    if airspeed is not None and airspeed.values.ndim == 1 and len(airspeed.time) > 1:
        speeds.append(Line("true airspeed", airspeed.time, airspeed.values, orange, 1.5, "6 6"))
    attitude = [Line("roll", time, roll, orange, turn=360.0), Line("pitch", time, pitch, blue)]
    yield '<div class="pair">'
    height = Line("height", time, truth.height, green)
    yield plot.plot("Height above the ellipsoid", "m", [height], span, marks=marks, least=1e-3)
    yield plot.plot("Speed", "m/s", speeds, span, marks=marks, least=1e-3)
    around = (-180.0, 180.0, 90.0) if np.abs(roll).max() > 120.0 else None
    yield plot.plot("Roll and pitch", "deg", attitude, span, marks=marks, least=1e-3, axis=around)
    turning = Line("heading", time, heading, green, turn=360.0)
    yield plot.plot("Heading", "deg", [turning], span, marks=marks, axis=(0.0, 360.0, 90.0))
    yield "</div>"
    if legs:
        yield '<h3>Legs as flown</h3><div class="events">'
        lines = [
            (
                str(i + 1),
                words(name),
                words(what),
                f"<td>{begin:.1f}</td>",
                "<td>–</td>" if end is None else f"<td>{end:.1f}</td>",
            )
            for i, (name, what, begin, end) in enumerate(legs)
        ]
        lines = [(n, f'<td class="name">{a}</td>', f'<td class="text">{w}</td>', b, e) for n, a, w, b, e in lines]
        yield table(("leg", "", "", "from [s]", "to [s]"), lines) + "</div>"
    if others:
        yield "<h3>Events</h3>" + table(
            ("time [s]", ""), [(f"<td>{t:.1f}</td>", f'<td class="text">{words(x)}</td>') for t, x in others]
        )


def _source(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Say where the true motion comes from."""
    flight = scenario.flight
    if flight is not None:
        yield "flown by JSBSim, aircraft", flight.aircraft
        yield "wind", given(flight.wind) or "none"
        yield "turbulence", given(flight.turbulence) if flight.turbulence else "none"
    for name in ("parked", "great_circle", "motion"):
        section = getattr(scenario, name)
        if section is not None:
            yield name.replace("_", " "), given(section)
    for vibration in scenario.vibration:
        yield "vibration", given(vibration)
    if scenario.isolator is not None:
        yield "isolator", given(scenario.isolator)


def _legs(
    scenario: Scenario, trajectory: Trajectory
) -> tuple[list[tuple[str, str, float, float | None]], list[tuple[float, str]]]:
    """Return the legs that were begun (type, what was asked for, begin, end), and all other events."""
    events = [(event.time, event.text) for event in trajectory.events]
    legs: list[tuple[str, str, float, float | None]] = []
    for i, leg in enumerate(scenario.flight.legs if scenario.flight is not None else (), start=1):
        times = {}
        for edge in ("begins", "ends"):
            found = next((e for e in events if e[1] == f"leg {i} ({leg.type}) {edge}"), None)
            if found is not None:
                times[edge] = found[0]
                events.remove(found)
        if "begins" in times:
            legs.append((leg.type, given(leg, "type", "timeout_s"), times["begins"], times.get("ends")))
    return legs, events


def _place(truth: NavState, row: int) -> str:
    lat, lon, height = (float(v[row]) for v in (truth.latitude, truth.longitude, truth.height))
    height = round(height, 1) + 0.0  # no negative zero
    return f"{degrees(lat / units.DEG, 'NS', 5)} {degrees(lon / units.DEG, 'EW', 5)}, {height:.1f} m"


def _between(values: Array, places: int, unit: str) -> str:
    rounded = (round(float(v), places) + 0.0 for v in (values.min(), values.max()))  # + 0.0: no negative zero
    low, high = (f"{v:.{places}f}".replace("-", "−") for v in rounded)
    blank = "" if unit == "°" else " "
    return f"{low}{blank}{unit}" if low == high else f"{low} … {high}{blank}{unit}"


# The errors


def _failure(failed: tuple[str, Mapping[str, Any]]) -> str:
    name, why = failed
    return f'<p class="broken"><strong>{words(name)} has no result.</strong> {words(page.capital(why["text"]))}</p>'


def _numbers(numbers: Mapping[str, Mapping[str, float | None]]) -> Iterator[str]:
    colors = dict(zip(numbers, map(page.css, style.colors(list(numbers))), strict=True))
    yield '<div class="errors">'
    for groups in _TABLES:
        above = (
            "<tr><th></th>" + "".join(f'<th class="group first" colspan="3">{t}</th>' for t, _, _ in groups) + "</tr>"
        )
        heads = ("algorithm", *_KINDS * len(groups))
        lines = []
        for name, found in numbers.items():
            cells = [
                f"<td{' class=first' if kind == 'final' else ''}>{_in_unit(found[f'{kind}_{key}'], size)}</td>"
                for _, key, size in groups
                for kind in _KINDS
            ]
            lines.append((page.swatch(colors[name]) + words(name), *cells))
        yield table(heads, lines, 1, above)
    yield (
        '</div><p class="note">Solution minus truth in the local level of the true position. The final height error '
        "has a sign (positive: too high), all others are magnitudes; attitude is the angle of the single rotation "
        "between computed and true attitude. Every digit: summary.json; every sample: streams/error_*.parquet.</p>"
    )


def _in_unit(value: float | None, size: float) -> str:
    return "–" if value is None else signed(value / size, _DIGITS)


def _error_plots(run: Material, period: float) -> Iterator[str]:
    names, errors = list(run.errors), list(run.errors.values())
    colors = [page.css(c) for c in style.colors(names)]
    dashes = plot.dashes(len(names))
    start, end = float(run.time[0]), float(run.time[-1])
    # A whole period belongs on the axis when the run ends just before it.
    span = (start, start + period if end < start + period < start + 1.02 * (end - start) else end)
    marks = [
        Mark(start + half * 0.5 * period, text if half < 3 else f"{half / 2:g} T")
        for half in range(1, min(24, int(2.0 * (span[1] - start) / period + 1e-9)) + 1)
        if half < 3 or half % 2 == 0
        for text in (f"T/2 = {0.5 * period / 60.0:.1f} min" if half == 1 else f"T = {period / 60.0:.1f} min",)
    ]

    def draw_one(
        title: str, values: Sequence[Array], unit: tuple[str, float], more: Sequence[Line] = (), **options: Any
    ) -> str:
        lines = []
        for name, error, rows, color, dash in zip(names, errors, values, colors, dashes, strict=True):
            lines.append(Line(name, error.time, rows, color, 2.0, dash, unit[1]))
        return plot.plot(title, unit[0], [*more, *lines], span, marks=marks, **options)

    def components(
        scale: Scale, kind: str, axes: Sequence[int], sign: float = 1.0
    ) -> tuple[list[list[Array]], tuple[str, float]]:
        columns = [[sign * getattr(e, kind)[:, i] for e in errors] for i in axes]
        return columns, suiting(scale, *(c for column in columns for c in column))

    seen = "" if marks else " The run is shorter than half a period."
    yield (
        f"<p>The Schuler period T = 2π√(R/g) is {period / 60.0:.2f} min here; dotted lines mark it and its "
        f"half.{seen} φ is the rotation vector of the error equations, q<sub>true</sub> = q(φ) ⊗ q<sub>solution</sub>, "
        "to first order C<sub>solution</sub> = (I − [φ×]) C<sub>true</sub>: φ<sub>N</sub> and φ<sub>E</sub> are tilts, "
        "and for a level vehicle −φ<sub>D</sub> is the error of heading.</p>"
    )
    horizontal = [e.horizontal for e in errors]
    unit = suiting(LENGTHS, *horizontal)
    mile = [] if unit[0] == "mm" else [_mile_an_hour(span, unit[1])]
    yield draw_one("Horizontal position error", horizontal, unit, mile, width=1140, height=240, from_zero=True)
    yield '<div class="pair">'
    position, unit = components(LENGTHS, "position_ned", (0, 1))
    velocity, v_unit = components(SPEEDS, "velocity_ned", (0, 1))
    tilts, a_unit = components(ANGLES, "attitude", (0, 1))
    azimuth, z_unit = components(ANGLES, "attitude", (2,))
    for title, columns, one in (
        ("position error", position, unit),
        ("velocity error", velocity, v_unit),
        ("tilt φ", tilts, a_unit),
    ):
        for axis, values in zip(("North", "East"), columns, strict=True):
            name = f"Tilt about {axis.lower()}, φ{axis[0]}" if title == "tilt φ" else f"{axis} {title}"
            yield draw_one(name, values, one)
    height = [e.height for e in errors]
    yield draw_one("Azimuth, φD", azimuth[0], z_unit)
    yield draw_one("Height error (positive: too high)", height, suiting(LENGTHS, *height))
    speed, angle = [e.speed for e in errors], [e.angle for e in errors]
    yield draw_one("Velocity error, magnitude", speed, suiting(SPEEDS, *speed), from_zero=True)
    yield draw_one("Attitude error, angle", angle, suiting(ANGLES, *angle), from_zero=True)
    yield "</div>"
    if len(names) > 1:
        yield _apart(run, colors, dashes, span, marks)


def _apart(
    run: Material, colors: Sequence[str], dashes: Sequence[str], span: tuple[float, float], marks: Sequence[Mark]
) -> str:
    """Draw how far each solution is from the first one: what is the algorithms' own, and not the sensors'."""
    # algorithms that take several samples at once have fewer rows: the instants that all of them have
    time = min((error.time for error in run.errors.values()), key=len)
    time = time[np.unique(np.linspace(0, len(time) - 1, min(len(time), 8192)).round().astype(np.intp))]
    found = {
        name: e.position_ned[np.searchsorted(e.time, time).clip(max=len(e.time) - 1)] for name, e in run.errors.items()
    }
    (first, base), *others = found.items()
    distances = [np.linalg.norm(position - base, axis=1) for _, position in others]
    unit, size = suiting(LENGTHS, *distances)
    lines = [
        Line(name, time, distance, color, 2.0, dash, size)
        for (name, _), distance, color, dash in zip(others, distances, colors[1:], dashes[1:], strict=True)
    ]
    title = f"Distance of {'the others' if len(lines) > 1 else lines[0].label} from {first}"
    return plot.plot(title, unit, lines, span, marks=marks, width=1140, from_zero=True)


def _mile_an_hour(span: tuple[float, float], size: float) -> Line:
    ends = np.array(span)
    rate = (ends - span[0]) / 3600.0 * units.NAUTICAL_MILE
    return Line("1 nmi/h", ends, rate, _css("reference"), 1.2, "6 4", size, reference=True)


def _singularities(found: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    if not found:
        return "<p>No algorithm went through a singular attitude.</p>"
    lines = [
        (
            words(name),
            f"{event['start_s']:.2f}",
            f"{event['end_s']:.2f}",
            _in_unit(event["damage_arcsec"], 60.0),
            _in_unit(event["damage_arcsec"], 1.0),
            f'<td class="text">{words(event["text"].removeprefix(f"{name}: "))}</td>',
        )
        for name, events in found.items()
        for event in events
    ]
    heads = ("algorithm", "from [s]", "to [s]", "damage [arcmin]", "[arcsec]", "")
    return table(heads, lines) + (
        '<p class="note">Damage: angle between the algorithm’s attitude after the passage and the one that a '
        "singularity-free algorithm reaches on the same increments.</p>"
    )


# The rest


def _made(scenario: Scenario, summary: Mapping[str, Any]) -> Iterator[str]:
    timing = {name.removesuffix("_s"): seconds for name, seconds in summary["timing"].items()}
    cached = {True: "from the cache", False: "flown now", None: ""}[summary.get("flight_cached")]
    times = [
        (words(name), f"{seconds:.2f}", f'<td class="name">{cached if name == "flight" else ""}</td>')
        for name, seconds in timing.items()
        if seconds or name == "total"
    ]
    versions = {**summary["versions"], "Python": platform.python_version()}
    facts = [
        ("seed", str(scenario.seed)),
        ("IMU rate", f"{scenario.imu.rate_hz:g} Hz"),
        *((name, words(value)) for name, value in versions.items()),
        ("processor", words(processor())),
    ]
    yield f'<div class="pair"><div>{table(("stage", "time [s]", ""), times)}</div>'
    yield f"<div>{table(('what made it', ''), [(words(k), v) for k, v in facts], 2)}</div></div>"
