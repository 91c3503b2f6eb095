"""What a study has to show: verdicts, recommended engines, errors, orders, costs, motions, method."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table

from sinssim.experiments.studies import study_charts as figures
from sinssim.experiments.studies import study_charts as study_laws
from sinssim.experiments.studies.step_cost import Operations
from sinssim.experiments.studies.study_charts import (
    Label,
    at_one_rate,
    coordinate_tables,
    labeller,
    line_labeller,
    one_draw,
    over_rates,
    sensors_of,
    varying,
)
from sinssim.experiments.studies.study_results import ERRORS, Pick, Row, StudyResult, Verdict
from sinssim.experiments.studies.study_schema import Part
from sinssim.formatting import capital, number_text
from sinssim.recording.diagrams import three_rates
from sinssim.recording.figures import to_svg
from sinssim.recording.report.page import page, swatch, table, words
from sinssim.recording.report.svg_chart import STYLE, html_of

if TYPE_CHECKING:
    from rich.console import Console


_METRICS = (
    ("max_horizontal_error_m", "horizontal max, m"),
    ("final_horizontal_error_m", "final, m"),
    ("max_velocity_error_mps", "velocity max, m/s"),
    ("max_attitude_error_arcsec", "attitude max, ″"),
    ("final_attitude_error_arcsec", "final, ″"),
    ("max_defect", "defect max"),
)

_KINDS = ("+ −", "×", "÷", "√", "sin, cos, …", "all")

_STYLE = """
.verdict { display: inline-block; min-width: 5.6rem; text-align: center; border-radius: 3px; padding: 0 .5rem;
  font-weight: 600; color: #fff; print-color-adjust: exact; -webkit-print-color-adjust: exact; }
.confirmed { background: #00735a; } .refuted { background: #b03a00; } .partly { background: #8a6100; }
.undecided { background: #666; }
.verdict.small { min-width: 4.6rem; padding: 0 .3rem; font-size: .8em; font-weight: 400; margin-right: .3rem; }
"""


def html_report(comparison: StudyResult, about: dict[str, str]) -> str:
    """Return the report."""
    study = comparison.study
    body = [f"<h1>{words(study.name)}</h1>", f'<p class="lead">{words(study.description)}</p>']
    count = len(comparison.rows)
    broken_off = {"interrupted": "was interrupted", "failed": "failed"}.get(comparison.status)
    status = f" <strong>The study {broken_off}; the report shows the finished cases.</strong>" if broken_off else ""
    navigations = "1 navigation" if count == 1 else f"{count} navigations"
    body.append(f'<p class="note">{navigations} in {comparison.seconds:.0f} s, seed {study.seed}.{status}</p>')
    if comparison.verdicts:
        body += ["<h2>Claims and verdicts</h2>", _verdicts(comparison)]
    if comparison.picks:
        body += ["<h2>Recommended engines</h2>", _picks(comparison)]
    paint = figures.palette(comparison)
    for number_, part in enumerate(study.parts, start=1):
        rows = comparison.of_part(part.title)
        body.append(f"<h2>{number_}. {words(part.title)}</h2>")
        if part.text:
            body.append(f"<p>{words(part.text)}</p>")
        if said := one_draw(part, study):
            body.append(f'<p class="note"><strong>{words(said)}</strong></p>')
        if part.schedules_hz:
            body.append(to_svg(three_rates(), f"rates{number_}"))
        body += _part(comparison, part, rows, paint) if rows else ["<p>Not reached.</p>"]
    body += ["<h2>Cost of a step</h2>", *_costs(comparison)]
    body += ["<h2>Motions</h2>", _motions(comparison), "<h2>How it was measured</h2>", _method(comparison, about)]
    return page(f"{study.name}: comparison", body, STYLE + _STYLE)


def _swatch(algorithm: str) -> str:
    return swatch(figures.color_of(algorithm))


def _verdicts(comparison: StudyResult) -> str:
    lines = [
        (
            words(capital(v.sentence)),
            f'<td class="name"><span class="verdict {v.verdict}">{v.verdict}</span></td>',
            f'<td class="text">{words(v.reason)}{_points(v)}</td>',
        )
        for v in comparison.verdicts
    ]
    verdicts = table(("claim", "verdict", "the numbers that decide"), lines, 3)
    return verdicts.replace("<td class=name>", '<td class="text">')


def _picks(comparison: StudyResult) -> str:
    lines = [
        (
            words(pick.part),
            f'<td class="name">{words(sensors_of(pick))}</td>',
            f'<td class="name"><strong>{words(pick.choice or "–")}</strong></td>',
            f'<td class="text">{words(pick.reason)}</td>',
        )
        for pick in comparison.picks
    ]
    picks = table(("part", "sensors", "pick", "the numbers that decide"), lines, 4)
    return picks.replace("<td class=name>", '<td class="text">') + (
        "<p class=note>The engine with the least computation among those accurate enough on every motion: horizontal "
        "error at most 0.1 nmi/h, or 1.1 of the least on that motion, and attitude error at most 0.3′, or 1.1 of the "
        "least. Processor time as measured below, of each schedule with its own rates.</p>"
    )


def _points(verdict: Verdict) -> str:
    points = "".join(f"<li>{_mark(judged)}{words(point)}</li>" for point, judged in verdict.lines)
    return f"<ul>{points}</ul>" if points else ""


def _mark(judged: str) -> str:
    return f'<span class="verdict small {judged}">{judged}</span> ' if judged else ""


def _part(comparison: StudyResult, part: Part, rows: list[Row], paint: figures.Paint) -> list[str]:
    body: list[str] = []
    failed = [row for row in rows if row.status == "failed"]
    if over_rates(part):
        label = labeller(rows)
        for over, draw in (("rate", figures.against_rate), ("cost", figures.against_cost)):
            body += [f"<h3>Accuracy against {over}</h3>", html_of(draw(rows, label, paint))]
        for quantity, title in zip(ERRORS, ("Largest attitude error, ″", "Largest horizontal error, m"), strict=True):
            for motion in dict.fromkeys(row.motion for row in rows):
                here = [row for row in rows if row.motion == motion]
                unfold = " open" if quantity == ERRORS[0] else ""
                body.append(f"<details{unfold}><summary>{title}: {words(motion)}</summary>")
                body.append(_pivot(here, quantity, label, paint) + "</details>")
        body += _orders(comparison, part)
        if any(row.max_defect > 0.0 for row in rows):
            body += [
                "<h3>Loss of norm or orthogonality</h3>",
                "<p class=note>|‖q‖ − 1| of quaternions, the largest element of |BBᵀ − I| of direction cosines, both "
                "of the algorithm's own variables; Euler angles have no such defect. Values of 1e-13 are rounding.</p>",
                html_of(figures.defect_against_rate(rows, label, paint)),
                study_laws.guarantees_section(comparison, part, rows),
            ]
    else:
        if any(row.status == "done" for row in rows):
            drawn = figures.bars(rows, labeller(rows, pace=True), line_labeller(part, rows), paint)
            body.append(html_of(drawn))
            label, done = line_labeller(part, rows), [row for row in rows if row.status == "done"]
            panels = {
                motion: [(label(row), comparison.history(row)) for row in at_one_rate(done) if row.motion == motion]
                for motion in dict.fromkeys(row.motion for row in done)
            }
            body += [
                "<h3>Growth of the position error</h3>",
                html_of(figures.growth(panels, paint)),
            ]
        body.append(_long_table(rows))
    body += coordinate_tables(comparison, part, rows)
    body += study_laws.turning_section(comparison, part) + study_laws.power_of_time_section(comparison, part)
    passed = [row for row in rows if row.passages]
    if passed:
        body += ["<h3>Passages through the singular attitude</h3>", _passages(passed)]
    if failed:
        body.append("<h3>Failed navigations</h3><ul>")
        reasons: dict[str, list[str]] = {}
        label = labeller(rows, pace=True)
        for row in failed:
            reasons.setdefault(row.message, []).append(f"{row.motion} · {label(row)}")
        body += [f"<li><strong>{words('; '.join(names))}</strong>: {words(why)}</li>" for why, names in reasons.items()]
        body.append("</ul>")
    return body


def _pivot(rows: list[Row], quantity: str, label: Label, paint: figures.Paint) -> str:
    rates = sorted({row.rate_hz for row in rows})
    values = {(label(row), row.rate_hz): getattr(row, quantity) for row in rows}
    finite = [v for v in values.values() if math.isfinite(v) and v > 0.0]
    low, high = (math.log10(min(finite)), math.log10(max(finite))) if finite else (0.0, 1.0)

    def cell(value: float) -> str:
        if not (math.isfinite(value) and value > 0.0):
            return f"<td>{number_text(value)}</td>"
        good = 1.0 - (math.log10(value) - low) / max(high - low, 1e-9)
        return f'<td style="background:rgba(0,158,115,{0.45 * good:.2f})">{number_text(value)}</td>'

    lines = []
    for name in dict.fromkeys(label(row) for row in rows):
        cells = [cell(values.get((name, rate), math.nan)) for rate in rates]
        lines.append((swatch(paint[name]) + words(name), *cells))
    return table(("", *(f"{rate:g} Hz" for rate in rates)), lines)


def _orders(comparison: StudyResult, part: Part) -> list[str]:
    orders = [order for order in comparison.orders if order.part == part.title and order.quantity in ERRORS]
    if not orders:
        return []
    attitude = [order for order in orders if order.quantity == ERRORS[0]]
    body = [
        "<h3>Order of convergence</h3>",
        "<p class=note>Slope of log error over log interval, fitted through the four highest rates at which the error "
        "exceeds rounding and thirty times the least error of the best algorithm, with its standard error. No number: "
        "fewer than three such rates, or the errors do not follow a straight line.</p>",
    ]
    if attitude:
        body.append(html_of(figures.orders(attitude)))
    motions = list(dict.fromkeys(order.motion for order in orders))
    heads = ["", *(f"{m}: {q}" for m in motions for q in ("attitude", "position"))]
    lines = []
    for algorithm in dict.fromkeys(row.algorithm for row in comparison.of_part(part.title)):
        cells = []
        for motion in motions:
            for quantity in ERRORS:
                one = [o for o in orders if (o.algorithm, o.motion, o.quantity) == (algorithm, motion, quantity)]
                cells.append(f"{one[0].order:.2f} ± {one[0].uncertainty:.2f}" if one else "–")
        lines.append((_swatch(algorithm) + words(algorithm), *cells))
    return [*body, table(heads, lines)]


def _long_table(rows: list[Row]) -> str:
    dimensions = [*(["motion"] if len({row.motion for row in rows}) > 1 else []), *varying(rows)]
    if len({row.pace for row in rows}) > 1:
        dimensions.append("pace")
    heads = [*("rate, Hz" if d == "pace" else d for d in dimensions), *(title for _, title in _METRICS)]
    lines = [
        (
            *(words(str(getattr(row, d))) for d in dimensions),
            *(number_text(getattr(row, m)) if row.status == "done" else "failed" for m, _ in _METRICS),
        )
        for row in rows
    ]
    return table(heads, lines, len(dimensions))


def _passages(rows: list[Row]) -> str:
    lines = [
        (words(r.algorithm), words(r.motion), r.pace, str(r.passages), number_text(r.max_damage_arcsec / 60.0),
         number_text(r.max_horizontal_error_m), f'<td class="text">{words(r.message)}</td>')
        for r in rows
    ]  # fmt: skip
    heads = ("", "motion", "rate, Hz", "passages", "largest damage, ′", "horizontal max, m")
    return table((*heads, "<th class=name>event</th>"), lines, 2)


def _costs(comparison: StudyResult) -> list[str]:
    lines = []
    for cost in comparison.costs.values():
        per_second = f"{cost.ns_per_step * cost.schedule_hz[0] * 1e-3:.1f}" if cost.schedule_hz else "–"
        lines.append(
            (
                _swatch(cost.algorithm) + words(cost.algorithm),
                words(cost.frame),
                words(cost.pace),
                *_operations(cost.operations),
                f"{cost.ns_per_step:.0f}",
                f"{1e3 / cost.ns_per_step:.2f}",
                per_second,
            )
        )
    heads = ("algorithm", "frame", "rates, Hz", *_KINDS, "ns per step", "million steps/s", "µs per s of motion")
    return [
        "<h3>Whole navigation</h3>",
        "<p class=note>A step is the complete computation for one sample: attitude, velocity and position, Coriolis "
        "and "
        "gravity. Of a schedule it is one step of the fast part with its share of the medium and the slow part; the "
        "cost depends only on the ratios of the rates, and holding and extrapolation have the same cost. Operations "
        "are "
        "counted by running the code of the step on numbers that count their operations, as written and along the "
        "branches taken; the compiled code may need fewer. The unit quaternion and the defect in a row of the solution "
        "are not counted. Time is the processor time of one core for the whole call with its checks and output rows, "
        "the minimum of several calls. The engine of one rate compensates the increments in blocks, several in one "
        "operation of the processor, and has a higher order; that of a schedule does not.</p>",
        html_of(figures.costs(comparison)),
        table(heads, lines, 3),
        *_attitude_costs(comparison),
    ]


def _attitude_costs(comparison: StudyResult) -> list[str]:
    """Return the table of the costs of the attitude alone."""
    if not comparison.attitude_costs:
        return []
    lines = [
        (
            _swatch(cost.algorithm) + words(cost.name),
            *_operations(cost.operations),
            f"{cost.matrix.total:.0f}",
            f"{cost.matrix.function:.0f}",
            f"{cost.ns_per_step:.1f}",
        )
        for cost in comparison.attitude_costs
    ]
    heads = ("algorithm", *_KINDS, "of these, B", "sin, cos of B", "ns per step")
    return [
        "<h3>Attitude alone</h3>",
        "<p class=note>A step is the compensation of the angle increments, the attitude, and the matrix B that "
        "resolves forces, computed for every sample; velocity and position are left out. Only operations that attitude "
        "and B depend on are counted. B follows from a quaternion by products and is itself the variable of Poisson’s "
        "equation. Euler angles need sines and cosines: the engine has them from its step by the addition theorems; "
        "the other line has six functions for each B. In sums a function counts as the 24 additions and "
        "multiplications of a sine to rounding.</p>",
        table(heads, lines, 1),
    ]


def _operations(o: Operations) -> tuple[str, ...]:
    """Return the cells of the numbers of operations, in the order of `_KINDS`."""
    return (
        *(f"{value:.0f}" for value in (o.add, o.multiply)),
        *(f"{value:.1f}" for value in (o.divide, o.root, o.function)),
        f"{o.total:.0f}",
    )


def _motions(comparison: StudyResult) -> str:
    heads = (
        "",
        "duration, s",
        "distance, km",
        "mean ground speed, km/h",
        "largest rate, deg/s",
        "steepest pitch, deg",
        "latitude rate, deg/h",
        "largest latitude, deg",
    )
    lines = [
        (
            words(name),
            f"{f.duration_s:.0f}",
            f"{f.distance_m / 1e3:.1f}",
            f"{f.ground_speed_kmh:.1f}",
            f"{f.max_rate_deg_s:.2f}",
            f"{f.max_pitch_deg:.1f}",
            f"{f.latitude_rate_deg_h:.3f}",
            f"{f.max_latitude_deg:.2f}",
        )
        # a motion of several parts appears once; with another duration it counts as another motion
        for name, f in dict.fromkeys((name, facts) for (_, name), facts in comparison.motions.items())
    ]
    return table(heads, lines)


def _method(comparison: StudyResult, about: dict[str, str]) -> str:
    versions = ", ".join(f"{name} {value}" for name, value in about.items())
    return (
        "<p>All algorithms process identical samples, which are generated (and, with real sensors, measured) at the "
        "highest rate of a part. Samples of a lower rate are sums of these, like the counts of a gyro that is read "
        "less often. "
        "The truth is a continuous motion; the increments are its exact integrals. Navigation starts at the true "
        "state. Errors against the truth are taken at about 4000 times spread evenly over the motion. Attitude "
        "errors are the angle of the single rotation between true and computed attitude in the local level. Every "
        f"number is in results.json and results.parquet in the same directory.</p><p class=note>{words(versions)}.</p>"
    )


_CELL = 10
"""Width of a number in a console table, including padding."""


def show(comparison: StudyResult, console: Console) -> None:
    """Print the verdicts, the recommended engines, and a table for each motion of the parts that decide no claim."""
    if comparison.verdicts:
        _show_verdicts(comparison.verdicts, console)
    if comparison.picks:
        _show_picks(comparison.picks, console)
    for part in comparison.study.parts:
        rows = comparison.of_part(part.title)
        for motion in dict.fromkeys(row.motion for row in rows if not part.decides):
            here = [row for row in rows if row.motion == motion]
            if over_rates(part):
                _show_rates(f"{part.title}: {motion}, largest attitude error in arcsec", here, labeller(rows), console)
            else:
                _show_cases(f"{part.title}: {motion}, largest errors", here, labeller(rows, pace=True), console)
        if said := one_draw(part, comparison.study):
            console.print(f"{part.title}: {said}", markup=False)
    failed = sum(row.status == "failed" for row in comparison.rows)
    if failed:
        console.print(
            f"{failed} of {len(comparison.rows)} navigations failed; the report gives the reasons.", markup=False
        )


def _show_verdicts(verdicts: list[Verdict], console: Console) -> None:
    """Print a line for each claim: in words, verdict, the measured figure, and the figure if it held."""
    table = _console_table()
    table.add_column("claim", no_wrap=True)
    for heading in ("verdict", "measured", "expected"):
        table.add_column(heading, overflow="fold")
    for verdict in verdicts:
        table.add_row(verdict.title, verdict.verdict, verdict.measured or "–", verdict.expected or "–")
    console.print(table, markup=False)


def _show_picks(picks: list[Pick], console: Console) -> None:
    """Print a line for each recommended engine."""
    table = _console_table()
    for heading in ("part", "sensors", "recommended engine"):
        table.add_column(heading, overflow="fold")
    for heading in ("horizontal\nm", "attitude\narcsec/h", "µs per s\nof motion"):
        table.add_column(heading, justify="right", no_wrap=True)
    for pick in picks:
        keys = ("max_horizontal_error_m", "attitude_drift_arcsec_h", "us_per_second")
        errors = (number_text(pick.numbers.get(key, math.nan)) for key in keys)
        table.add_row(pick.part, sensors_of(pick), pick.choice or pick.reason, *errors)
    console.print(table, markup=False)


def _show_rates(title: str, rows: list[Row], label: Label, console: Console) -> None:
    names = list(dict.fromkeys(label(row) for row in rows))
    rates = sorted({row.rate_hz for row in rows})
    # As many rates as fit, the lowest and the highest among them; no number is truncated.
    room = max(2, (console.width - max(map(len, names)) - 2) // _CELL)
    if len(rates) > room:
        rates = [rates[round(i * (len(rates) - 1) / (room - 1))] for i in range(room)]
    console.print(title, markup=False)
    console_table = _console_table()
    console_table.add_column("", no_wrap=True)
    for rate in rates:
        console_table.add_column(f"{rate:g} Hz", justify="right", no_wrap=True)
    values = {(label(row), row.rate_hz): row.max_attitude_error_arcsec for row in rows}
    for name in names:
        console_table.add_row(name, *(number_text(values.get((name, rate), math.nan), 2) for rate in rates))
    console.print(console_table)


def _show_cases(title: str, rows: list[Row], label: Label, console: Console) -> None:
    console.print(title, markup=False)
    console_table = _console_table()
    console_table.add_column("", overflow="fold")
    for heading in ("horizontal\nm", "velocity\nm/s", "attitude\narcsec"):
        console_table.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        errors = (row.max_horizontal_error_m, row.max_velocity_error_mps, row.max_attitude_error_arcsec)
        console_table.add_row(label(row), *(map(number_text, errors) if row.status == "done" else ("failed", "", "")))
    console.print(console_table)


def _console_table() -> Table:
    return Table(box=box.SIMPLE_HEAD, pad_edge=False)
