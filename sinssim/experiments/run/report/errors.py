"""The section of a run's report about the errors of its solutions: tables, plots, singular attitudes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from sinssim import units
from sinssim.data import Array
from sinssim.formatting import capital, signed
from sinssim.recording import style
from sinssim.recording.report import page, plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.plot import Line, Mark
from sinssim.scales import ANGLES, HEIGHTS, LENGTHS, SPEEDS, Scale, suiting
from sinssim.strapdown.nav_error import NavError

_KINDS = ("final", "rms", "max")
_DIGITS = 4
_MOST_MARKS, _MARKS_WITH_HALF = 12, 5
"""Largest number of marks at multiples of Schuler's period, and of periods in a run that has one at the half, too."""
_COLUMNS: tuple[tuple[str, str, Scale, float], ...] = (
    ("horizontal", "horizontal_error_m", LENGTHS, 1.0),
    ("height", "height_error_m", HEIGHTS, 1.0),
    ("velocity", "velocity_error_mps", SPEEDS, 1.0),
    ("attitude", "attitude_error_arcsec", ANGLES, units.ARCSEC),
)
"""Title, name in `summary.json` after "final_", "rms_", "max_", units, and the size of the summary's unit in SI."""


@dataclass(frozen=True)
class Compared:
    """Errors of solutions that belong to no run in memory, in the form in which those of a run are drawn.

    Attributes:
        time: first and last time, (2,) s.
        errors: by algorithm.
        axes: axes of the errors.
    """

    time: Array
    errors: Mapping[str, NavError]
    axes: str


def failure(failed: tuple[str, Mapping[str, Any]]) -> str:
    """Return the line about an algorithm without a result.

    Args:
        failed: name of the algorithm, and its entry in `summary.json`.

    Returns:
        HTML.
    """
    name, why = failed
    return f'<p class="broken"><strong>{words(name)} has no result.</strong> {words(capital(why["text"]))}</p>'


def error_tables(
    numbers: Mapping[str, Mapping[str, float | None]],
    where: str = "summary.json; all samples: sinssim.load_streams, or sinssim export --to parquet",
    against: str = "truth",
) -> Iterator[str]:
    """Yield the tables of the errors.

    Args:
        numbers: errors by algorithm, as in `summary.json`.
        where: the files with all digits.
        against: what the solutions are compared with.

    Yields:
        HTML.
    """
    colors = dict(zip(numbers, map(style.css, style.colors(list(numbers))), strict=True))
    groups = [(title, key, *_unit(numbers.values(), key, scale, si)) for title, key, scale, si in _COLUMNS]
    heads = [f'<th class="group first" colspan="3">{title} [{unit}]</th>' for title, _, unit, _ in groups]
    lines = []
    for name, found in numbers.items():
        cells = [
            f"<td{' class=first' if kind == 'final' else ''}>{_in_unit(found[f'{kind}_{key}'], size)}</td>"
            for _, key, _, size in groups
            for kind in _KINDS
        ]
        lines.append((page.swatch(colors[name]) + words(name), *cells))
    yield '<div class="errors">'
    yield table(("algorithm", *_KINDS * len(groups)), lines, 1, f"<tr><th></th>{''.join(heads)}</tr>")
    yield (
        f'</div><p class="note">Solution minus {against}, in the local level of the latter. The final '
        "height error has a sign (positive: too high); all others are magnitudes. Attitude is the angle of the single "
        f"rotation between computed and true attitude. Full precision: {where}.</p>"
    )


def _unit(numbers: Iterable[Mapping[str, float | None]], key: str, scale: Scale, si: float) -> tuple[str, float]:
    """Return the unit of a column, which is that of its plot, and its size in the summary's unit."""
    largest = [found[f"max_{key}"] for found in numbers]
    unit, size = suiting(scale, np.array([value * si for value in largest if value is not None]))
    return unit, size / si


def _in_unit(value: float | None, size: float) -> str:
    return "–" if value is None else signed(value / size, _DIGITS)


class WithErrors(Protocol):
    """A run, or what has the errors of its solutions.

    Attributes:
        time: from the beginning to the end of the run, s.
        axes: axes of the errors, one of `sinssim.frames.AXES`.
        errors: by algorithm; a kind of errors that is NaN throughout is not drawn.
    """

    @property
    def time(self) -> Array: ...
    @property
    def axes(self) -> str: ...
    @property
    def errors(self) -> Mapping[str, NavError]: ...


def error_plots(run: WithErrors, period: float, *, apart: bool = True) -> Iterator[str]:
    """Yield the plots of the errors over time.

    Args:
        run: whose errors they are; quantities that are not known are NaN.
        period: Schuler's, s.
        apart: whether the distance of the solutions from the first one is drawn, too.

    Yields:
        HTML.
    """
    names, errors = list(run.errors), list(run.errors.values())
    colors = [style.css(c) for c in style.colors(names)]
    dashes = plot.dashes(len(names))
    span, marks = _schuler_marks(float(run.time[0]), float(run.time[-1]), period)

    def draw_one(
        title: str, values: Sequence[Array], unit: tuple[str, float], more: Sequence[Line] = (), **options: Any
    ) -> str:
        lines = []
        if not any(np.isfinite(rows).any() for rows in values):
            return ""
        for name, error, rows, color, dash in zip(names, errors, values, colors, dashes, strict=True):
            if not np.isnan(rows).all():
                lines.append(Line(name, error.time, rows, color, 2.0, dash, unit[1]))
        return plot.plot(title, unit[0], [*more, *lines], span, marks=marks, **options)

    def components(
        scale: Scale, kind: str, axes: Sequence[int], whole: Sequence[Array] = ()
    ) -> tuple[list[list[Array]], tuple[str, float]]:
        """Return components and their unit, which is that of the magnitude where one is drawn."""
        columns = [[getattr(e, kind)[:, i] for e in errors] for i in axes]
        return columns, suiting(scale, *_known(whole or [c for column in columns for c in column]))

    yield _explanation(period, span[1] - span[0])
    if run.axes == "transported":
        yield _NEAR_A_POLE
    horizontal = [e.horizontal for e in errors]
    unit = suiting(LENGTHS, *_known(horizontal))
    mile = [] if unit[0] == "mm" else [_mile_an_hour(span, unit[1])]
    yield draw_one("Horizontal position error", horizontal, unit, mile, width=1140, height=240, from_zero=True)
    yield '<div class="pair">'
    speed, angle = [e.speed for e in errors], [e.angle for e in errors]
    position, unit = components(LENGTHS, "position_ned", (0, 1), horizontal)
    velocity, v_unit = components(SPEEDS, "velocity_ned", (0, 1), speed)
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
    yield draw_one("Azimuth misalignment, φD", azimuth[0], z_unit)
    yield draw_one("Height error (positive: too high)", height, suiting(HEIGHTS, *_known(height)))
    yield draw_one("Velocity error, magnitude", speed, v_unit, from_zero=True)
    yield draw_one("Attitude error, angle", angle, suiting(ANGLES, *_known(angle)), from_zero=True)
    yield "</div>"
    if apart and len(names) > 1:
        yield _apart(run.errors, colors, dashes, span, marks)


def _known(columns: Sequence[Array]) -> list[Array]:
    """Return the columns that have values: a scored solution may lack velocity or attitude."""
    return [column for column in columns if not np.isnan(column).all()]


_NEAR_A_POLE = (
    '<p class="note">The run comes within 1° of a pole, where the direction of north depends on the position. Velocity '
    "and attitude are therefore compared without a rotation about the vertical. The components are along north and "
    "east of "
    "the solution’s place: they change their signs where it passes over the pole.</p>"
)
"""What the errors of a run near a pole are."""


def _schuler_marks(start: float, end: float, period: float) -> tuple[tuple[float, float], list[Mark]]:
    """Return the time axis of the error plots, and marks at half the Schuler period and at its multiples.

    A run of many periods has marks at twelve multiples at most, and none at the half.
    """
    # The mark at a whole period stays on the axis if the run ends just before it.
    span = (start, start + period if end < start + period < start + 1.02 * (end - start) else end)
    periods = int((span[1] - start) / period + 1e-9)
    step = -(-periods // _MOST_MARKS) or 1
    whole = range(step, periods + 1, step)
    marks = [Mark(start + k * period, f"T = {period / 60.0:.1f} min" if k == 1 else f"{k} T") for k in whole]
    if periods <= _MARKS_WITH_HALF and span[1] - start >= 0.5 * period * (1.0 - 1e-9):
        marks.insert(0, Mark(start + 0.5 * period, f"T/2 = {0.5 * period / 60.0:.1f} min"))
    return span, marks


def _explanation(period: float, length: float) -> str:
    """Explain the marks and the angles in the error plots."""
    if length < 0.5 * period * (1.0 - 1e-9):
        marks = "the run is shorter than half a period."
    elif length < (_MARKS_WITH_HALF + 1) * period:
        marks = "dotted lines mark it and its half."
    else:
        marks = "dotted lines mark its multiples."
    return (
        f"<p>The Schuler period T = 2π√(R/g) is {period / 60.0:.2f} min here; {marks} φ is the rotation vector of the "
        "error equations, q<sub>true</sub> = q(φ) ⊗ q<sub>solution</sub>, to first order C<sub>solution</sub> = "
        "(I − [φ×]) C<sub>true</sub>: φ<sub>N</sub> and φ<sub>E</sub> are tilts, and for a level vehicle "
        "−φ<sub>D</sub> is the error of heading.</p>"
    )


def _apart(
    errors: Mapping[str, NavError],
    colors: Sequence[str],
    dashes: Sequence[str],
    span: tuple[float, float],
    marks: Sequence[Mark],
) -> str:
    """Draw the distance of each solution from the first one, which shows the errors of the algorithms alone."""
    # algorithms that take several samples per update have fewer rows: use the instants common to all
    time = min((error.time for error in errors.values()), key=len)
    time = time[np.unique(np.linspace(0, len(time) - 1, min(len(time), 8192)).round().astype(np.intp))]
    found = {
        name: e.position_ned[np.searchsorted(e.time, time).clip(max=len(e.time) - 1)] for name, e in errors.items()
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
    return Line("1 nmi/h", ends, rate, style.css(style.COLORS["reference"]), 1.2, "6 4", size, reference=True)


def singularity_table(found: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """Return the table of the passages through a singular attitude.

    Args:
        found: passages by algorithm, as in `summary.json`.

    Returns:
        HTML.
    """
    if not found:
        return "<p>No algorithm passed through a singular attitude.</p>"
    lines = [
        (
            words(name),
            f"{event['start_s']:.2f}",
            f"{event['end_s']:.2f}",
            _in_unit(event["damage_arcsec"], 60.0),
            f'<td class="text">{words(event["text"].removeprefix(f"{name}: "))}</td>',
        )
        for name, events in found.items()
        for event in events
    ]
    heads = ("algorithm", "from [s]", "to [s]", "damage [arcmin]", "")
    return table(heads, lines) + (
        '<p class="note">Damage: angle between the attitude of the algorithm after the passage and that of a '
        "singularity-free algorithm with the same increments.</p>"
    )
