"""The errors of sensors.

Readings of a run against the truth before and after compensation, the errors of each axis and their 1σ; the error
terms of a grade, and the position error that each causes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import rotation, units
from sinssim.data import Array, ImuData
from sinssim.formatting import capital, signed
from sinssim.recording import style
from sinssim.recording.report import svg_plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.svg_plot import Line
from sinssim.scenario.notes import keys_without_effect
from sinssim.sensors.error_propagation import ASSUMPTIONS, Expectation
from sinssim.sensors.imu.compensation import imperfect_calibration
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import of_triad
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.grades import find_grade, grade_name
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.sets.gimballed_sensors import torquer_sigma
from sinssim.sensors.sets.sensor_set import AttitudeSensor, Gyros, Platform, Redundant, SixAccelerometers
from sinssim.simulation.truth_stage import Truth
from sinssim.system.short_repr import short_repr
from sinssim.units import ANGLE_SCALE, DEG, NAUTICAL_MILE, SPEED_SCALE, Scale, suiting

if TYPE_CHECKING:
    from rich.console import Console

    from sinssim.scenario import Scenario
    from sinssim.sensors.imu.faults import ImuFault
    from sinssim.sensors.imu.grades import TriadGrade
    from sinssim.sensors.imu.imu import Imu
    from sinssim.sensors.sets.gimballed_sensors import AttitudeSensorErrors, PlatformErrors
    from sinssim.sensors.sets.sensor_readings import Readings, TrueErrors
    from sinssim.simulation.sensed_stage import Sensed


AXES = ("x", "y", "z")


@short_repr
@dataclass(frozen=True)
class SensorComparison:
    """Readings of one kind of sensor against the truth, along a run.

    Attributes:
        key: key in entities and labels: "gyro", "accel", "single", "single_gyro", "single_accel" or "attitude".
        title: name of the kind.
        names: k names of the lines: axes, or numbers.
        time: edges of the samples, (N+1,) s.
        error: accumulated errors of the sensors, (N+1, k) rad or m/s; for an attitude sensor, the error itself.
        left: the same after compensation, None without compensation.
        sums: units of both.
        drift: unit of their rate of change, and its size in SI.
        ideal, measured: increments, (N, k); None for an attitude sensor, which has none.
        reading: unit of their mean rates, and its size in SI.
    """

    key: str
    title: str
    names: tuple[str, ...]
    time: Array
    error: Array
    left: Array | None
    sums: Scale
    drift: tuple[str, float]
    ideal: Array | None = None
    measured: Array | None = None
    reading: tuple[str, float] = ("", 1.0)

    @property
    def window(self) -> float:
        """Averaging time of the errors, s, such that a run has a few hundred means."""
        duration = float(self.time[-1] - self.time[0])
        return next((w for w in (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0) if w >= duration / 200.0), 120.0)

    def averaged(self, error: Array) -> tuple[Array, Array]:
        """Return the mean error of the readings over each window.

        Args:
            error: `error` or `left`, (N+1, k).

        Returns:
            End of each window, (M,) s, and means, (M, k), in rad/s or m/s²; in rad for an attitude sensor. M is 0 for a
            run shorter than a window.
        """
        ends = np.arange(self.time[0], self.time[-1] + 1e-9, self.window)
        edges = np.unique(np.searchsorted(self.time, ends - 1e-6 * self.window))  # whatever the rounding of the ends
        time = self.time[edges]
        if self.measured is None:
            readings = np.diff(edges)[:, np.newaxis]
            return time[1:], np.add.reduceat(error[: edges[-1]], edges[:-1], axis=0) / readings
        return time[1:], np.diff(error[edges], axis=0) / np.diff(time)[:, np.newaxis]


def sensor_comparisons(sensed: Sensed | None) -> tuple[SensorComparison, ...]:
    """Return the readings of a simulated run by kind of sensor, as drawn in the report and the views.

    Args:
        sensed: what the sensors read; None for a run that ended before.
    """
    if sensed is None or not isinstance(sensed.truth, Truth):
        return ()
    return tuple(compare_sensors(sensed.readings, sensed.perfect, sensed.truth.ideal, sensed.readings.compensated))


def compare_sensors(
    readings: Readings, perfect: Readings, ideal: ImuData, compensated: ImuData | None
) -> Iterator[SensorComparison]:
    """Compare the readings of each kind of sensor with those of perfect sensors.

    Args:
        compensated: compensated increments, None without a calibration.
    """
    time, imu = ideal.time, readings.imu
    drift, ug = ("deg/h", units.DEG_H), ("µg", units.UG)
    deg_s, titles = ("deg/s", units.DEG), ["Gyros", "Accelerometers"]
    if readings.single is not None and perfect.single is not None:
        names = tuple(str(i) for i in range(1, readings.single.dtheta.shape[1] + 1))
        titles = ["Angular rate from the single gyros", "Specific force from the single accelerometers"]
        after = readings.single_compensated
        true, read = perfect.single.dtheta, readings.single.dtheta
        error, left = _total(read, true), None if after is None else _total(after.dtheta, true)
        yield SensorComparison(
            "single_gyro", "Single gyros", names, time, error, left, ANGLE_SCALE, drift, true, read, deg_s
        )
        true, read = perfect.single.dvel, readings.single.dvel
        error, left = _total(read, true), None if after is None else _total(after.dvel, true)
        yield SensorComparison(
            "single_accel",
            "Single accelerometers",
            names,
            time,
            error,
            left,
            SPEED_SCALE,
            ug,
            true,
            read,
            ("m/s²", 1.0),
        )
    if readings.accelerometers is not None and perfect.accelerometers is not None:
        names = tuple(str(i) for i in range(1, readings.accelerometers.shape[1] + 1))
        true, read = perfect.accelerometers, readings.accelerometers
        yield SensorComparison(
            "single",
            "Single accelerometers",
            names,
            time,
            _total(read, true),
            None,
            SPEED_SCALE,
            ug,
            true,
            read,
            ("m/s²", 1.0),
        )
    if readings.attitude is not None and perfect.attitude is not None:
        off = rotation.multiply(readings.attitude, rotation.conjugate(perfect.attitude))
        error = rotation.rotation_vector_from_quaternion(off)
        yield SensorComparison(
            "attitude", "Attitude sensor, inertial axes", AXES, time, error, None, ANGLE_SCALE, drift
        )
    else:
        title = titles[0] if readings.accelerometers is None else "Angular rate from the accelerometers"
        left = None if compensated is None else _total(compensated.dtheta, ideal.dtheta)
        error = _total(imu.dtheta, ideal.dtheta)
        yield SensorComparison(
            "gyro", title, AXES, time, error, left, ANGLE_SCALE, drift, ideal.dtheta, imu.dtheta, deg_s
        )
    title = titles[1] if readings.accelerometers is None else "Specific force from the accelerometers"
    left = None if compensated is None else _total(compensated.dvel, ideal.dvel)
    error = _total(imu.dvel, ideal.dvel)
    yield SensorComparison(
        "accel", title, AXES, time, error, left, SPEED_SCALE, ug, ideal.dvel, imu.dvel, ("m/s²", 1.0)
    )


def _total(read: Array, true: Array) -> Array:
    """Return the accumulated errors at every edge."""
    return np.concatenate((np.zeros((1, read.shape[1])), np.cumsum(read - true, axis=0)))


_DIGITS = 4
_AXES = ("x (forward)", "y (right)", "z (down)")

_ALWAYS = ("bias", "scale", "misalignment")  # fields that the report lists even if they are zero


def sensor_errors(scenario: Scenario, true: TrueErrors, kinds: Sequence[SensorComparison]) -> Iterator[str]:
    """Return the section about the sensors: the errors of this run, their 1σ, and their effect on the readings.

    Args:
        kinds: readings of the sensors; empty if the run ended before.
    """
    section, grade = scenario.imu, find_grade(scenario.imu.grade)
    name = f"<strong>{words(grade_name(section.grade))}</strong>"
    if isinstance(section.sensor_set, Gyros | Redundant | Platform):
        of = f"Grade {name}: {words(grade.description)}."
    else:  # the grade's description is that of a unit with gyros
        of = f"Accelerometers of the grade {name}."
    yield (
        f"<p>{of} The error of each {'sensor' if true.single_sensors else 'axis'} was drawn with the seed "
        f"{scenario.seed} from a normal distribution of the given 1σ, added to the value that the scenario gives, if "
        "any.</p>"
    )
    errors, keys = true.imu, section.model_dump()
    shift = ("null shift by gas flow, at most", _null_shift(errors), units.DEG_H, "deg/h")
    noise = _noises(*_of_noise(errors.accel, "accel"))
    gyros = _table(errors.gyro, grade.gyro, keys, "gyro") + _noises(*_of_noise(errors.gyro, "gyro"), shift)
    accelerometers = _table(errors.accel, grade.accel, keys, "accel") + noise
    match section.sensor_set:
        case SixAccelerometers(arm_m=arm):
            yield f"<h3>Six accelerometers</h3>{_six(section, true.accelerometers, arm)}{noise}"
        case Redundant():
            singles = (single_errors(true.single_sensors, section, kind) for kind in ("gyro", "accel"))
            yield "<h3>Single gyros</h3>" + next(singles) + _noises(*_of_noise(errors.gyro, "gyro"))
            yield "<h3>Single accelerometers</h3>" + next(singles) + noise
        case AttitudeSensor():
            sensor = _attitude_sensor(section, true.attitude_sensor)
            yield _pair(f"<h3>Attitude sensor</h3>{sensor}", f"<h3>Accelerometers</h3>{accelerometers}")
        case _:
            yield _pair(f"<h3>Gyros</h3>{gyros}", f"<h3>Accelerometers</h3>{accelerometers}")
    if true.platform is not None:
        yield f"<h3>Platform</h3>{platform_errors(section, true.platform, scenario.navigation.frame)}"
    if section.faults:
        numbered = isinstance(section.sensor_set, Redundant)
        yield f"<p>Faults: {'; '.join(_fault(fault, numbered) for fault in section.faults)}.</p>"
    if scenario.compensation is not None:
        yield "<h3>Residual errors after calibration</h3><p>Errors that the compensation does not remove.</p>"
        # known errors: true errors minus remaining errors
        if true.calibration is not None:
            left = imperfect_calibration(errors, true.calibration)
            none = find_grade("ideal")
            known = {key: value for key, value in scenario.compensation if "_sigma_" in key}
            yield _pair(_table(left.gyro, none.gyro, known, "gyro"), _table(left.accel, none.accel, known, "accel"))
        elif true.left is not None:
            both = zip(true.single_sensors, true.single_calibrations, strict=True)
            blocks = tuple(imperfect_calibration(*one) for one in both)
            yield from (single_errors(blocks, true.left, kind) for kind in ("gyro", "accel"))
    if any(kind.error.any() for kind in kinds):
        strapped = " of the same sensors strapped down" if true.platform is not None else ""
        yield f"<h3>Errors of the measurements{strapped}</h3>"
        yield from _plots(kinds)
    elif kinds:
        yield "<p>All sensors are ideal.</p>"


def _null_shift(errors: ImuErrors) -> float:
    """Return the largest null shift of laser gyros between the temperatures of the warm-up, rad/s."""
    if errors.null_shift is None:
        return 0.0
    between = np.linspace(errors.warm_up.start, errors.warm_up.steady, 1000)
    return float(np.abs(errors.null_shift.bias(between)).max())


def _fault(fault: ImuFault, numbered: bool) -> str:
    kinds = (("gyro", "gyro"), ("accel", "accelerometer"))
    named = [f"{name} {number}" for kind, name in kinds for number in sorted(fault.sensors(kind)) if numbered]
    of = f" of {', '.join(named)}" if named else ""
    if fault.type == "spike":
        return f"a spike{of} at {fault.at_s:g} s"
    end = "to the end" if fault.to_s is None else f"to {fault.to_s:g} s"
    return f"{fault.type.replace('-', ' ')}{of} from {fault.from_s:g} s {end}"


def _pair(left: str, right: str) -> str:
    return f'<div class="pair"><div>{left}</div><div>{right}</div></div>'


def _six(section: Imu, triads: Sequence[TriadErrors], arm: float) -> str:
    """Return the errors of six single accelerometers."""
    accel = find_grade(section.grade).accel
    bias = np.concatenate([triad.bias for triad in triads]) / units.UG
    scale = np.concatenate([triad.scale for triad in triads]) / units.PPM
    tilt = np.concatenate([np.linalg.norm(triad.misalignment, axis=1) for triad in triads]) / units.ARCSEC
    spread = (
        accel.bias / units.UG if section.accel_bias_sigma_ug is None else section.accel_bias_sigma_ug,
        accel.scale / units.PPM if section.accel_scale_sigma_ppm is None else section.accel_scale_sigma_ppm,
        accel.misalignment / units.ARCSEC
        if section.accel_misalignment_sigma_arcsec is None
        else section.accel_misalignment_sigma_arcsec,
    )
    rows = (
        (name, unit, *(signed(float(v), _DIGITS) for v in values), f"{sigma:.6g}")
        for (name, unit, values), sigma in zip(
            (("bias", "µg", bias), ("scale factor", "ppm", scale), ("axis tilt", "arcsec", tilt)), spread, strict=True
        )
    )
    return table(("", "unit", *(str(i) for i in range(1, 7)), "1σ"), rows, 2) + (
        f'<p class="note">On the faces of a cube, {arm:g} m from its centre, with their axes along: 1 front, '
        "(y + z)/√2; 2 aft, (y − z)/√2; 3 right, (x + z)/√2; 4 left, (z − x)/√2; 5 below, (x + y)/√2; 6 above, "
        "(x − y)/√2. Each axis has two tilts of the given 1σ.</p>"
    )


def _spread(given: bool, sigma: float | None, of_grade: float) -> str:
    """Return the 1σ of an error; beside a given error it is zero by default, not that of the grade."""
    if given:
        return f"given ± {_short(sigma)}" if sigma else "given"
    return _short(of_grade if sigma is None else sigma)


def _short(value: float) -> str:
    """Write a size with four significant digits, which a conversion of units does not lengthen."""
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"


def _attitude_sensor(section: Imu, errors: AttitudeSensorErrors | None) -> str:
    """Return the errors of the attitude sensor."""
    sensor = section.sensor_set
    assert isinstance(sensor, AttitudeSensor)
    assert errors is not None
    bias = _spread(sensor.bias_arcsec is not None, sensor.bias_sigma_arcsec, 0.0)
    own = find_grade(section.grade).gyro.bias / units.DEG_H
    rows = [
        ("initial error", "arcsec", *(signed(float(v), _DIGITS) for v in errors.bias / units.ARCSEC), bias),
        (
            "drift", "deg/h", *(signed(float(v), _DIGITS) for v in errors.drift / units.DEG_H),
            _spread(sensor.drift_deg_h is not None, sensor.drift_sigma_deg_h, own),
        ),
    ]  # fmt: skip
    return (
        table(("reference", "unit", "X", "Y", "Z", "1σ"), rows, 2)
        + _noises(("noise of each measurement, 1σ", errors.noise, units.ARCSEC, "arcsec"))
        + '<p class="note">Earth-centred inertial axes: Z to the north pole, X to the prime meridian at t = 0.</p>'
    )


def _plots(kinds: Sequence[SensorComparison]) -> Iterator[str]:
    """Draw the errors of the readings of each kind side by side, before and after compensation."""
    drawn = {kind.key: list(_of_kind(kind)) for kind in kinds}
    if single := drawn.pop("single", None):
        yield _pair(*single)
    if single := drawn.pop("single_gyro", None):
        yield _pair("".join(single), "".join(drawn.pop("single_accel")))
    yield _pair(*("".join(column) for column in drawn.values()))


def _of_kind(kind: SensorComparison) -> Iterator[str]:
    span = (float(kind.time[0]), float(kind.time[-1]))
    paint = style.colors(kind.names)
    unit, size = suiting(kind.sums, kind.error)
    lines = [(kind.error, paint, 1.5, "")]
    if kind.left is not None:
        pale = [style.tint(color) for color in paint]
        lines = [(kind.error, pale, 5.0, " measured"), (kind.left, paint, 1.5, " compensated")]

    def draw_all(title: str, unit: str, values: Sequence[tuple[Array, Array]], size: float) -> str:
        curves = [
            Line(f"{name}{word}", time, rows[:, i], style.css(colors[i]), width, size=size)
            for (time, rows), (_, colors, width, word) in zip(values, lines, strict=True)
            for i, name in enumerate(kind.names)
        ]
        return svg_plot.plot(f"{kind.title}: {title}", unit, curves, span)

    means = [kind.averaged(error) for error, *_ in lines]
    if len(means[0][0]):
        of_mean = (unit, size) if kind.measured is None else kind.drift
        yield draw_all(f"error, mean over {kind.window:g} s", of_mean[0], means, of_mean[1])
    what = "error of each measurement" if kind.measured is None else "error, accumulated"
    yield draw_all(what, unit, [(kind.time, error) for error, *_ in lines], size)
    if kind.left is not None:
        unit, size = suiting(kind.sums, kind.left)
        lines = [(kind.left, paint, 1.5, "")]
        yield draw_all("error after compensation, accumulated", unit, [(kind.time, kind.left)], size)


def _table(errors: TriadErrors, grade: TriadGrade, keys: Mapping[str, Any], kind: str) -> str:
    return table(("", "unit", *_AXES, "1σ"), _triad(errors, grade, keys, kind), 2)


def _triad(errors: TriadErrors, grade: TriadGrade, section: Mapping[str, Any], kind: str) -> Iterator[Sequence[str]]:
    """Return the rows of one triad: turn-on errors per axis, and their 1σ."""

    def spread(term: ErrorTerm) -> str:
        of_grade = grade.of(term) / term.unit
        return _spread(section.get(term.key) is not None, section.get(term.sigma_key), of_grade)

    for term in of_triad(kind):
        error = getattr(errors, term.field)
        if not term.drawn or not (term.field in _ALWAYS or np.any(error)):
            continue
        values, unit = error / term.unit, term.written_unit
        if values.ndim == 1:
            yield (term.label, unit, *(signed(float(v), _DIGITS) for v in values), spread(term))
            continue
        for j, axis in enumerate("xyz"):
            cells = [signed(float(values[i, j]), _DIGITS) if i != j or term.size == 9 else "" for i in range(3)]
            yield (f"{term.label} {axis}", unit, *cells, spread(term))


def _of_noise(errors: TriadErrors, kind: str) -> Iterator[tuple[str, float, float, str]]:
    """Yield the values common to all axes of a triad: label, value, size of the unit, and the unit."""
    for term in sorted(of_triad(kind), key=lambda term: term.stage in ("LIMITED", "QUANTISED")):  # noises first
        if not term.drawn and term.label:
            yield term.label, getattr(errors, term.field), term.unit, term.written_unit


def _noises(*terms: tuple[str, float, float, str]) -> str:
    parts = [f"{name} {_short(value / size)} {unit}" for name, value, size, unit in terms if value]
    return f'<p class="note">{capital(", ".join(parts) or "no noise")}.</p>'


def platform_errors(section: Imu, errors: PlatformErrors, frame: str) -> str:
    """Return a table of the errors of a platform's torquers and pick-offs.

    Args:
        section: the [imu] section, whose sensor set is a platform.
    """
    own = section.sensor_set
    assert isinstance(own, Platform)

    def spread(given: object, sigma: float) -> str:
        if given is not None:
            return f"given ± {sigma:.6g}" if sigma else "given"
        return f"{sigma:.6g}"

    rows = []
    if frame != "inertial":
        ppm = (signed(float(v), 4) for v in errors.torquer_scale / units.PPM)
        rows.append(
            ("torquing scale factor x, y, z", "ppm", *ppm, spread(own.torquer_scale_ppm, torquer_sigma(section) * 1e6))
        )
    arcsec = (signed(float(v), 4) for v in errors.pickoff / units.ARCSEC)
    sigma = spread(own.pickoff_arcsec, own.pickoff_sigma_arcsec or 0.0)
    rows.append(("gimbal angle roll, pitch, azimuth", "arcsec", *arcsec, sigma))
    noise = f"Noise of each gimbal angle {own.pickoff_noise_arcsec:g} arcsec. " if own.pickoff_noise_arcsec else ""
    return table(("", "unit", "1", "2", "3", "1σ"), rows, 2) + (
        f'<p class="note">{noise}The axes of gyros and accelerometers above are those of the platform, and of the '
        "sensor block for the strapdown system.</p>"
    )


def single_errors(blocks: Sequence[ImuErrors], section: Imu, kind: str) -> str:
    """Return a table of the errors of single sensors.

    Args:
        section: the [imu] section, whose sensor set is redundant.
        kind: "gyro" or "accel".
    """
    assert isinstance(section.sensor_set, Redundant)
    count = len(section.sensor_set.axes)
    rows = []
    for term in of_triad(kind):
        values = np.concatenate([getattr(getattr(block, kind), term.field).reshape(-1) for block in blocks]) if (
            term.drawn and term.size == 3
        ) else None  # fmt: skip
        if term.drawn and term.field == "misalignment":
            tilts = [np.linalg.norm(getattr(block, kind).misalignment, axis=1) for block in blocks]
            values = np.concatenate(tilts)
        if values is None or not (values.any() or term.field in ("bias", "scale", "misalignment")):
            continue
        label = "tilt of the axis" if term.field == "misalignment" else term.label
        sigma = float(np.max(section.stated(term)[1])) / term.unit
        cells = (signed(float(value) / term.unit, _DIGITS) for value in values[:count])
        rows.append((label, term.written_unit, *cells, f"{sigma:.6g}"))
    heads = ("", "unit", *(str(number) for number in range(1, count + 1)), "1σ")
    return table(heads, rows, 2)


CIRCULAR = 0.8326
"""Ratio of the radius that holds half of all errors to their rms, √(ln 2), for equal normal north and east errors."""
_LINEAR = 5e5
"""Position error beyond which the linear theory does not hold, m."""


def expectation_numbers(expectation: Expectation) -> dict[str, Any]:
    """Return the expectation as plain numbers with units in the names."""
    e = expectation
    grade = find_grade(e.imu.grade)
    return {
        "grade": e.imu.grade,
        "description": grade.description,
        "source": grade.source,
        "latitude_deg": e.latitude / DEG,
        "duration_s": e.duration,
        "terms": [vars(term) for term in e.terms],
        "contributions": [{"term": c.term, "assumes": c.assumes, "position_m": c.position} for c in e.contributions],
        "root_sum_square_m": e.total,
        "root_sum_square_nmi": e.total / NAUTICAL_MILE,
        "circular_error_probable_nmi": CIRCULAR * e.total / NAUTICAL_MILE if e.drawn else None,
        "unaided_height_from_accelerometer_bias_m": e.height,
        "linear": e.total < _LINEAR,
    }


def show_expectation(expectation: Expectation, console: Console) -> None:
    """Print the error terms and the position error that each causes."""
    from rich import box
    from rich.table import Table

    e = expectation
    grade = find_grade(e.imu.grade)
    console.print(f"{grade_name(e.imu.grade)}: {grade.description}", markup=False)
    console.print(f"Source: {grade.source}\n", markup=False)
    if not e.terms:
        console.print("The sensors have no errors.")
        return
    terms = Table(title="Value (1σ)", title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading, justify in (("term", "left"), ("value", "right"), ("", "left"), ("SI", "right"), ("", "left")):
        terms.add_column(heading, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    terms.add_column("is")
    for term in e.terms:
        terms.add_row(
            term.name, _number(term.value), term.unit, f"{term.si:.4g}", term.si_unit.removeprefix("1"), term.meaning
        )
    console.print(terms)
    hours = e.duration / 3600.0
    sums = Table(
        title=f"Horizontal position error that each alone causes in {hours:g} h, latitude {e.latitude / DEG:g}°",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    sums.add_column("m (1σ)", justify="right", no_wrap=True)
    sums.add_column("nmi", justify="right", no_wrap=True)
    sums.add_column("from", no_wrap=True)
    sums.add_column("vehicle", no_wrap=True)
    for c in e.contributions:
        sums.add_row(*_position(c.position), c.term, c.assumes)
    sums.add_section()
    sums.add_row(*_position(e.total), "total", "")
    console.print(sums)
    assumed = dict.fromkeys(c.assumes for c in e.contributions)
    console.print("Vehicle: " + "; ".join(f"{name}, {ASSUMPTIONS[name]}" for name in assumed) + ".")
    console.print("All together: root of the sum of squares.")
    if e.total > _LINEAR:
        console.print(f"The linear theory is not valid beyond {_LINEAR / 1e3:g} km: the position is lost.")
    elif e.total and e.drawn:
        console.print(
            f"Half of all runs end within {CIRCULAR * e.total / NAUTICAL_MILE / hours:.2f} nmi per hour, which is "
            "called the class of a unit."
        )
    for sentence in keys_without_effect(e.imu, e.duration):
        console.print(sentence)
    if e.height:
        away = f"{_digits(e.height)} m" if e.height < _LINEAR else f"more than {_LINEAR / 1e3:g} km"
        console.print(
            f"Height is not included: unaided, its error grows to {away} in {hours:g} h for the bias of the down "
            "accelerometer alone."
        )


def _number(value: float) -> str:
    """Write four digits, without a power of ten where it is not customary."""
    return f"{value:.0f}" if 1e4 <= value < 1e7 else f"{value:.4g}"


def _position(error: float) -> tuple[str, str]:
    """Write a position error in metres and nautical miles."""
    beyond = "> " if error > _LINEAR else ""
    error = min(error, _LINEAR)
    return beyond + _digits(error), beyond + _digits(error / NAUTICAL_MILE)


def _digits(value: float) -> str:
    """Write a number with three or four significant digits and no more."""
    rounded = float(f"{value:.4g}")
    decimals = sum(rounded < limit for limit in (100.0, 10.0, 1.0))
    return f"{rounded:,.{decimals}f}"
