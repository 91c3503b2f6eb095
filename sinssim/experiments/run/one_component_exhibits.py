"""A run in a vertical plane, of one component (chapter (8.10) to (8.13), (8.15)), from end to end."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from sinssim.charts import PAIR, WIDE, Axis, Chart, Charts, Color, Line, Rule, Weight, over
from sinssim.data import Array
from sinssim.exhibits import Column, Exhibits, Item, Medium, Picture, Section, Sentence, Table, Verbatim, charts_in
from sinssim.experiments.run.run_files import about, keep
from sinssim.experiments.run.run_report import computed_with
from sinssim.experiments.run.run_result import PlaneRun
from sinssim.experiments.run.summary_types import PlaneNumbers, RunSummary
from sinssim.recording import style
from sinssim.recording.diagrams import one_component_axes, one_component_scheme, schuler_loop
from sinssim.recording.result import Media, RunDirectory, plain
from sinssim.recording.streams import Stream, Vector
from sinssim.recording.style import COLORS, Rgb, thinned
from sinssim.scenario import Scenario
from sinssim.scenario.planned_limits import check_times
from sinssim.simulation.truth_and_sensors import Stages
from sinssim.strapdown.one_component_system import PlaneErrors, projections
from sinssim.truth.one_component import WAYS
from sinssim.units import (
    ANGLE_SCALE,
    ARCMIN,
    ARCSEC,
    DEG,
    SPEED_SCALE,
    Scale,
    duration_words,
    fixed,
    number_text,
    signed,
)

if TYPE_CHECKING:
    from sinssim.recording.rerun_file import Recording, Watching
    from sinssim.simulation.one_component_run import OneComponentResult, PlaneReadings

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

    They are the truth, the readings, those of an attitude sensor, too, the solution, the forces, and the errors of the
    run, with perfect sensors, and of each of `EQUATIONS`.
    """
    truth, solution, name = result.truth, result.solution, result.section.variant.replace("-", "_")
    time = truth.time
    moved = {"velocity_mps": truth.velocity, "coordinate_rad": result.coordinate, "height_m": truth.height}
    state = [("motion", moved),
             ("attitude", {"pitch_rad": truth.pitch, "body_pitch_rad": truth.body_pitch, "rate_radps": truth.rate}),
             ("force", {"horizontal_mps2": truth.horizontal, "vertical_mps2": truth.vertical})]  # fmt: skip
    attitude = {"pitch_rad": solution.pitch, "body_pitch_rad": solution.pitch - result.section.mounting_angle_deg * DEG}
    if solution.rate is not None:
        attitude["rate_radps"] = solution.rate
    navigated = [("motion", {"velocity_mps": solution.velocity, "coordinate_rad": solution.coordinate}),
                 ("attitude", attitude)]  # fmt: skip
    push = result.measured.dvel / np.diff(time)[:, None]
    along, up = projections(push[:, 0], push[:, 1], 0.5 * (solution.pitch[:-1] + solution.pitch[1:]))
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


def numbers(result: OneComponentResult) -> PlaneNumbers:
    """Return the numbers of a one-component run for `summary.json`.

    Differences are the largest ones of each equation's coordinate from that of the simulation minus that with perfect
    sensors, in m and relative to its largest value.
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
    plane: PlaneNumbers = plain(
        {
            "variant": section.variant,
            "schuler_period_s": float(2.0 * np.pi * np.sqrt(radius / section.gravity_mps2)),
            "errors": {name: _statistics(error, radius) for name, error in errors.items()},
            "errors_by_source": sources,
            "differences": differences,
        }
    )
    return plane


def _statistics(error: PlaneErrors, radius: float) -> dict[str, float]:
    columns = {
        "position_error_m": error.coordinate * radius,
        "velocity_error_mps": error.velocity,
        "pitch_error_arcsec": error.pitch / ARCSEC,
    }
    statistics = {}
    with np.errstate(over="ignore", invalid="ignore"):
        for name, values in columns.items():
            statistics[f"final_{name}"] = float(values[-1])
            statistics[f"rms_{name}"] = float(np.sqrt(np.mean(values * values)))
            statistics[f"max_{name}"] = float(np.abs(values).max())
    return statistics


_PAGE: tuple[Medium, ...] = ("page",)
_FORMULAS = (
    "(8.10) Δα̇ = Δω + ΔV/R, ΔV̇ = Δa_{x} cos α − Δa_{y} sin α − a_{η} Δα",
    "(8.11) Δÿ + (a_{η}/R) Δy = (Δa_{x} cos α − Δa_{y} sin α)/R − (a_{η}/R) Δα_{g}, "
    "Δα_{g} = Δα − Δy = Δα_{g}(0) + ∫Δω dt",
    "(8.12) Δÿ + (g/R) Δy = (Δa_{x} − α Δa_{y})/R − (g/R) Δα_{g}, first order in α, with a_{η} = g",
    "closed form Δy = (Δa/g − Δα_{g}(0))(1 − cos ω_{s}t) − Δω (t − sin ω_{s}t/ω_{s}) − "
    "Δω̇ (t²/2 − (1 − cos ω_{s}t)/ω_{s}²) + Δy(0) cos ω_{s}t + ΔV(0) sin ω_{s}t/(ω_{s}R): (8.13), (8.15) and initial "
    "errors, of a body at rest",
)
_FINE: Scale = (("mas", ANGLE_SCALE[0][1] * 1e-3, ANGLE_SCALE[0][1]), *ANGLE_SCALE)
_MILES = fixed("arcmin ≈ nmi", ARCMIN)
_STACK: tuple[Weight, ...] = ("broad", "wide", "bold", "line")
"""Weights of lines of which each is thinner than the one under it."""


def plane_exhibits(scenario: Scenario, result: OneComponentResult, summary: RunSummary) -> Exhibits:
    """Return what a run in a vertical plane has to show."""
    numbers = summary["one_component"]
    items: list[Item] = [*plane_brief(scenario, summary), *_in_short(result, numbers)]
    items += [Picture(one_component_axes), Picture(one_component_scheme)]
    items.append(Section("Errors", [error_table(numbers), _note(), *_errors_over_time(result)], on=_PAGE))
    if len(result.by_source) > 1:
        items.append(Section("Each error source alone", list(_by_source(result)), on=_PAGE))
    loop = Picture(schuler_loop)
    items.append(Section("Error equations", [*map(Sentence, _FORMULAS), loop, *_differences(result)], on=_PAGE))
    items.append(Section("Motion", list(_motion(result)), on=_PAGE))
    items.append(Section("How the run was computed", [computed_with(scenario, summary)], on=_PAGE))
    items.append(Section("Scenario", [Verbatim("", scenario.to_toml().strip())], on=_PAGE))
    return Exhibits(f"{scenario.name}: run", items, heading=scenario.name)


def plane_charts(result: OneComponentResult) -> Iterator[Charts]:
    """Yield all that changes over time."""
    further = _by_source(result) if len(result.by_source) > 1 else ()
    yield from charts_in([*_errors_over_time(result), *further, *_differences(result), *_motion(result)])


def plane_brief(scenario: Scenario, summary: RunSummary) -> Iterator[Item]:
    """Yield what the console shows."""
    console: tuple[Medium, ...] = ("console",)
    numbers = summary["one_component"]
    if scenario.description:
        yield Sentence(f"{scenario.description}\n", "lead")
    yield Section("", [error_table(numbers, f"{scenario.name}: errors against the truth")], on=console)
    yield Sentence(
        f"Variant “{numbers['variant']}”: {WAYS[numbers['variant']]}. Schuler period "
        f"{numbers['schuler_period_s'] / 60.0:.2f} min.", on=console,
    )  # fmt: skip
    yield Sentence(
        "Difference: from the simulated error minus that with perfect sensors; relative: its ratio to the largest "
        "value of that error.", on=console,
    )  # fmt: skip
    times = ", ".join(f"{name.removesuffix('_s')} {s:.2f} s" for name, s in summary["timing"].items() if s)
    yield Sentence(f"Time: {times}", on=console)


def _in_short(result: OneComponentResult, numbers: PlaneNumbers) -> Iterator[Sentence]:
    section, time = result.section, result.truth.time
    yield Sentence(
        f"One component, variant “{section.variant}”: {WAYS[section.variant]}. {section.rate_hz:g} samples per second "
        f"for {duration_words(float(time[-1] - time[0]))}; R = {section.radius_m / 1e3:g} km, g = "
        f"{section.gravity_mps2:g} m/s², Schuler period {numbers['schuler_period_s'] / 60.0:.2f} min.", on=_PAGE,
    )  # fmt: skip
    errors, apart = numbers["errors"]["simulation"], numbers["differences"]["equation_8_11"]["relative"]
    most, end = errors["max_position_error_m"], errors["final_position_error_m"]
    if most is None or end is None:
        yield Sentence("The solution diverged: its errors are not finite.", on=_PAGE)
        return
    agreement = "" if apart is None else f" Relative difference of equation (8.11) from the simulation: {apart:.1e}."
    text = f"Position error: {signed(end, 4)} m at the end, {number_text(most, 4)} m at most.{agreement}"
    yield Sentence(text, on=_PAGE)


def error_table(numbers: PlaneNumbers, title: str = "") -> Table:
    """Return the errors of the simulation, of perfect sensors and of the error equations."""
    colors = {"simulation": SIMULATION_COLOR, **EQUATION_COLORS}
    metres = fixed("m")
    columns = (
        Column("", words=True),
        *(Column(kind, metres, group="position") for kind in ("final", "rms", "max")),
        Column("max", fixed("m/s"), group="velocity"), Column("max", fixed("arcmin"), group="pitch"),
        Column("max", metres, group="difference"), Column("relative", group="difference"),
    )  # fmt: skip
    rows: list[list[str | float]] = []
    for name, errors in numbers["errors"].items():
        apart = numbers["differences"].get(name)
        sizes = (*((f"{kind}_position_error_m", 1.0) for kind in ("final", "rms", "max")),
                 ("max_velocity_error_mps", 1.0), ("max_pitch_error_arcsec", 60.0))  # fmt: skip
        cells = [np.nan if (v := errors[key]) is None else v / size for key, size in sizes]
        difference: list[str | float] = ["", ""]
        if apart is not None:
            most, relative = apart["max_m"], apart["relative"]
            difference = [np.nan if most is None else most, "–" if relative is None else f"{relative:.1e}"]
        rows.append([ROW_NAMES[name], *cells, *difference])
    return Table(columns, rows, title=title, colors=[colors.get(name, "reference") for name in numbers["errors"]])


def _note() -> Sentence:
    return Sentence(
        "Computed minus true; position is R Δy. “Perfect sensors” is the error of the same computation without any "
        "error of sensors and initial values; it is due to the method and the sampling. “Difference” is the largest "
        "difference of Δy from that of the simulation minus that with perfect sensors; “relative” is its ratio to the "
        "largest value of that error. All samples: streams/error_*.parquet.", "note",
    )  # fmt: skip


def _chart(
    result: OneComponentResult,
    key: str,
    title: str,
    units: Scale,
    lines: Sequence[tuple[str, Array, Color]],
    least: float = 0.0,
    periods: bool = True,
) -> Chart:
    """Return lines over time of which each is thinner than the one under it, with marks at Schuler's periods."""
    time = result.truth.time
    marks = tuple(
        Line(label=name, x=time, y=values, color=color, weight=weight)
        for (name, values, color), weight in zip(lines, _STACK[-len(lines) :], strict=True)
    )
    rules = schuler_marks(result) if periods else ()
    span = over((float(time[0]), float(time[-1])))
    return Chart(key=key, title=title, x=span, y=Axis(units=units, least=least), marks=(*rules, *marks))


def schuler_marks(result: OneComponentResult) -> tuple[Rule, ...]:
    """Return marks at the first Schuler periods, at most twelve."""
    section, time = result.section, result.truth.time
    period = float(2.0 * np.pi * np.sqrt(section.radius_m / section.gravity_mps2))
    count = min(12, int((time[-1] - time[0]) / period))
    texts = [f"T = {period / 60.0:.1f} min" if k == 1 else f"{k} T" for k in range(1, count + 1)]
    return tuple(Rule(at=float(time[0]) + k * period, upright=True, text=text, dash=":")
                 for k, text in enumerate(texts, start=1))  # fmt: skip


def _errors_over_time(result: OneComponentResult) -> Iterator[Charts]:
    keys = ("closed_form", "equation_8_12", "equation_8_11")  # (8.10) is the same line as (8.11)
    lines = [_equation(result, key) for key in keys] + [("simulation", result.error.coordinate, SIMULATION_COLOR)]
    yield Charts("coordinate", ((_chart(result, "coordinate", "Error Δy of the coordinate", _MILES, lines),),), WIDE)
    charts = []
    for key, title, scale in (("velocity", "Velocity error ΔV", SPEED_SCALE), ("pitch", "Pitch error Δα", ANGLE_SCALE)):
        name, color = EQUATION_NAMES["equation_8_11"], EQUATION_COLORS["equation_8_11"]
        simulated = ("simulation", getattr(result.error, key), SIMULATION_COLOR)
        both = [(name, getattr(result.pendulum, key), color), simulated]
        charts.append(_chart(result, f"{key}_error", title, scale, both))
    yield Charts("components", (tuple(charts),), PAIR)


def _equation(result: OneComponentResult, key: str) -> tuple[str, Array, Rgb]:
    return EQUATION_NAMES[key], getattr(result, EQUATIONS[key]).coordinate, EQUATION_COLORS[key]


def _by_source(result: OneComponentResult) -> Iterator[Item]:
    """Yield figure 8.4 for the errors of the run: one plot for each group of sources."""
    yield Sentence(
        "Figure 8.4 of chapter 8 for the errors of this run. The simulation follows the motion; the closed form is "
        "that of a body at rest."
    )
    name, color = EQUATION_NAMES["closed_form"], EQUATION_COLORS["closed_form"]
    charts = [
        _chart(
            result, f"source_{number}", f"Δy due to the {source.name} alone", _MILES,
            [(name, source.closed.coordinate, color), ("simulation", source.simulated.coordinate, SIMULATION_COLOR)],
        )
        for number, source in enumerate(result.by_source, start=1)
    ]  # fmt: skip
    rows = tuple(tuple(charts[k : k + 2]) for k in range(0, len(charts), 2))
    yield Charts("sources", rows, (PAIR[0], len(rows) * PAIR[1]))


def _differences(result: OneComponentResult) -> Iterator[Item]:
    caused = result.caused.coordinate
    equations = [_equation(result, key) for key in ("equation_8_10", "equation_8_11")]
    apart = [(name, values - caused, color) for name, values, color in equations]
    yield Sentence("R and g are those of the table; a_{η} and α are true. Rates and angles are positive nose-up.")
    chart = _chart(result, "difference", "Δy: equation minus simulation", _FINE, apart)
    yield Charts("difference", ((chart,),), (WIDE[0], PAIR[1]))
    yield Sentence(
        "The remaining differences are products of errors, mainly Δa_{y} Δα, which the equations neglect. (8.10) and "
        "(8.11) are the same equation in other variables.", "note",
    )  # fmt: skip


def _motion(result: OneComponentResult) -> Iterator[Item]:
    truth, gravity = result.truth, result.section.gravity_mps2
    steady = all(np.ptp(values) == 0.0 for values in (truth.velocity, truth.height, truth.body_pitch))
    if steady:
        yield Sentence(
            f"Steady: V = {truth.velocity[0]:g} m/s, H = {truth.height[0]:g} m, pitch ϑ = "
            f"{truth.body_pitch[0] / DEG:g}°; a_{{η}} = {truth.vertical[0]:.6g} m/s²."
        )
    forces = [("horizontal aξ", truth.horizontal, "x"), ("vertical aη − g", truth.vertical - gravity, "z")]
    charts = [
        _chart(result, key, title, units, lines, 1e-9, periods=False)
        for key, title, units, lines in (
            ("velocity", "Velocity V", fixed("m/s"), [("velocity", truth.velocity, "y")]),
            ("height", "Height H", fixed("m"), [("height", truth.height, "z")]),
            ("body_pitch", "Pitch ϑ of the body", fixed("°", DEG), [("pitch", truth.body_pitch, "x")]),
            ("force", "Specific force", fixed("m/s²"), forces),
        )
    ]
    rows = (tuple(charts[:2]), tuple(charts[2:]))
    yield Charts("motion", rows, (PAIR[0], 2.0 * PAIR[1]), on=("recording",) if steady else ("page", "recording"))


_FRAMES = 2000  # positions of the pendulum
_LARGEST = 35.0 * DEG  # largest angle at which it is drawn


def compute_one_component(
    scenario: Scenario,
    folder: RunDirectory | None,
    stages: Stages,
    media: Media[PlaneRun],
    viewer: Watching | None = None,
) -> PlaneRun:
    """Compute a one-component run; write it to a run directory, if there is a `folder`, and show it in a viewer."""
    assert scenario.one_component is not None  # the caller asks for such a run only
    check_times(scenario)
    with stages("navigate"):
        from sinssim.simulation.one_component_run import compute

        result = compute(scenario.one_component, scenario.seed)
        plane = numbers(result)
    choice = scenario.recording
    if folder is not None and choice.has_streams:
        with stages("record"), folder.writing():
            from sinssim.recording.streams import write_stream

            (folder.path / "streams").mkdir()
            streams = one_component_streams(result)
            for stream in streams:
                write_stream(stream, folder.path / "streams")
            if choice.has_recording:
                record(folder.path / "recording.rrd", scenario, result, streams, viewer)
    start, end = float(result.truth.time[0]), float(result.truth.time[-1])
    entries = {**about(scenario, stages, "finished"), "start_s": start, "end_s": end, "one_component": plane}
    summary = cast("RunSummary", entries)
    directory = None
    if folder is not None:
        from sinssim.recording.page import page_of

        report = page_of(plane_exhibits(scenario, result, summary)) if choice.has_report else None
        directory = keep(folder, scenario, (), summary, report)
    return PlaneRun(scenario, result, entries, directory, media=media)


def record(
    path: Path,
    scenario: Scenario,
    result: OneComponentResult,
    streams: Iterable[Stream],
    viewer: Watching | None = None,
) -> None:
    """Write the recording."""
    from sinssim.recording.rerun_exhibits import markdown_of, record_charts
    from sinssim.recording.rerun_file import Recording
    from sinssim.recording.rerun_viewer import RUN_ENTITY
    from sinssim.recording.rerun_views import RunInfo, all_views

    time, variant = result.truth.time, result.section.variant
    span = (float(time[0]), float(time[-1]))
    run = RunInfo(scenario.name, *span, (variant,), labels={"kind": "one-component"}, views=scenario.views)
    with Recording(path, run.application, all_views(run), viewer) as recording:
        labels = {**run.labels, **_draw_pendulum(recording, result)}
        for charts in plane_charts(result):
            labels |= record_charts(recording, charts, "one_component/")
        recording.document("about/scenario", f"```toml\n{scenario.to_toml()}\n```")
        recording.document("about/summary", markdown_of([error_table(numbers(result))]))
        for stream in streams:
            recording.stream(stream, thin=scenario.recording.detail == "light")
        run = replace(run, labels=labels, ranges=dict(recording.ranges))
        recording.document(RUN_ENTITY, run.to_json())
        recording.blueprint(all_views(run))


def _draw_pendulum(recording: Recording, result: OneComponentResult) -> dict[str, str]:
    """Record the Schuler pendulum that Δy swings like, simulation over closed form; return how much it is enlarged."""
    import rerun as rr

    k = thinned(len(result.truth.time), _FRAMES)
    t = result.truth.time[k]
    lines = ((result.closed.coordinate, "closed", 9.0), (result.error.coordinate, "simulation", 3.0))
    largest = max(float(np.abs(y).max()) for y, _, _ in lines)
    factor = _LARGEST / largest if largest and np.isfinite(largest) else 1.0
    digits = 10.0 ** np.floor(np.log10(factor))
    factor = float(digits * np.floor(factor / digits))  # a round number
    arc = np.linspace(-1.3 * _LARGEST, 1.3 * _LARGEST, 61)
    grey = style.COLORS["ground"]
    rim = np.column_stack((np.sin(arc), np.cos(arc)))
    still = [rim, np.array([[0.0, 0.0], [0.0, 1.08]])]
    recording.static(
        "one_component/pendulum/scale", rr.LineStrips2D(still, radii=rr.Radius.ui_points(0.8), colors=grey)
    )
    colors = (EQUATION_COLORS["closed_form"], SIMULATION_COLOR)
    recording.static(
        "one_component/pendulum/words",
        rr.Points2D(
            [[0.0, 1.14], [-0.42, -0.1], [0.42, -0.1]],
            labels=["Δy = 0: true vertical", "closed form at rest", "simulation"],
            radii=rr.Radius.ui_points(0.1),
            colors=[grey, *colors],
            show_labels=True,
        ),
    )
    for order, ((y, name, size), color) in enumerate(zip(lines, colors, strict=True), start=1):
        angle, entity = factor * y[k], f"one_component/pendulum/{name}"
        bob = np.column_stack((np.sin(angle), np.cos(angle)))
        rods = np.stack((np.zeros_like(bob), bob), axis=1)
        rod = rr.LineStrips2D.from_fields(radii=rr.Radius.ui_points(size / 2.0), colors=[color], draw_order=order)
        recording.static(f"{entity}/rod", rod)
        recording.columns(f"{entity}/rod", t, rr.LineStrips2D.columns(strips=list(rods)))
        ball = rr.Points2D.from_fields(radii=rr.Radius.ui_points(3.0 + size), colors=[color], draw_order=order)
        recording.static(f"{entity}/bob", ball)
        recording.columns(f"{entity}/bob", t, rr.Points2D.columns(positions=bob))
    return {"enlarged": f"{factor:g}"}
