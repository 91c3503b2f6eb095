"""The section of a run's report about the sensors: the errors of each axis, and their 1σ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import units
from sinssim.data import Array
from sinssim.experiments.run.sensor_comparison import SensorComparison
from sinssim.formatting import capital, signed
from sinssim.recording import style
from sinssim.recording.report import plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.plot import Line
from sinssim.scales import suiting
from sinssim.sensors.imu.compensation import imperfect_calibration
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.errors import ImuErrors
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.grades import find_grade, grade_name
from sinssim.sensors.imu.terms import of_triad
from sinssim.sensors.sets.platform import torquer_sigma
from sinssim.sensors.sets.sensor_set import (
    AttitudeSensor,
    Gyros,
    Platform,
    Redundant,
    SixAccelerometers,
)

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.sensors.imu.faults import ImuFault
    from sinssim.sensors.imu.grade_file import TriadGrade
    from sinssim.sensors.imu.imu import Imu
    from sinssim.sensors.sets.attitude_sensor import AttitudeSensorErrors
    from sinssim.sensors.sets.platform import PlatformErrors
    from sinssim.sensors.sets.true_errors import TrueErrors

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
        return plot.plot(f"{kind.title}: {title}", unit, curves, span)

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
