"""The one-component run (chapter (8.10) to (8.13), (8.15)).

Its streams and numbers, names and colours of its errors, table, and report.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich import box
from rich.table import Table

from sinssim.data import Array
from sinssim.experiments.run.error_exhibits import error_text
from sinssim.formatting import number_text, signed
from sinssim.recording import style
from sinssim.recording.diagrams import one_component_axes, one_component_scheme, schuler_loop
from sinssim.recording.figures import to_svg
from sinssim.recording.report import page, svg_plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.svg_plot import Line, Mark
from sinssim.recording.run_directory import plain, processor
from sinssim.recording.stream_tables import Stream, Vector
from sinssim.recording.style import COLORS, Rgb
from sinssim.strapdown.one_component_system import PlaneErrors, projections
from sinssim.truth.one_component_configuration import WAYS
from sinssim.units import ANGLE_SCALE, ARCMIN, ARCSEC, DEG, SPEED_SCALE, Scale, duration_words, suiting

if TYPE_CHECKING:
    from rich.console import Console

    from sinssim.experiments.run.run_result import PlaneRun
    from sinssim.scenario import Scenario
    from sinssim.sensors.sets.one_component_sensors import PlaneReadings
    from sinssim.simulation.one_component_run import OneComponentResult


SIMULATION_COLOR: Rgb = COLORS["measured-attitude"]
"""Colour of the simulation, as in figure 8.4."""

EQUATION_NAMES = {
    "equation_8_10": "equation (8.10)",
    "equation_8_11": "equation (8.11)",
    "equation_8_12": "first order (8.12)",
    "closed_form": "closed form at rest",
}
"""Names of the error equations by their names in summary and streams."""

EQUATION_COLORS: dict[str, Rgb] = {
    "equation_8_10": COLORS["rotation-vector"],
    "equation_8_11": COLORS["two-quaternions"],
    "equation_8_12": COLORS["euler"],
    "closed_form": COLORS["poisson"],
}
"""Their colours."""

ROW_NAMES = {"simulation": "simulation", "perfect_sensors": "perfect sensors", **EQUATION_NAMES}
"""Names of the rows of the table of errors."""


EQUATIONS = {
    "equation_8_10": "along_motion",
    "equation_8_11": "pendulum",
    "equation_8_12": "first_order",
    "closed_form": "closed",
}
"""Attributes of `OneComponentResult` by their names in streams and summary."""

_ERROR_COLUMNS = ("velocity_mps", "coordinate_rad", "pitch_rad")


def one_component_streams(result: OneComponentResult) -> list[Stream]:
    """Return the streams of a one-component run.

    Args:
        result: the run.

    Returns:
        `truth`, the readings `imu_ideal`, `imu_measured` and, of an attitude sensor, `attitude_ideal` and
        `attitude_measured`, `nav_<variant>`, `forces_<variant>`, `error_<variant>`, `error_perfect_sensors`, and
        `error_<equation>` for each entry of `EQUATIONS`.
    """
    truth, found, name = result.truth, result.solution, result.section.variant.replace("-", "_")
    time = truth.time
    moved = {"velocity_mps": truth.velocity, "coordinate_rad": result.coordinate, "height_m": truth.height}
    state = [("motion", moved),
             ("attitude", {"pitch_rad": truth.pitch, "body_pitch_rad": truth.body_pitch, "rate_radps": truth.rate}),
             ("force", {"horizontal_mps2": truth.horizontal, "vertical_mps2": truth.vertical})]  # fmt: skip
    attitude = {"pitch_rad": found.pitch, "body_pitch_rad": found.pitch - result.section.mounting_angle_deg * DEG}
    if found.rate is not None:
        attitude["rate_radps"] = found.rate
    navigated = [("motion", {"velocity_mps": found.velocity, "coordinate_rad": found.coordinate}),
                 ("attitude", attitude)]  # fmt: skip
    push = result.measured.dvel / np.diff(time)[:, None]
    along, up = projections(push[:, 0], push[:, 1], 0.5 * (found.pitch[:-1] + found.pitch[1:]))
    return [
        _stream("truth", time, *state),
        *_readings("ideal", result.ideal),
        *_readings("measured", result.measured),
        _stream(f"nav_{name}", time, *navigated),
        _stream(f"forces_{name}", time[1:], ("force", {"horizontal_mps2": along, "vertical_mps2": up})),
        _errors(name, result.error),
        _errors("perfect_sensors", result.perfect),
        *(_errors(key, getattr(result, field)) for key, field in EQUATIONS.items()),
    ]


def _stream(name: str, time: Array, *vectors: tuple[str, dict[str, Array]]) -> Stream:
    made = (Vector(group, tuple(columns), np.column_stack(list(columns.values()))) for group, columns in vectors)
    return Stream(name, time, tuple(made))


def _readings(kind: str, readings: PlaneReadings) -> Iterator[Stream]:
    columns = {"dvel_x_mps": readings.dvel[:, 0], "dvel_y_mps": readings.dvel[:, 1]}
    if readings.dvel_arm is not None:
        columns["dvel_arm_mps"] = readings.dvel_arm
    vectors = [("dvel", columns)]
    if readings.dtheta is not None:
        vectors.append(("dtheta", {"dtheta_rad": readings.dtheta}))
    yield _stream(f"imu_{kind}", readings.time[1:], *vectors)
    if readings.angle is not None:
        yield _stream(f"attitude_{kind}", readings.time, ("attitude", {"inertial_angle_rad": readings.angle}))


def _errors(name: str, error: PlaneErrors) -> Stream:
    values = np.column_stack((error.velocity, error.coordinate, error.pitch))
    return Stream(f"error_{name}", error.time, (Vector("error", _ERROR_COLUMNS, values),))


def numbers(result: OneComponentResult) -> dict[str, Any]:
    """Return the numbers of a one-component run for `summary.json`.

    Args:
        result: the run.

    Returns:
        The variant, the Schuler period, statistics of the errors of the simulation, with perfect sensors and of each
        equation, and the largest difference of each equation's coordinate from that of the simulation minus that with
        perfect sensors, in m and relative to its largest value.
    """
    section = result.section
    caused, radius = result.caused, section.radius_m
    errors = {"simulation": result.error, "perfect_sensors": result.perfect}
    errors |= {key: getattr(result, field) for key, field in EQUATIONS.items()}
    largest = float(np.abs(caused.coordinate).max())
    apart = {key: float(np.abs(errors[key].coordinate - caused.coordinate).max()) for key in EQUATIONS}
    differences = {
        key: {"max_m": most * radius, "relative": most / largest if largest else None} for key, most in apart.items()
    }
    sources = {source.name.replace(" ", "_"): _statistics(source.simulated, radius) for source in result.by_source}
    found: dict[str, Any] = plain(
        {
            "variant": section.variant,
            "schuler_period_s": float(2.0 * np.pi * np.sqrt(radius / section.gravity_mps2)),
            "errors": {name: _statistics(error, radius) for name, error in errors.items()},
            "errors_by_source": sources,
            "differences": differences,
        }
    )
    return found


def _statistics(error: PlaneErrors, radius: float) -> dict[str, float]:
    columns = {
        "position_error_m": error.coordinate * radius,
        "velocity_error_mps": error.velocity,
        "pitch_error_arcsec": error.pitch / ARCSEC,
    }
    found = {}
    with np.errstate(over="ignore", invalid="ignore"):
        for name, values in columns.items():
            found[f"final_{name}"] = float(values[-1])
            found[f"rms_{name}"] = float(np.sqrt(np.mean(values * values)))
            found[f"max_{name}"] = float(np.abs(values).max())
    return found


def markdown(found: Mapping[str, Any]) -> str:
    """Return the errors as a table.

    Args:
        found: result of `numbers`.

    Returns:
        Markdown: a row for the simulation and for each equation.
    """
    lines = ["| | R Δy max [m] | ΔV max [m/s] | difference, relative |", "|---|---|---|---|"]
    for key, errors in found["errors"].items():
        apart = found["differences"].get(key, {}).get("relative")
        values = (number_text(math.nan if errors[name] is None else errors[name], 4)
                  for name in ("max_position_error_m", "max_velocity_error_mps"))  # fmt: skip
        lines.append(f"| {ROW_NAMES[key]} | {' | '.join(values)} | {'' if apart is None else f'{apart:.1e}'} |")
    return "\n".join(lines)


_STYLE = f"""{svg_plot.STYLE}
.pair {{ display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 1.2rem 1.4rem; align-items: start; }}
@media screen and (max-width: 820px) {{ .pair {{ grid-template-columns: minmax(0, 1fr); }} }}
.formulas {{ margin: .4rem 0 .8rem 1.5rem; line-height: 1.7; }}
pre {{ background: var(--head); padding: .8rem 1rem; font-size: .78rem; line-height: 1.45; columns: 3 19rem;
  white-space: pre-wrap; overflow-wrap: anywhere; }}
"""

_FORMULAS = """<div class="formulas">
(8.10)&ensp; Δα̇ = Δω + ΔV/R,&ensp; ΔV̇ = Δa<sub>x</sub> cos α − Δa<sub>y</sub> sin α − a<sub>η</sub> Δα<br>
(8.11)&ensp; Δÿ + (a<sub>η</sub>/R) Δy = (Δa<sub>x</sub> cos α − Δa<sub>y</sub> sin α)/R − (a<sub>η</sub>/R)
Δα<sub>g</sub>,&ensp; Δα<sub>g</sub> = Δα − Δy = Δα<sub>g</sub>(0) + ∫Δω dt<br>
(8.12)&ensp; Δÿ + (g/R) Δy = (Δa<sub>x</sub> − α Δa<sub>y</sub>)/R − (g/R) Δα<sub>g</sub>, first order in α, with
a<sub>η</sub> = g<br>
closed form&ensp; Δy = (Δa/g − Δα<sub>g</sub>(0))(1 − cos ω<sub>s</sub>t) − Δω (t − sin ω<sub>s</sub>t/ω<sub>s</sub>) −
Δω̇ (t²/2 − (1 − cos ω<sub>s</sub>t)/ω<sub>s</sub>²) + Δy(0) cos ω<sub>s</sub>t + ΔV(0)
sin ω<sub>s</sub>t/(ω<sub>s</sub>R): (8.13), (8.15) and initial errors, of a body at rest
</div>"""


def one_component_report(scenario: Scenario, result: OneComponentResult, summary: Mapping[str, Any]) -> str:
    """Return the report of a one-component run.

    Args:
        summary: contents of `summary.json`.
    """
    found = summary["one_component"]
    body = [f"<h1>{words(scenario.name)}</h1>", f'<p class="lead">{words(scenario.description)}</p>']
    body += [f"<p>{sentence}</p>" for sentence in _in_short(result, found)]
    body += [to_svg(one_component_axes(), "axes"), to_svg(one_component_scheme(), "scheme")]
    body += ["<h2>Errors</h2>", _table(found), *_error_plots(result, found)]
    if len(result.by_source) > 1:
        body += ["<h2>Each error source alone</h2>", *_by_source(result, found)]
    body += ["<h2>Error equations</h2>", _FORMULAS, to_svg(schuler_loop(), "loop"), *_differences(result, found)]
    body += ["<h2>Motion</h2>", *_motion(result)]
    body += ["<h2>How the run was computed</h2>", _made(summary)]
    body += ["<h2>Scenario</h2>", f"<pre>{page.verbatim(scenario.to_toml().strip())}</pre>"]
    return page.page(f"{scenario.name}: run", body, _STYLE)


def _in_short(result: OneComponentResult, found: Mapping[str, Any]) -> Iterator[str]:
    section, time = result.section, result.truth.time
    yield words(
        f"One component, variant “{section.variant}”: {WAYS[section.variant]}. {section.rate_hz:g} samples per second "
        f"for {duration_words(float(time[-1] - time[0]))}; R = {section.radius_m / 1e3:g} km, g = "
        f"{section.gravity_mps2:g} m/s², Schuler period {found['schuler_period_s'] / 60.0:.2f} min."
    )
    errors, apart = found["errors"]["simulation"], found["differences"]["equation_8_11"]["relative"]
    most, end = errors["max_position_error_m"], errors["final_position_error_m"]
    if most is None:
        yield "The solution diverged: its errors are not finite."
        return
    agreement = "" if apart is None else f" Relative difference of equation (8.11) from the simulation: {apart:.1e}."
    yield words(f"Position error: {signed(end, 4)} m at the end, {number_text(most, 4)} m at most.{agreement}")


def _table(found: Mapping[str, Any]) -> str:
    heads = ("", "position final [m]", "rms [m]", "max [m]", "velocity max [m/s]", "pitch max [arcmin]",
             "difference max [m]", "relative")  # fmt: skip
    colors = {"simulation": SIMULATION_COLOR, **EQUATION_COLORS}
    lines = []
    for name, errors in found["errors"].items():
        apart = found["differences"].get(name, {})
        cells = (
            *((errors[f"{kind}_position_error_m"], 1.0) for kind in ("final", "rms", "max")),
            (errors["max_velocity_error_mps"], 1.0),
            (errors["max_pitch_error_arcsec"], 60.0),
            (apart.get("max_m"), 1.0),
        )
        label = (page.swatch(style.css(colors[name])) if name in colors else "") + words(ROW_NAMES[name])
        values = ["–" if value is None else signed(value / size, 4) for value, size in cells]
        if not apart:
            values[-1] = ""
        relative = apart.get("relative")
        lines.append((label, *values, "" if relative is None else f"{relative:.1e}"))
    return table(heads, lines) + (
        '<p class="note">Computed minus true; position is R Δy. “Perfect sensors” is the error of the same computation '
        "without any error of sensors and initial values; it is due to the method and the sampling. “Difference” "
        "is the largest difference of Δy from that of the simulation minus that with perfect sensors; “relative” is "
        "its ratio to the largest value of that error. All samples: streams/error_*.parquet.</p>"
    )


def _error_plots(result: OneComponentResult, found: Mapping[str, Any]) -> Iterator[str]:
    span, marks = _span(result, found)
    time = result.truth.time
    keys = ("closed_form", "equation_8_12", "equation_8_11")
    lines = _stacked(
        time,
        [*((EQUATION_NAMES[key], getattr(result, EQUATIONS[key]).coordinate, EQUATION_COLORS[key]) for key in keys),
         ("simulation", result.error.coordinate, SIMULATION_COLOR)],
        ARCMIN,
    )  # fmt: skip
    yield svg_plot.plot("Error Δy of the coordinate", "arcmin ≈ nmi", lines, span, marks=marks, width=1140, height=280)
    yield '<div class="pair">'
    for title, key, scale in (("Velocity error ΔV", "velocity", SPEED_SCALE), ("Pitch error Δα", "pitch", ANGLE_SCALE)):
        values = getattr(result.error, key)
        unit, size = suiting(scale, values)
        equation = (EQUATION_NAMES["equation_8_11"], getattr(result.pendulum, key), EQUATION_COLORS["equation_8_11"])
        pair = _stacked(time, [equation, ("simulation", values, SIMULATION_COLOR)], size)
        yield svg_plot.plot(title, unit, pair, span, marks=marks)
    yield "</div>"


def _by_source(result: OneComponentResult, found: Mapping[str, Any]) -> Iterator[str]:
    """Yield figure 8.4 for the errors of the run: one plot for each group of sources."""
    span, marks = _span(result, found)
    yield (
        "<p>Figure 8.4 of chapter 8 for the errors of this run. The simulation follows the motion; the closed form is "
        "that of a body at rest.</p>"
    )
    yield '<div class="pair">'
    for source in result.by_source:
        lines = _stacked(
            result.truth.time,
            [(EQUATION_NAMES["closed_form"], source.closed.coordinate, EQUATION_COLORS["closed_form"]),
             ("simulation", source.simulated.coordinate, SIMULATION_COLOR)],
            ARCMIN,
        )  # fmt: skip
        yield svg_plot.plot(f"Δy due to the {source.name} alone", "arcmin ≈ nmi", lines, span, marks=marks)
    yield "</div>"


def _differences(result: OneComponentResult, found: Mapping[str, Any]) -> Iterator[str]:
    span, marks = _span(result, found)
    apart = [
        (
            EQUATION_NAMES[key],
            getattr(result, EQUATIONS[key]).coordinate - result.caused.coordinate,
            EQUATION_COLORS[key],
        )
        for key in ("equation_8_10", "equation_8_11")
    ]
    unit, size = suiting(_FINE, *(values for _, values, _ in apart))
    yield "<p>R and g are those of the table; a<sub>η</sub> and α are true. Rates and angles are positive nose-up.</p>"
    lines = _stacked(result.truth.time, apart, size)
    yield svg_plot.plot("Δy: equation minus simulation", unit, lines, span, marks=marks, width=1140)
    yield (
        '<p class="note">The remaining differences are products of errors, mainly Δa<sub>y</sub> Δα, which the '
        "equations neglect. "
        "(8.10) and (8.11) are the same equation in other variables.</p>"
    )


_FINE: Scale = (("mas", ANGLE_SCALE[0][1] * 1e-3, ANGLE_SCALE[0][1]), *ANGLE_SCALE)


def _motion(result: OneComponentResult) -> Iterator[str]:
    truth, gravity = result.truth, result.section.gravity_mps2
    span = (float(truth.time[0]), float(truth.time[-1]))
    green, blue, orange = (style.css(color) for color in style.colors(["y", "z", "x"]))
    if np.ptp(truth.velocity) == 0.0 and np.ptp(truth.height) == 0.0 and np.ptp(truth.body_pitch) == 0.0:
        yield (
            f"<p>Steady: V = {truth.velocity[0]:g} m/s, H = {truth.height[0]:g} m, pitch ϑ = "
            f"{truth.body_pitch[0] / DEG:g}°; a<sub>η</sub> = {truth.vertical[0]:.6g} m/s².</p>"
        )
        return
    yield '<div class="pair">'
    for title, unit, values, color in (
        ("Velocity V", "m/s", truth.velocity, green),
        ("Height H", "m", truth.height, blue),
        ("Pitch ϑ of the body", "°", truth.body_pitch / DEG, orange),
    ):
        yield svg_plot.plot(title, unit, [Line("", truth.time, values, color)], span, least=1e-9)
    forces = [
        Line("horizontal aξ", truth.time, truth.horizontal, orange),
        Line("vertical aη − g", truth.time, truth.vertical - gravity, blue),
    ]
    yield svg_plot.plot("Specific force", "m/s²", forces, span, least=1e-9) + "</div>"


def _stacked(time: Array, lines: Sequence[tuple[str, Array, style.Rgb]], size: float) -> list[Line]:
    """Return lines of which each is thinner than the one under it."""
    widths = (7.0, 4.6, 3.0, 1.4)[-len(lines) :]
    return [
        Line(name, time, values, style.css(color), width, size=size)
        for (name, values, color), width in zip(lines, widths, strict=True)
    ]


def _span(result: OneComponentResult, found: Mapping[str, Any]) -> tuple[tuple[float, float], list[Mark]]:
    """Return the time axis, and marks at the first Schuler periods."""
    start, end = float(result.truth.time[0]), float(result.truth.time[-1])
    period = found["schuler_period_s"]
    count = min(12, int((end - start) / period))
    marks = [
        Mark(start + k * period, f"T = {period / 60.0:.1f} min" if k == 1 else f"{k} T") for k in range(1, count + 1)
    ]
    return (start, end), marks


def _made(summary: Mapping[str, Any]) -> str:
    stages = {name.removesuffix("_s"): seconds for name, seconds in summary["timing"].items()}
    times = [(words(name), f"{s:.2f}") for name, s in stages.items() if s or name == "total"]
    facts = {"seed": str(summary["seed"]), **summary["versions"], "processor": processor()}
    made = [(words(name), words(value)) for name, value in facts.items()]
    left, right = table(("stage", "time [s]"), times), table(("computed with", ""), made, 2)
    return f'<div class="pair"><div>{left}</div><div>{right}</div></div>'


_HEADINGS = (
    "position\nfinal, m",
    "\nrms, m",
    "\nmax, m",
    "velocity\nmax, m/s",
    "pitch\nmax, arcmin",
    "difference\nmax, m",
    "\nrelative",
)


def show(run: PlaneRun, console: Console) -> None:
    """Print the errors of the simulation and of the error equations, and the time of each stage.

    Args:
        run: the finished run.
        console: the console to print on.
    """
    scenario, summary = run.scenario, run.summary
    found = summary["one_component"]
    table = Table(
        title=f"{scenario.name}: errors against the truth",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.add_column("", no_wrap=True)
    for heading in _HEADINGS:
        table.add_column(heading, justify="right", no_wrap=True)
    for name, errors in found["errors"].items():
        table.add_row(ROW_NAMES[name], *_cells(errors, found["differences"].get(name)))
    if scenario.description:
        console.print(f"{scenario.description}\n", markup=False)
    console.print(table)
    for line in sentences(found):
        console.print(line, markup=False)
    timing = {stage.removesuffix("_s"): seconds for stage, seconds in summary["timing"].items()}
    times = ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in timing.items() if seconds)
    console.print(f"Time: {times}", markup=False)


def sentences(found: Mapping[str, Any]) -> list[str]:
    """Return what the table's rows mean.

    Args:
        found: entry `one_component` of `summary.json`.
    """
    return [
        f"Variant “{found['variant']}”: {WAYS[found['variant']]}. Schuler period "
        f"{found['schuler_period_s'] / 60.0:.2f} min.",
        "Difference: from the simulated error minus that with perfect sensors; relative: its ratio to the largest "
        "value of that error.",
    ]


def _cells(errors: Mapping[str, float | None], difference: Mapping[str, float | None] | None) -> tuple[str, ...]:
    angle = errors["max_pitch_error_arcsec"]
    return (
        error_text(errors["final_position_error_m"]),
        error_text(errors["rms_position_error_m"]),
        error_text(errors["max_position_error_m"]),
        error_text(errors["max_velocity_error_mps"]),
        "–" if angle is None else error_text(angle / 60.0),
        *(("", "") if difference is None else (error_text(difference["max_m"]), _relative(difference["relative"]))),
    )


def _relative(value: float | None) -> str:
    return "–" if value is None else f"{value:.1e}"
