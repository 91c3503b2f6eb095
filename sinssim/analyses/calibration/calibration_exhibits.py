"""What a calibration has to show: the parameters with their errors, what the sequence determines, the residuals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sinssim.analyses.calibration.compensation_file import compensation_text
from sinssim.analyses.calibration.least_squares import OBSERVABLE
from sinssim.analyses.calibration.result import CalibrationResult
from sinssim.charts import Axis, Bars, Chart, Charts, Dots, Mark, Rule
from sinssim.data import Array
from sinssim.exhibits import Column, Exhibits, Item, Section, Sentence, Table, Verbatim
from sinssim.formatting import number_text
from sinssim.scales import fixed
from sinssim.truth.turntable.sequences import SEQUENCES
from sinssim.units import DEG_H, UG

_LEAST = 1e-3
"""The least ratio of 1σ, and the least singular value, that is drawn."""
_MOST_DOTS = 2000
_METHOD = {
    "separate": "Means in known positions and integrals over known turns; the errors of the table are nuisance "
    "parameters with the stated accuracy.",
    "systematic": "Navigation errors during the sequence: in each dwell the true velocity is zero, and the computed "
    "velocity shows the effect of gyro and accelerometer errors. The angles of the table are not used, except for the "
    "nominal attitude of the first position.",
}
_DIRECTION = (
    "A direction in the space of the parameters, each in units of its 1σ before the calibration, is observable if the "
    "sequence determines it better than this 1σ."
)


def exhibits_of(result: CalibrationResult) -> Exhibits:
    """Return what a calibration has to show."""
    scenario = result.scenario
    items: list[Item] = [
        Sentence(scenario.description, "lead", on=("page",)),
        Sentence(_METHOD[result.method], on=("page",)),
        Sentence(_sequence(result), on=("page",)),
        Section("Parameters", [_parameters(result), *map(Sentence, _sentences(result)), _determined(result)]),
        Section("Observability of the sequence", [Sentence(_DIRECTION), _singular(result)], on=("page",)),
        Section("Residuals", [_residuals(result)]),
        Section("Compensation", [Verbatim("compensation.toml", compensation_text(result))], on=("page",)),
    ]
    plain = f"{scenario.name}: calibration, {result.method} method, {len(result.dwells)} positions"
    return Exhibits(f"{scenario.name}: calibration", items, plain, figure="parameters")


def _sequence(result: CalibrationResult) -> str:
    own = result.scenario.turntable
    assert own is not None  # a calibration has one
    last = result.dwells[-1, 1] - result.dwells[0, 0]
    what = f"Sequence: {len(result.dwells)} positions in {last:.0f} s"
    ready = own.ready
    if ready is None:
        return f"{what}, given by [[turntable.turns]]."
    (name,) = (name for name, one in SEQUENCES.items() if one is ready)
    return f"{what}, “{name}”: {ready.about} ({ready.source})."


def _parameters(result: CalibrationResult) -> Table:
    """Return the table of the parameters, each in its own unit."""
    known = [] if result.truth is None else [Column("true"), Column("error/σ")]
    rows = []
    for k, one in enumerate(result.parameters):
        unit, size = one.unit
        seen, sigma = bool(result.observable[k]), float(result.sigma[k]) / size
        row = [one.name, like(result.values[k] / size, sigma) if seen else "–", number_text(sigma), unit]
        row.append(number_text(one.size / size))
        if result.truth is not None:
            off = (result.values[k] - result.truth[k]) / result.sigma[k]
            row += [like(result.truth[k] / size, sigma), f"{off:+.2f}".replace("-", "−")]
        rows.append([*row, "" if seen else "not observable"])
    heads = (Column("parameter", words=True), Column("estimate"), Column("1σ"), Column("unit", words=True),
             Column("before, 1σ"), *known, Column("", words=True))  # fmt: skip
    return Table(heads, rows)


def like(value: float, sigma: float) -> str:
    """Write a value with as many decimals as its 1σ has with three significant digits."""
    decimals = len(number_text(sigma).partition(".")[2]) if 1e-4 <= sigma < 1e6 else 4
    return f"{value:.{decimals}f}".replace("-", "−")


def _sentences(result: CalibrationResult) -> list[str]:
    """Return what is said below the table."""
    solution = result.estimate.solution
    found = [f"Misalignments refer to {result.frame}."]
    if result.unobservable:
        found.append(
            "The sequence does not determine the following, which stay 0 in the compensation (factors are in units of "
            f"each error's 1σ before): {'; '.join(result.unobservable)}."
        )
    else:
        found.append("The sequence determines every parameter.")
    found.append(f"Residuals: χ² = {solution.chi_square:.1f} with {solution.degrees} degrees of freedom.")
    total = result.chi_square_of_errors
    if total is not None:
        found.append(f"Errors of the observable parameters: χ² = {total[0]:.1f} with {total[1]} degrees of freedom.")
    return [*found, *result.notes]


def _determined(result: CalibrationResult) -> Charts:
    """Return 1σ of each parameter over its size before, and its error over 1σ where the truth is known."""
    count = len(result.parameters)
    place, seen = np.arange(float(count)), result.observable
    colors = ["aided" if one else "refused" for one in seen]
    ratio = result.sigma / np.array([one.size for one in result.parameters])
    names = Axis(names=tuple(result.names), grid=False)
    across = Axis(label="1σ after the calibration over 1σ before", log=True,
                  low=min(_LEAST, 0.5 * float(ratio.min())), high=2.0)  # fmt: skip
    bars = Bars(places=place, values=ratio, color=colors, width=0.6)
    title = "What the sequence determines" + ("" if seen.all() else " (pink: not observable)")
    marks: tuple[Mark, ...] = (bars, Rule(at=1.0, upright=True, color="limit"))
    charts = [Chart(key="determined", title=title, x=across, y=names, marks=marks)]
    if (off := result.normalised_error) is not None:
        reach = max(3.5, 1.1 * float(np.abs(off).max()))
        marks = (Rule(at=0.0, upright=True, color="truth", low=-1.0, high=1.0),
                 Dots(x=off, y=place, color=colors, size=5.0))  # fmt: skip
        across = Axis(label="error over 1σ", low=-reach, high=reach)
        charts.append(Chart(key="errors", title="Errors against the truth", x=across, y=names, marks=marks))
    return Charts("parameters", (tuple(charts),), (11.0, 0.8 + 0.21 * count))


def _singular(result: CalibrationResult) -> Charts:
    """Return the singular values of the observations."""
    singular = np.maximum(result.estimate.solution.singular, _LEAST)
    number, seen = np.arange(1.0, len(singular) + 1.0), singular >= OBSERVABLE
    marks: list[Mark] = [Rule(at=OBSERVABLE, label="limit", color="limit")]
    for label, color, rows in (("observable", "aided", seen), ("not observable", "refused", ~seen)):
        if rows.any():
            marks.append(Dots(label=label, x=number[rows], y=singular[rows], color=color, size=6.0))
    x = Axis(label="direction, by falling information", ticks=tuple(number), low=0.0, high=len(singular) + 1.0)
    y = Axis(label="1σ before over 1σ after", log=True, low=0.7 * min(OBSERVABLE, float(singular.min())))
    chart = Chart(key="singular", title="Singular values", x=x, y=y, marks=tuple(marks))
    return Charts("observability", ((chart,),), (11.0, 2.9))


def _residuals(result: CalibrationResult) -> Charts:
    """Return the residuals in the order of time."""
    estimate = result.estimate
    separate = result.method == "separate"
    series = [(estimate.residual_gyro, "gyros", fixed("deg/h", DEG_H), "position or turn"),
              (estimate.residual_accel, "accelerometers", fixed("µg", UG), "position")]  # fmt: skip
    if not separate:
        series = [(estimate.residual_accel, "velocity", fixed("1σ"), "observation")]
    axes = ("x", "y", "z") if separate else ("north", "east", "down")
    rows = []
    for values, label, units, name in series:
        marks: tuple[Mark, ...] = (Rule(at=0.0, weight="hair"), *_dots(values, axes))
        chart = Chart(key=f"residual/{label}", x=Axis(label=name), y=Axis(label=label, units=units), marks=marks,
                      legend="right")  # fmt: skip
        rows.append((chart,))
    return Charts("residuals", tuple(rows), (11.0, 2.7 * len(rows)))


def _dots(values: Array, axes: Sequence[str]) -> list[Dots]:
    """Return a row of dots for each axis, numbered from 1."""
    every = max(len(values) // _MOST_DOTS, 1)
    number = np.arange(1.0, len(values) + 1.0)[::every]
    size = 2.2 if len(values) > 200 else 4.0
    return [Dots(label=word, x=number, y=values[::every, k], color=word, size=size) for k, word in enumerate(axes)]
