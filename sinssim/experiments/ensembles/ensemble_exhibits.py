"""What an ensemble has to show, and the files that it writes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sinssim import units
from sinssim.charts import Axis, Band, Chart, Charts, Cloud, Dots, Histogram, Line, Mark, Rule, in_rows
from sinssim.data import Array
from sinssim.estimation.state_model import GRAVITY
from sinssim.exhibits import Column, Exhibits, Interactive, Item, Section, Sentence, Table, Verbatim, definitions
from sinssim.experiments.ensembles.ensemble_errors import COMPONENTS, VECTORS
from sinssim.experiments.ensembles.ensemble_result import EnsembleResult, MeanSquare
from sinssim.experiments.ensembles.ensemble_summary import (
    DEFINITIONS,
    PART_121_HOURS,
    PART_121_RATE,
    Circles,
    EnsembleNumbers,
    Regulation,
    circles,
    consistency_sentences,
    covariance_at_end,
    ensemble_numbers,
    predicted_sigma,
    summary_of,
)
from sinssim.experiments.ensembles.ensemble_verdicts import looks_text, requirement_lines, verdict_text
from sinssim.recording.result import plain, software, versions, write_json, write_shown
from sinssim.recording.style import RowNumbers, thinned
from sinssim.sensors.imu.grades import grade_name
from sinssim.statistics.circular_error import circle_radius
from sinssim.statistics.percentiles import Percentile, runs_for_band
from sinssim.statistics.requirements import CIRCLES, limits_of
from sinssim.statistics.requirements import COMPONENTS as QUANTITIES
from sinssim.units import (
    ANGLE_SCALE,
    LENGTH_SCALE,
    SPEED_SCALE,
    Scale,
    capital,
    duration_words,
    fixed,
    number_text,
    percent,
    signed,
    suiting,
    with_band,
)

_DOTS = 5000
"""Most runs drawn as dots."""
_FRAMES, _MOVING = 200, 2000
"""Most instants and runs of the moving cloud of positions."""
_TOUCHED = (120, 500)
"""Most instants and runs that a page shows one by one."""
_LIMIT_SHOWN = 3.0
"""The limit of the regulation is drawn if it is less than this multiple of the largest value."""
_MOST_FAILURES, _MOST_REASONS = 50, 5
_LABELS = {"r95": "R95", "cep": "CEP"}
_AXES = ("north", "east", "down")
_NAMES = ("position", "velocity", "attitude φ")
_KNOTS = fixed("nmi/h", units.NAUTICAL_MILE / 3600.0)
_PAGE: Any = ("page", "recording")
_HOW = (
    "Percentiles are tested by the exact binomial interval, without an assumption about the distribution; components "
    "are tested by the χ² interval for normal errors. Each requirement is tested separately. "
)
_OF_SQUARES = (
    "Mean over the runs per degree of freedom, with the 95 % band of χ² for this number of runs; a filter with a "
    "correct covariance has 1, and an overconfident filter has more. Neighbouring epochs are correlated: biases are "
    "constant in a run, so the mean of a correct filter can be outside the band for some time."
)
_OF_GRAVITY = (
    " Gravity that the navigator does not know is the same in all runs: its states count as those of a single run."
)
_SEEDS = (
    "Run i has the seed S_i, the first 53 bits of SHA-256 over the ensemble’s seed and i. Its errors are those of "
    "`sinssim run` with that seed, to rounding. All runs share one motion, unless turbulence, vibration or a varied "
    "key changes it."
)


def exhibits_of(result: EnsembleResult, numbers: EnsembleNumbers, predicted: Array | None = None) -> Exhibits:
    """Return what an ensemble has to show, with σ predicted by the covariance budget at the epochs, (K, 9) SI."""
    plan, scales = result.plan, scales_of(result)
    items: list[Item] = [
        *([Sentence(plan.scenario.description, "lead", on=("page",))] if plan.scenario.description else []),
        Sentence(opening(result, numbers.status), "note"),
        *(Sentence(note, "strong", on=_PAGE) for note in result.notes),
        *_requirements(result),
        Section("Errors of the population", [
            _headline(numbers, scales[0]), Sentence(regulation(numbers.part_121)),
            _overview(result, scales[0]), _rates(result),
        ]),
        Section("Each run", [Interactive("each_run", lambda: _each_run(result))], on=("page",)),
        *(Sentence(line, on=("console",)) for line in requirement_lines(result)),
        Section("Errors by component", [_components(result, scales, predicted), _component_table(numbers, scales)],
                on=("page",)),
        _sigmas(result, scales),
        _cloud(result, scales[0]),
        *([_consistency(result, numbers)] if result.nees else []),
        _runs(result, numbers, scales[0]),
        *_failures(result),
        definitions(DEFINITIONS, ("page",)),
        Section("How it was computed", [*_method(result, numbers)], on=("page",)),
        Verbatim("Scenario", plan.scenario.to_toml(), on=("recording",)),
    ]  # fmt: skip
    name = plan.scenario.name
    labels = {"runs": str(len(result)), "filter": "yes" if result.nees else ""}
    return Exhibits(
        f"{name}: an ensemble of {len(result)} runs", items, f"{name}: {len(result)} runs",
        name=f"{name} ensemble", kind="ensemble", root="ensemble", span=(plan.start, float(plan.epochs[-1])),
        figure="overview", labels=labels,
    )  # fmt: skip


def opening(result: EnsembleResult, status: str) -> str:
    """Return what an ensemble is of, in a few sentences; it is "finished", "interrupted" or "failed"."""
    plan = result.plan
    broken_off = {"interrupted": "was interrupted", "failed": "failed"}.get(status)
    needed = runs_for_band(0.95)
    few = f" R95 has no upper bound with fewer than {needed} runs." if len(result) < needed else ""
    ended = f" The ensemble {broken_off}; the report shows the finished runs." if broken_off else ""
    varied = f" Varied from run to run: {', '.join(plan.keys)}." if plan.keys else ""
    failed = int(result.failed.sum())
    count = f" {failed} of {len(result)} runs failed; their errors are treated as infinite." if failed else ""
    return (
        f"Solution: {plan.solution}. Seed {plan.scenario.seed}. Each run lasts "
        f"{duration_words(float(plan.epochs[-1]) - plan.start)}; its errors are kept at {len(plan.epochs)} epochs."
        f"{varied}{few}{count}{ended}"
    )


def _with_band(estimate: Percentile, size: float = 1.0) -> str:
    return with_band(float(estimate.value), max(float(estimate.low), 0.0), float(estimate.high), size)


def regulation(comparison: Regulation) -> str:
    """Return the comparison with the regulation as sentences."""
    verdict = {
        "met": "met, with 95 % confidence",
        "not met": "not met, with 95 % confidence",
        "undecided": "undecided: the limit lies within the confidence interval; more runs narrow it",
        "does not apply": f"it does not apply, because {comparison.reason}",
    }[comparison.verdict]
    pairs = comparison.quantities.items()
    shown = "; ".join(f"{name}: {_with_band(value)}, limit {limit:g}" for name, (value, limit) in pairs)
    return f"{comparison.rule}: {verdict}{'. ' if shown else ''}{capital(shown)}."


def scales_of(result: EnsembleResult) -> list[Scale]:
    """Return the one unit each for positions, velocities and attitudes in all charts and tables of an ensemble."""
    lengths = (result.r95.value, result.cep.value, result.errors.final[:, :2])
    scales = []
    for quantity, scale in zip(VECTORS, (LENGTH_SCALE, SPEED_SCALE, ANGLE_SCALE), strict=True):
        spread = result.spread(quantity)
        values = (spread.sigma, spread.mean, *(lengths if scale is LENGTH_SCALE else ()))
        scales.append(fixed(*suiting(scale, *(v[np.isfinite(v)] for v in values))))
    return scales


def _requirements(result: EnsembleResult) -> Iterator[Section]:
    if not result.verdicts:
        return
    sections = []
    for verdict in result.verdicts:
        surely = "" if verdict.verdict == "undecided" else f"It is {verdict.verdict} with 95 % confidence. "
        text = f"{capital(verdict.requirement.meaning)}. {surely}{verdict_text(verdict)}"
        sections.append(Section(verdict.requirement.text, [Sentence(text)], verdict.verdict, on=_PAGE))
    yield Section("Requirements", [*sections, Sentence(_HOW + looks_text(result), "note")], on=_PAGE)


def _headline(numbers: EnsembleNumbers, scale: Scale) -> Table:
    """Return the table of CEP and R95."""
    (unit, size, _), *_ = scale
    lines: list[tuple[str, Circles, float]] = [
        *((f"horizontal error at {time:g} s, {unit}", there, size) for time, there in numbers.at),
        (f"horizontal error at the end, {unit}", numbers.final, size),
        ("rate by the line Σ t r / Σ t², nmi/h", numbers.line, 1.0),
        ("rate at the end r(T) / T, nmi/h", numbers.end, 1.0),
    ]
    rows = [[name, *(_with_band(circle, by) for circle in both)] for name, both, by in lines]
    normal = [number_text(radius / size) for radius in numbers.normal]
    rows.append([f"circle of a normal distribution with this covariance, {unit}", *normal])
    heads = ("CEP (95 % band)", "R95 (95 % band)")
    return Table((Column("", words=True), *map(Column, heads)), rows)


def _finite(values: Array) -> Array:
    return np.where(np.isfinite(values), values, np.nan)


def _overview(result: EnsembleResult, scale: Scale) -> Charts:
    """Return growth of CEP and R95 beside the cloud of final positions: the figure for a paper."""
    return Charts("overview", ((_growth(result, scale), _final(result, scale)),), (10.0, 4.4), widths=(5.0, 4.0))


def _growth(result: EnsembleResult, scale: Scale) -> Chart:
    """Return CEP and R95 over time with their bands, and the limits of the regulation and of requirements."""
    (unit, size, _), *_ = scale
    time, marks = result.elapsed, list[Mark]()
    largest = max(float(_finite(v.value)[np.isfinite(v.value)].max(initial=0.0)) for v in (result.r95, result.cep))
    for key, circle in (("r95", result.r95), ("cep", result.cep)):
        end = float(circle.value[-1])
        more = f", at the end {number_text(end / size)} {unit}"
        more = more if np.isfinite(end) else " is infinite: too many runs failed"
        low = np.maximum(_finite(circle.low), 0.0)
        marks.append(Band(x=time, low=low, high=_finite(circle.high), color=key))
        marks.append(Line(label=_LABELS[key], more=more, x=time, y=_finite(circle.value), color=key))
    limit = PART_121_RATE * units.NAUTICAL_MILE / 3600.0 * time
    near = not result.plan.filtered and float(limit[-1]) < _LIMIT_SHOWN * largest
    if time[-1] <= PART_121_HOURS * 3600.0 and near:
        label = "2 nmi/h, limit of R95 (14 CFR 121 App. G)"
        marks.append(Line(label=label, x=time, y=limit, color="limit", dash="--", weight="thin"))
    marks += limits_of(_judged(result), CIRCLES, float(time[-1]))
    y = Axis(label="horizontal error", units=scale, low=0.0)
    return Chart(key="growth", title=f"{len(result)} runs, 95 % bands", y=y, marks=tuple(marks), room=1.25)


def _final(result: EnsembleResult, scale: Scale) -> Chart:
    """Return the final positions with circles of CEP and R95, and circle and ellipse of their covariance."""
    (unit, size, _), *_ = scale
    final = result.errors.final[~result.failed][:, :2]
    shown, p = final[:_DOTS], covariance_at_end(result)
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    marks: list[Mark] = [Dots(x=shown[:, 1], y=shown[:, 0], color="run", size=1.9 if len(shown) > 200 else 3.4)]
    reach = max(float(np.abs(final).max(initial=0.0)), 1e-3)
    final_circles = circles(result.final_horizontal)
    for key, circle in (("r95", final_circles.r95), ("cep", final_circles.cep)):
        radius = float(circle.value)
        if np.isfinite(radius):
            label, reach = f"{_LABELS[key]} {number_text(radius / size)} {unit}", max(reach, radius)
            marks.append(Line(label=label, x=radius * np.sin(angle), y=radius * np.cos(angle), color=key))
    if np.isfinite(p).all():
        root, vectors = np.linalg.eigh(p)
        ring = vectors @ (np.sqrt(np.maximum(root, 0.0))[:, None] * np.array([np.cos(angle), np.sin(angle)]))
        k, normal = float(np.sqrt(-2.0 * np.log(0.05))), float(circle_radius(p, 0.95))
        marks.append(Line(label="95 % ellipse of the covariance", x=k * ring[1], y=k * ring[0], color="ink",
                          weight="thin", dash="--"))  # fmt: skip
        marks.append(Line(label=f"95 % circle of the covariance {number_text(normal / size)} {unit}",
                          x=normal * np.sin(angle), y=normal * np.cos(angle), color="ink", dash=":"))  # fmt: skip
        reach = max(reach, k * float(np.sqrt(max(root.max(), 0.0))))
    axes = [Axis(label=name, units=scale, low=-1.05 * reach, high=1.05 * reach) for name in ("east", "north")]
    lost = "" if len(marks) > 1 else ": every run failed, or too many for a circle"
    return Chart(key="final", title=f"errors at the end{lost}", x=axes[0], y=axes[1], marks=tuple(marks), equal=True,
                 legend="below")  # fmt: skip


def _rates(result: EnsembleResult) -> Charts:
    """Return histograms of the rate of each run in both definitions."""
    pairs = (("line through the origin, Σ t r / Σ t²", result.mean_rates), ("at the end, r(T) / T", result.end_rates))
    charts = []
    for number, (title, values) in enumerate(pairs):
        finite = values[np.isfinite(values)]
        marks: list[Mark] = [Histogram(values=finite, color="run")] if len(finite) else []
        for key, circle in circles(values)._asdict().items():
            if np.isfinite(circle.value):
                at = float(circle.value)
                high = float(circle.high) if np.isfinite(circle.high) else float(finite.max())
                marks.append(Rule(at=at, upright=True, label=f"{_LABELS[key]} {number_text(at / _KNOTS[0][1])} nmi/h",
                                  color=key, weight="line", low=max(float(circle.low), 0.0), high=high))  # fmt: skip
        charts.append(Chart(key=f"rates/{number}", title=title, x=Axis(label="rate", units=_KNOTS, low=0.0, grid=False),
                            y=Axis(label="runs", low=0.0), marks=tuple(marks), legend="below"))  # fmt: skip
    return Charts("rates", (tuple(charts),), (10.0, 3.4), title="Rates of the runs", share="y", on=("page",))


def _judged(result: EnsembleResult) -> Sequence[Any]:
    return [(verdict.requirement, verdict.verdict) for verdict in result.verdicts]


def _components(result: EnsembleResult, scales: Sequence[Scale], predicted: Array | None) -> Charts:
    """Return σ over the runs by component with its standard error, the filter's own and that of the budget."""
    time, rows, judged = result.elapsed, list[tuple[Chart, ...]](), _judged(result)
    for row, (quantity, scale, name) in enumerate(zip(VECTORS, scales, _NAMES, strict=True)):
        spread, claimed = result.spread(quantity), result.stated(quantity)
        charts = []
        for column, axis in enumerate(_AXES):
            sigma, error, mean = (v[:, column] for v in (spread.sigma, spread.standard_error, spread.mean))
            marks: list[Mark] = [
                Band(x=time, low=sigma - 1.96 * error, high=sigma + 1.96 * error, color=axis),
                Line(label="σ of the runs, ± 1.96 standard errors", x=time, y=sigma, color=axis),
            ]
            if claimed is not None:
                marks.append(Line(label="σ stated by the filter", x=time, y=claimed[:, column], color="ink",
                                  weight="thin", dash="--"))  # fmt: skip
            if predicted is not None:  # on the filter's own where they agree
                marks.append(Line(label="σ predicted by the budget", x=time, y=predicted[:, 3 * row + column],
                                  color="ink" if claimed is None else "smoothed", dash=":"))  # fmt: skip
            marks.append(Line(label="mean of the runs", x=time, y=mean, color="soft", weight="thin"))
            marks += limits_of(judged, [QUANTITIES[3 * row + column]], float(time[-1]))
            charts.append(Chart(key=f"component/{row}/{column}", title=f"{name}, {axis}", y=Axis(units=scale),
                                marks=tuple(marks)))  # fmt: skip
        rows.append(tuple(charts))
    return Charts("components", tuple(rows), (10.5, 7.4), share="x", legend="below", on=("page",))


def _component_table(numbers: EnsembleNumbers, scales: Sequence[Scale]) -> Table:
    rows = []
    for number, component in enumerate(numbers.components.values()):
        (unit, size, _), *_ = scales[number // 3]
        sigma = _with_error(component.final_sigma / size, component.final_sigma_standard_error / size)
        name = f"{_NAMES[number // 3]}, {_AXES[number % 3]}"
        rows.append([name, unit, signed(component.final_mean / size), sigma, number_text(component.rms / size)])
    heads = ("mean at the end", "σ at the end ± standard error", "rms over runs and epochs")
    return Table((Column("", words=True), Column("unit", words=True), *map(Column, heads)), rows)


def _with_error(value: float, error: float) -> str:
    """Write a value with the decimals of its standard error, which has two significant digits."""
    text = number_text(error, 2)
    if not (math.isfinite(value) and math.isfinite(error) and error > 0.0) or "e" in text:
        return f"{number_text(value)} ± {text}"
    return f"{value:.{len(text.partition('.')[2])}f} ± {text}"


def _sigmas(result: EnsembleResult, scales: Sequence[Scale]) -> Charts:
    """Return σ over the runs, the three components of a quantity together."""
    time, judged, charts = result.elapsed, _judged(result), []
    for row, (quantity, scale, name) in enumerate(zip(VECTORS, scales, _NAMES, strict=True)):
        sigma = result.spread(quantity).sigma
        lines = (Line(label=axis, x=time, y=sigma[:, k]) for k, axis in enumerate(_AXES))
        limits = limits_of(judged, QUANTITIES[3 * row : 3 * row + 3], float(time[-1]))
        key = f"sigma_{name.removesuffix(' φ')}"
        charts.append(Chart(key=key, title=f"σ of the {name}", y=Axis(units=scale, low=0.0), marks=(*lines, *limits)))
    return Charts("sigma", (tuple(charts),), (11.0, 3.6), on=("recording",))


def _cloud(result: EnsembleResult, scale: Scale) -> Cloud:
    """Return the horizontal errors of the runs over time, with the circles of CEP and R95."""
    rows = thinned(len(result.time), _FRAMES)
    runs = np.flatnonzero(~result.failed)[:_MOVING]
    north, east = (_taken(result, name, runs, rows) for name in COMPONENTS[:2])
    circles = {"cep": result.cep.value[rows], "r95": result.r95.value[rows]}
    return Cloud(
        key="cloud", time=result.elapsed[rows], x=east, y=north, units=scale, names=("east", "north"), circles=circles
    )


def _each_run(result: EnsembleResult) -> tuple[dict[str, Any], list[Array]]:
    """Return what a page needs to show single runs: words, then the times, the circles, and the errors by run."""
    rows = thinned(len(result.time), _TOUCHED[0])
    runs = np.flatnonzero(~result.failed)[: _TOUCHED[1]]
    numbers = [int(number) for number in result.errors.number[runs]]
    plain = {
        "runs": numbers, "seeds": [str(result.errors.seed[run]) for run in runs], "all": len(result),
        "commands": [result.command(number, scenario="scenario.toml") for number in numbers],
        "radii": [[float(v) if np.isfinite(v) else None for v in circle.value[rows]]
                  for circle in (result.cep, result.r95)],
    }  # fmt: skip
    north, east = (_taken(result, name, runs, rows) for name in COMPONENTS[:2])
    return plain, [result.elapsed[rows], *north, *east]


def _taken(result: EnsembleResult, name: str, runs: RowNumbers, rows: RowNumbers) -> Array:
    """Return some runs of a column at some epochs."""
    parts, first = [], slice(0, int(runs.max(initial=-1)) + 1)
    for epochs in result.errors.spans():
        there = rows[(rows >= epochs.start) & (rows < epochs.stop)] - epochs.start
        parts.append(result.errors.column(name, epochs, first)[np.ix_(runs, there)])
    return np.concatenate(parts, axis=1)


def _consistency(result: EnsembleResult, numbers: EnsembleNumbers) -> Section:
    """Return mean normalised squares over the runs with their χ² bands, and the verdict on the filter."""
    sentences = consistency_sentences(numbers.consistency, len(result))
    items: list[Item] = [Sentence(text, "strong") for text in sentences]
    items.append(Sentence(_OF_SQUARES + (_OF_GRAVITY if GRAVITY in result.nees else "")))
    heads = ("mean over all epochs", "at the last epoch", "95 % band there", "epochs within the band")
    for key, courses, squares, title, what in (
        ("nees", result.nees, numbers.nees, "NEES / n", "ANEES by block of states"),
        ("nis", result.nis, numbers.nis, "NIS / n", "NIS by sensor"),
    ):
        rows = [
            [name, number_text(square.mean), number_text(square.end),
             f"{number_text(square.low)} … {number_text(square.high)}",
             percent(square.share_in_band)]
            for name, square in squares.items()
        ]  # fmt: skip
        table = Table((Column("", words=True), *map(Column, heads)), rows)
        items.append(Section(what, [*_squares(result, key, courses, title), table]))
    return Section("Consistency of the filter", items)


def _squares(result: EnsembleResult, key: str, squares: Mapping[str, MeanSquare], title: str) -> Iterator[Charts]:
    """Yield a chart for each block or sensor, and one of all of them together for the recording."""
    time, charts, y = result.elapsed, [], Axis(label=title, low=0.0)
    for square in squares.values():
        low, high = (np.broadcast_to(end, square.value.shape) for end in (square.band.low, square.band.high))
        there = np.isfinite(square.value)
        marks = (
            Band(x=time[there], low=low[there], high=high[there], color="bound"),
            Line(x=time[there], y=square.value[there], color=square.name, weight="thin"),
            Rule(at=1.0, weight="hair"),
        )
        charts.append(Chart(key=f"{key}/{square.name}", title=square.name, y=y, marks=marks))
    if charts:
        rows = in_rows(charts, 2)
        yield Charts(f"{key}s", rows, (5.2 * len(rows[0]), 0.5 + 1.9 * len(rows)), share="x", on=("page",))
    lines = tuple(
        Line(label=square.name, x=time, y=square.value)
        for square in squares.values()
        if np.isfinite(square.value).any()
    )
    yield Charts(key, ((Chart(key=key, y=y, marks=lines),),), (8.0, 3.0), on=("recording",))


def _runs(result: EnsembleResult, numbers: EnsembleNumbers, scale: Scale) -> Section:
    rows = [
        [run.rank, str(run.run), "failed" if run.failure else run.rate_nmi_h * _KNOTS[0][1],
         "–" if run.failure else run.final_horizontal_m, f"`{result.command(run.run)}`"]
        for run in numbers.named_runs
    ]  # fmt: skip
    columns = (
        Column("", words=True), Column("run"), Column("rate Σ t r / Σ t²", _KNOTS), Column("final", scale),
        Column("command for the complete run", words=True),
    )  # fmt: skip
    return Section("Runs to examine", [Table(columns, rows)], on=_PAGE)


def _failures(result: EnsembleResult) -> Iterator[Item]:
    """Yield a table of failed runs, and on the console the reasons with their runs."""
    if not result.failures:
        return
    shown = list(result.failures.items())[:_MOST_FAILURES]
    rows = [[str(number), str(result.member(number).seed), text] for number, text in shown]
    more = len(result.failures) - len(shown)
    rest = f"… and {more} more; runs.parquet of to_parquet and the files of runs have all of them." if more else ""
    table = Table((Column("run"), Column("seed"), Column("reason", words=True)), rows, note=rest)
    yield Section("Failed runs", [table], on=_PAGE)
    reasons: dict[str, list[int]] = {}
    for number, text in result.failures.items():
        reasons.setdefault(text, []).append(number)
    for text, runs in list(reasons.items())[:_MOST_REASONS]:
        named = ", ".join(map(str, runs[:5])) + (f" and {len(runs) - 5} more" if len(runs) > 5 else "")
        yield Sentence(f"FAILED, {'run' if len(runs) == 1 else 'runs'} {named}: {text}", on=("console",))
    if len(reasons) > _MOST_REASONS:
        left = len(reasons) - _MOST_REASONS
        yield Sentence(f"… and {left} other reasons; see the report.", on=("console",))


def _method(result: EnsembleResult, numbers: EnsembleNumbers) -> Iterator[Item]:
    """Yield how the ensemble was computed, and the files outside the package on which the numbers depend."""
    yield Sentence(f"{_SEEDS} {result.computed} runs were computed in {result.seconds:.1f} s by this call.")
    yield Sentence(software(), "note")
    if numbers.own_content:
        heads = ("own content", "name", "SHA-256", "file")
        rows = [[file["kind"], file["name"], f"{file['sha256'][:12]}…", file["file"]] for file in numbers.own_content]
        yield Table(tuple(Column(head, words=True) for head in heads), rows)


def sheet_of(result: EnsembleResult, numbers: EnsembleNumbers) -> Exhibits:
    """Return the performance of the unit in the words of a data sheet, with their definitions."""

    def rms(*names: str, size: float = 1.0) -> str:
        squares = [numbers.components[name].rms ** 2 for name in names]
        return number_text(math.sqrt(sum(squares) / len(names)) / size)

    rows = []
    for rates, name in ((numbers.line, "Σ t r / Σ t²"), (numbers.end, "r(T) / T")):
        rows.append(["position rate, CEP", f"{_with_band(rates.cep)} nmi/h", f"{name}, 50 % of the runs"])
        rows.append(["position rate, R95", f"{_with_band(rates.r95)} nmi/h", f"{name}, 95 % of the runs"])
    rows += [
        ["velocity, north and east", f"{rms('velocity_n_mps', 'velocity_e_mps')} m/s", "per axis, rms"],
        ["velocity, vertical", f"{rms('velocity_d_mps')} m/s", "rms"],
        ["roll and pitch", f"{rms('attitude_n_rad', 'attitude_e_rad', size=units.DEG)} °", "tilt per axis, rms"],
        ["heading", f"{rms('attitude_d_rad', size=units.DEG)} °", "rms"],
    ]
    plan = result.plan
    title = f"Performance of {grade_name(plan.scenario.imu.grade)} in {plan.scenario.name}, {len(result)} runs"
    texts = [
        regulation(numbers.part_121),
        *requirement_lines(result),
        "Common terms: navigation grade 0.5 to 1 nmi/h CEP, tactical grade 10 to 20 nmi/h. Definitions:",
        *(f"  {name}: {text}." for name, text in DEFINITIONS.items()),
    ]
    columns = (Column("quantity", words=True), Column("value"), Column("definition", words=True))
    return Exhibits(title, [Table(columns, rows, title), *map(Sentence, texts)])


FIGURES = ("ensemble.svg", "ensemble.png")
"""The picture of an ensemble for a paper."""


def to_json(result: EnsembleResult, numbers: EnsembleNumbers | None = None) -> dict[str, Any]:
    """Return the contents of `summary.json`, from the numbers if they are known."""
    return dict(plain({**summary_of(result, numbers), "versions": versions()}))


def write_ensemble(result: EnsembleResult, folder: Path, status: str = "finished") -> list[str]:
    """Write report, figure, numbers and recording of an ensemble that is "finished", "interrupted" or "failed"."""
    from sinssim.recording.figures import figure_of, save

    numbers = ensemble_numbers(result, status)
    exhibits = exhibits_of(result, numbers, predicted_sigma(result.plan) if status == "finished" else None)
    write_shown(exhibits, folder)
    picture = figure_of(exhibits.chosen(exhibits.figure))
    for name in FIGURES:
        save(picture, folder / name)
    write_json(folder / "summary.json", to_json(result, numbers))
    return ["report.html", "summary.json", "recording.rrd", *FIGURES]
