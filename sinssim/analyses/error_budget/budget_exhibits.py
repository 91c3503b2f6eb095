"""Exhibits and files of a covariance budget."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.analyses.error_budget.budget_result import (
    BUDGET_COMPONENTS,
    Allowance,
    Answer,
    BudgetResult,
    Improvement,
    PredictedMiss,
)
from sinssim.analyses.error_budget.error_sources import Source
from sinssim.analyses.error_budget.what_if import what_if
from sinssim.charts import TIME, Axis, Bars, Chart, Charts, Line, Mark, Shares
from sinssim.data import Array
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.exhibits import Column, Exhibits, Interactive, Item, Section, Sentence, Table, Verdict, four_digits
from sinssim.recording.result import Json, Media, plain, versions, write_shown
from sinssim.recording.streams import Stream, Vector, write_table
from sinssim.recording.track_map import NOTE, Spread, track_map
from sinssim.scenario.plan_summary import named_places
from sinssim.statistics import requirements
from sinssim.statistics.requirements import CIRCLES, COMPONENTS, Judged, limits_of
from sinssim.system.files import write_text
from sinssim.units import (
    ANGLE_SCALE,
    LENGTH_SCALE,
    NAUTICAL_MILE,
    SPEED_SCALE,
    Scale,
    capital,
    fixed,
    number_text,
    suiting,
)

_SHOWN, _ALONE, _RANKED = 8, 6, 12
"""Numbers of sources with a colour of their own, with a curve in a recording, and with bars."""
OTHERS = "all others"
_PALETTE = (
    (0, 114, 178), (230, 159, 0), (0, 158, 115), (213, 94, 0), (204, 121, 167), (86, 180, 233), (120, 100, 200),
    (160, 160, 60),
)  # fmt: skip
_KINDS = {"given": "same in every run", "one run": "from one run", "random": ""}
_ANY = 1000.0
"""Factor beyond which the largest value of a source is not printed."""
_LEAST = 1e-4
"""Sources with a smaller share of the horizontal mean square are counted, not listed."""
_ROUNDING = 1e-9
"""Share of the limit below which a margin is rounding."""
_FIXED_GAINS = (
    "If a source is halved or limited, the gains of the filter do not change; a filter whose model contains the "
    "change performs as well or better."
)
_RATE = "R95 divided by the time since the start"
_NAMES = ("north", "east", "down", "v north", "v east", "v down", "tilt n", "tilt e", "heading")
_GROUPS = (
    ("position", ("north", "east", "down")),
    ("velocity", ("north", "east", "down")),
    ("attitude", ("tilt north", "tilt east", "heading")),
)
_PERCENT = Axis(label="share of the mean square", units=fixed("%", 0.01), low=0.0, high=1.0)


def exhibits_of(result: BudgetResult, answers: Sequence[Answer] = (), times: Sequence[float] = ()) -> Exhibits:
    """Return what a budget has to show, with `times`, s, in the table beside the usual ones."""
    what = "inertial navigation"
    if result.solution == "filter":
        kind = "error-state" if result.scenario.filter is None else result.scenario.filter.kind
        what += " with the filter" if kind == "error-state" else f" with the linear filter in place of the {kind} one"
    name, end = result.scenario.name, result.time[-1]
    rate = f"{four_digits(float(result.r95[-1]) / NAUTICAL_MILE / (float(end) / 3600.0))} nmi/h"
    (unit, metre), _, _ = units_of_budget(result)
    cep, r95 = (f"**{four_digits(float(v[-1]) / metre)} {unit}**" for v in (result.cep, result.r95))
    items: list[Item] = [
        Sentence(result.scenario.description, "lead", on=("page",)),
        Sentence(
            f"Errors of {what} over all possible runs, by source. They are propagated along the true motion by the "
            "linear error equations, without random numbers.", on=("page",)),
        Sentence(f"After {end:g} s, half of all runs are within {cep} (CEP) and 95 % within {r95} (R95), {rate} as "
                 f"{_RATE}.", on=("page", "recording")),
        *([Section("Requirements", [_requirement(answer) for answer in answers], on=("page", "recording"))]
          if answers else []),
        Section("Growth of the error", [_growth(result, answers), _alone(result), _over_time(result, times)]),
        *_map(result),
        *_waypoints(result),
        *_rankings(result),
        Section("What if", [Interactive("what_if", lambda: what_if(result, answers, times))], on=("page",)),
        Sentence(f"Rate at the end: {rate} ({_RATE}).", on=("console",)),
        *([Sentence(_FIXED_GAINS, on=("console",))] if result.solution == "filter" else []),
        *(replace(_requirement(answer), on=("console",)) for answer in answers),
        Section("Position, velocity and attitude", [_sigmas(result, answers), *_notes(result)], on=("page",)),
    ]  # fmt: skip
    return Exhibits(
        f"{name}: covariance budget", items, f"{name}: covariance budget of {what}", name=name, kind="budget",
        root="budget", span=(float(result.time[0]), float(end)), figure="growth", pictures=("growth", "ranking0"),
    )  # fmt: skip


def _map(result: BudgetResult) -> Iterator[Section]:
    """Yield the map of the true track with the ellipses of all runs."""
    if result.track is None:
        return
    scenario, horizontal = result.scenario, slice(2)
    spread = Spread(result.track.name, result.time, result.total[:, horizontal, horizontal],
                    result.bias[:, horizontal], "of all runs")  # fmt: skip
    outages = () if scenario.aiding is None else scenario.aiding.outages
    chart = track_map([result.track], ELLIPSOIDS[scenario.truth.ellipsoid], outages=outages, spread=spread,
                      places=named_places(scenario), note=NOTE.format("true"))  # fmt: skip
    yield Section("Where the runs are", [chart], on=("page",))


def _waypoints(result: BudgetResult) -> Iterator[Section]:
    """Yield how the flights by the navigator miss their waypoints."""
    if not result.waypoints:
        return
    columns = (Column("waypoint", words=True), Column("at", fixed("s")),
               *(Column(head, LENGTH_SCALE) for head in ("perfect navigator", "mean of all runs", "1σ")))  # fmt: skip
    rows = [(w.waypoint, w.time, w.technical, w.mean, w.sigma) for w in result.waypoints]
    note = ("The flight follows this navigator. By linear theory, the true path passes a waypoint as that of a perfect "
            "navigator does, less the error of the navigator across; positive to the right.")  # fmt: skip
    yield Section("Waypoints on the true path", [Table(columns, rows, note=note)])


def units_of_budget(result: BudgetResult) -> tuple[tuple[str, float], tuple[str, float], tuple[str, float]]:
    """Return one unit each, with its size in SI, for the lengths, the velocities and the angles of a budget."""
    errors = result.root_mean_square()
    return (
        suiting(LENGTH_SCALE, errors[:, :3], result.cep, result.r95),
        suiting(SPEED_SCALE, errors[:, 3:6]),
        suiting(ANGLE_SCALE, errors[:, 6:]),
    )


def _scales(result: BudgetResult) -> list[Scale]:
    """Return the units of `units_of_budget` as the only ones of each kind."""
    return [fixed(*unit) for unit in units_of_budget(result)]


def answer_word(answer: Answer) -> Verdict:
    """Return the verdict on a requirement."""
    return "met" if answer.met else "not met"


def full_label(source: Source) -> str:
    """Return a source's name with what it belongs to, for example "gyros: bias"."""
    return f"{source.group.replace('_', ' ')}: {source.label}"


def shares(result: BudgetResult) -> tuple[list[str], Array]:
    """Return the labels of the largest sources, and their shares of the horizontal mean square over time, (k, E).

    The shares add up to 1, or are zero where there is no error at all. The given errors together are one source.
    """
    square = {s.name: np.trace(result.covariance[s.name][:, :2, :2], axis1=1, axis2=2) for s in result.sources
              if s.name in result.covariance}  # fmt: skip
    labels = {s.name: full_label(s) for s in result.sources}
    if result.bias[:, :2].any():
        square["given"], labels["given"] = np.sum(result.bias[:, :2] ** 2, axis=1), "errors equal in every run"
    whole = np.asarray(sum(square.values(), np.zeros(len(result.time))))
    part = {n: np.divide(v, whole, out=np.zeros_like(v), where=whole > 0.0) for n, v in square.items()}
    order = sorted(part, key=lambda n: -float(part[n].mean() + part[n][-1]))
    names, rows = [labels[n] for n in order[:_SHOWN]], [part[n] for n in order[:_SHOWN]]
    if len(order) > _SHOWN:
        names.append(OTHERS)
        rows.append(np.asarray(sum(part[n] for n in order[_SHOWN:])))
    return names, np.array(rows).reshape(len(names), len(result.time))


def _palette(labels: Sequence[str]) -> tuple[tuple[int, int, int], ...]:
    """Return one colour for each label of `shares`."""
    return tuple((170, 170, 170) if label == OTHERS else _PALETTE[k % len(_PALETTE)] for k, label in enumerate(labels))


def _growth(result: BudgetResult, answers: Sequence[Answer]) -> Charts:
    """Return CEP and R95 over time with the requirements on them, above the shares of the sources."""
    length, *_ = _scales(result)
    circles: tuple[Mark, ...] = (
        Line(label="R95: 95 % of all runs", x=result.time, y=result.r95, color="r95"),
        Line(label="CEP: half of all runs", x=result.time, y=result.cep, color="cep"),
        *limits_of(_judged(answers), CIRCLES, float(result.time[-1])),
    )
    labels, parts = shares(result)
    some = np.flatnonzero(parts.sum(axis=0) > 0.0)  # an exact start has no error to share
    stack = (Shares(x=result.time[some], parts=parts[:, some], labels=tuple(labels), colors=_palette(labels)),)
    error = Axis(label="horizontal error", units=length, low=0.0)
    of_sources = "Horizontal position: shares of the sources"
    return Charts("growth", (
        (Chart(key="circles", title="CEP and R95", y=error, marks=circles, legend="right"),),
        (Chart(key="shares", title=of_sources, y=_PERCENT, marks=stack if len(some) else (), legend="right"),),
    ), (11.0, 7.6), share="x", heights=(1.0, 1.2))  # fmt: skip


def _alone(result: BudgetResult) -> Charts:
    """Return R95 over time by each of the largest sources alone."""
    labels, _ = shares(result)
    paint = dict(zip(labels, _palette(labels), strict=True))
    sources = sorted((s for s in result.sources if full_label(s) in paint), key=lambda s: labels.index(full_label(s)))
    marks = tuple(
        Line(label=full_label(s), x=result.time, y=result.radius(0.95, s.name), color=paint[full_label(s)])
        for s in sources[:_ALONE]
    )
    y = Axis(label="R95 from this source alone", units=_scales(result)[0], low=0.0)
    return Charts("alone", ((Chart(key="r95_alone", y=y, marks=marks),),), (11.0, 4.0), on=("recording",))


def _over_time(result: BudgetResult, times: Sequence[float]) -> Table:
    rows = result.table_rows(times)
    values = result.root_mean_square()[rows]
    length, speed, angle = _scales(result)
    units = [length] * 3 + [speed] * 3 + [angle] * 3
    return Table(
        (Column("t", fixed("s")), Column("CEP", length), Column("R95", length),
         *(Column(name, unit) for name, unit in zip(_NAMES, units, strict=True))),
        [[f"{result.time[row]:g}", float(result.cep[row]), float(result.r95[row]), *map(float, values[k])]
         for k, row in enumerate(rows)],
        "Errors over time: root mean square over all runs; CEP and R95 are the radii of 50 % and 95 % of the runs",
        on=("console", "page"),
    )  # fmt: skip


def when(result: BudgetResult, t: float) -> str:
    """Return an instant of a ranking in words."""
    return f"at the end, {t:g} s" if t == result.time[-1] else f"where R95 is largest, at {t:g} s"


def _rankings(result: BudgetResult) -> Iterator[Section]:
    """Yield bars and table of the sources at each instant that is ranked."""
    for number, t in enumerate(result.instants_to_rank):
        charts, table = _bars(result, t, f"ranking{number}"), _ranking(result, t)
        yield Section(f"What to improve first, {when(result, t)}", [charts, table])


def _bars(result: BudgetResult, t: float, key: str) -> Charts:
    """Return the gain if each source were halved, and R95 by each source alone."""
    length, *_ = _scales(result)
    size = length[0][1]
    ranked = [item for item in result.improvements(t) if item.alone > 0.0][:_RANKED]
    names = tuple(full_label(item.source) for item in ranked)
    charts = []
    for number, (values, title) in enumerate((
        (np.array([item.gain for item in ranked]), "Decrease of R95 if this source were halved"),
        (np.array([item.alone for item in ranked]), "R95 from this source alone"),
    )):  # fmt: skip
        most = float(values.max(initial=0.0))
        texts = tuple("0" if abs(v) < 5e-4 * most else number_text(float(v) / size) for v in values)
        bars = Bars(places=np.arange(float(len(ranked))), values=values, color="aided", texts=texts)
        charts.append(Chart(key=f"{key}/{number}", title=title, x=Axis(units=length, low=0.0),
                            y=Axis(names=names, grid=False), marks=(bars,)))  # fmt: skip
    return Charts(key, (tuple(charts),), (11.0, 1.4 + 0.3 * max(len(ranked), 1)), share="y")


def _ranking(result: BudgetResult, t: float) -> Table:
    length, *_ = _scales(result)
    ranked = result.improvements(t)
    shown = [item for item in ranked if abs(item.share) >= _LEAST]
    small = len(ranked) - len(shown)
    few = "source" if small == 1 else "sources"
    return Table(
        (Column("source", words=True), Column("group", words=True, on=("console", "page")), Column("value"),
         Column("unit", words=True), Column("share"), Column("R95 alone", length),
         Column("R95 decrease if halved", length, on=("console", "page")),
         Column("", words=True, on=("console", "page"))),
        [[item.source.name, item.source.group.replace("_", " "), four_digits(item.source.value), item.source.unit,
          f"{100.0 * item.share:.2f} %", item.alone, item.gain, _KINDS[item.source.kind]] for item in shown],
        note=f"{small} {few} below 0.01 % of the mean square." if small else "",
    )  # fmt: skip


def _sigmas(result: BudgetResult, answers: Sequence[Answer]) -> Charts:
    """Return the standard deviations of position, velocity and attitude over time, and the limits of requirements."""
    sigma, charts = result.sigma(), []
    by_filter = None if result.filter_covariance is None else np.sqrt(np.einsum("kii->ki", result.filter_covariance))
    for number, ((name, axes), units) in enumerate(zip(_GROUPS, _scales(result), strict=True)):
        marks: list[Mark] = []
        for k, axis in enumerate(axes):
            i = 3 * number + k
            marks.append(Line(label=axis, x=result.time, y=sigma[:, i], color=("north", "east", "down")[k]))
            if by_filter is not None:
                marks.append(Line(label="filter's own" if k == 2 else "", x=result.time, y=by_filter[:, i], color="ink",
                                  weight="thin", dash=":", counts=False))  # fmt: skip
        marks += limits_of(_judged(answers), COMPONENTS[3 * number : 3 * number + 3], float(result.time[-1]))
        y = Axis(units=units, low=0.0)
        charts.append(Chart(key=f"sigma/{name}", title=f"σ of the {name}", x=TIME, y=y, marks=tuple(marks), room=1.25))
    return Charts("sigma", (tuple(charts),), (11.0, 3.6))


def _judged(answers: Sequence[Answer]) -> Judged:
    return [(answer.requirement, answer_word(answer)) for answer in answers]


def _requirement(answer: Answer) -> Section:
    """Return the answer to a requirement: sentences, and the largest value of each source."""
    first, *more = lines_of(answer)
    requirement = answer.requirement
    return Section(requirement.text, [
        *(Sentence(line, on=("console",)) for line in (first, *more)),
        Sentence(" ".join((f"{capital(requirement.meaning)}.", *more)), on=("page", "recording")),
        Table((Column("source", words=True), Column("now"), Column("at most"), Column("", words=True)),
              allowance_cells(answer),
              "Largest value of each source with which the requirement is met, if all others do not change",
              on=("console", "page")),
    ], answer_word(answer))  # fmt: skip


def lines_of(answer: Answer) -> Iterator[str]:
    """Yield the answer to a requirement in sentences."""
    requirement, size, unit = answer.requirement, answer.requirement.unit_size, answer.requirement.unit
    verdict = "met" if answer.met else "NOT MET"
    yield f"{requirement.text}: {verdict}. {requirement.meaning[0].upper()}{requirement.meaning[1:]}."
    side = "below" if answer.met else "above"
    share = abs(answer.margin) / requirement.limit
    apart = f"{four_digits(abs(answer.margin) / size)} {unit} ({100.0 * share:.3g} %) {side} the limit"
    yield (
        f"{'The largest value' if requirement.when == 'run' else 'It'} is {four_digits(answer.value / size)} {unit} at "
        f"{answer.time:g} s, {'which is the limit' if share < _ROUNDING else apart}."
    )
    if answer.exceeded is not None:
        yield f"It is {answer.exceeded.text}."
    if answer.joint is not None:
        yield _joint(answer.joint, answer)
    if not any(allowance.possible for allowance in answer.allowances):
        yield "No single source can be made small enough: even with any one of them at zero, the limit is exceeded."
    if answer.everything.possible and not answer.met:
        factor = four_digits(answer.everything.factor)
        yield f"It is met with all sources in the table {factor} times as large as they are."


def _joint(joint: Allowance, answer: Answer) -> str:
    requirement = answer.requirement
    names = " and ".join(source.name for source in joint.sources)
    if not joint.possible:
        return (
            f"Not even with {names} at zero: the other sources alone give "
            f"{four_digits(joint.without / requirement.unit_size)} {requirement.unit}."
        )
    if math.isinf(joint.factor):
        return f"{names} have no effect on it."
    values = ", ".join(
        f"{source.name} {four_digits(value)} {source.unit}"
        for source, value in zip(joint.sources, joint.values, strict=True)
    )
    return f"Together, by the common factor {four_digits(joint.factor)}, they may be at most: {values}."


def allowance_cells(answer: Answer) -> list[list[str]]:
    """Return the cells of the largest values of the sources: source, present and largest value, remark."""
    requirement, cells = answer.requirement, []
    for allowance in answer.allowances:
        source: Source = allowance.sources[0]
        unit = source.unit
        if not allowance.possible:
            rest = f"{four_digits(allowance.without / requirement.unit_size)} {requirement.unit}"
            unit, largest, remark = "", "–", f"not even at zero, because the other sources give {rest}"
        elif allowance.factor > _ANY:
            unit, largest, remark = "", "any", f"more than {_ANY:g} times the present value"
        else:
            largest = four_digits(allowance.values[0])
            remark = f"{four_digits(allowance.factor)} times the present value"
        cells.append([source.name, f"{four_digits(source.value)} {source.unit}", f"{largest} {unit}".rstrip(), remark])
    return cells


def _notes(result: BudgetResult) -> list[Sentence]:
    notes = ["The results are valid to first order in the errors; docs/budgets.md lists the effects that this omits."]
    if result.solution == "filter":
        notes.append(
            "Dotted: the covariance of the filter. A difference from the budget means that the filter's model differs "
            f"from the true errors. {_FIXED_GAINS} The gate of the filter is not considered."
        )
    if any(source.kind == "one run" for source in result.sources):
        notes.append("Sources “from one run” are computed from the sensor outputs with only this source.")
    return [Sentence(note, "note", on=("page",)) for note in notes]


_SI = ("m", "m", "m", "mps", "mps", "mps", "rad", "rad", "rad")
_HEADING = np.array([1.0] * 8 + [-1.0])
"""Signs of the errors with the heading, −φ_down."""


def to_json(result: BudgetResult, answers: Sequence[Answer] = (), times: Sequence[float] = ()) -> dict[str, Json]:
    """Return a budget as plain numbers with units in the names, with `times`, s, in the table beside the usual ones."""
    hours = float(result.time[-1]) / 3600.0
    sigma, bias, cep, r95 = result.sigma(), result.bias, result.cep, result.r95
    contents: dict[str, Json] = {
        "name": result.scenario.name,
        "description": result.scenario.description,
        "solution": result.solution,
        "duration_s": float(result.time[-1]),
        "cep_m": float(cep[-1]),
        "r95_m": float(r95[-1]),
        "r95_over_time_nmi_per_h": float(r95[-1]) / NAUTICAL_MILE / hours,
        "table": [
            {
                "time_s": float(result.time[row]),
                "cep_m": float(cep[row]),
                "r95_m": float(r95[row]),
                "sigma": _components(sigma[row]),
                "mean": _components(bias[row] * _HEADING),
            }
            for row in result.table_rows(times)
        ],
        "sources": [_source(result, improvement) for improvement in result.improvements()],
        "requirements": [_answer(answer) for answer in answers],
        **({"waypoints": [_waypoint(miss) for miss in result.waypoints]} if result.waypoints else {}),
        "versions": versions(),
    }
    return dict(plain(contents))


def _waypoint(miss: PredictedMiss) -> dict[str, Json]:
    return {"waypoint": miss.waypoint, "time_s": miss.time, "technical_right_m": miss.technical,
            "mean_right_m": miss.mean, "sigma_m": miss.sigma}  # fmt: skip


def _components(values: Array) -> dict[str, float]:
    heads = zip(BUDGET_COMPONENTS, _SI, values, strict=True)
    return {f"{name}_{unit}": float(value) for name, unit, value in heads}


def _source(result: BudgetResult, improvement: Improvement) -> dict[str, Json]:
    """Return a source with its effect at the end."""
    source, random = improvement.source, improvement.source.kind == "random"
    return {
        "source": source.name,
        "label": source.label,
        "group": source.group,
        "kind": source.kind,
        "value": source.value,
        "unit": source.unit,
        "r95_alone_m": improvement.alone,
        "r95_gain_if_halved_m": improvement.gain,
        "share_of_horizontal_mean_square": improvement.share,
        "sigma": _components(result.sigma(source.name)[-1]) if random else None,
        "mean": None if random else _components(result.mean[source.name][-1] * _HEADING),
    }


def _allowance(allowance: Allowance, size: float) -> dict[str, Json]:
    return {
        "sources": [source.name for source in allowance.sources],
        "possible": allowance.possible,
        "factor": allowance.factor,
        "largest": [
            {"value": value, "unit": source.unit}
            for source, value in zip(allowance.sources, allowance.values, strict=True)
        ],
        "without_them": allowance.without / size,
    }


def _answer(answer: Answer) -> dict[str, Json]:
    requirement, size = answer.requirement, answer.requirement.unit_size
    certain = requirements.Verdict.certain(requirement, answer.value, answer.time, answer.exceeded)
    verdict = certain.in_unit
    return {
        "requirement": verdict.requirement,
        "meaning": requirement.meaning,
        "met": answer.met,
        "value": verdict.value,
        "limit": verdict.limit,
        "margin": answer.margin / size,
        "unit": verdict.unit,
        "time_s": verdict.time_s,
        "exceeded_from_s": verdict.exceeded_from_s,
        "after_fixes_end_s": verdict.after_fixes_end_s,
        "sources": [_allowance(allowance, size) for allowance in answer.allowances],
        "free_together": None if answer.joint is None else _allowance(answer.joint, size),
        "factor_of_all_sources": answer.everything.factor,
    }


def _columns(result: BudgetResult, name: str | None) -> dict[str, Array]:
    """Return the columns of one source over time, (E,) each; of all sources together if the name is None."""
    mean = result.bias if name is None else result.mean.get(name, np.zeros((len(result.time), 9)))
    columns = {"cep_m": result.radius(0.5, name), "r95_m": result.radius(0.95, name)}
    for what, values in (("sigma", result.sigma(name)), ("mean", mean * _HEADING)):
        heads = (f"{what}_{part}_{unit}" for part, unit in zip(BUDGET_COMPONENTS, _SI, strict=True))
        columns |= dict(zip(heads, values.T, strict=True))
    return columns


def streams(result: BudgetResult) -> Iterator[Stream]:
    """Yield the growth of the errors over time, by all sources together ("total") and by each."""
    for name in (None, *(source.name for source in result.sources)):
        columns = _columns(result, name)
        yield Stream(name or "total", result.time, tuple(Vector(k, (k,), v[:, None]) for k, v in columns.items()))


def _write_parquet(result: BudgetResult, path: Path) -> None:
    """Write one row for each instant and source; the source "total" is all of them."""
    import pyarrow as pa

    count, kinds = len(result.time), {"total": "total", **{source.name: source.kind for source in result.sources}}
    parts = [{"time_s": result.time, **_columns(result, None if name == "total" else name)} for name in kinds]
    columns: dict[str, Any] = {
        "source": pa.array([name for name in kinds for _ in range(count)]),
        "kind": pa.array([kind for kind in kinds.values() for _ in range(count)]),
    }
    columns |= {head: pa.array(np.concatenate([part[head] for part in parts])) for head in parts[0]}
    write_table(pa.table(columns), path)


class BudgetMedia(Media[BudgetResult]):
    """Numbers, streams, figure and files of a covariance budget."""

    file = "budget.json"

    def summary(self, result: BudgetResult) -> dict[str, Json]:
        return to_json(result, result.answers(), result.times)

    def streams(self, result: BudgetResult) -> Iterator[Stream]:
        yield from streams(result)

    def exhibits(self, result: BudgetResult) -> Exhibits:
        return exhibits_of(result, result.answers(), result.times)

    def write(self, result: BudgetResult, exhibits: Exhibits, folder: Path) -> None:
        write_text(folder / "scenario.toml", result.scenario.to_toml())
        _write_parquet(result, folder / "budget.parquet")
        write_shown(exhibits, folder)
