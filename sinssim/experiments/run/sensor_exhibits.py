"""The errors of a run's sensors: what was drawn for each axis and its 1σ, what calibration leaves, and the readings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from sinssim import rotation, units
from sinssim.charts import PAIR, Axis, Chart, Charts, Color, Line, Rule, Weight, over
from sinssim.data import Array, ImuData, short_repr
from sinssim.exhibits import Beside, Column, Item, Medium, Section, Sentence, Table
from sinssim.recording import style
from sinssim.recording.style import thinned
from sinssim.scenario import Scenario
from sinssim.sensors.imu.compensation import imperfect_calibration
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import of_triad
from sinssim.sensors.imu.faults import ImuFault
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.grades import TriadGrade, find_grade, grade_name
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_readings import (
    AttitudeSensorErrors,
    PlatformErrors,
    Readings,
    TrueErrors,
    torquer_sigma,
)
from sinssim.sensors.sensor_set_section import AttitudeSensor, Gyros, Platform, Redundant, SixAccelerometers
from sinssim.simulation.truth_and_sensors import Sensed, Truth
from sinssim.units import ANGLE_SCALE, DEG, DEG_H, SPEED_SCALE, UG, Scale, capital, fixed, signed, suiting

AXES = ("x", "y", "z")
RECORDED_ROWS = 8001
"""Number of instants between which a recording has mean readings: no more than it shows without thinning."""
_Units = tuple[Scale, tuple[str, float], tuple[str, float]]
_GYRO: _Units = (ANGLE_SCALE, ("deg/h", DEG_H), ("deg/s", DEG))
_ACCEL: _Units = (SPEED_SCALE, ("µg", UG), ("m/s²", 1.0))
"""Units of sums of errors, of errors, and of readings."""
READINGS = {"gyro": "inertial angular rate", "accel": "specific force", "single": "specific force along each axis",
            "single_gyro": "angular rate", "single_accel": "specific force"}  # fmt: skip
"""What the sensors of a kind read."""


@short_repr
@dataclass(frozen=True)
class SensorComparison:
    """Readings of one kind of sensor against the truth, along a run."""

    key: str  # key in entities and labels: "gyro", "accel", "single", "single_gyro", "single_accel" or "attitude"
    title: str  # name of the kind
    names: tuple[str, ...]  # k names of the lines: axes, or numbers
    time: Array  # edges of the samples, (N+1,) s
    error: Array  # accumulated errors of the sensors, (N+1, k) rad or m/s; for an attitude sensor, the error itself
    left: Array | None  # the same after compensation, None without compensation
    sums: Scale  # units of both
    drift: tuple[str, float]  # unit of their rate of change, and its size in SI
    # increments, (N, k); None for an attitude sensor, which has none
    ideal: Array | None = None
    measured: Array | None = None
    reading: tuple[str, float] = ("", 1.0)  # unit of their mean rates, and its size in SI

    @property
    def window(self) -> float:
        """Averaging time of the errors, s, such that a run has a few hundred means."""
        duration = float(self.time[-1] - self.time[0])
        return next((w for w in (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0) if w >= duration / 200.0), 120.0)

    def averaged(self, error: Array) -> tuple[Array, Array]:
        """Return the ends of the windows, (M,) s, and the mean error of the readings over each, (M, k) SI.

        M is 0 for a run shorter than a window.
        """
        ends = np.arange(self.time[0], self.time[-1] + 1e-9, self.window)
        edges = np.unique(np.searchsorted(self.time, ends - 1e-6 * self.window))  # whatever the rounding of the ends
        time = self.time[edges]
        if self.measured is None:
            readings = np.diff(edges)[:, np.newaxis]
            return time[1:], np.add.reduceat(error[: edges[-1]], edges[:-1], axis=0) / readings
        return time[1:], np.diff(error[edges], axis=0) / np.diff(time)[:, np.newaxis]


def sensor_comparisons(sensed: Sensed | None) -> tuple[SensorComparison, ...]:
    """Return the readings of a simulated run by kind of sensor; nothing for a run that ended before them."""
    if sensed is None or not isinstance(sensed.truth, Truth):
        return ()
    return tuple(compare_sensors(sensed.readings, sensed.perfect, sensed.truth.ideal, sensed.readings.compensated))


def compare_sensors(
    readings: Readings, perfect: Readings, ideal: ImuData, compensated: ImuData | None
) -> Iterator[SensorComparison]:
    """Compare the readings of each kind of sensor, and the compensated increments, with those of perfect sensors."""
    time, imu = ideal.time, readings.imu
    rate, force = "Gyros", "Accelerometers"

    def kind(key: str, title: str, units: _Units, read: Array, true: Array, after: Array | None) -> SensorComparison:
        single = key.startswith("single")
        names = tuple(str(i) for i in range(1, read.shape[1] + 1)) if single else AXES
        left = None if after is None else _total(after, true)
        sums, drift, reading = units
        return SensorComparison(key, title, names, time, _total(read, true), left, sums, drift, true, read, reading)

    if readings.single is not None and perfect.single is not None:
        rate, force = "Angular rate from the single gyros", "Specific force from the single accelerometers"
        read, true, rest = readings.single, perfect.single, readings.single_compensated
        after = (None, None) if rest is None else (rest.dtheta, rest.dvel)
        yield kind("single_gyro", "Single gyros", _GYRO, read.dtheta, true.dtheta, after[0])
        yield kind("single_accel", "Single accelerometers", _ACCEL, read.dvel, true.dvel, after[1])
    if readings.accelerometers is not None and perfect.accelerometers is not None:
        rate, force = "Angular rate from the accelerometers", "Specific force from the accelerometers"
        yield kind("single", "Single accelerometers", _ACCEL, readings.accelerometers, perfect.accelerometers, None)
    if readings.attitude is not None and perfect.attitude is not None:
        off = rotation.multiply(readings.attitude, rotation.conjugate(perfect.attitude))
        error = rotation.rotation_vector_from_quaternion(off)
        title = "Attitude sensor, inertial axes"
        yield SensorComparison("attitude", title, AXES, time, error, None, ANGLE_SCALE, _GYRO[1])
    else:
        yield kind("gyro", rate, _GYRO, imu.dtheta, ideal.dtheta, None if compensated is None else compensated.dtheta)
    yield kind("accel", force, _ACCEL, imu.dvel, ideal.dvel, None if compensated is None else compensated.dvel)


def _total(read: Array, true: Array) -> Array:
    """Return the accumulated errors at every edge."""
    return np.concatenate((np.zeros((1, read.shape[1])), np.cumsum(read - true, axis=0)))


def comparison_charts(kinds: Sequence[SensorComparison]) -> Iterator[Charts]:
    """Yield the readings and the errors of each kind, gyros to the left of accelerometers."""
    by_key = {kind.key: kind for kind in kinds}
    pairs = (("single",), ("single_gyro", "single_accel"), ("gyro", "attitude", "accel"))
    for keys in pairs:
        columns = [list(_errors(by_key[key])) for key in keys if key in by_key]
        if len(columns) == 1:
            rows = [tuple(columns[0])]
        else:
            rows = [tuple(chart for chart in row if chart is not None) for row in zip_longest(*columns)]
        if rows:
            yield Charts(f"{keys[0]}_errors", tuple(rows), (PAIR[0], len(rows) * PAIR[1]))
    read = tuple((_readings(kind),) for kind in kinds if kind.measured is not None)
    if read:
        yield Charts("readings", read, (PAIR[0], len(read) * PAIR[1]), on=("recording",))


def _errors(kind: SensorComparison) -> Iterator[Chart]:
    """Yield the mean and the accumulated errors of a kind of sensor.

    The error after compensation is drawn over the measured one, which is wide and pale.
    """
    unit, paint = suiting(kind.sums, kind.error), style.colors(kind.names)
    lines: list[tuple[Array, Sequence[Color], Weight, str]] = [(kind.error, paint, "line", "")]
    if kind.left is not None:
        pale = [style.tint(color) for color in paint]
        lines = [(kind.error, pale, "wide", " measured"), (kind.left, paint, "line", " compensated")]

    def chart(key: str, title: str, unit: tuple[str, float], values: Sequence[tuple[Array, Array]]) -> Chart:
        drawn = tuple(
            Line(label=f"{name}{word}", x=time, y=rows[:, i], color=colors[i], weight=weight)
            for (time, rows), (_, colors, weight, word) in zip(values, lines, strict=False)
            for i, name in enumerate(kind.names)
        )
        return _chart(kind, key, title, unit, drawn)

    means = [kind.averaged(error) for error, *_ in lines]
    if len(means[0][0]):
        of_mean = unit if kind.measured is None else kind.drift
        yield chart("error", f"error, mean over {kind.window:g} s", of_mean, means)
    what = "error of each measurement" if kind.measured is None else "error, accumulated"
    yield chart("sum", what, unit, [(kind.time, error) for error, *_ in lines])
    if kind.left is not None:
        rest = tuple(
            Line(label=name, x=kind.time, y=kind.left[:, i], color=paint[i]) for i, name in enumerate(kind.names)
        )
        unit = suiting(kind.sums, kind.left)
        yield _chart(kind, "left", "error after compensation, accumulated", unit, rest)


def _chart(kind: SensorComparison, key: str, title: str, unit: tuple[str, float], lines: tuple[Line, ...]) -> Chart:
    span = over((float(kind.time[0]), float(kind.time[-1])))
    return Chart(
        key=f"sensors/{kind.key}/{key}", title=f"{kind.title}: {title}", x=span, y=Axis(units=fixed(*unit)), marks=lines
    )


def _readings(kind: SensorComparison) -> Chart:
    """Return what sensors measured over what ideal ones would have, wide and pale."""
    assert kind.ideal is not None
    assert kind.measured is not None
    paint = style.colors(kind.names)
    lines = [
        line
        for word, increments, colors, weight in (
            ("ideal", kind.ideal, [style.tint(color) for color in paint], "wide"),
            ("measured", kind.measured, paint, "line"),
        )
        for line in mean_lines(kind.time, increments, [f"{name} {word}" for name in kind.names], colors, weight)  # type: ignore[arg-type]
    ]
    return _chart(kind, "reading", READINGS[kind.key], kind.reading, tuple(lines))


def mean_lines(
    time: Array,
    increments: Array,
    names: Sequence[str],
    colors: Sequence[Color],
    weight: Weight = "line",
    most: int = RECORDED_ROWS,
) -> Iterator[Line]:
    """Yield mean rates between at most some of the instants (N+1,) s, of increments (N, k), without aliasing."""
    edges = thinned(len(time), most)
    sums = np.add.reduceat(increments, edges[:-1], axis=0)
    means = sums / np.diff(time[edges])[:, np.newaxis]
    for i, (name, color) in enumerate(zip(names, colors, strict=True)):
        yield Line(label=name, x=time[edges[1:]], y=means[:, i], color=color, weight=weight)


def recorded_readings(imu: ImuData, marks: Sequence[Rule] = ()) -> Iterator[Charts]:
    """Yield what a recorded inertial unit sensed: on a page every reading, in a recording the means between a few."""
    x, paint = over((float(imu.time[0]), float(imu.time[-1]))), style.colors(AXES)
    kinds = (("gyro", "Inertial angular rate", imu.dtheta, _GYRO), ("accel", "Specific force", imu.dvel, _ACCEL))
    media: tuple[tuple[Medium, int], ...] = (("page", len(imu.time)), ("recording", RECORDED_ROWS))
    for medium, most in media:
        charts = tuple(
            Chart(key=f"sensors/{key}/reading", title=title, x=x, y=Axis(units=fixed(*units[2])),
                  marks=(*marks, *mean_lines(imu.time, increments, AXES, paint, "thin", most)))
            for key, title, increments, units in kinds
        )  # fmt: skip
        yield Charts("readings", (charts,), PAIR, on=(medium,))


_DIGITS = 4
_AXES = ("x (forward)", "y (right)", "z (down)")
_ALWAYS = ("bias", "scale", "misalignment")
"""Fields that are listed even if they are zero."""
Row = Sequence[str]


def sensor_errors(scenario: Scenario, true: TrueErrors, kinds: Sequence[SensorComparison]) -> Iterator[Item]:
    """Yield the errors of this run's sensors, their 1σ, and their effect on the readings, if there are any."""
    section, grade = scenario.imu, find_grade(scenario.imu.grade)
    of = f"Accelerometers of the grade **{grade_name(section.grade)}**."
    if isinstance(section.sensor_set, Gyros | Redundant | Platform):  # the grade describes a unit with gyros
        of = f"Grade **{grade_name(section.grade)}**: {grade.description}."
    yield Sentence(
        f"{of} The error of each {'sensor' if true.single_sensors else 'axis'} was drawn with the seed {scenario.seed} "
        "from a normal distribution of the given 1σ, added to the value that the scenario gives, if any."
    )
    yield from _drawn(section, true, scenario.navigation.frame)
    if section.faults:
        numbered = isinstance(section.sensor_set, Redundant)
        yield Sentence(f"Faults: {'; '.join(_fault(fault, numbered) for fault in section.faults)}.")
    if scenario.compensation is not None:
        left = list(_after_calibration(dict(scenario.compensation), true))
        yield Section(
            "Residual errors after calibration", [Sentence("Errors that the compensation does not remove."), *left]
        )
    if any(kind.error.any() for kind in kinds):
        strapped = " of the same sensors strapped down" if true.platform is not None else ""
        yield Section(f"Errors of the measurements{strapped}", list(comparison_charts(kinds)))
    elif kinds:
        yield Sentence("All sensors are ideal.")


def _drawn(section: Imu, true: TrueErrors, frame: str) -> Iterator[Item]:
    """Yield the drawn errors of the sensors of a set."""
    errors, grade, keys = true.imu, find_grade(section.grade), section.model_dump()
    shift = ("null shift by gas flow, at most", _null_shift(errors), units.DEG_H, "deg/h")
    noise = (_noises(*_of_noise(errors.gyro, "gyro"), shift), _noises(*_of_noise(errors.accel, "accel")))
    accelerometers = Section(
        "Accelerometers", [triad_table(errors.accel, grade.accel, keys, "accel"), Sentence(noise[1], "note")]
    )
    match section.sensor_set:
        case SixAccelerometers(arm_m=arm):
            yield Section(
                "Six accelerometers",
                [_six(section, true.accelerometers), Sentence(_CUBE.format(arm), "note"), Sentence(noise[1], "note")],
            )
        case Redundant():
            for kind, title in (("gyro", "Single gyros"), ("accel", "Single accelerometers")):
                of_kind = _noises(*_of_noise(getattr(errors, kind), kind))
                table = single_errors(true.single_sensors, section, kind)
                yield Section(title, [table, Sentence(of_kind, "note")])
        case AttitudeSensor():
            sensor = Section("Attitude sensor", _attitude_sensor(section, true.attitude_sensor))
            yield Beside([sensor, accelerometers])
        case _:
            table = triad_table(errors.gyro, grade.gyro, keys, "gyro")
            yield Beside([Section("Gyros", [table, Sentence(noise[0], "note")]), accelerometers])
    if true.platform is not None:
        yield Section("Platform", platform_errors(section, true.platform, frame))


def _after_calibration(compensation: Mapping[str, object], true: TrueErrors) -> Iterator[Item]:
    """Yield the errors that a calibration leaves: known errors are true errors minus remaining ones."""
    if true.calibration is not None:
        left, ideal = imperfect_calibration(true.imu, true.calibration), find_grade("ideal")
        known = {key: value for key, value in compensation.items() if "_sigma_" in key}
        yield Beside(
            [triad_table(left.gyro, ideal.gyro, known, "gyro"), triad_table(left.accel, ideal.accel, known, "accel")]
        )
    elif true.left is not None:
        both = zip(true.single_sensors, true.single_calibrations, strict=True)
        blocks = tuple(imperfect_calibration(*pair) for pair in both)
        yield from (single_errors(blocks, true.left, kind) for kind in ("gyro", "accel"))


def error_table(axes: Sequence[str], rows: Sequence[Row], head: str = "") -> Table:
    """Return a table of errors: what, its unit, its value for each axis or sensor, and its 1σ."""
    words = (Column(head, words=True), Column("unit", words=True))
    return Table((*words, *(Column(axis) for axis in (*axes, "1σ"))), rows)


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


_CUBE = (
    "On the faces of a cube, {:g} m from its centre, with their axes along: 1 front, (y + z)/√2; 2 aft, (y − z)/√2; "
    "3 right, (x + z)/√2; 4 left, (z − x)/√2; 5 below, (x + y)/√2; 6 above, (x − y)/√2. Each axis has two tilts of the "
    "given 1σ."
)


def _six(section: Imu, triads: Sequence[TriadErrors]) -> Table:
    """Return the errors of six single accelerometers."""
    rows = []
    for field, label in (("bias", "bias"), ("scale", "scale factor"), ("misalignment", "axis tilt")):
        term = next(term for term in of_triad("accel") if term.field == field)
        values = _of_single([getattr(triad, field) for triad in triads])
        sigma = getattr(section, term.sigma_key)
        sigma = getattr(find_grade(section.grade).accel, field) / term.unit if sigma is None else sigma
        cells = (signed(float(v) / term.unit, _DIGITS) for v in values)
        rows.append((label, term.written_unit, *cells, f"{sigma:.6g}"))
    return error_table([str(i) for i in range(1, 7)], rows)


def _of_single(values: Sequence[np.ndarray]) -> np.ndarray:
    """Return one number for each single sensor of some blocks of three: for misalignments the tilt of its axis."""
    return np.concatenate([np.linalg.norm(v, axis=1) if v.ndim == 2 else v.reshape(-1) for v in values])


def _spread(given: bool, sigma: float | None, of_grade: float) -> str:
    """Return the 1σ of an error; beside a given error it is zero by default, not that of the grade."""
    if given:
        return f"given ± {_short(sigma)}" if sigma else "given"
    return _short(of_grade if sigma is None else sigma)


def _short(value: float) -> str:
    """Write a size with four significant digits, which a conversion of units does not lengthen."""
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"


def _attitude_sensor(section: Imu, errors: AttitudeSensorErrors | None) -> list[Item]:
    """Return the errors of the attitude sensor."""
    sensor = section.sensor_set
    assert isinstance(sensor, AttitudeSensor)
    assert errors is not None
    bias = _spread(sensor.bias_arcsec is not None, sensor.bias_sigma_arcsec, 0.0)
    drift = find_grade(section.grade).gyro.bias / units.DEG_H
    rows = [
        ("initial error", "arcsec", *(signed(float(v), _DIGITS) for v in errors.bias / units.ARCSEC), bias),
        (
            "drift", "deg/h", *(signed(float(v), _DIGITS) for v in errors.drift / units.DEG_H),
            _spread(sensor.drift_deg_h is not None, sensor.drift_sigma_deg_h, drift),
        ),
    ]  # fmt: skip
    noise = _noises(("noise of each measurement, 1σ", errors.noise, units.ARCSEC, "arcsec"))
    axes = "Earth-centred inertial axes: Z to the north pole, X to the prime meridian at t = 0."
    return [error_table("XYZ", rows, "reference"), Sentence(noise, "note"), Sentence(axes, "note")]


def triad_table(errors: TriadErrors, grade: TriadGrade, keys: Mapping[str, object], kind: str) -> Table:
    """Return the turn-on errors of a triad per axis, and their 1σ, by the grade and the keys that replace it."""
    return error_table(_AXES, list(_triad(errors, grade, keys, kind)))


def _triad(errors: TriadErrors, grade: TriadGrade, keys: Mapping[str, object], kind: str) -> Iterator[Row]:
    def spread(term: ErrorTerm) -> str:
        sigma = keys.get(term.sigma_key)
        return _spread(keys.get(term.key) is not None, sigma, grade.of(term) / term.unit)  # type: ignore[arg-type]

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
    return f"{capital(', '.join(parts) or 'no noise')}."


def platform_errors(section: Imu, errors: PlatformErrors, frame: str) -> list[Item]:
    """Return the errors of a platform's torquers and pick-offs."""
    platform = section.sensor_set
    assert isinstance(platform, Platform)

    def spread(given: object, sigma: float) -> str:
        if given is not None:
            return f"given ± {sigma:.6g}" if sigma else "given"
        return f"{sigma:.6g}"

    rows = []
    if frame != "inertial":
        ppm = (signed(float(v), 4) for v in errors.torquer_scale / units.PPM)
        sigma = spread(platform.torquer_scale_ppm, torquer_sigma(section) * 1e6)
        rows.append(("torquing scale factor x, y, z", "ppm", *ppm, sigma))
    arcsec = (signed(float(v), 4) for v in errors.pickoff / units.ARCSEC)
    sigma = spread(platform.pickoff_arcsec, platform.pickoff_sigma_arcsec or 0.0)
    rows.append(("gimbal angle roll, pitch, azimuth", "arcsec", *arcsec, sigma))
    noise = platform.pickoff_noise_arcsec
    note = f"Noise of each gimbal angle {noise:g} arcsec. " if noise else ""
    note += (
        "The axes of gyros and accelerometers above are those of the platform, and of the sensor block for the "
        "strapdown system."
    )
    return [error_table("123", rows), Sentence(note, "note")]


def single_errors(blocks: Sequence[ImuErrors], section: Imu, kind: str) -> Table:
    """Return the errors of single sensors of a redundant set, "gyro" or "accel"."""
    assert isinstance(section.sensor_set, Redundant)
    count = len(section.sensor_set.axes)
    rows = []
    for term in of_triad(kind):
        if not term.drawn or not (term.size == 3 or term.field == "misalignment"):
            continue
        values = _of_single([getattr(getattr(block, kind), term.field) for block in blocks])
        if not (values.any() or term.field in _ALWAYS):
            continue
        label = "tilt of the axis" if term.field == "misalignment" else term.label
        sigma = float(np.max(section.stated(term)[1])) / term.unit
        cells = (signed(float(value) / term.unit, _DIGITS) for value in values[:count])
        rows.append((label, term.written_unit, *cells, f"{sigma:.6g}"))
    return error_table([str(number) for number in range(1, count + 1)], rows)
