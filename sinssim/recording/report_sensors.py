"""The part of a run's report on the sensors: the errors of each axis, and what they were drawn from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import units
from sinssim.data import Array
from sinssim.recording import page, plot, style
from sinssim.recording.page import signed, table, words
from sinssim.recording.plot import Line
from sinssim.recording.scales import suiting
from sinssim.recording.sensed import Sensed
from sinssim.scenario.datasheet import QUANTITIES, Quantity
from sinssim.scenario.grades import find_grade
from sinssim.scenario.sensor_set import AttitudeSensor, Gyros, SixAccelerometers
from sinssim.sensors.accelerometers import draw_accelerometers
from sinssim.sensors.attitude_sensor import draw_attitude_sensor
from sinssim.sensors.compensation import draw_calibration, imperfect_calibration
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors, draw

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.scenario.compensation import CompensationSection
    from sinssim.scenario.faults import Fault
    from sinssim.scenario.grades import TriadGrade
    from sinssim.scenario.imu import ImuSection

_DIGITS = 4
_AXES = ("x (forward)", "y (right)", "z (down)")

# How the table names what not every block has, and the unit of the scenario's key
_MORE = {
    "gyro_asymmetry": ("asymmetry", "ppm"),
    "gyro_quadratic": ("scale factor, with the rate", "ppm/(deg/s)"),
    "gyro_cubic": ("scale factor, with its square", "ppm/(deg/s)²"),
    "gyro_g_sensitivity": ("g-sensitivity to", "deg/h/g"),
    "gyro_bias_temperature": ("bias, with temperature", "deg/h/°C"),
    "gyro_scale_temperature": ("scale factor, with temperature", "ppm/°C"),
    "gyro_ramp": ("growth of the bias", "deg/h/h"),
    "accel_asymmetry": ("asymmetry", "ppm"),
    "accel_quadratic": ("K₂", "µg/g²"),
    "accel_cubic": ("K₃", "µg/g³"),
    "accel_cross_axis": ("coupling with", "µg/g²"),
    "accel_bias_temperature": ("bias, with temperature", "µg/°C"),
    "accel_scale_temperature": ("scale factor, with temperature", "ppm/°C"),
    "accel_ramp": ("growth of the bias", "µg/h"),
}


def sensor_errors(scenario: Scenario, kinds: Sequence[Sensed]) -> Iterator[str]:
    """Return the section on the sensors: what this run's seed drew, from what, and what it made of the readings.

    Args:
        scenario: what is run.
        kinds: what the sensors read; nothing if the run broke off before.

    Yields:
        HTML.
    """
    section, grade = scenario.imu, find_grade(scenario.imu.grade)
    name = f"<strong>{words(section.grade)}</strong>"
    if isinstance(section.sensor_set, Gyros):
        of = f"Grade {name}: {words(grade.description)}."
    else:  # the grade's own words are those of a unit with gyros
        of = f"Accelerometers of the grade {name}."
    yield (
        f"<p>{of} Each axis' error is what this run's seed {scenario.seed} drew from a normal distribution of the "
        "given 1σ, or what the scenario gives.</p>"
    )
    errors = draw(section, scenario.seed)
    gyros = _table(errors.gyro, grade.gyro, section, "gyro") + _noises(
        ("angle random walk", errors.gyro.random_walk, units.DEG_SQRT_H, "deg/√h"),
        ("bias instability, 1σ", errors.gyro.instability, units.DEG_H, "deg/h"),
        ("flicker B", errors.gyro.flicker, units.DEG_H, "deg/h"),
        ("rate random walk", errors.gyro.rate_walk, units.DEG_H / 60.0, "deg/h/√h"),
        ("pulse weight", errors.gyro.quantum, units.ARCSEC, "arcsec"),
        ("range ±", errors.gyro.limit, units.DEG, "deg/s"),
        ("null shift by gas flow, at most", _null_shift(errors), units.DEG_H, "deg/h"),
    )
    noise = _noises(
        ("velocity random walk", errors.accel.random_walk, units.UG, "µg/√Hz"),
        ("bias instability, 1σ", errors.accel.instability, units.UG, "µg"),
        ("flicker B", errors.accel.flicker, units.UG, "µg"),
        ("rate random walk", errors.accel.rate_walk, units.UG / 60.0, "µg/√h"),
        ("pulse weight", errors.accel.quantum, 1e-3, "mm/s"),
        ("range ±", errors.accel.limit, units.G0, "g"),
    )
    accelerometers = _table(errors.accel, grade.accel, section, "accel") + noise
    match section.sensor_set:
        case SixAccelerometers(arm_m=arm):
            yield f"<h3>Six accelerometers</h3>{_six(scenario, arm)}{noise}"
        case AttitudeSensor():
            yield _pair(
                f"<h3>Attitude sensor</h3>{_attitude_sensor(scenario)}", f"<h3>Accelerometers</h3>{accelerometers}"
            )
        case _:
            yield _pair(f"<h3>Gyros</h3>{gyros}", f"<h3>Accelerometers</h3>{accelerometers}")
    if section.faults:
        yield f"<p>Faults: {'; '.join(map(_fault, section.faults))}.</p>"
    if scenario.compensation is not None:
        known = draw_calibration(section, scenario.compensation, scenario.seed)
        left = imperfect_calibration(errors, known)  # true less known, as true less left is known
        none = find_grade("ideal")
        yield "<h3>Left by the calibration</h3><p>What the compensation in front of navigation does not take away.</p>"
        yield _pair(
            _table(left.gyro, none.gyro, scenario.compensation, "gyro"),
            _table(left.accel, none.accel, scenario.compensation, "accel"),
        )
    if any(kind.error.any() for kind in kinds):
        yield "<h3>Errors of the readings</h3>"
        yield from _plots(kinds)
    elif kinds:
        yield "<p>Every reading is the ideal one.</p>"


def _null_shift(errors: ImuErrors) -> float:
    """Return the largest null shift of laser gyros between the temperatures of the warm-up, rad/s."""
    if errors.null_shift is None:
        return 0.0
    between = np.linspace(errors.warm_up.start, errors.warm_up.steady, 1000)
    return float(np.abs(errors.null_shift.bias(between)).max())


def _fault(fault: Fault) -> str:
    if fault.type == "spike":
        return f"a spike at {fault.at_s:g} s"
    end = "to the end" if fault.to_s is None else f"to {fault.to_s:g} s"
    return f"{fault.type.replace('-', ' ')} from {fault.from_s:g} s {end}"


def _pair(left: str, right: str) -> str:
    return f'<div class="pair"><div>{left}</div><div>{right}</div></div>'


def _six(scenario: Scenario, arm: float) -> str:
    """Return the errors of six single accelerometers."""
    section, accel = scenario.imu, find_grade(scenario.imu.grade).accel
    triads = draw_accelerometers(section, 6, scenario.seed)
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
            (("bias", "µg", bias), ("scale factor", "ppm", scale), ("axis off by", "arcsec", tilt)), spread, strict=True
        )
    )
    return table(("", "unit", *(str(i) for i in range(1, 7)), "1σ"), rows, 2) + (
        f'<p class="note">On the faces of a cube, {arm:g} m from its centre, with their axes along: 1 forward, '
        "(y + z)/√2; 2 aft, (y − z)/√2; 3 right, (x + z)/√2; 4 left, (z − x)/√2; 5 below, (x + y)/√2; 6 above, "
        "(x − y)/√2. Each axis is off by two tilts of the given 1σ.</p>"
    )


def _attitude_sensor(scenario: Scenario) -> str:
    """Return the errors of the attitude sensor."""
    errors = draw_attitude_sensor(scenario.imu, scenario.seed)
    sensor = scenario.imu.sensor_set
    assert isinstance(sensor, AttitudeSensor)
    bias = "given" if sensor.bias_arcsec is not None else f"{sensor.bias_sigma_arcsec or 0.0:.6g}"
    own = find_grade(scenario.imu.grade).gyro.bias / units.DEG_H
    drift = own if sensor.drift_sigma_deg_h is None else sensor.drift_sigma_deg_h
    rows = [
        ("off at the start", "arcsec", *(signed(float(v), _DIGITS) for v in errors.bias / units.ARCSEC), bias),
        (
            "drift", "deg/h", *(signed(float(v), _DIGITS) for v in errors.drift / units.DEG_H),
            "given" if sensor.drift_deg_h is not None else f"{drift:.6g}",
        ),
    ]  # fmt: skip
    return (
        table(("reference", "unit", "X", "Y", "Z", "1σ"), rows, 2)
        + _noises(("noise of every reading, 1σ", errors.noise, units.ARCSEC, "arcsec"))
        + '<p class="note">Earth-centred inertial axes: Z to the north pole, X to the prime meridian at t = 0.</p>'
    )


def _plots(kinds: Sequence[Sensed]) -> Iterator[str]:
    """Draw the errors of the readings, kind beside kind, before and after compensation."""
    drawn = {kind.key: list(_of_kind(kind)) for kind in kinds}
    if single := drawn.pop("single", None):
        yield _pair(*single)
    yield _pair(*("".join(column) for column in drawn.values()))


def _of_kind(kind: Sensed) -> Iterator[str]:
    span = (float(kind.time[0]), float(kind.time[-1]))
    paint = style.colors(kind.names)
    unit, size = suiting(kind.sums, kind.error)
    lines = [(kind.error, paint, 1.5, "")]
    if kind.left is not None:
        pale = [style.tint(color) for color in paint]
        lines = [(kind.error, pale, 5.0, " measured"), (kind.left, paint, 1.5, " compensated")]

    def draw_all(title: str, unit: str, values: Sequence[tuple[Array, Array]], size: float) -> str:
        curves = [
            Line(f"{name}{word}", time, rows[:, i], page.css(colors[i]), width, size=size)
            for (time, rows), (_, colors, width, word) in zip(values, lines, strict=True)
            for i, name in enumerate(kind.names)
        ]
        return plot.plot(f"{kind.title}: {title}", unit, curves, span)

    means = [kind.averaged(error) for error, *_ in lines]
    if len(means[0][0]):
        of_mean = (unit, size) if kind.measured is None else kind.drift
        yield draw_all(f"error, mean over {kind.window:g} s", of_mean[0], means, of_mean[1])
    what = "error of each reading" if kind.measured is None else "error, accumulated"
    yield draw_all(what, unit, [(kind.time, error) for error, *_ in lines], size)
    if kind.left is not None:
        unit, size = suiting(kind.sums, kind.left)
        lines = [(kind.left, paint, 1.5, "")]
        yield draw_all("error left by the compensation, accumulated", unit, [(kind.time, kind.left)], size)


def _table(errors: TriadErrors, grade: TriadGrade, section: ImuSection | CompensationSection, kind: str) -> str:
    return table(("", "unit", *_AXES, "1σ"), _triad(errors, grade, section.model_dump(), kind), 2)


def _triad(errors: TriadErrors, grade: TriadGrade, section: Mapping[str, Any], kind: str) -> Iterator[Sequence[str]]:
    """Return the rows of one triad: turn-on errors per axis, and what they were drawn from."""
    of_kind = {quantity.field: quantity for quantity in QUANTITIES if quantity.triad == kind and quantity.drawn}

    def spread(quantity: Quantity) -> str:
        if section.get(quantity.key) is not None:
            return "given"
        own = section[quantity.sigma_key]
        return f"{getattr(grade, quantity.field, 0.0) / quantity.unit if own is None else own:.6g}"

    def rows(quantity: Quantity, title: str, unit: str) -> Iterator[Sequence[str]]:
        values = getattr(errors, quantity.field) / quantity.unit
        if values.ndim == 1:
            yield (title, unit, *(signed(float(v), _DIGITS) for v in values), spread(quantity))
            return
        for j, axis in enumerate("xyz"):
            cells = [signed(float(values[i, j]), _DIGITS) if i != j or quantity.size == 9 else "" for i in range(3)]
            yield (f"{title} {axis}", unit, *cells, spread(quantity))

    yield from rows(of_kind["bias"], "bias", {"gyro": "deg/h", "accel": "µg"}[kind])
    yield from rows(of_kind["scale"], "scale factor", "ppm")
    yield from rows(of_kind["misalignment"], "tilt towards", "arcsec")
    for name, (title, unit) in _MORE.items():
        quantity = next((q for q in of_kind.values() if q.name == name), None)
        if quantity is not None and np.any(getattr(errors, quantity.field)):
            yield from rows(quantity, title, unit)


def _noises(*terms: tuple[str, float, float, str]) -> str:
    said = [f"{name} {value / size:.6g} {unit}" for name, value, size, unit in terms if value]
    return f'<p class="note">{page.capital(", ".join(said) or "no noise")}.</p>'
