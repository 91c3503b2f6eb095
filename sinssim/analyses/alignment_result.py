"""The alignment of one session with its expected errors: numbers, exhibits and files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sinssim.alignment.alignment_budget import (
    AVERAGED,
    MOTION,
    SOURCES,
    Expected,
    Method,
    bias_takes_over,
    error_budget,
    expected_errors,
    reading_errors,
    total,
)
from sinssim.alignment.base_motion import Stillness, motion_errors, stillness
from sinssim.alignment.determination import Determination, determine, doubt, mean_readings, solve
from sinssim.alignment.disturbed_base import align_disturbed
from sinssim.alignment.parked_theory import Angles, Attitude, coefficients, linear
from sinssim.charts import Axis, Bars, Chart, Charts, Dots, Line, Mark, Remark, Rule
from sinssim.data import Array, ImuData, html_table, short_repr
from sinssim.errors import InputError
from sinssim.exhibits import Column, Exhibits, Item, Section, Sentence, Table
from sinssim.recording.result import Media, Result, plain, write_shown
from sinssim.recording.streams import Stream, imu_stream
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.units import ANGLE_SCALE, ARCMIN, ARCSEC, DEG, DEG_H, capital, fixed, suiting


@short_repr
@dataclass(frozen=True, eq=False)
class AlignmentResult(Result):
    """One session's alignment.

    Attributes:
        source: name of the scenario or of the log's file.
        method: method of alignment.
        imu: the session.
        determination: the angles and the latitude; the heading in the range of the scenario's [output], if it has one.
        sigma: standard deviations of the sensor block's errors, if known.
        mean: known part of the determination's error (from errors that a scenario fixes), rad, if known.
        budget: standard deviations by source, if known and if the theory holds, rad.
        crossing: session lengths from which bias dominates, s, likewise.
        truth: heading, roll, pitch and latitude of a simulated session, rad.
        residual: root mean square of the residual velocity on a disturbed base, m/s.
        residual_velocity: residual velocity over time, in the block's axes at the first instant, (N+1, 3) m/s.
        mean_angles: result of eq. (1) for a disturbed session, for comparison, rad.
        warmed: time from when the sensors were switched on to the session's first sample, s.
        directory: directory of the alignment; None if none was written.
        media: what draws and writes it.
    """

    source: str
    method: Method
    imu: ImuData
    determination: Determination
    sigma: ImuErrors | None = None
    mean: Angles | None = None
    budget: dict[str, Angles] | None = None
    crossing: Angles | None = None
    truth: Angles | None = None
    residual: float | None = None
    residual_velocity: Array | None = None
    mean_angles: Angles | None = None
    warmed: float = 0.0
    directory: Path | None = None
    media: Media[AlignmentResult] = field(
        default_factory=lambda: AlignmentMedia(), kw_only=True, repr=False, compare=False
    )

    def _repr_html_(self) -> str:
        sigma = None if self.budget is None else total(self.budget)
        rows = [
            (name, f"{float(getattr(self.determination, name)) / DEG:.5f}",
             "" if sigma is None else f"{float(getattr(sigma, name)) / ARCMIN:.3g}")
            for name in Angles._fields
        ]  # fmt: skip
        title = f"Alignment of {self.source}, {self.duration:g} s"
        return html_table(title, rows, ("", "determined, deg", "expected error (1σ), arcmin"))

    @property
    def duration(self) -> float:
        """Length of the session, s."""
        return float(self.imu.time[-1] - self.imu.time[0])

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.imu)

    @property
    def error(self) -> Angles | None:
        """Determined minus true angles, rad."""
        if self.truth is None:
            return None
        d = self.determination
        determined = (d.heading, d.roll, d.pitch, d.latitude)
        return Angles(*((a - b + np.pi) % (2.0 * np.pi) - np.pi for a, b in zip(determined, self.truth, strict=True)))


def align_session(
    imu: ImuData,
    source: str,
    sensors: Imu | None = None,
    *,
    method: Method = "quiet",
    latitude: float | None = None,
    truth: Angles | None = None,
    warmed: float = 0.0,
) -> AlignmentResult:
    """Align one session and state the expected errors, by the sensor block if it is known.

    Method "quiet" is eq. (1), the others the cone of gravity, for a moving base, with a `latitude` in rad if it is
    known. `truth` are the angles of a simulated session, rad; `warmed` is the time since the sensors were switched on,
    s.
    """
    expected = None if sensors is None else expected_errors(sensors)
    if method == "quiet":
        determination = determine(*mean_readings(imu), None if expected is None else expected.instrument_sigmas)
        still = stillness(imu, expected, warmed)
        still.require()
        result = AlignmentResult(source, method, imu, determination, truth=truth, warmed=warmed)
    else:
        alignment, still = align_disturbed(imu, latitude), None
        method = "disturbed" if latitude is None else "disturbed, latitude known"
        result = AlignmentResult(
            source, method, imu, alignment.determination, truth=truth, residual=alignment.residual,
            residual_velocity=alignment.residual_velocity, mean_angles=solve(*mean_readings(imu))[0], warmed=warmed,
        )  # fmt: skip
    where = result.determination.latitude if latitude is None else np.asarray(latitude)
    if expected is None or not all(map(np.isfinite, (*result.determination.attitude, where))):
        return result
    return _with_expected_errors(result, expected, where, still)


def _with_expected_errors(
    result: AlignmentResult, expected: Expected, latitude: Array, still: Stillness | None
) -> AlignmentResult:
    """Add the error budget at a latitude, rad; near a singularity, where first-order theory fails, there is none."""
    d = result.determination
    method, rate_hz = result.method, result.samples / result.duration
    try:
        budget = error_budget(
            d.attitude, latitude, expected.sigma, result.duration, method=method, gravity=d.gravity,
            start=result.warmed, rate_hz=rate_hz,
        )  # fmt: skip
        crossing = bias_takes_over(
            d.attitude, latitude, expected.sigma, method=method, gravity=d.gravity, start=result.warmed, rate_hz=rate_hz
        )
    except InputError:  # the determination has its own warnings
        return result
    by_reading = coefficients(d.attitude, latitude, gravity=d.gravity)
    if still is not None:
        budget[MOTION] = motion_errors(by_reading, still)
    errors = reading_errors(expected.mean, *mean_readings(result.imu), result.duration, result.warmed)
    return replace(
        result,
        determination=doubt(d, total(budget)),
        sigma=expected.sigma,
        mean=linear(by_reading, *errors),
        budget=budget,
        crossing=crossing,
    )


def _by_name(angles: Angles, unit: float) -> dict[str, float]:
    return {name: float(value) / unit for name, value in zip(Angles._fields, angles, strict=True)}


_INSTANTS = 1000
"""Instants of a session at which the angles so far are shown."""
_DEGREES, _MINUTES = fixed("°", DEG), fixed("′", ARCMIN)
_UNITS = {"heading": fixed("arcmin", ARCMIN), "latitude": fixed("arcmin", ARCMIN)}
_NONE = np.empty(0)


def has_expectation(result: AlignmentResult) -> bool:
    """Return whether the expected errors are known: those of known sensors, at determined angles."""
    d = result.determination
    finite = all(map(np.isfinite, (*d.attitude, d.latitude)))
    return result.budget is not None and result.sigma is not None and finite


def exhibits_of(result: AlignmentResult) -> Exhibits:
    """Return what an alignment has to show; "error_budget" are charts of the expected errors, if they are known."""
    d = result.determination
    how = "eq. (1) on a quiet base" if result.method == "quiet" else "gravity's cone in inertial space"
    measured = f"Measured: Earth rate {float(d.earth_rate) / DEG_H:.4f} deg/h, gravity {float(d.gravity):.5f} m/s²."
    items: list[Item] = [_angles(result), Sentence(measured)]
    if result.residual is not None:
        items.append(Sentence("Residual velocity after the fit of the cone (heave, sway, noise): "
                              f"{result.residual:.3g} m/s rms."))  # fmt: skip
    items += [Sentence(capital(warning)) for warning in d.warnings]
    if result.budget is not None:
        items.append(_sources(result, result.budget))
    items.append(Section("The session", [_session(result)], on=("page", "recording")))
    expected = has_expectation(result)
    if expected:
        items.append(Section("Expected error", [_expected(result)], on=("page", "recording")))
    title = f"{result.source}: {result.duration:g} s, {result.samples} samples, {how}"
    return Exhibits(
        title, [Sentence(f"{title}.", "lead", on=("page",)), Section("", items)], title, f"{result.source}: alignment",
        name="alignment", root="session", span=(float(result.imu.time[0]), float(result.imu.time[-1])),
        figure="error_budget" if expected else "", pictures=("error_budget",),
    )  # fmt: skip


def _angles(result: AlignmentResult) -> Table:
    """Return the angles and the latitude beside their expected and true errors."""
    d, error = result.determination, result.error
    sigma = None if result.budget is None else total(result.budget)
    columns = [Column("", words=True), Column("determined", _DEGREES)]
    rows: list[list[str | float]] = [[name, _angle(getattr(d, name))] for name in Angles._fields]
    if sigma is not None and result.crossing is not None:
        columns += [Column("σ", _MINUTES), Column("bias dominates from", fixed("s"))]
        for row, value, crossing in zip(rows, sigma, result.crossing, strict=True):
            row += [_minutes(float(value)), f"{float(crossing):.3g}"]
    if result.truth is not None and error is not None:
        columns += [Column("true", _DEGREES), Column("error", _MINUTES)]
        for row, true, off in zip(rows, result.truth, error, strict=True):
            row += [_angle(true), "–" if math.isnan(off) else f"{float(off) / ARCMIN:.3f}"]
    if result.mean_angles is not None:
        columns.append(Column("eq. (1) on the same data", _DEGREES))
        for row, mean in zip(rows, result.mean_angles, strict=True):
            row.append(_angle(mean))
    return Table(tuple(columns), rows)


def _sources(result: AlignmentResult, budget: Mapping[str, Angles]) -> Table:
    """Return the expected error by source."""
    shown = _shown(budget)
    if result.mean is not None and any(float(value) != 0.0 for value in result.mean):
        shown["known mean error"] = result.mean
    rows = [[source, *(_minutes(float(value)) for value in angles)] for source, angles in shown.items()]
    columns = Column("source", words=True), *(Column(name, _MINUTES) for name in Angles._fields)
    return Table(columns, rows, "Expected error by source, 1σ")


def _shown(budget: Mapping[str, Angles]) -> dict[str, Angles]:
    """Return the sources that are not zero, and their total."""
    sources = {source: angles for source, angles in budget.items() if any(float(value) > 0.0 for value in angles)}
    return {**sources, "total": total(dict(budget))}


def _angle(value: ArrayLike) -> str:
    return "not determined" if np.isnan(value) else f"{round(float(value) / DEG, 5) + 0.0:.5f}"  # type: ignore[arg-type]  # no negative zero


def _minutes(value: float) -> str:
    return "–" if value == 0.0 else f"{value / ARCMIN:.3f}" if abs(value) >= 5e-4 * ARCMIN else "<0.001"


def _session(result: AlignmentResult) -> Charts:
    """Return the angles from the session so far, and the departure of the block from rest."""
    imu = result.imu
    time = imu.time - imu.time[0]
    share = (time / result.duration)[:, None]

    def departure(increments: Array) -> Array:
        accumulated = np.concatenate([np.zeros((1, 3)), np.cumsum(increments, axis=0)])
        return np.asarray(accumulated - share * accumulated[-1])

    linear = result.residual_velocity is None
    what = "a linear trend" if linear else "gravity's cone in inertial space"
    velocity = departure(imu.dvel) if result.residual_velocity is None else result.residual_velocity
    charts = [
        Chart(key=key, title=title, y=Axis(units=fixed(*unit)), marks=tuple(
            Line(label=axis, x=time, y=values[:, k]) for k, axis in enumerate(("forward", "right", "down"))
        ))
        for key, title, unit, values in (
            ("turn", "departure of the gyros' angle from a linear trend", ("arcsec", ARCSEC), departure(imu.dtheta)),
            ("velocity", f"departure of the accelerometers' velocity from {what}", ("mm/s", 1e-3), velocity),
        )
    ]  # fmt: skip
    rows = tuple((chart,) for chart in (*_so_far(result), *charts))
    return Charts("session", rows, (11.0, 2.5 * len(rows)))


def _so_far(result: AlignmentResult) -> list[Chart]:
    """Return the result of eq. (1) up to each instant of the session with its ±σ; a swaying base has none."""
    if result.method != "quiet":
        return []
    imu = result.imu
    ends = np.unique(np.linspace(max(1, len(imu) // 100), len(imu), _INSTANTS).astype(int))
    elapsed = imu.time[ends] - imu.time[0]
    so_far, _, _ = solve(*(np.cumsum(x, axis=0)[ends - 1] / elapsed[:, None] for x in (imu.dtheta, imu.dvel)))
    budget = None
    if result.sigma is not None and result.budget is not None:
        last = Angles(*(angle[-1] for angle in so_far))  # only the length changes
        budget = total(
            error_budget(
                Attitude(*last[:3]), last.latitude, result.sigma, elapsed, gravity=result.determination.gravity,
                start=result.warmed, rate_hz=len(imu) / result.duration,
            )
        )  # fmt: skip
    charts = []
    for k, name in enumerate(Angles._fields):
        final = so_far[k][-1]
        if np.isfinite(determined := getattr(result.determination, name)):  # in the range of the scenario's headings
            final = determined + (final - determined + np.pi) % (2.0 * np.pi) - np.pi
        angle = final + (so_far[k] - final + np.pi) % (2.0 * np.pi) - np.pi  # no jump from 360° to 0°
        lines = {"so far": angle}
        if budget is not None:
            # the effect of motion is known for the whole session; the same is assumed for a part of it
            moved = float(result.budget[MOTION][k]) if result.budget is not None else 0.0
            sigma = np.hypot(np.broadcast_to(budget[k], angle.shape), moved)
            lines |= {"so far + σ": angle + sigma, "so far − σ": angle - sigma}
        if result.truth is not None:
            true = float(result.truth[k])
            lines["true"] = np.full_like(angle, true + 2.0 * np.pi * np.round((final - true) / (2.0 * np.pi)))
        marks = tuple(Line(label=label, x=elapsed, y=values) for label, values in lines.items())
        y = Axis(units=fixed("deg", DEG))
        charts.append(Chart(key=f"angles/{name}", title=f"{name} from the session so far", y=y, marks=marks))
    return charts


def _expected(result: AlignmentResult) -> Charts:
    """Return the budget by source above the expected errors over the length of the session."""
    assert result.budget is not None
    assert result.sigma is not None
    d = result.determination
    duration = Rule(at=result.duration, upright=True, label="duration", dash=":")
    lines = curves(Angles._fields, d.attitude, d.latitude, {"total": result.sigma}, result.method, (duration,))
    title = f"{result.source}: expected error of a session of {result.duration:g} s"
    return Charts("error_budget", (bars(result.budget), lines), (13.0, 8.0), title, legend="below", heights=(1.15, 1.0))


def bars(budget: Mapping[str, Angles]) -> tuple[Chart, ...]:
    """Return an error budget, standard deviations by source in rad, as bars, a chart for each angle."""
    shown = _shown(budget)
    places, names = np.arange(float(len(shown))), Axis(names=tuple(shown), grid=False)
    charts = []
    for k, name in enumerate(Angles._fields):
        values = np.array([float(angles[k]) for angles in shown.values()])
        unit, size = suiting(ANGLE_SCALE, values)
        texts = tuple(_two_decimals(float(value) / size, float(values[-1]) / size) for value in values)
        colors = [name] * (len(values) - 1) + ["soft"]
        x = Axis(label="σ", units=fixed(unit, size), low=0.0)
        marks = (Bars(places=places, values=values, color=colors, texts=texts),)
        charts.append(Chart(key=f"budget/{name}", title=name, x=x, y=names, marks=marks))
    return tuple(charts)


def _two_decimals(value: float, most: float) -> str:
    return f"{value:.2f}" if value >= 0.005 * (most or 1.0) else "" if value == 0.0 else f"{value:.1g}"


def curves(
    names: Sequence[str], attitude: Attitude, latitude: ArrayLike, sigmas: Mapping[str, ImuErrors], method: Method,
    more: tuple[Mark, ...] = (),
) -> tuple[Chart, ...]:  # fmt: skip
    """Return the σ of angles over the length of the session: all sources, and those that averaging does not reduce."""
    time = np.geomspace(1.0, 2e4, 200)
    steady = tuple(source for source in SOURCES if source not in AVERAGED)
    known = {}
    for label, sigma in sigmas.items():
        budget = error_budget(attitude, latitude, sigma, time, method=method)
        crossing = bias_takes_over(attitude, latitude, sigma, method=method)
        known[label] = total(budget), total(budget, steady), crossing
    return tuple(_curve(name, time, known, more) for name in names)


def _curve(name: str, time: Array, known: Mapping[str, tuple[Angles, ...]], more: tuple[Mark, ...]) -> Chart:
    """Return the chart of an angle: totals, what averaging does not reduce of them, and their crossing, by label."""
    k, palette = Angles._fields.index(name), Angles._fields
    marks: list[Mark] = []
    for number, (label, (of_all, lasting, crossings)) in enumerate(known.items()):
        color = palette[number % len(palette)]
        floor = np.broadcast_to(lasting[k], time.shape)
        marks += [Line(label=label, x=time, y=np.broadcast_to(of_all[k], time.shape), color=color),
                  Line(x=time, y=floor, color=color, weight="thin", dash="--")]  # fmt: skip
        crossing = float(crossings[k])
        if time[0] < crossing < time[-1]:
            height = math.sqrt(2.0) * float(floor[0])
            marks += [Dots(x=np.array([crossing]), y=np.array([height]), color=color, size=5.0),
                      Remark(x=crossing, y=height, text=f"{crossing:.0f} s")]  # fmt: skip
    marks += [Line(label="not reduced by averaging", x=_NONE, y=_NONE, color="soft", weight="thin", dash="--"),
              Dots(label="bias dominates", x=_NONE, y=_NONE, color="soft", size=5.0), *more]  # fmt: skip
    x = Axis(label="session length T", units=fixed("s"), log=True, low=1.0, high=2e4)
    y = Axis(label=f"σ of the {name}", units=_UNITS.get(name, fixed("arcsec", ARCSEC)), log=True)
    return Chart(key=f"length/{name}", title=name, x=x, y=y, marks=tuple(marks))


def to_json(result: AlignmentResult) -> dict[str, Any]:
    """Return plain numbers with units in the names; undetermined values are None."""
    d = result.determination
    numbers: dict[str, Any] = {
        "source": result.source,
        "method": result.method,
        "duration_s": result.duration,
        "samples": result.samples,
        **{f"{name}_deg": float(getattr(d, name)) / DEG for name in Angles._fields},
        "earth_rate_deg_h": float(d.earth_rate) / DEG_H,
        "gravity_mps2": float(d.gravity),
        "warnings": list(d.warnings),
    }
    if result.residual is not None:
        numbers["residual_velocity_mps"] = result.residual
    if result.mean_angles is not None:
        numbers["eq_1_on_the_same_data_deg"] = _by_name(result.mean_angles, DEG)
    for name, angles in (("error", result.error), ("known_error", result.mean)):
        if angles is not None:
            numbers[f"{name}_arcmin"] = _by_name(angles, ARCMIN)
    if result.budget is not None:
        numbers["sigma_arcmin"] = _by_name(total(result.budget), ARCMIN)
        numbers["sigma_by_source_arcmin"] = {
            source: _by_name(result.budget[source], ARCMIN) for source in result.budget
        }
    if result.crossing is not None:
        numbers["bias_takes_over_s"] = _by_name(result.crossing, 1.0)
    return dict(plain(numbers))


class AlignmentMedia(Media[AlignmentResult]):
    """Numbers, streams, figure and files of an alignment."""

    file = "alignment.json"

    def summary(self, result: AlignmentResult) -> dict[str, Any]:
        return to_json(result)

    def streams(self, result: AlignmentResult) -> Iterator[Stream]:
        yield imu_stream("measured", result.imu)

    def exhibits(self, result: AlignmentResult) -> Exhibits:
        return exhibits_of(result)

    def figure(self, result: AlignmentResult, quantity: str | None = None) -> Any:
        if not has_expectation(result):
            raise InputError(
                f"{result.source}: nothing to plot: the expected errors need the sensors' grade (--grade for a log) "
                "and a determined attitude and latitude."
            )
        return super().figure(result, quantity)

    def write(self, result: AlignmentResult, exhibits: Exhibits, folder: Path) -> None:
        from sinssim.recording.figures import figure_of, save

        write_shown(exhibits, folder)
        if exhibits.figure:
            save(figure_of(exhibits.chosen(exhibits.figure)), folder / "alignment.svg")
