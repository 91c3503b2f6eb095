"""What a study has to show, and the files that it writes."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import tomli_w

from sinssim.charts import Charts
from sinssim.errors import InputError
from sinssim.exhibits import Column, Exhibits, Item, Picture, Points, Section, Sentence, Table
from sinssim.experiments.studies import study_charts as charts
from sinssim.experiments.studies.attitude_claims import guarantee
from sinssim.experiments.studies.step_cost import Operations
from sinssim.experiments.studies.study_charts import Label, labeller, over_rates, varying
from sinssim.experiments.studies.study_directory import StudyDirectory
from sinssim.experiments.studies.study_results import DEFECT, ERRORS, Case, Pick, Row, StudyResult, Verdict
from sinssim.experiments.studies.study_schema import Part
from sinssim.recording.diagrams import three_rates
from sinssim.recording.result import Media, plain, software, versions, write_json, write_shown
from sinssim.recording.streams import write_table
from sinssim.scenario.tables import COORDINATES
from sinssim.system.files import write_text
from sinssim.units import ARCMIN, ARCSEC, capital, fixed, number_text, percent

_PAGE: Any = ("page",)
_CONSOLE: Any = ("console",)
_WRITTEN: Any = ("page", "recording")
_METRES, _ARCSEC = fixed("m"), fixed("″", ARCSEC)
_TITLES = ("largest attitude error", "largest horizontal error")
"""Of the tables of `ERRORS`."""
_METRICS: tuple[tuple[str, Column, float], ...] = (
    ("max_horizontal_error_m", Column("horizontal max", _METRES, digits=3), 1.0),
    ("final_horizontal_error_m", Column("final", _METRES, digits=3, on=_PAGE), 1.0),
    ("max_velocity_error_mps", Column("velocity max", fixed("m/s"), digits=3, on=("page", "console")), 1.0),
    ("max_attitude_error_arcsec", Column("attitude max", _ARCSEC, digits=3), ARCSEC),
    ("final_attitude_error_arcsec", Column("final", _ARCSEC, digits=3, on=_PAGE), ARCSEC),
    ("max_defect", Column("defect max", digits=3, on=_PAGE), 1.0),
)
"""The numbers of a case: attribute of its row, column, and unit of the attribute in SI."""
_OPERATIONS = tuple(map(Column, ("+ −", "×", "÷", "√", "sin, cos, …", "all")))
_COORDINATE_UNITS = (("_mps", fixed("m/s")), ("_rad", _ARCSEC), ("_m", _METRES))


def exhibits_of(comparison: StudyResult) -> Exhibits:
    """Return what a study has to show."""
    study, paint = comparison.study, charts.palette(comparison)
    stopped = {"interrupted": "was interrupted", "failed": "failed"}.get(comparison.status)
    count, failed = len(comparison.rows), sum(row.status == "failed" for row in comparison.rows)
    panels, growth = charts.growth_over_time(comparison, paint)
    items: list[Item] = [
        Sentence(" ".join(study.description.split()), "lead", on=_WRITTEN),
        Sentence(f"{count} navigation{'s' * (count != 1)} in {comparison.seconds:.0f} s, seed {study.seed}.", "note",
                 on=_WRITTEN),
        *([Sentence(f"The study {stopped}; the report shows the finished cases.", "strong", on=_WRITTEN)]
          if stopped else []),
        *([_verdicts(comparison.verdicts)] if comparison.verdicts else []),
        *([_picks(comparison.picks)] if comparison.picks else []),
        *(Section(f"{number}. {part.title}", [*_part(comparison, part, paint)])
          for number, part in enumerate(study.parts, start=1)),
        Section("Cost of a step", [*_costs(comparison)], on=_PAGE),
        Section("Motions", [_motions(comparison)], on=_PAGE),
        Section("How it was measured", [Sentence(_METHOD), Sentence(f"{software()}.", "note")], on=_PAGE),
        *growth,
    ]  # fmt: skip
    if failed:
        items.append(Sentence(f"{failed} of {count} navigations failed; the report gives the reasons.",
                              on=_CONSOLE))  # fmt: skip
    last = max((float(history.time[-1]) for history in comparison.histories.values()), default=1.0)
    drawn = next((part for part in study.parts if charts.finished(comparison.of_part(part.title))), None)
    return Exhibits(
        study.name, items, name=study.name, kind="study", root="comparison", span=(0.0, last),
        figure="" if drawn is None else "rate" if over_rates(drawn) else "bars", labels={"panels": json.dumps(panels)},
    )  # fmt: skip


def _verdicts(verdicts: Sequence[Verdict]) -> Section:
    heads = tuple(Column(head, words=True) for head in ("claim", "verdict", "measured", "expected"))
    rows = [(v.title, v.verdict, v.measured or "–", v.expected or "–") for v in verdicts]
    claims = [
        Section(
            capital(v.sentence),
            [Sentence(v.reason), Points([f"{word}: {point}" if word else point for point, word in v.lines])],
            v.verdict,  # type: ignore[arg-type]
            on=_WRITTEN,
        )
        for v in verdicts
    ]
    return Section("Claims and verdicts", [Table(heads, rows), *claims])


def _picks(picks: Sequence[Pick]) -> Section:
    columns = (
        *(Column(head, words=True) for head in ("part", "sensors", "recommended engine")),
        Column("horizontal", _METRES, digits=3, on=_CONSOLE), Column("attitude", fixed("″/h"), digits=3, on=_CONSOLE),
        Column("processor time", fixed("µs/s"), digits=3, on=_CONSOLE),
        Column("the numbers that decide", words=True, on=_WRITTEN),
    )  # fmt: skip
    keys = ("max_horizontal_error_m", "attitude_drift_arcsec_h", "us_per_second")
    rows: list[Sequence[str | float]] = [
        (p.part, p.block, f"**{p.choice}**" if p.choice else p.reason, *(p.numbers.get(key, math.nan) for key in keys),
         p.reason if p.choice else "")
        for p in picks
    ]  # fmt: skip
    note = (
        "The engine with the least computation among those accurate enough on every motion: horizontal error at most "
        "0.1 nmi/h, or 1.1 of the least on that motion, and attitude error at most 0.3′/h, or 1.1 of the least. "
        "Processor time as measured below, of each schedule with its own rates."
    )
    return Section("Recommended engines", [Table(columns, rows), Sentence(note, "note", on=_WRITTEN)])


def _part(comparison: StudyResult, part: Part, paint: charts.Paint) -> Iterator[Item]:
    rows = comparison.of_part(part.title)
    warning = charts.one_draw(part, comparison.study)
    if (rows and not part.decides) or warning:
        yield Sentence(f"{part.title}:", on=_CONSOLE)
    if part.text:
        yield Sentence(" ".join(part.text.split()), on=_WRITTEN)
    if part.schedules_hz:
        yield Picture(three_rates)
    if not rows:
        yield Sentence("Not reached.", on=_WRITTEN)
    elif over_rates(part):
        yield from _over_rates(comparison, part, rows, paint)
    else:
        if charts.finished(rows):
            name = charts.line_labeller(part, rows)
            yield charts.bars(rows, labeller(rows, pace=True), name, paint)
            panels = charts.panels_of(comparison, part, rows)
            yield Section("Growth of the position error", [charts.growth(panels, paint)])
        yield _cases(rows, _WRITTEN if part.decides else ("console", *_WRITTEN))
    if warning:
        yield Sentence(warning, "strong")
    if rows:
        yield from _coordinates(comparison, part, rows)
        yield from _headings(comparison, part)
        yield from _power_of_time(comparison, part)
        yield from _passages(rows)
        yield from _failures(rows)


def _over_rates(comparison: StudyResult, part: Part, rows: Sequence[Row], paint: charts.Paint) -> Iterator[Item]:
    label = labeller(rows)
    yield Section("Accuracy against rate", [charts.against_rate(rows, label, paint)])
    yield Section("Accuracy against cost", [charts.against_cost(rows, label, paint)])
    for quantity, title in zip(ERRORS, _TITLES, strict=True):
        attitude = quantity == ERRORS[0]
        on: Any = _PAGE if not attitude else _WRITTEN if part.decides else ("console", *_WRITTEN)
        for motion in dict.fromkeys(row.motion for row in rows):
            table = _against_rates([row for row in rows if row.motion == motion], quantity, label, paint)
            name = f"{motion}: {title}, {'″' if attitude else 'm'}"
            yield Section(name, [table], fold="open" if attitude else "closed", on=on)
    yield from _orders(comparison, part)
    if any(row.max_defect > 0.0 for row in rows):
        note = (
            "|‖q‖ − 1| of quaternions, the largest element of |BBᵀ − I| of direction cosines, both of the algorithm's "
            "own variables; Euler angles have no such defect. Values of 1e-13 are rounding."
        )
        drawn = charts.defect_against_rate(rows, label, paint)
        yield Section("Loss of norm or orthogonality", [
            Sentence(note, "note"), drawn, *_guarantees(comparison, part, rows)], on=_PAGE)  # fmt: skip


def _against_rates(rows: Sequence[Row], quantity: str, label: Label, paint: charts.Paint) -> Table:
    """Return the errors of one motion: a row for each algorithm or varied choice, a column for each rate."""
    rates, names = sorted({row.rate_hz for row in rows}), list(dict.fromkeys(map(label, rows)))
    values = {(label(row), row.rate_hz): getattr(row, quantity) for row in rows}
    return Table(
        (Column("", words=True), *(Column(f"{rate:g} Hz", digits=3) for rate in rates)),
        [(name, *(values.get((name, rate), math.nan) for rate in rates)) for name in names],
        colors=[paint[name] for name in names], shaded=True, rising=True,
    )  # fmt: skip


def _orders(comparison: StudyResult, part: Part) -> Iterator[Item]:
    orders = [order for order in comparison.orders if order.part == part.title and order.quantity in ERRORS]
    if not orders:
        return
    note = (
        "Slope of log error over log interval, fitted through the four highest rates at which the error exceeds "
        "rounding and thirty times the least error of the best algorithm, with its standard error. No number: fewer "
        "than three such rates, or the errors do not follow a straight line."
    )
    attitude = [order for order in orders if order.quantity == ERRORS[0]]
    motions = list(dict.fromkeys(order.motion for order in orders))
    algorithms = list(dict.fromkeys(row.algorithm for row in comparison.of_part(part.title)))
    texts = {(o.algorithm, o.motion, o.quantity): f"{o.order:.2f} ± {o.uncertainty:.2f}" for o in orders}
    table = Table(
        (Column("", words=True), *(Column(f"{m}: {q}") for m in motions for q in ("attitude", "position"))),
        [(name, *(texts.get((name, m, q), "–") for m in motions for q in ERRORS)) for name in algorithms],
        colors=charts.colors_of(algorithms),
    )  # fmt: skip
    drawn = [charts.orders(attitude)] if attitude else []
    yield Section("Order of convergence", [Sentence(note, "note"), *drawn, table], on=_PAGE)


def _guarantees(comparison: StudyResult, part: Part, rows: Sequence[Row]) -> Iterator[Item]:
    """Yield what each algorithm keeps of norm and orthogonality, by theory and measured."""
    orders = [order for order in comparison.orders if (order.part, order.quantity) == (part.title, DEFECT)]
    measured = {(o.algorithm, o.motion): f"{o.order:.2f} ± {o.uncertainty:.2f}" for o in orders}
    motions, algorithms = (list(dict.fromkeys(getattr(row, k) for row in rows)) for k in ("motion", "algorithm"))
    lines = []
    for algorithm in algorithms:
        theory = guarantee(algorithm)
        worst = max((r.max_defect for r in charts.finished(rows) if r.algorithm == algorithm), default=0.0)
        lines.append((algorithm, theory.condition, theory.words, theory.reason,
                      *(measured.get((algorithm, motion), "–") for motion in motions), worst))  # fmt: skip
    yield Sentence(
        "What is kept exactly, to rounding, or to a power of the interval h, by theory; φ is the angle of a step. Axes "
        "of a matrix that is computed from a quaternion remain orthogonal; their length is the squared norm. Measured "
        "order: the slope of the log of the largest defect over log h through the four highest rates above rounding "
        "(1e-10). No number: fewer than three such rates, or no straight line.", "note",
    )  # fmt: skip
    heads = (Column(head, words=True) for head in ("", "condition", "kept", "why"))
    orders_of = (Column(f"order: {motion}") for motion in motions)
    columns = (*heads, *orders_of, Column("largest defect", digits=2))
    yield Table(columns, lines, colors=charts.colors_of(algorithms))


def _cases(rows: Sequence[Row], on: Any) -> Table:
    """Return the errors of cases that are not compared over rates."""
    several = [name for name in ("motion", "pace") if len({getattr(row, name) for row in rows}) > 1]
    names = [*(["motion"] if "motion" in several else []), *varying(rows), *(["pace"] if "pace" in several else [])]
    names = names or ["algorithm"]
    columns = [*(Column("rate, Hz" if name == "pace" else name, words=True) for name in names),
               *(column for _, column, _ in _METRICS)]  # fmt: skip
    lines = [
        (*(str(getattr(row, name)) for name in names),
         *(getattr(row, key) * size if row.status == "done" else "failed" for key, _, size in _METRICS))
        for row in rows
    ]  # fmt: skip
    motion = "" if "motion" in names else f", {rows[0].motion}"
    return Table(tuple(columns), lines, f"Largest and final errors{motion}", on=on)


def _coordinates(comparison: StudyResult, part: Part, rows: Sequence[Row]) -> Iterator[Item]:
    """Yield the largest errors in each kind of further coordinates of a part."""
    label = labeller(rows, pace=True)
    for kind in part.coordinates:
        lines, columns = list[Sequence[str | float]](), list[Column]()
        for row in rows:
            errors = [e for e in comparison.coordinate_errors if e.coordinates == kind and e.case == row.case]
            if errors:
                columns = [_coordinate_column(error.column) for error in errors]
                lines.append((row.motion, label(row), *(error.max_error for error in errors)))
        if lines:
            note = (f"{capital(COORDINATES[kind])}. Computed minus true, component by component; the attitude is the "
                    "angle of the single rotation between both.")  # fmt: skip
            heads = (Column("motion", words=True), Column("", words=True), *columns)
            yield Section(f"Largest errors in the coordinates {kind}", [Sentence(note, "note"), Table(heads, lines)],
                          on=_PAGE)  # fmt: skip


def _coordinate_column(name: str) -> Column:
    for ending, units in _COORDINATE_UNITS:
        if name.endswith(ending):
            return Column(name.removesuffix(ending).replace("_", " "), units, digits=3)
    return Column(name.replace("_", " "), digits=3)


def _headings(comparison: StudyResult, part: Part) -> Iterator[Item]:
    headings = [heading for heading in comparison.headings if heading.part == part.title]
    if not headings:
        return
    note = (
        "Only the attitude, with the true rate of the local level, compared with the true heading, which counts turns. "
        "The heading of Euler angles is an integral. That of direction cosines is the arctangent of C₂₁/C₁₁: of one "
        "argument it lies within ±90°, of two within ±180°; unwrapped, it adds a turn if two successive values differ "
        "by more than half a turn."
    )
    columns = (
        Column("motion", words=True), Column("form", words=True), Column("rate", fixed("Hz")), Column("turns"),
        *map(Column, ("error max", "final", "jumps", "wrong by > 0.3′", "lowest rate of reading, Hz")),
    )  # fmt: skip
    lines = [
        (h.motion, h.form, h.rate_hz, f"{h.turns:.2f}", _angle(h.max_error_arcsec), _angle(h.final_error_arcsec),
         str(h.jumps), percent(h.wrong), number_text(h.least_hz, 2) if h.least_hz else "any")
        for h in headings
    ]  # fmt: skip
    drawn = charts.turning(charts.at_highest_rate(headings))
    yield Section("Heading through full turns", [Sentence(note, "note"), drawn, Table(columns, lines)], on=_PAGE)


def _angle(arcsec: float) -> str:
    return f"{number_text(arcsec)}″" if abs(arcsec) < 3600.0 else f"{number_text(arcsec / 3600.0)}°"


def _power_of_time(comparison: StudyResult, part: Part) -> Iterator[Item]:
    blocks = charts.gyro_free_blocks(comparison, part) if "gyro-free" in part.decides else {}
    if blocks:
        note = (
            "Errors while the tilt is below 5°, from where the biases’ direct effect is below one percent. Below: the "
            "local power of time, d log error / d log t. The closed form for a body at rest, from "
            "R δω̇ (½ t² − (1 − cos ω_s t)/ω_s²), is (θ² − θ sin θ)/(½ θ² − 1 + cos θ) with θ = ω_s t. Grey: 4.0 ± 0.1 "
            "below 1000 s, 2.0 ± 0.2 beyond one Schuler period. The rotation of the Earth causes the slow deviation at "
            "the end."
        )
        drawn: Charts = charts.power_of_time(blocks)
        yield Section("Power of time without gyros", [Sentence(note, "note"), drawn], on=_PAGE)


def _passages(rows: Sequence[Row]) -> Iterator[Item]:
    columns = (
        Column("", words=True), Column("motion", words=True), Column("rate, Hz"), Column("passages"),
        Column("largest damage", fixed("′", ARCMIN), digits=3), Column("horizontal max", _METRES, digits=3),
        Column("event", words=True),
    )  # fmt: skip
    lines: list[Sequence[str | float]] = [
        (row.algorithm, row.motion, row.pace, str(row.passages), row.max_damage_arcsec * ARCSEC,
         row.max_horizontal_error_m, row.message)
        for row in rows if row.passages
    ]  # fmt: skip
    if lines:
        yield Section("Passages through the singular attitude", [Table(columns, lines)], on=_PAGE)


def _failures(rows: Sequence[Row]) -> Iterator[Item]:
    label, reasons = labeller(rows, pace=True), dict[str, list[str]]()
    for row in rows:
        if row.status == "failed":
            reasons.setdefault(row.message, []).append(f"{row.motion} · {label(row)}")
    if reasons:
        texts = [f"**{'; '.join(names)}**: {why}" for why, names in reasons.items()]
        yield Section("Failed navigations", [Points(texts)], on=_WRITTEN)


def _costs(comparison: StudyResult) -> Iterator[Item]:
    """Yield the costs of a step, of the whole navigation and of the attitude alone."""
    costs = comparison.costs.values()
    columns = (
        *(Column(head, words=True) for head in ("algorithm", "frame", "rates, Hz")), *_OPERATIONS,
        *map(Column, ("ns per step", "million steps/s", "µs per s of motion")),
    )  # fmt: skip
    lines = [
        (cost.algorithm, cost.frame, cost.pace, *_operations(cost.operations), f"{cost.ns_per_step:.0f}",
         f"{1e3 / cost.ns_per_step:.2f}",
         f"{cost.ns_per_step * cost.schedule_hz[0] * 1e-3:.1f}" if cost.schedule_hz else "–")
        for cost in costs
    ]  # fmt: skip
    yield Section("Whole navigation", [
        Sentence(_WHOLE, "note"), charts.costs(comparison),
        Table(columns, lines, colors=charts.colors_of([cost.algorithm for cost in costs])),
    ])  # fmt: skip
    if comparison.attitude_costs:
        heads = map(Column, ("of these, B", "sin, cos of B", "ns per step"))
        lines = [
            (cost.name, *_operations(cost.operations), f"{cost.matrix.total:.0f}", f"{cost.matrix.function:.0f}",
             f"{cost.ns_per_step:.1f}")
            for cost in comparison.attitude_costs
        ]  # fmt: skip
        table = Table((Column("algorithm", words=True), *_OPERATIONS, *heads), lines,
                      colors=charts.colors_of([cost.algorithm for cost in comparison.attitude_costs]))  # fmt: skip
        yield Section("Attitude alone", [Sentence(_ALONE, "note"), table])


_WHOLE = (
    "A step is the complete computation for one sample: attitude, velocity and position, Coriolis and gravity. Of a "
    "schedule it is one step of the fast part with its share of the medium and the slow part; the cost depends only on "
    "the ratios of the rates, and holding and extrapolation have the same cost. Operations are counted by running the "
    "code of the step on numbers that count their operations, as written and along the branches taken; the compiled "
    "code may need fewer. The unit quaternion and the defect in a row of the solution are not counted. Time is the "
    "processor time of one core for the whole call with its checks and output rows, the minimum of several calls. The "
    "engine of one rate compensates the increments in blocks, several in one operation of the processor, and has a "
    "higher order; that of a schedule does not."
)
_ALONE = (
    "A step is the compensation of the angle increments, the attitude, and the matrix B that resolves forces, computed "
    "for every sample; velocity and position are left out. Only operations that attitude and B depend on are counted. "
    "B follows from a quaternion by products and is itself the variable of Poisson’s equation. Euler angles need sines "
    "and cosines: the engine has them from its step by the addition theorems; the other line has six functions for "
    "each B. In sums a function counts as the 24 additions and multiplications of a sine to rounding."
)
_METHOD = (
    "All algorithms process identical samples, which are generated (and, with real sensors, measured) at the highest "
    "rate of a part. Samples of a lower rate are sums of these, like the counts of a gyro that is read less often. The "
    "truth is a continuous motion; the increments are its exact integrals. Navigation starts at the true state. Errors "
    "against the truth are taken at about 4000 times spread evenly over the motion. Attitude errors are the angle of "
    "the single rotation between true and computed attitude in the local level. Every number is in results.json and "
    "results.parquet in the same directory."
)


def _operations(o: Operations) -> tuple[str, ...]:
    """Return the cells of the numbers of operations, in the order of `_OPERATIONS`."""
    return (
        *(f"{value:.0f}" for value in (o.add, o.multiply)),
        *(f"{value:.1f}" for value in (o.divide, o.root, o.function)),
        f"{o.total:.0f}",
    )


def _motions(comparison: StudyResult) -> Table:
    heads = ("duration, s", "distance, km", "mean ground speed, km/h", "largest rate, deg/s", "steepest pitch, deg",
             "latitude rate, deg/h", "largest latitude, deg")  # fmt: skip
    lines = [
        (name, f"{f.duration_s:.0f}", f"{f.distance_m / 1e3:.1f}", f"{f.ground_speed_kmh:.1f}",
         f"{f.max_rate_deg_s:.2f}", f"{f.max_pitch_deg:.1f}", f"{f.latitude_rate_deg_h:.3f}",
         f"{f.max_latitude_deg:.2f}")
        # a motion of several parts appears once; with another duration it counts as another motion
        for name, f in dict.fromkeys((name, facts) for (_, name), facts in comparison.motions.items())
    ]  # fmt: skip
    return Table((Column("", words=True), *map(Column, heads)), lines)


def to_json(comparison: StudyResult) -> dict[str, Any]:
    """Return all results of a study as plain numbers and words, the contents of `results.json`; unknown numbers are
    None."""
    study = comparison.study
    contents = {
        "study": study.name,
        "description": study.description,
        "status": comparison.status,
        "seed": study.seed,
        "seconds": round(comparison.seconds, 2),
        "verdicts": [asdict(verdict) for verdict in comparison.verdicts],
        "picks": [asdict(pick) for pick in comparison.picks],
        "motions": [
            {"part": part, "motion": name, **asdict(facts)} for (part, name), facts in comparison.motions.items()
        ],
        "costs": [{**asdict(cost), "operations_per_step": cost.operations.total} for cost in comparison.costs.values()],
        "attitude_costs": [
            {
                **asdict(cost),
                "operations_per_step": cost.operations.total,
                "matrix_operations_per_step": cost.matrix.total,
            }
            for cost in comparison.attitude_costs
        ],
        "headings": [
            {name: value for name, value in vars(heading).items() if name not in ("time", "heading", "truth")}
            for heading in comparison.headings
        ],
        "coordinate_errors": [
            {**asdict(error.case), **{key: value for key, value in vars(error).items() if key != "case"}}
            for error in comparison.coordinate_errors
        ],
        "orders": [asdict(order) for order in comparison.orders],
        "guarantees": {
            name: asdict(guarantee(name)) for name in dict.fromkeys(row.algorithm for row in comparison.rows)
        },
        "cases": [asdict(row) for row in comparison.rows],
        "versions": versions(),
    }
    return {key: plain(value) for key, value in contents.items()}


def write_study(comparison: StudyResult, folder: Path) -> None:
    """Write all results of a study."""
    import pyarrow as pa

    write_text(folder / "study.toml", tomli_w.dumps(comparison.study.model_dump(exclude_none=True)))
    write_json(folder / "results.json", to_json(comparison))
    write_table(pa.table(_columns(Row, comparison.rows)), folder / "results.parquet")
    if comparison.coordinate_errors:
        write_table(pa.table(_coordinate_columns(comparison)), folder / "coordinates.parquet")
    write_shown(exhibits_of(comparison), folder)


def _columns(kind: type, values: Sequence[Any]) -> dict[str, list[Any]]:
    """Return the fields of cases or rows as columns of a table; a schedule is a text."""
    columns = {field.name: [getattr(value, field.name) for value in values] for field in fields(kind)}
    return columns | {"schedule_hz": ["/".join(f"{rate:g}" for rate in rates) for rates in columns["schedule_hz"]]}


def _coordinate_columns(comparison: StudyResult) -> dict[str, list[Any]]:
    """Return the errors in further coordinates as columns: a row for each case and column."""
    errors, names = comparison.coordinate_errors, ("coordinates", "column", "max_error", "final_error")
    columns = _columns(Case, [error.case for error in errors])
    return columns | {name: [getattr(error, name) for error in errors] for name in names}


class StudyMedia(Media[StudyResult]):
    """Numbers, exhibits and files of a study."""

    def summary(self, result: StudyResult) -> dict[str, Any]:
        return to_json(result)

    def exhibits(self, result: StudyResult) -> Exhibits:
        return exhibits_of(result)

    def figure(self, result: StudyResult, quantity: str | None = None) -> Any:
        if not charts.finished(result.rows):
            raise InputError(f"the study {result.study.name} has no finished navigation to draw.")
        return super().figure(result)

    def save(self, result: StudyResult, directory: Path, *, overwrite: bool) -> Path:
        with StudyDirectory(directory, result.study, overwrite=overwrite) as folder:
            folder.write_all(result)
            folder.keep(lambda place: write_study(result, place))
            return folder.path
