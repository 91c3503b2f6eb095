"""The error model of a scenario's filter: its states, their standard deviations and correlation times.

The standard deviations are those from which the emulated errors are drawn. An error that a scenario gives as a number
is unknown to the filter; its standard deviation is the magnitude of the number.

Default states are the inertial errors that the planned motion makes noticeable. An error of 1σ that multiplies an
input u(t) adds σ u(t) to a reading with white noise of density N. The input is 1 for a bias, the rates of the motion
for the gyros' scale factors and misalignments, and the specific force for those of the accelerometers. The largest
signal-to-noise ratio d that any filter can have for it, whatever the aiding sensors, is that of the matched filter,

    d² = Σ σ² ∫u² dt / N²,

summed over the errors of a block; that of gravity is in `unknown_gravity`. An error without a state disturbs the filter
by at most that: νᵀS⁻¹ν over the run and xᵀP⁻¹x are noncentral χ² with a mean noncentrality of at most d². A block is a
state if d² exceeds `LEFT_OUT`; a bias is one if the sensors have a bias.

Noises and errors of the combination of a redundant set have covariances proportional to P = (HᵀWH)⁻¹ of the sensors
in use (`sinssim.sensors.redundant_set_errors`). The white noise of the model is that of the smallest eigenvalue of P
for all sensors; the remainder and the increase by an exclusion are added noise. At an exclusion the states get the
covariance of the difference; errors that a faulty sensor causes before are not part of the model.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from sinssim import units
from sinssim.data import Array
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.estimation.state_model import FLICKER, GRAVITY, Block, ErrorModel, error_model
from sinssim.scenario import Scenario
from sinssim.scenario.filter_section import FILTER_STATES, OF_THREE_AXES
from sinssim.scenario.planned_limits import expected_duration
from sinssim.scenario.tables import Tables
from sinssim.scenario.unknown_gravity import gravity_block, gravity_notes, unknown_gravity
from sinssim.sensors import flicker
from sinssim.sensors.aiding.magnetometer import Magnetometer
from sinssim.sensors.aiding_sensor import SensorState
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import of_triad
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.redundant_set_errors import maps, spread
from sinssim.sensors.sensor_set_section import Redundant
from sinssim.sensors.vibration_noise import AddedNoise, Change
from sinssim.truth.motion import Motion
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCSEC, DEG, DEG_H, G0

if TYPE_CHECKING:
    from sinssim.sensors.fault_detection import Monitored


LEFT_OUT = 0.3
"""Largest d² of a block that is left out: the NEES of three states is then at most 1.1 per state instead of 1, which a
single run cannot distinguish."""

PRODUCTS = 3.0
"""Smallest d of second-order errors that is reported: 3σ of the noise."""

_TRIADS = {"gyro": "gyros", "accelerometer": "accelerometers"}


_RADIUS = 6.371e6  # radius of the Earth, m


class Excitation(NamedTuple):
    """Rotation and acceleration that excite the errors of the inertial sensors."""

    duration: float  # duration of the run, s
    rate: float  # ∫ω² dt over the run, rad²/s; ω is the rate relative to inertial space
    force: float  # ∫f² dt over the run, m²/s³; at least the effect of gravity


def excitation(scenario: Tables) -> Excitation:
    """Estimate the rotation and acceleration of a scenario's motion.

    The estimate contains the Earth's rate and the transport rate, a flight's manoeuvres and turbulence or the rates of
    another motion, the turning of the block, angular vibration, and gravity. It is accurate to a factor of a few.
    """
    lasts = expected_duration(scenario)
    rate, turning, source = OMEGA_IE, 0.0, scenario.source
    if isinstance(source, Motion):
        rate += source.usual_speed / _RADIUS
        turning = source.turning(scenario.truth)
    if scenario.imu.rotation is not None:
        turning += scenario.imu.rotation.mean_square_rate_deg2_s2 * DEG**2 * lasts
    for vibration in scenario.vibration:
        middle = math.sqrt(vibration.low_hz * (vibration.high_hz or vibration.low_hz))
        turning += ((vibration.rms_arcsec or 0.0) * ARCSEC * 2.0 * math.pi * middle) ** 2 * lasts
    return Excitation(lasts, rate**2 * lasts + turning, G0**2 * lasts)


class Weight(NamedTuple):
    """Significance of one block."""

    block: str  # its name
    ratio: float  # d, its largest signal-to-noise ratio over the run; infinite without noise
    needed: bool  # whether a filter needs it


def weights(scenario: Scenario, moved: Excitation | None = None) -> tuple[Weight, ...]:
    """Return the significance of the errors of the inertial sensors of a scenario, for each block of `FILTER_STATES`,
    and of the gravity that its navigator does not know.

    The motion is `moved` if it is known, otherwise that of the plan.
    """
    motion, sigma = moved or excitation(scenario), inertial_sigma(scenario)
    model = error_model(sigma, imu=[n for n in FILTER_STATES if not n.endswith(FLICKER)], duration=motion.duration)
    result = []
    for block in model.blocks:
        if block.name not in FILTER_STATES:
            continue
        triad, _, what = block.name.partition(" ")
        size = float(np.max(np.square(block.sigma) + np.square(block.density) * motion.duration))
        if size == 0.0 and what not in ("bias", "scale", "misalignment"):
            continue
        noise = model.gyro_noise if triad == "gyro" else model.accel_noise
        squared = _ratio_squared(size * block.size / 3.0 * _input(motion, triad, what), noise)
        impossible = block.name in OF_THREE_AXES and isinstance(scenario.imu.sensor_set, Redundant)
        needed = squared > (0.0 if what == "bias" else LEFT_OUT) and not impossible
        result.append(Weight(block.name, math.sqrt(squared), needed))
    for name, of in (("gyro", sigma.gyro), ("accelerometer", sigma.accel)):
        if of.flicker:  # the change in the run: a constant is a bias
            ratio = motion.duration / flicker.shortest_time(of.flicker, of.random_walk)
            size = of.flicker**2 / math.pi * math.log(max(ratio, 1.0))
            squared = _ratio_squared(3.0 * size * motion.duration, of.random_walk)
            result.append(Weight(f"{name} {FLICKER}", math.sqrt(squared), squared > LEFT_OUT))
    if (gravity := unknown_gravity(scenario)) is not None:
        ratio = gravity.ratio(model.accel_noise)
        result.append(Weight(GRAVITY, ratio, ratio**2 > LEFT_OUT))
    return tuple(result)


def _input(motion: Excitation, triad: str, what: str) -> float:
    """Return ∫u² dt, summed over the three axes; squares and cubes of the input as if it were normally distributed."""
    if what == "bias":
        return 3.0 * motion.duration
    once = motion.rate if triad == "gyro" and what != "g-sensitivity" else motion.force
    moment, power = {"quadratic": (3.0, 2), "cross-axis": (1.0, 2), "cubic": (15.0, 3)}.get(what, (1.0, 1))
    return moment * once * (once / motion.duration) ** (power - 1) * (0.25 if what == "asymmetry" else 1.0)


def _ratio_squared(signal: float, noise: float) -> float:
    """Return ∫(σu)² dt over N²; infinite without noise."""
    return signal / noise**2 if noise > 0.0 else math.inf if signal > 0.0 else 0.0


def states(scenario: Scenario, moved: Excitation | None = None) -> tuple[str, ...]:
    """Return the blocks of the sensors' and gravity's errors that a scenario's filter has, for the motion of
    `weights`."""
    assert scenario.filter is not None
    if scenario.filter.states is not None:
        return scenario.filter.states
    return tuple(weight.block for weight in weights(scenario, moved) if weight.needed)


def with_states(scenario: Scenario, moved: Excitation | None = None) -> Scenario:
    """Return a scenario in which the default of `filter.states` is written out, for the motion of `weights`.

    It is the same object if there is nothing to write.
    """
    section = scenario.filter
    if section is None or section.states is not None:
        return scenario
    return scenario.model_copy(update={"filter": section.model_copy(update={"states": states(scenario, moved)})})


def with_first(scenario: Scenario, name: str) -> Scenario:
    """Return a scenario in which a further filter is that of [filter]; the same one for another name."""
    first = scenario.filter
    chosen = next((of for of in scenario.filters if of.name == name), None)
    if first is None or chosen is None:
        return scenario
    others = tuple(of.model_copy(update=dict(of.beside(first))) for of in scenario.filters)  # with their own keys
    return scenario.model_copy(update={"filter": chosen.beside(first), "filters": others})


def choice(scenario: Scenario, moved: Excitation | None = None) -> tuple[str, ...]:
    """Return lines of text, one for each block, about the states that a scenario's filter has by default, for the
    motion of `weights`.

    There are none if the scenario has no filter or names its states.
    """
    if scenario.filter is None or scenario.filter.states is not None:
        return ()
    motion = "planned" if moved is None else "recorded"
    lines = [f"states chosen by the sensors and the {motion} motion, with the signal-to-noise ratio of a 1σ error:"]
    for block, ratio, needed in weights(scenario, moved):
        why = "no such error" if ratio == 0.0 else _times(ratio)
        why += ", and no state of a redundant set" * (not needed and ratio**2 > LEFT_OUT)
        lines.append(f"  {block:<27} {'a state' if needed else 'left out':<9} {why}")
    moved = moved or excitation(scenario)
    model = filter_model(with_states(scenario, moved), moved.duration)
    for name, names in model.sums.items():
        times = [block.correlation_time for block in model.blocks if block.name in names]
        lines.append(
            f"  {name} is the sum of {len(times)} Gauss-Markov processes with correlation times from {times[0]:.2g} to "
            f"{times[-1]:.2g} s"
        )
    return tuple(lines)


def _times(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < 99.5 else f"{ratio:.0f}" if math.isfinite(ratio) else "infinite, no noise"


def hints(scenario: Scenario) -> Iterator[str]:
    """Explain an inconsistent filter by states that it lacks."""
    yield from _about_gravity(scenario)
    yield from _about_turning(scenario)
    missing = list(_about_missing(scenario))
    yield from missing or _products(scenario)


def _about_missing(scenario: Scenario) -> Iterator[str]:
    """Report errors of the sensors that matter and have no state."""
    if scenario.filter is None or scenario.filter.states is None:
        return
    given = states(scenario)
    missing = [w for w in weights(scenario) if w.needed and w.block not in given and w.block != GRAVITY]
    if missing:
        which = ", ".join(f"{w.block} ({_times(w.ratio)} times the noise over the run)" for w in missing)
        yield (
            f"filter.states lacks errors of the sensors that matter on this motion: {which}. Add them, or "
            "omit filter.states; they are then chosen automatically."
        )


def _about_gravity(scenario: Scenario) -> Iterator[str]:
    """Report gravity that the navigator does not know."""
    if scenario.gravity is None:
        return
    model = error_model(inertial_sigma(scenario), duration=expected_duration(scenario))
    bias = float(np.max(model.sigma[model.slices["accelerometer bias"]]))
    block = gravity_block(scenario) if GRAVITY in states(scenario) else None
    yield from gravity_notes(scenario, bias, model.accel_noise, block)


def notes(scenario: Scenario) -> Iterator[str]:
    """Report what a scenario's sensors are not accurate enough for, and the gravity that its navigator does not
    know."""
    if scenario.filter is not None:
        yield from _about_gravity(scenario)
        yield from _about_turning(scenario)
        yield from _about_missing(scenario)
        if scenario.filter.flicker_processes and not any(name.endswith(FLICKER) for name in states(scenario)):
            yield "filter.flicker_processes has no effect: no state of the filter is flicker noise."
    section, parked = scenario.filter, scenario.parked
    if section is None or section.alignment_s is None or section.alignment != "at-rest" or parked is None:
        return
    gyro = inertial_sigma(scenario).gyro
    drift = math.hypot(float(np.max(gyro.bias)), gyro.instability, gyro.random_walk / math.sqrt(section.alignment_s))
    north = OMEGA_IE * math.cos(math.radians(parked.latitude_deg))
    if drift > north:  # a heading error of one radian
        yield (
            f"filter.alignment_s: the gyros drift by {drift / DEG_H:.3g} deg/h (1σ), and the north component of the "
            f"Earth's rate is {north / DEG_H:.3g} deg/h. Such gyros cannot find the heading, and the run will most "
            "likely fail. Use better gyros, or an initial heading and [aiding.magnetometer] in place of alignment_s."
        )


def _about_turning(scenario: Scenario) -> Iterator[str]:
    """Report a motion that turns far between predictions.

    What an error adds up to in an interval, along axes that turn with the block, is taken along those in its middle;
    over an angle θ the mean axis differs by θ²/24 from that.
    """
    source, section = scenario.source, scenario.filter
    if section is None or not isinstance(source, Motion):
        return
    angle = math.sqrt(source.turning(scenario.truth) / expected_duration(scenario)) / section.rate_hz
    across = ("gyro scale", "gyro misalignment")
    ratio = angle**2 / 24.0 * max((w.ratio for w in weights(scenario) if w.block in across), default=0.0)
    if ratio > PRODUCTS and math.isfinite(ratio):
        yield (
            f"filter.rate_hz = {section.rate_hz:g}: the block turns by {math.degrees(angle):.0f} deg (rms) from one "
            f"prediction to the next, so that the filter mistakes the effect of {' and '.join(across)} by up to "
            f"{_times(ratio)} times their noise over the run. Set filter.rate_hz = "
            f"{math.ceil(0.1 * section.rate_hz * math.sqrt(ratio / PRODUCTS)) * 10} or more."
        )


def _products(scenario: Scenario) -> Iterator[str]:
    """Report errors so large that their products matter, which a linear filter neglects."""
    motion, sigma = excitation(scenario), inertial_sigma(scenario)
    for name, triad, of in (("gyro", sigma.gyro, motion.rate), ("accelerometer", sigma.accel, motion.force)):
        product = float(np.max(triad.scale)) ** 2 + 2.0 * float(np.max(triad.misalignment)) ** 2
        ratio = math.sqrt(_ratio_squared(product**2 * of, triad.random_walk))
        if ratio > PRODUCTS:
            yield (
                f"The errors of the {_TRIADS[name]} are too large for a linear filter: products of scale factors "
                f"({1e6 * float(np.max(triad.scale)):.3g} ppm) and misalignments "
                f"({1e3 * float(np.max(triad.misalignment)):.3g} mrad) with the attitude errors that such errors cause "
                f"in turns, which no state describes, make up to {_times(ratio)} times their noise over the run. "
                "Calibrate the sensors beforehand ([compensation])."
            )


def inertial_sigma(scenario: Scenario, factor: float | None = None) -> ImuErrors:
    """Return the standard deviations of the inertial sensors' errors that a scenario's filter assumes.

    The noises are multiplied by the factor, by default `inertial_noise_factor` of the filter, which must be there then.
    """
    from sinssim.alignment.alignment_budget import expected_errors

    imu, calibrated = scenario.imu, scenario.compensation
    noise = left = expected_errors(imu)
    single = imu.sensor_set.type == "redundant"  # each sensor is compensated by itself
    if single:
        left = noise if calibrated is None else expected_errors(calibrated.left(imu))
        imu = imu.model_copy(update={"faults": ()})  # the monitoring excludes a faulty sensor
    if factor is None:
        assert scenario.filter is not None
        factor = scenario.filter.inertial_noise_factor

    def size(term: ErrorTerm) -> Array:
        """Return fixed and random part together, after the calibration."""
        if calibrated is not None and term.calibrated and not single:
            return term.si(getattr(calibrated, term.sigma_key))
        of = left if term.calibrated else noise
        return np.asarray(np.hypot(*(getattr(getattr(item, term.triad), term.field) for item in (of.mean, of.sigma))))

    def triad(name: Literal["gyro", "accel"]) -> TriadErrors:
        given: TriadErrors = getattr(noise.sigma, name)
        drawn: dict[str, Any] = {term.field: size(term) for term in of_triad(name) if term.drawn}
        return replace(given, **drawn, random_walk=factor * given.random_walk, instability=factor * given.instability)

    sigma = imu.with_triads(triad("gyro"), triad("accel"))
    return sigma if calibrated is None else replace(sigma, arms=np.zeros((3, 3)), delay=0.0)


_TRIAD_OF_KIND = {"gyro": "gyro", "accel": "accelerometer"}
_DIAGONAL = np.eye(3, dtype=bool).ravel()
_MATRIX = {"scale": _DIAGONAL, "misalignment": ~_DIAGONAL}
_ROUNDING = 1e-12


def of_combination(model: ErrorModel, scenario: Scenario) -> ErrorModel:
    """Return an error model with the covariances between the axes of a redundant set, the same model for other sets.

    Its standard deviations are those of the combination.
    """
    section = scenario.imu.sensor_set
    if not isinstance(section, Redundant):
        return model
    p, added = spread(section.axes), []
    for kind, triad in _TRIAD_OF_KIND.items():
        for block in _like_bias(model, triad):
            added.append((block.name, block.name, _of_one(block.sigma, p) * p))
        matrix = _of_matrix(scenario, kind, maps(section.axes))
        added += [
            (f"{triad} {row}", f"{triad} {column}", matrix[np.ix_(_MATRIX[row], _MATRIX[column])])
            for row, column in (("scale", "scale"), ("misalignment", "misalignment"), ("scale", "misalignment"))
        ]
    least = float(np.sqrt(np.linalg.eigvalsh(p)[0] / (np.trace(p) / 3.0)))
    return replace(
        model,
        gyro_noise=least * model.gyro_noise,
        accel_noise=least * model.accel_noise,
        correlations=(*model.correlations, *added),
    )


def noise_of_combination(
    model: ErrorModel, scenario: Scenario, monitored: Sequence[Monitored], edges: Array
) -> AddedNoise | None:
    """Return the noise that the directions of a redundant set and its exclusions add to that of the model of
    `of_combination`, None if there is none.

    `monitored` are the results of the monitoring, empty without one, at the edges of the samples, (N+1,) s.
    """
    section = scenario.imu.sensor_set
    if not isinstance(section, Redundant):
        return None
    axes, whole = section.axes, spread(section.axes)
    least, most = np.linalg.eigvalsh(whole)[[0, 2]]
    used = {item.kind: item.used for item in monitored}
    cuts = {kind: np.flatnonzero(np.any(np.diff(rows, axis=0), axis=1)) + 1 for kind, rows in used.items()}
    if most - least < _ROUNDING * most and not any(map(len, cuts.values())):
        return None
    times = np.unique(np.concatenate([[0], *cuts.values()]).astype(np.intp))
    roots: list[Array] = []
    changes: list[Change] = []
    for kind, noise in zip(_TRIAD_OF_KIND, (model.gyro_noise, model.accel_noise), strict=True):
        spreads = [spread(axes, used[kind][k] if used else None) for k in times]
        roots.append(noise / np.sqrt(least) * np.array([_root_above(least, item) for item in spreads]))
        for k in cuts.get(kind, ()):
            both = used[kind][k - 1], used[kind][k]
            changes += _changes(model, scenario, kind, both, float(edges[k]), float(edges[k] - edges[0]))
    return AddedNoise(edges[times], roots[0], roots[1], tuple(changes))


def _changes(
    model: ErrorModel, scenario: Scenario, kind: str, used: tuple[Array, Array], time: float, since: float
) -> Iterator[Change]:
    """Yield what an exclusion changes in the errors of the sensors of a kind."""
    section = scenario.imu.sensor_set
    assert isinstance(section, Redundant)
    axes, none = section.axes, np.zeros((1, 1))
    whole, before, after = spread(axes), *(spread(axes, item) for item in used)
    for block in _like_bias(model, _TRIAD_OF_KIND[kind]):
        walk = _of_one(block.density, whole)
        gathered = _of_one(block.sigma, whole) + (since * walk if np.isinf(block.correlation_time) else 0.0)
        yield Change(time, block.name, gathered * (after - before), walk * (after - before))
    maps_before, maps_after = (maps(axes, item) for item in used)
    matrix = _of_matrix(scenario, kind, {field: maps_after[field] - maps_before[field] for field in _MATRIX})
    for field, rows in _MATRIX.items():
        yield Change(time, f"{_TRIAD_OF_KIND[kind]} {field}", matrix[np.ix_(rows, rows)], none)


def _like_bias(model: ErrorModel, triad: str) -> list[Block]:
    names = (f"{triad} bias", f"{triad} instability", *model.sums.get(f"{triad} {FLICKER}", ()))
    return [block for block in model.blocks if block.name in names]


def _of_one(sizes: ArrayLike, p: Array) -> float:
    """Return the variance of one sensor's error, by the 1σ of the combination."""
    return float(np.mean(np.square(sizes)) / np.mean(p.diagonal()))


def _of_matrix(scenario: Scenario, kind: str, effects: Mapping[str, Array]) -> Array:
    """Return the covariance of scale factors and misalignments, row by row, (9, 9)."""
    imu = scenario.imu if scenario.compensation is None else scenario.compensation.left(scenario.imu)
    sigma = {term.field: float(np.max(imu.stated(term)[1])) for term in of_triad(kind) if term.field in _MATRIX}
    return np.asarray(sum(sigma[field] ** 2 * effects[field] @ effects[field].T for field in _MATRIX))


def _root_above(least: float, matrix: Array) -> Array:
    """Return a root of what a covariance has beyond the least one of all directions, without rounding errors."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray(vectors * np.sqrt(np.where(values - least > _ROUNDING * least, values - least, 0.0)))


_LEAST_POSITION_M, _LEAST_VELOCITY_MPS, _LEAST_ANGLE_ARCMIN = 0.1, 0.01, 0.1
"""Assumed 1σ of an initial state that is exact, so that the covariance is not singular."""


class HasStates(Protocol):
    """A sensor with errors that are states of the filter."""

    def states(self) -> Iterator[SensorState]:
        """Yield them."""
        ...


def filter_model(scenario: Scenario, duration: float = 3600.0, recorded: Sequence[HasStates] = ()) -> ErrorModel:
    """Return the error model of a scenario's filter for a duration, s.

    It has the blocks of navigation, those of the inertial sensors and of gravity that the section names or that matter,
    and those of the aiding sensors: the emulated ones of [aiding], and the recorded ones.
    """
    f, start = scenario.filter, scenario.navigation.initial_error
    assert f is not None
    sensors = [*recorded, *(scenario.aiding.sensors().values() if scenario.aiding is not None else ())]

    def sigma_of(given: float | None, least: float, *known: float) -> float:
        return max(least, math.hypot(*known)) if given is None else given

    sigma, s = f.initial_sigma, start
    north = sigma_of(sigma.position_m, _LEAST_POSITION_M, s.position_sigma_m, s.north_m)
    east = sigma_of(sigma.position_m, _LEAST_POSITION_M, s.position_sigma_m, s.east_m)
    height = sigma_of(sigma.height_m, _LEAST_POSITION_M, s.height_sigma_m, s.height_m)
    velocity = [
        sigma_of(sigma.velocity_mps, _LEAST_VELOCITY_MPS, s.velocity_sigma_mps, v)
        for v in (s.velocity_north_mps, s.velocity_east_mps, s.velocity_down_mps)
    ]
    tilt = sigma_of(sigma.tilt_arcmin, _LEAST_ANGLE_ARCMIN, s.tilt_sigma_arcmin, s.roll_arcmin, s.pitch_arcmin)
    heading = sigma_of(sigma.heading_arcmin, _LEAST_ANGLE_ARCMIN, s.heading_sigma_arcmin, s.heading_arcmin)
    chosen = states(scenario)
    gravity = [gravity_block(scenario)] if GRAVITY in chosen else []
    model = error_model(
        inertial_sigma(scenario),
        position=(north, east, height),
        velocity=velocity,
        attitude=np.array([tilt, tilt, heading]) * units.ARCMIN,
        imu=[name for name in chosen if name in FILTER_STATES],
        extra=[*gravity, *_sensor_blocks(sensors, f.measurement_noise_factor)],
        duration=duration,
        flicker_processes=f.flicker_processes,
    )
    return of_combination(model, scenario)


def _sensor_blocks(sensors: Sequence[HasStates], factor: float) -> Iterator[Block]:
    """Yield the blocks of the aiding sensors' errors, where the sensors have them."""
    for sensor in sensors:
        for state in sensor.states():
            if any(state.sigma):
                yield Block(state.block, factor * np.array(state.sigma), correlation_time=state.correlation_time)


_BLOCK = "magnetometer bias"


def with_declination(model: ErrorModel, scenario: Scenario, trajectory: Trajectory) -> ErrorModel:
    """Return the error model with a compass whose declination is that of the start, and changes along the way.

    It is the same model where nothing changes, or where it has no state of the compass. As for other drifts, the change
    is a random walk whose 1σ bounds it: K = R/√T for the largest change R over the duration T. At t < T its 1σ R √(t/T)
    is more than a steady change R t/T.
    """
    compass = None if scenario.aiding is None else scenario.aiding.sensor(Magnetometer)
    change = 0.0 if compass is None or _BLOCK not in model.slices else compass.largest_change(trajectory)
    if not change:
        return model
    walk = change / math.sqrt(trajectory.end - trajectory.start)
    return replace(model, blocks=tuple(replace(b, random_walk=walk) if b.name == _BLOCK else b for b in model.blocks))
