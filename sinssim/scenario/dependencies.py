"""Which tables and keys of a scenario need or exclude each other: one table, in the order of the messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from sinssim.errors import InputError, unknown_name
from sinssim.estimation import SHIPPED
from sinssim.scenario.ensemble_section import check_variation
from sinssim.scenario.filter_section import OF_THREE_AXES, FilterSection
from sinssim.scenario.tables import IN_SPACE, OF_FRAME, Tables
from sinssim.sensors.aiding.gnss import Gnss
from sinssim.sensors.imu.error_term_table import OF_TURNS, TERMS, of_triad
from sinssim.sensors.sensor_set_section import Platform
from sinssim.strapdown.attitude import MEASURED_ATTITUDE, PLATFORM, schedule
from sinssim.strapdown.frames import check_correctable
from sinssim.toml_section import Rules
from sinssim.truth.flight.flight import Flight
from sinssim.truth.flight.guidance import AIDED, TRUTH
from sinssim.units import listed

_OF_TURNS = (*OF_TURNS, "limit", "quantum")
"""Fields of the error terms that gyros on a platform do not have, because they sense no turns."""

_GEOCENTRIC = ("wgs84", "pz-90.11")
"""Ellipsoids whose centre is that of the models."""


def _given(s: Tables) -> list[str]:
    return [name for name in type(s).model_fields if name in s.model_fields_set and getattr(s, name)]


def _in_plane(s: Tables) -> str:
    others = [] if s.source.in_space else [f"[{name}]" for name in _given(s) if name in IN_SPACE]
    what = f"{' and '.join(others)} {'does' if len(others) == 1 else 'do'} not apply to [{s.source.table}]"
    return f"{what}, which has its own sensors and states: remove {'it' if len(others) == 1 else 'them'}" * bool(others)


def _idle(s: Tables) -> str:
    return next((f"[{name}] {why}" for name, why in s.source.idle.items() if name in _given(s)), "")


def _not_still(flight: Flight) -> str:
    """Return the table of a flight that moves or warms the air."""
    wind = ("wind",) if flight.wind.model_dump(exclude_defaults=True) else ()
    return next((name for name in (*wind, "turbulence", "atmosphere") if getattr(flight, name) is not None), "")


def _turning_block(s: Tables) -> str:
    """Return the aiding sensor that needs a block fixed to the vehicle, and why."""
    sensors = s.aiding.sensors().items() if s.imu.rotation and s.aiding else ()
    return next((f"[aiding.{name}] {sensor.of_fixed_block}" for name, sensor in sensors if sensor.of_fixed_block), "")


def _known_already(s: Tables) -> str:
    """Return an initial error that an alignment determines."""
    errors = s.navigation.initial_error if s.navigation.alignment and not s.filter else ()
    position = ("north", "east", "height", "position")
    return next((name for name, value in errors if value and not name.startswith(position)), "")


def _not_correctable(s: Tables) -> tuple[list[str], str] | None:
    """Return the algorithms, and why a filter cannot navigate by the first of them."""
    algorithms = s.navigation.algorithms
    reason = _refusal(lambda: check_correctable(algorithms[0])).rstrip(".") if s.filter else ""
    return (list(algorithms), reason) if reason else None


def _mismatch(s: Tables, kind: str, algorithm: str) -> list[str] | None:
    """Return the algorithms where a set of sensors is without its own algorithm, or the algorithm without the set."""
    algorithms = list(s.navigation.algorithms)
    return algorithms if (s.imu.sensor_set.type == kind) != (algorithm in algorithms) else None


def _rates(s: Tables) -> str:
    rates = s.navigation.rates_hz
    return "" if rates is None else _refusal(lambda: schedule(rates, s.imu.rate_hz))


def _refusal(check: Callable[[], object]) -> str:
    """Return the message of a check, "" if it passes."""
    try:
        check()
    except (InputError, ValueError) as error:
        return str(error)
    return ""


def _too_fast(s: Tables) -> str:
    sensors = s.aiding.sensors() if s.aiding else {}
    fast = (f"{k}.rate_hz = {sensor.rate_hz:g}" for k, sensor in sensors.items() if sensor.rate_hz > s.imu.rate_hz)
    return next(fast, "")


def _no_fixes(s: Tables) -> str:
    """Return where fixes of position and velocity are missing for an alignment in motion."""
    if s.filter is None or s.filter.alignment_s is None:
        return ""
    if s.log is not None:
        lacks = s.filter.alignment == "in-motion" and (s.log.gnss is None or len(s.log.gnss.use) < 2)
        return "log" if lacks else ""
    gnss = s.aiding.sensor(Gnss) if s.aiding else None
    lacks = s.filter.alignment != "at-rest" and (gnss is None or not (gnss.position and gnss.velocity))
    return "aiding" if s.aiding and lacks else ""


def _too_short(s: Tables) -> float | None:
    """Return the duration of a motion that ends before the alignment of the filter."""
    lasts = s.source.known_duration
    aligned = s.filter.alignment_s if s.filter and s.aiding and s.log is None else None
    return lasts if lasts is not None and aligned is not None and aligned >= lasts else None


def _coordinates(s: Tables) -> str:
    for name in s.output.coordinates or ():
        able = [other for other, coordinates in OF_FRAME.items() if name in coordinates]
        if name in ("frame", "conditional") and s.navigation.frame not in able:
            return f'"{name}" needs the frame {listed(able, "or")}'
    return ""


def _torquer(s: Tables) -> str:
    """Return a key of the torquers of a platform."""
    platform, keys = s.imu.sensor_set, ("torquer_scale_ppm", "torquer_scale_sigma_ppm")
    return next((key for key in keys if isinstance(platform, Platform) and getattr(platform, key) is not None), "")


def _of_turns(s: Tables) -> Iterator[str]:
    """Yield the keys of errors that the gyros of a platform do not have."""
    if not isinstance(s.imu.sensor_set, Platform) or len(s.navigation.algorithms) > 1:
        return
    for term in of_triad("gyro"):
        for key in term.keys if term.field in _OF_TURNS else ():
            if getattr(s.imu, key) is not None and not (key == "gyro_scale_sigma_ppm" and not _torquer(s)):
                yield key


def _of_triads(s: Tables) -> str:
    keys = ("accel_arms_mm", *(term.key for term in TERMS if term.calibrated))
    return next((key for key in keys if s.compensation and getattr(s.compensation, key) is not None), "")


def _solution(s: Tables) -> str:
    solution = s.ensemble.solution if s.ensemble else None
    known = [*s.solution_names, *(["aided"] if s.filter else [])]
    return "" if solution is None or solution in known else f": {unknown_name('solution', solution, known)}"


def _variation(s: Tables) -> str:
    section = s.ensemble
    if section is None or not section.vary:
        return ""
    return _refusal(lambda: check_variation(s, section, s.contents(without=("ensemble",))))


def _degree_above(s: Tables) -> int | None:
    """Return the degree of the true field where the navigator's is higher."""
    has = s.gravity.coefficients() if s.gravity and s.navigation.gravity_degree is not None else None
    return has.degree if has is not None and (s.navigation.gravity_degree or 0) > has.degree else None


def _model(s: Tables) -> str:
    """Return the model of the true disturbance, "" for none."""
    return "" if s.gravity is None or s.gravity.model == "normal" else s.gravity.model


def _not_computed(s: Tables) -> str:
    """Return why the source of the guidance has no solution; "" if it has one."""
    source = "" if s.flight is None else s.flight.guidance.source
    if source in ("", TRUTH, *s.solution_names) or (source == AIDED and s.filter):
        return ""
    if source == AIDED:
        return 'flight.guidance.source = "aided" needs a [filter]: add one, or name an algorithm of [navigation]'
    known = listed([*s.solution_names, *([AIDED] if s.filter else [])], "or")
    return f'flight.guidance.source = "{source}" is not computed in this scenario: it has {known}'


def _inputs(s: Tables) -> set[str]:
    """Return what the navigators of others get."""
    return {name for navigator in s.navigator for name in navigator.inputs}


def _wrong_beside(s: Tables) -> str:
    """Return why a further filter cannot be with the keys of [filter]."""
    for number, of in enumerate(s.filters, start=1):
        if of.kind not in SHIPPED:
            if of.model_fields_set - {"name", "kind", "rate_hz", "measurement_noise_factor"}:
                return (
                    f"{number}: a filter of a project has no keys but name, kind, rate_hz and measurement_noise_factor"
                )
            continue
        whole = of.beside(s.filter or FilterSection())
        for wrong, message in FilterSection.rules:
            if it := wrong(whole):
                return f"{number}: {message.format(s=whole, it=it)}"
    return ""


def _unknown_input(s: Tables) -> str:
    """Return an input of another navigator that the scenario does not have."""
    known = ["imu", *(s.aiding.sensors() if s.aiding else ())]
    if s.log is not None:
        known += [*(["gnss"] if s.log.gnss else []), *(other.name for other in s.log.others)]
    for number, navigator in enumerate(s.navigator, start=1):
        for name in navigator.inputs:
            if name not in known:
                return f"{number}.inputs: {unknown_name('input', name, known)}".rstrip(".")
    return ""


def _unused(s: Tables) -> bool:
    """Return whether an aiding sensor beside a barometer is used by nothing."""
    return bool(s.aiding and not s.filter and set(s.aiding.sensors()) - _inputs(s) - {"baro"})


def _unused_barometer(s: Tables) -> bool:
    """Return whether a barometer is used by nothing."""
    idle = not s.filter and s.navigation.vertical != "baro-loop" and "baro" not in _inputs(s)
    return bool(s.aiding and idle and "baro" in s.aiding.sensors())


DEPENDENCIES: Rules = (
    # the source
    (_in_plane, "{it}"),
    (_idle, "{it} ([{s.source.table}]): remove it"),
    (lambda s: s.source.leaves_air and s.aiding
     and next((name for name in ("baro", "airspeed") if name in s.aiding.sensors()), ""),
     "[aiding.{it}] senses the air, which [{s.source.table}] leaves: remove it"),
    (lambda s: s.source.leaves_air and s.navigation.vertical == "baro-loop",
     'navigation.vertical = "baro-loop" has no meaning for [{s.source.table}], which leaves the air: choose "free" '
     "and aid the height by [aiding.gnss]"),
    (lambda s: s.source.leaves_air and s.gravity,
     "[{s.source.table}] falls freely in the gravity of [truth], and [gravity] would only change its sensors: remove "
     "[gravity]"),
    (lambda s: s.drop and (not s.source.travels or s.source.leaves_air),
     "[drop] needs a carrier that moves in the air, which [{s.source.table}] is not: use [flight] or [great_circle], "
     "or remove [drop]"),
    (lambda s: s.drop and s.source.known_duration and s.drop.release_s > s.source.known_duration,
     "drop.release_s = {s.drop.release_s:g} is after the motion of the carrier, [{s.source.table}], which lasts "
     "{s.source.known_duration:g} s: release earlier, or let it move longer"),
    (lambda s: s.drop and s.flight and _not_still(s.flight),
     "flight.{it} moves or warms the air, but what [drop] releases falls through still standard air: remove one of the "
     "two"),
    (lambda s: s.drop and s.flight and s.flight.guidance.source != TRUTH and s.flight.guidance.source,
     'flight.guidance.source = "{it}" steers the carrier by the navigator of the bomb, which leaves it: remove [drop], '
     'or set "truth"'),
    (lambda s: s.drop and s.gravity,
     "[drop] falls in the gravity of [truth], and [gravity] would only change its sensors: remove [gravity]"),
    (lambda s: s.drop and s.aiding and "airspeed" in s.aiding.sensors(),
     "[aiding.airspeed] is a sensor of the carrier, which [drop] leaves: remove it"),
    (lambda s: s.log and s.gravity and s.gravity.remainder is not None,
     "[gravity.remainder] is a random part of the true field, but the data are recorded ([log]): remove it"),
    (lambda s: s.log and s.gravity and s.navigation.gravity_degree is None,
     "[gravity] would have no effect: recorded data ([log]) contain the true field, and the table describes only the "
     "model of the navigation algorithm. Add navigation.gravity_degree, for example 120, or remove [gravity]"),
    (lambda s: s.log and "grade" not in s.imu.model_fields_set,
     "imu.grade: give the grade of the IMU that recorded the log, or the nearest grade (`sinssim list grades`) and the "
     "values of its data sheet that differ; the filter assumes these errors"),
    (lambda s: s.log and s.imu.faults,
     "imu.faults would have no effect: the data are recorded ([log]); remove them"),
    (lambda s: s.log and s.imu.sensor_set.type != "gyros",
     '[log] has three gyros and three accelerometers; imu.sensor_set.type = "{s.imu.sensor_set.type}" is another set'),
    (lambda s: s.log and s.log.outages is not None and not s.filter,
     "log.outages need a [filter]: without a filter, GNSS is not used"),
    (lambda s: s.calibration and not s.turntable,
     "[calibration] needs the sequence that it works on: add [turntable]"),
    (lambda s: s.sequence and not s.calibration,
     "[turntable] with [log] describes the sequence of a calibration: add [calibration], or remove it"),
    # a flight that its navigator guides
    (_not_computed, "{it}"),
    # a block that turns in the vehicle
    (lambda s: s.imu.rotation and s.source.recorded,
     "[{s.source.table}] contains recorded data without the angles of a rotating IMU: remove it, or [imu.rotation]"),
    (lambda s: s.imu.rotation and s.navigation.alignment,
     "[navigation.alignment] assumes the inertial data of a vehicle at rest, but the IMU rotates: remove it, or "
     "[imu.rotation]"),
    (lambda s: s.imu.rotation and s.filter and s.filter.alignment_s is not None,
     "filter.alignment_s = {s.filter.alignment_s:g} needs inertial data in the axes of the vehicle, but the IMU "
     "rotates: remove it, or [imu.rotation]"),
    (lambda s: s.imu.rotation and s.filter and s.filter.backward,
     "filter.backward = true navigates in reverse time, which requires an IMU fixed to the vehicle, but the IMU "
     "rotates: remove it, or [imu.rotation]"),
    (lambda s: s.imu.rotation and s.filter and s.filter.vibration_noise,
     "filter.vibration_noise = {s.filter.vibration_noise:g} treats changes of the inertial data as vibration, but the "
     "rotation of the IMU changes them: remove it, or [imu.rotation]"),
    (_turning_block, "{it}, but the IMU rotates: remove it, or [imu.rotation]"),
    # a filter
    (lambda s: s.filter and not s.aiding and not s.source.has_readings and ("log" if s.source.recorded else "aiding"),
     "[filter] needs an aiding sensor: add one, for example [{it}.gnss]"),
    (_unused, "[aiding] needs a [filter] that uses it: add [filter]; its keys have defaults"),
    (_unused_barometer,
     '[aiding.baro] is not used: add [filter], or navigation.vertical = "baro-loop"'),
    (lambda s: s.filter and s.imu.sensor_set.type == PLATFORM,
     "[filter] estimates the errors of gyros and accelerometers fixed to the vehicle; on a platform they act about its "
     'axes, and the filter would have to torque it: remove [filter], or sensor_set.type = "platform"'),
    (lambda s: s.filter and s.imu.sensor_set.type not in ("gyros", "redundant"),
     '[filter] needs gyros and accelerometers; imu.sensor_set.type = "{s.imu.sensor_set.type}" is another set'),
    (lambda s: s.filter and s.imu.sensor_set.type == "redundant"
     and ("backward" if s.filter.backward else "vibration_noise" if s.filter.vibration_noise else ""),
     "filter.{it} is not possible with a redundant set, whose combination and noise change at each exclusion of a "
     'sensor: remove it, or imu.sensor_set.type = "redundant"'),
    (lambda s: s.filter and s.imu.sensor_set.type == "redundant"
     and next((n for of in (s.filter, *s.filters) for n in of.states or () if n in OF_THREE_AXES), ""),
     'filter.states: a redundant set has no state "{it}", because the errors of sensors along their own axes are in '
     "sum no such error of three axes; remove it"),
    (lambda s: s.filter and s.filter.monitor_s and not (s.log.gnss if s.log else s.aiding and s.aiding.sensor(Gnss)),
     "filter.monitor_s = {s.filter.monitor_s:g} watches the innovations of GNSS, which this scenario does not have: "
     "add [aiding.gnss] (of a log, [log.gnss]), or remove it"),
    (lambda s: s.filters and not s.filter,
     "[[filters]] are beside that of [filter], whose keys they take: add [filter]"),
    (lambda s: next((of.name for of in s.filters if of.name in {n.name for n in s.navigator}), ""),
     'two solutions have the name "{it}": rename one of [[navigator]] and [[filters]]'),
    (_wrong_beside, "filters.{it}"),
    (lambda s: s.imu.rotation and next((of.name for of in s.filters if of.kind not in SHIPPED), ""),
     "filters: {it} is the filter of a project, on sensors fixed to the vehicle, but the IMU rotates: remove it, or "
     "[imu.rotation]"),
    # navigators of others
    (_unknown_input, "navigator.{it}"),
    (lambda s: s.navigator and s.imu.rotation,
     "[[navigator]] navigates on sensors fixed to the vehicle, but the IMU rotates: remove it, or [imu.rotation]"),
    (lambda s: s.navigator and s.imu.sensor_set.type in ("attitude-sensor", PLATFORM),
     '[[navigator]] navigates on strapdown increments; imu.sensor_set.type = "{s.imu.sensor_set.type}" has none'),
    # an alignment of the navigators
    (lambda s: s.navigation.alignment and s.source.recorded,
     "navigation.alignment is for simulated sensors; for [log] give filter.alignment and filter.alignment_s"),
    (lambda s: s.navigation.alignment and s.imu.sensor_set.type not in ("gyros", "redundant"),
     'navigation.alignment needs gyros and accelerometers; imu.sensor_set.type = "{s.imu.sensor_set.type}" is another '
     "set"),
    (_known_already, "navigation.initial_error.{it} would have no effect: [navigation.alignment] determines the "
     "attitude and the velocity; remove one of the two"),
    (_not_correctable, "navigation.algorithms = {it[0]}: [filter] navigates by the first of them, and {it[1]}: put "
     "another first, or remove [filter]"),
    (_too_fast, "aiding.{it} must be at most imu.rate_hz = {s.imu.rate_hz:g}"),
    (_no_fixes, 'filter.alignment = "{s.filter.alignment}" needs [{it}.gnss] with position and velocity'),
    (_too_short, "filter.alignment_s = {s.filter.alignment_s:g} must be less than duration_s = {it:g}: the filter "
     "needs time after the alignment"),
    # the navigators
    (_coordinates, 'output.coordinates: {it}; navigation.frame is "{s.navigation.frame}"'),
    (_rates, "navigation.{it}"),
    (lambda s: _mismatch(s, "attitude-sensor", MEASURED_ATTITUDE),
     f'imu.sensor_set.type = "attitude-sensor" requires navigation.algorithms = ["{MEASURED_ATTITUDE}"] (with '
     'navigation.frame = "inertial"), and vice versa; here imu.sensor_set.type = "{s.imu.sensor_set.type}" and '
     "navigation.algorithms = {it}"),
    (lambda s: _mismatch(s, PLATFORM, PLATFORM),
     f'imu.sensor_set.type = "platform" requires "{PLATFORM}" among navigation.algorithms, and vice versa; here '
     'imu.sensor_set.type = "{s.imu.sensor_set.type}" and navigation.algorithms = {it}'),
    (lambda s: s.navigation.frame == "inertial" and _torquer(s),
     'imu.sensor_set.{it} would have no effect: with navigation.frame = "inertial" the platform keeps its direction in '
     "inertial space and is not torqued; remove it, or choose another frame"),
    (lambda s: next(_of_turns(s), ""),
     "imu.{it} would have no effect: the gyros stabilise the platform and sense no rotation; remove it, or add a "
     'strapdown algorithm for the same sensors, for example "quaternion", to navigation.algorithms'),
    # gravity
    (lambda s: s.navigation.gravity_degree is not None and not _model(s),
     "navigation.gravity_degree = {s.navigation.gravity_degree} needs the model whose disturbance is to be "
     'compensated: add [gravity] with model = "egm2008", or remove the key'),
    (lambda s: s.navigation.gravity_degree is not None and s.navigation.gravity != "normal",
     "navigation.gravity_degree = {s.navigation.gravity_degree} adds to normal gravity; navigation.gravity = "
     '"{s.navigation.gravity}" is another model: remove one of the two'),
    (lambda s: s.navigation.gravity_degree is not None and s.imu.sensor_set.type in ("attitude-sensor", "platform"),
     'navigation.gravity_degree needs strapdown gyros, which imu.sensor_set.type = "{s.imu.sensor_set.type}" lacks: '
     "remove one of the two"),
    (_degree_above, "navigation.gravity_degree = {s.navigation.gravity_degree} is above gravity.degree = {it}: the "
     "navigation algorithm can use the model of the truth only to the same or a lower degree"),
    (lambda s: s.truth.gravity != "normal" and _model(s),
     'gravity.model = "{it}" adds to normal gravity; truth.gravity = "{s.truth.gravity}" is another model: remove '
     "truth.gravity"),
    (lambda s: s.truth.ellipsoid not in _GEOCENTRIC and _model(s),
     f'gravity.model = "{{it}}" needs an ellipsoid about the centre of mass, {" or ".join(_GEOCENTRIC)}; here '
     'truth.ellipsoid = "{s.truth.ellipsoid}"'),
    # values for a compensation
    (lambda s: s.compensation and s.imu.sensor_set.type not in ("gyros", "redundant"),
     '[compensation] needs gyros and accelerometers; imu.sensor_set.type = "{s.imu.sensor_set.type}" is another set'),
    (lambda s: s.imu.sensor_set.type == "redundant" and _of_triads(s),
     "compensation.{it} is a value for a block of two triads, but the redundant set has single sensors whose "
     "calibration errors are random: give the keys with _sigma_"),
    # an ensemble
    (_solution, "ensemble.solution{it}"),
    (_variation, "ensemble.{it}"),
)  # fmt: skip
