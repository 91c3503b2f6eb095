"""The result of a calibration, with its exhibits and files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.calibration_problem import OBSERVABLE, Estimate, Parameter, errors_of, unobservable
from sinssim.charts import Axis, Bars, Chart, Charts, Dots, Mark, Rule
from sinssim.data import Array, html_table, short_repr
from sinssim.exhibits import Column, Exhibits, Item, Section, Sentence, Table, Verbatim
from sinssim.recording.result import Json, Media, Result, versions
from sinssim.scenario.schema import Scenario
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.system.files import write_text
from sinssim.truth.motions.turntable import SEQUENCES
from sinssim.units import ARCSEC, DEG_H, UG, fixed, number_text

FRAMES = {
    "separate": "the axes of the table's positions, in which [turntable] gives attitudes and turns",
    "systematic": "the frame of the accelerometers: x along the sensitive axis of the forward one, y in the plane of "
    "the forward and the right one, so that the accelerometers' misalignments xy, xz and yz are zero by definition",
}
"""The frame that the misalignments of a method refer to."""


@short_repr
@dataclass(frozen=True, eq=False)
class CalibrationResult(Result):
    """The errors of a sensor block, estimated from a sequence on a turntable.

    Attributes:
        scenario: the scenario.
        method: "separate" or "systematic".
        parameters: the parameters.
        estimate: values, residuals and the last linear solution.
        dwells: beginning and end of each dwell, (P, 2) s.
        truth: true values of the parameters in the same frame, (p,) SI; None for a log.
        notes: sentences on what was found and what is not modelled.
        directory: directory of the calibration; None if none was written.
        media: what draws and writes it.
    """

    scenario: Scenario
    method: str
    parameters: tuple[Parameter, ...]
    estimate: Estimate
    dwells: Array
    truth: Array | None
    notes: tuple[str, ...]
    directory: Path | None = None
    media: Media[CalibrationResult] = field(
        default_factory=lambda: CalibrationMedia(), kw_only=True, repr=False, compare=False
    )

    def _repr_html_(self) -> str:
        rows = [
            (parameter.name, f"{value / size:.6g}" if seen else "not observable", f"{sigma / size:.3g}", unit)
            for parameter, value, sigma, seen in zip(
                self.parameters, self.values, self.sigma, self.observable, strict=True
            )
            for unit, size in (parameter.unit,)
        ]
        title = f"Calibration of {self.scenario.name}, {self.method}"
        return html_table(title, rows, ("parameter", "estimate", "1σ", "unit"))

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return [parameter.name for parameter in self.parameters]

    @property
    def values(self) -> Array:
        """Estimated values, (p,) SI; zero for what is not observable."""
        return self.estimate.values

    @property
    def covariance(self) -> Array:
        """Covariance of the estimates, (p, p) SI; what is not observable has its size before the calibration."""
        return self.estimate.solution.covariance

    @property
    def sigma(self) -> Array:
        """Standard deviations of the estimates, (p,) SI."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def observable(self) -> NDArray[np.bool_]:
        """Whether the sequence determines each parameter, (p,)."""
        return self.estimate.solution.observable

    @property
    def unobservable(self) -> list[str]:
        """What the sequence does not determine: parameters and combinations of them."""
        return unobservable(self.estimate.solution, self.names)

    @property
    def error(self) -> Array | None:
        """Estimated minus true values, (p,) SI; None for a log."""
        return None if self.truth is None else self.values - self.truth

    @property
    def normalised_error(self) -> Array | None:
        """Error over 1σ, (p,); None for a log."""
        return None if self.error is None else self.error / self.sigma

    @property
    def chi_square_of_errors(self) -> tuple[float, int] | None:
        """Sum of squares of the errors of the observable parameters by their covariance, and its degrees of freedom."""
        if self.error is None:
            return None
        seen = self.observable
        if not seen.any():
            return 0.0, 0
        error, covariance = self.error[seen], self.covariance[np.ix_(seen, seen)]
        return float(error @ np.linalg.solve(covariance, error)), int(np.count_nonzero(seen))

    @property
    def frame(self) -> str:
        """The frame that the misalignments refer to."""
        return FRAMES[self.method]


_OFF = ~np.eye(3, dtype=bool)


def compensation_text(result: CalibrationResult) -> str:
    """Return a compensation file: TOML that `[compensation] file = "…"` takes, and that can be pasted into a scenario.

    Errors that the calibration does not determine are left in the readings: their value is 0, and their 1σ that of
    [imu].
    """
    errors = errors_of(result.parameters, result.values)
    lines = [
        f"# Calibration of {result.scenario.name} by the {result.method} method.",
        f"# Misalignments refer to {result.frame}.",
        '# Use: [compensation] with file = "compensation.toml", or paste this table.',
    ]
    if result.unobservable:
        lines.append("# Not determined by the sequence, therefore 0 with their former 1σ:")
        lines += [f"#   {words}" for words in result.unobservable]
    lines += ["", "[compensation]"]
    later = ["", "# Not calibrated and not corrected:"]
    for term in TERMS:
        if not term.calibrated:
            continue
        if term.field in ("bias", "scale", "misalignment"):
            lines += _term_lines(result, term, errors)
        else:
            mean, sigma = (np.broadcast_to(part, term.shape) for part in result.scenario.imu.stated(term))
            former = float(np.sqrt(np.mean(mean**2 + sigma**2))) / term.unit
            later += [f"{term.key} = {[0.0] * term.size}", f"{term.sigma_key} = {_number(former)}"]
    if np.any(errors.arms):
        places = ", ".join(f"[{', '.join(map(_number, row))}]" for row in errors.arms / 1e-3)
        lines.append(f"accel_arms_mm = [{places}]")
    return "\n".join([*lines, *later, ""])


def _term_lines(result: CalibrationResult, term: ErrorTerm, errors: ImuErrors) -> list[str]:
    value: Array = getattr(errors.gyro if term.triad == "gyro" else errors.accel, term.field)
    flat = value[_OFF] if term.field == "misalignment" else value
    rows = [
        k
        for k, parameter in enumerate(result.parameters)
        if parameter.triad == term.triad and parameter.field == term.field
    ]
    sigma = float(np.sqrt(np.mean(result.sigma[rows] ** 2))) / term.unit
    numbers = ", ".join(_number(x / term.unit) for x in flat)
    return [f"{term.key} = [{numbers}]", f"{term.sigma_key} = {_number(sigma)}"]


def _number(value: float) -> str:
    """Write a number with nine digits, as TOML's floating-point numbers need it."""
    text = f"{value:.9g}"
    return text if any(mark in text for mark in ".en") else f"{text}.0"


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
    table = result.scenario.turntable
    assert table is not None  # a calibration has one
    last = result.dwells[-1, 1] - result.dwells[0, 0]
    what = f"Sequence: {len(result.dwells)} positions in {last:.0f} s"
    ready = table.ready
    if ready is None:
        return f"{what}, given by [[turntable.turns]]."
    (name,) = (name for name, sequence in SEQUENCES.items() if sequence is ready)
    return f"{what}, “{name}”: {ready.about} ({ready.source})."


def _parameters(result: CalibrationResult) -> Table:
    """Return the table of the parameters, each in its own unit."""
    known = [] if result.truth is None else [Column("true"), Column("error/σ")]
    rows = []
    for k, parameter in enumerate(result.parameters):
        unit, size = parameter.unit
        seen, sigma = bool(result.observable[k]), float(result.sigma[k]) / size
        row = [parameter.name, like(result.values[k] / size, sigma) if seen else "–", number_text(sigma), unit]
        row.append(number_text(parameter.size / size))
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
    sentences = [f"Misalignments refer to {result.frame}."]
    if result.unobservable:
        sentences.append(
            "The sequence does not determine the following, which stay 0 in the compensation (factors are in units of "
            f"each error's 1σ before): {'; '.join(result.unobservable)}."
        )
    else:
        sentences.append("The sequence determines every parameter.")
    sentences.append(f"Residuals: χ² = {solution.chi_square:.1f} with {solution.degrees} degrees of freedom.")
    total = result.chi_square_of_errors
    if total is not None:
        sentences.append(
            f"Errors of the observable parameters: χ² = {total[0]:.1f} with {total[1]} degrees of freedom."
        )
    return [*sentences, *result.notes]


def _determined(result: CalibrationResult) -> Charts:
    """Return 1σ of each parameter over its size before, and its error over 1σ where the truth is known."""
    count = len(result.parameters)
    place, seen = np.arange(float(count)), result.observable
    colors = ["aided" if known else "refused" for known in seen]
    ratio = result.sigma / np.array([parameter.size for parameter in result.parameters])
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


_SI = {("gyro", "bias"): "rad/s", ("accel", "bias"): "m/s²", "scale": "1", "misalignment": "rad", "arm": "m"}


def to_json(result: CalibrationResult) -> dict[str, Any]:
    """Return a calibration as plain numbers with their units."""
    solution, estimate = result.estimate.solution, result.estimate
    rows = []
    for k, parameter in enumerate(result.parameters):
        unit, size = parameter.unit
        true = None if result.truth is None else float(result.truth[k])
        rows.append(
            {
                "name": parameter.name,
                "value": float(result.values[k]) / size,
                "sigma": float(result.sigma[k]) / size,
                "unit": unit,
                "observable": bool(result.observable[k]),
                "size_before": parameter.size / size,
                "true": None if true is None else true / size,
                "error_over_sigma": None if true is None else float((result.values[k] - true) / result.sigma[k]),
                "value_si": float(result.values[k]),
                "sigma_si": float(result.sigma[k]),
                "unit_si": _SI.get(parameter.field) or _SI[parameter.triad, parameter.field],
            }
        )
    total = result.chi_square_of_errors
    return {
        "name": result.scenario.name,
        "description": result.scenario.description,
        "method": result.method,
        "frame": result.frame,
        "parameters": rows,
        "covariance_si": result.covariance.tolist(),
        "unobservable": result.unobservable,
        "singular_values": solution.singular.tolist(),
        "directions": solution.directions.T.tolist(),
        "residuals": {
            "chi_square": solution.chi_square,
            "degrees_of_freedom": solution.degrees,
            "gyro_rad_s": estimate.residual_gyro.tolist(),
            "accel_mps2" if result.method == "separate" else "velocity_over_sigma": estimate.residual_accel.tolist(),
        },
        "errors": None if total is None else {"chi_square": total[0], "degrees_of_freedom": total[1]},
        "table_tilt_arcsec": None if estimate.tilt is None else (estimate.tilt / ARCSEC).tolist(),
        "dwells_s": result.dwells.tolist(),
        "iterations": estimate.iterations,
        "notes": list(result.notes),
        "versions": versions(),
    }


class CalibrationMedia(Media[CalibrationResult]):
    """Numbers, figure and files of a calibration."""

    file = "calibration.json"

    def summary(self, result: CalibrationResult) -> dict[str, Json]:
        return to_json(result)

    def exhibits(self, result: CalibrationResult) -> Exhibits:
        return exhibits_of(result)

    def write(self, result: CalibrationResult, exhibits: Exhibits, folder: Path) -> None:
        from sinssim.recording.page import page_of

        write_text(folder / "compensation.toml", compensation_text(result))
        write_text(folder / "scenario.toml", result.scenario.to_toml())
        write_text(folder / "report.html", page_of(exhibits))
