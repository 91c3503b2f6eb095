"""The sources of navigation errors by inertial and aiding sensors, initial state and encoders, each with its size.

The angles of a rotating IMU enter the vehicle's attitude alone, and directly: an error b of the angle about an axis a
of the rotation, in north-east-down axes, is an attitude error φ = a b. The noise and the step of the encoders
(`sinssim.sensors.imu.rotation_encoder`) count with σ² and Q²/12. A filter compares the readings of its sensors with the
vehicle's attitude, so that the error acts on them, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from sinssim import rotation
from sinssim.analyses.error_budget.source_propagation import Flicker, GaussMarkov, Process, Sum, Walk
from sinssim.data import Array, Measurements
from sinssim.errors import InputError
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.sensors.aiding_sensor import AidingSensor, Vehicle
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.imu.imu_section import OF_THE_RING
from sinssim.sensors.imu.rotation_encoder import EncoderErrors, draw_encoders, encoders_of
from sinssim.sensors.redundant_set_errors import axes_of_values, spread
from sinssim.sensors.sensor_set_section import Redundant, estimator
from sinssim.truth.motions.imu_rotation import TurningBlock
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCMIN, ARCSEC, DEG_H, PPM

if TYPE_CHECKING:
    from sinssim.scenario import Scenario


Kind = Literal["random", "given", "one run"]
"""random: differs from run to run, with a 1σ; given: the same in every run, with its sign; one run: not linear, the
effect of the sensors' readings in one run with this source alone."""

_GROUPS = {"gyro": "gyros", "accel": "accelerometers"}


@dataclass(frozen=True)
class Source:
    """One source of navigation errors."""

    name: str  # as in the scenario without the unit, for example "gyro_bias"
    label: str  # in words
    group: str  # "gyros", "accelerometers", "initial state", or the aiding sensor
    kind: Kind  # how it enters
    value: float
    """Its 1σ, the value of a noise, or the given error, in `unit`; the largest component if they differ; NaN if no
    number describes it.
    """
    unit: str  # unit as people write it
    key: str = ""  # key of the scenario that gives it; "" if no single key does
    values: tuple[float, ...] = ()  # of the key, in `unit`; one for all that are equal


class Column(NamedTuple):
    """One value of a constant error, of one sensor."""

    triad: int  # 0 for gyros, 1 for accelerometers
    direction: Array  # in which the sensor's reading acts, (3,): its axis, or the gain of a combination of sensors
    sensitive: Array  # axis of the sensor, (3,)
    along: Array  # axis to which the value belongs, (3,)
    term: ErrorTerm  # the error, whose `multiplies` is the input of the column


@dataclass(frozen=True)
class Constants:
    """Constant errors of the inertial sensors: one column for each value of each error."""

    sources: list[Source]  # of each column's random part and given part, by name; one entry for each source
    columns: list[Column]
    parts: dict[str, tuple[list[int], Array]]
    """For each source its columns and their sizes: 1σ for a random source, values for a given one."""


@dataclass(frozen=True)
class InertialNoise:
    """A noise of the three sensors of a triad."""

    source: Source
    triad: int  # 0 for gyros, 1 for accelerometers, 2 for gravity in north, east, down
    what: Literal["white", "quantum", "process"]  # "white", "quantum", or "process"
    size: float  # density, quantum or 1σ, SI
    density: float = 0.0  # of the white noise that drives the navigation errors, for a white noise or a quantum
    process: Process | None = None  # of unit size, for a process
    sizes: Array | None = None  # 1σ of the three components, where they differ, (3,)
    mix: Array = field(default_factory=lambda: np.eye(3))
    """Root of the matrix by which the squares of size and density are multiplied for a redundant set, (3, 3)."""


def _in_unit(term: ErrorTerm, values: Array) -> float:
    largest = float(np.max(np.abs(values)))
    return float(f"{largest / term.unit:.12g}")


def _listed(term: ErrorTerm, values: Array) -> tuple[float, ...]:
    """Return values as the keys of a term list them, in its unit; one number for all that are equal."""
    whole = np.broadcast_to(values, term.shape)
    listed = [_in_unit(term, value) * float(np.sign(value)) for value in
              (whole[~np.eye(3, dtype=bool)] if term.size == 6 else whole.ravel())]  # fmt: skip
    return tuple(listed[:1] if len(set(listed)) == 1 else listed)


def remaining(scenario: Scenario, term: ErrorTerm) -> tuple[Array, Array]:
    """Return mean and 1σ, SI, of one error of the increments that navigation receives, after [compensation]."""
    mean, sigma = scenario.imu.stated(term)
    known = scenario.compensation
    if known is None or not term.calibrated:
        return mean, sigma
    value = getattr(known, term.key)
    if value is not None:  # a measured value is removed as it is
        return np.asarray(mean - term.si(value)), sigma
    return np.zeros(()), term.si(getattr(known, term.sigma_key))


def constants(scenario: Scenario) -> Constants:
    """Return the constant errors of the inertial sensors; one that varies about a given value is two sources."""
    result = Constants([], [], {})
    sensors, axes = scenario.imu.sensor_set, np.eye(3)
    for term in TERMS:
        if not term.drawn:
            continue
        triad, mean_and_sigma = ("gyro", "accel").index(term.triad), remaining(scenario, term)
        columns: dict[tuple[int, ...], Column] = {}
        if isinstance(sensors, Redundant):  # the same 1σ for all single sensors; given values are refused
            gains, many = estimator(sensors.axes).T, list(enumerate(axes_of_values(sensors.axes, term.size)))
            for i, (gain, axis) in enumerate(zip(gains, sensors.axes, strict=True)):
                columns |= {(i, k): Column(triad, gain, axis, along[i], term) for k, along in many}
            sigma = np.full((len(gains), len(many)), np.max(mean_and_sigma[1]))
            mean = np.zeros_like(sigma)
        else:
            mean, sigma = (np.broadcast_to(a, term.shape) for a in mean_and_sigma)
            for at in np.ndindex(term.shape):
                columns[at] = Column(triad, axes[at[0]], axes[at[0]], axes[at[-1]], term)
        known = scenario.compensation is not None and term.calibrated
        kinds: Iterable[tuple[Kind, str, str, Array, str]] = (
            ("random", term.name, "", sigma, f"{'compensation' if known else 'imu'}.{term.sigma_key}"),
            ("given", f"{term.name}_given", ", given", mean, "" if known else f"imu.{term.key}"),
        )
        places: dict[tuple[int, ...], int] = {}
        for (kind, name, also, values, key), stated in zip(kinds, reversed(mean_and_sigma), strict=True):
            where = [tuple(map(int, index)) for index in np.argwhere(values)]
            if not where:
                continue
            for index in where:
                if index not in places:
                    places[index] = len(result.columns)
                    result.columns.append(columns[index])
            result.sources.append(
                Source(name, f"{_label(term)}{also}", _GROUPS[term.triad], kind, _in_unit(term, values),
                       term.written_unit, key, _listed(term, stated))
            )  # fmt: skip
            result.parts[name] = ([places[index] for index in where], np.array([values[index] for index in where]))
    return result


def _label(term: ErrorTerm) -> str:
    words = term.name.split("_", 1)[1].replace("_", " ")
    return {"arw": "angle random walk", "vrw": "velocity random walk", "rrw": "rate random walk",
            "scale": "scale factor", "cross axis": "cross-axis coupling", "quantum": "quantisation",
            "instability": "bias instability", "g sensitivity": "g-sensitivity", "ramp": "bias ramp"
            }.get(words, words)  # fmt: skip


def inertial_noises(scenario: Scenario, *, summed: bool = False) -> list[InertialNoise]:
    """Return the noises of a scenario's inertial sensors.

    With `summed`, the integral of the gyros' white noise is a state of its own, for readings of a mean rate.
    """
    section, noises = scenario.imu, []
    sensors = section.sensor_set
    mix = np.asarray(np.linalg.cholesky(spread(sensors.axes)) if isinstance(sensors, Redundant) else np.eye(3))
    by_name = {(term.triad, term.field): term for term in TERMS}
    for term in TERMS:
        if term.field not in ("random_walk", "quantum", "instability", "rate_walk", "flicker"):
            continue
        size = float(section.stated(term)[0])
        if not size:
            continue
        tau = float(section.stated(by_name[term.triad, "correlation_time"])[0])
        processes: dict[str, Process] = {"random_walk": Sum()} if summed and term.triad == "gyro" else {}
        processes |= {
            "instability": GaussMarkov(tau), "rate_walk": Walk(), "flicker": Flicker(1.0 / section.rate_hz)
        }  # fmt: skip
        rounded = term.field == "quantum" and section.output != "increments"  # each reading by itself
        what: Literal["white", "quantum", "process"] = (
            "white" if term.field == "random_walk" or rounded else "quantum" if term.field == "quantum" else "process"
        )
        value = _in_unit(term, np.array(size))
        key = "" if section.laser_gyro is not None and term.name in OF_THE_RING else f"imu.{term.key}"
        source = Source(term.name, _label(term), _GROUPS[term.triad], "random", value, term.written_unit, key, (value,))
        triad = ("gyro", "accel").index(term.triad)
        size = size * math.sqrt(section.rate_hz / 12.0) if rounded else size
        density = size if what == "white" else size / math.sqrt(12.0 * section.rate_hz) if what == "quantum" else 0.0
        noises.append(InertialNoise(source, triad, what, size, density, processes.get(term.field), mix=mix))
    return noises


@dataclass(frozen=True)
class InitialErrors:
    """Errors of the initial state."""

    sources: list[Source] = field(default_factory=list)
    parts: dict[str, Array] = field(default_factory=dict)
    """For each of them its errors at the start, one column for each independent one, (9, c)."""


def initial_errors(scenario: Scenario, given: Array) -> InitialErrors:
    """Return the errors of a scenario's initial state; `given` are those by the given initial errors alone, (9,) SI."""
    e, errors = scenario.navigation.initial_error, InitialErrors()
    rows: tuple[tuple[str, str, tuple[int, ...], str, float, str], ...] = (
        ("initial_position", "position, north and east", (0, 1), "position_sigma_m", 1.0, "m"),
        ("initial_height", "height", (2,), "height_sigma_m", 1.0, "m"),
        ("initial_velocity", "velocity", (3, 4, 5), "velocity_sigma_mps", 1.0, "m/s"),
        ("initial_tilt", "tilts", (6, 7), "tilt_sigma_arcmin", ARCMIN, "arcmin"),
        ("initial_heading", "heading", (8,), "heading_sigma_arcmin", ARCMIN, "arcmin"),
    )
    for name, label, where, key, unit, written in rows:
        if size := float(getattr(e, key)):
            key = f"navigation.initial_error.{key}"
            errors.sources.append(Source(name, label, "initial state", "random", size, written, key, (size,)))
            errors.parts[name] = size * unit * np.eye(9)[:, list(where)]
    if given.any():
        errors.sources.append(Source("initial_given", "given errors", "initial state", "given", float("nan"), ""))
        errors.parts["initial_given"] = given[:, None]
    return errors


_GROUP = "rotation"


@dataclass(frozen=True)
class AngleError:
    """An error of the angles."""

    source: Source
    what: Literal["constant", "noise", "given"]
    """A constant of a run, a noise of its own at every instant, or an error that is the same in every run."""
    size: Array  # 1σ of each component, rad; 1 for a given error, (c,)
    phi: Callable[[Array], Array]
    """Returns the vehicle's attitude error by a unit of each component at instants (K,) s, (K, 3, c)."""


def angle_errors(scenario: Scenario, block: Trajectory) -> list[AngleError]:
    """Return the errors of the angles of a rotating IMU that are not zero; none for a block that does not turn."""
    section = scenario.imu.rotation
    if section is None or not isinstance(block, TurningBlock):
        return []
    turning, turns = block, block.turns
    results: list[AngleError] = []

    def axes(time: Array) -> Array:
        q_nv = turning.base.state(time).q_nb
        outer_turn = rotation.quaternion_from_rotation_vector(turns.angles(time)[:, :1] * turns.outer)
        outer = rotation.rotate(q_nv, turns.outer)
        inner = rotation.rotate(rotation.multiply(q_nv, outer_turn), turns.inner)
        return np.stack([outer, inner][: 2 if turns.two_axes else 1], axis=2)

    def add_random(name: str, label: str, what: Literal["constant", "noise"], value: float, size: float) -> None:
        if value:
            key = f"imu.rotation.{name}{'_sigma' if what == 'constant' else ''}_arcsec"
            source = Source(name, label, _GROUP, "random", value, "arcsec", key, (value,))
            results.append(AngleError(source, what, np.full(2 if turns.two_axes else 1, size * ARCSEC), axes))

    bias, noise, step = section.encoder_bias_sigma_arcsec, section.encoder_noise_arcsec, section.encoder_quantum_arcsec
    add_random("encoder_bias", "encoder bias", "constant", bias, bias)
    add_random("encoder_noise", "encoder noise", "noise", noise, noise)
    add_random("encoder_quantum", "step of the encoder", "noise", step, step / 12.0**0.5)
    same = scenario.imu.model_copy(update={"rotation": section.model_copy(update={"encoder_bias_sigma_arcsec": 0.0})})
    given = draw_encoders(same, scenario.seed)
    assert given is not None
    given = replace(given, noise=0.0, quantum=0.0)
    largest = max(np.abs(given.bias).max(), given.periodic) / ARCSEC
    for name, label, errors, wobbles, value in (
        ("encoder_given", "encoder errors equal in every run", given, False, float(largest)),
        ("wobble", "wobble of the axis", EncoderErrors(), True, section.wobble_arcsec),
    ):
        if value:
            source = Source(name, label, _GROUP, "given", value, "arcsec")
            results.append(AngleError(source, "given", np.ones(1), _given(turning, errors, wobbles)))
    return results


def _given(block: TurningBlock, errors: EncoderErrors, wobbles: bool) -> Callable[[Array], Array]:
    """Return the attitude error by errors that are the same in every run, with or without the wobble of the axis."""

    def phi(time: Array) -> Array:
        q_nv, turns = block.base.state(time).q_nb, block.turns
        encoders = encoders_of(block, errors, time)
        assert encoders is not None
        true = turns.attitude(time) if wobbles else turns.without_wobble(turns.angles(time))
        q_solution = rotation.multiply(rotation.multiply(q_nv, true), rotation.conjugate(encoders.attitude(time)))
        off = rotation.multiply(q_nv, rotation.conjugate(q_solution))
        return np.asarray(rotation.rotation_vector_from_quaternion(off)[:, :, None])

    return phi


def of_turning(
    scenario: Scenario, block: Trajectory, outputs: Array
) -> tuple[list[Source], dict[str, Array], dict[str, Array]]:
    """Return the errors of a rotating IMU's angles as sources of an inertial solution, at `outputs`, (E,) s.

    The covariances of the random ones are (E, 9, 9), the errors that are the same in every run (E, 9), SI.
    """
    sources: list[Source] = []
    covariance: dict[str, Array] = {}
    mean: dict[str, Array] = {}
    for error in angle_errors(scenario, block):
        sources.append(error.source)
        phi = error.phi(outputs) * error.size
        if error.what == "given":
            mean[error.source.name] = np.hstack([np.zeros((len(outputs), 6)), phi.sum(axis=2)])
        else:
            covariance[error.source.name] = np.zeros((len(outputs), 9, 9))
            covariance[error.source.name][:, 6:, 6:] = phi @ phi.transpose(0, 2, 1)
    return sources, covariance, mean


@dataclass(frozen=True)
class SensorConstant:
    """Constant errors of an aiding sensor's readings."""

    source: Source
    block: str  # block of states of the truth's model
    sigma: Array  # 1σ of each component, SI


@dataclass(frozen=True)
class SensorProcess:
    """A Gauss-Markov error of an aiding sensor's readings."""

    source: Source
    block: str  # block of states of the truth's model
    sigma: Array  # 1σ of each component, SI
    correlation_time: float  # s


@dataclass(frozen=True)
class SensorNoise:
    """White noise of an aiding sensor's readings, for one kind of measurement."""

    source: Source
    label: str  # name of the readings
    sigma: Array  # true 1σ of each component, SI


@dataclass(frozen=True)
class SensorGiven:
    """Errors of an aiding sensor's readings that are the same in every run."""

    source: Source
    label: str  # name of the readings


@dataclass(frozen=True)
class SensorAngle:
    """An error of the angles of a rotating IMU, for a filter whose readings are those of the vehicle."""

    source: Source
    error: AngleError


SensorSource = SensorConstant | SensorProcess | SensorNoise | SensorGiven | SensorAngle


_WRITTEN = {"m": ("m", 1.0), "mps": ("m/s", 1.0), "rad": ("arcmin", ARCMIN), "radps": ("deg/h", DEG_H)}
"""Units as people write them, by the unit of a residual."""

_OF_TIME = (" delay", " time offset")
"""Endings of the states of an error of time, which the budget does not model."""


@dataclass(frozen=True)
class AidingSources:
    """The aiding sensors of a scenario."""

    measurements: list[Measurements]
    """Readings without random errors, with the true 1σ of their noise; those of sensors at rest are zero."""
    sources: list[SensorSource]  # their errors
    tables: tuple[str, ...]  # the tables of the sensors
    blocks: dict[str, Array]  # 1σ of each random error with states, by block of an error model


def aiding_sources(scenario: Scenario, trajectory: Trajectory) -> AidingSources:
    """Return the errors of a scenario's aiding sensors; raise `InputError` for a sensor that has no budget."""
    assert scenario.aiding is not None
    vehicle = Vehicle(trajectory, scenario.seed)
    sources = AidingSources([], [], tuple(scenario.aiding.sensors()), {})
    for table, sensor in scenario.aiding.sensors().items():
        if sensor.no_budget:
            raise InputError(f"[aiding.{table}] has no budget: {sensor.no_budget}. Remove it, or use an ensemble.")
        late = next(
            (state.block for state in sensor.states() if state.block.endswith(_OF_TIME) and any(state.sigma)), ""
        )
        if late:
            raise InputError(f"[aiding.{table}] has no budget: the state {late!r}. Remove its key, or use an ensemble.")
        noisy = [readings.measurements for readings in sensor.read(vehicle)]
        exact = noisy if sensor.assumed else _exact(table, _without_random(sensor), trajectory, scenario.seed)
        kinds = {}
        for with_noise, m in zip(noisy, exact, strict=True):
            value = np.zeros_like(m.value) if sensor.assumed else m.value
            sources.measurements.append(replace(m, value=value, sigma=with_noise.sigma))
            kinds[m.label] = m.kind
            sources.sources.extend(_noises(table, m, with_noise.sigma))
            given = Source(_name(f"{m.label} given"), "errors equal in every run", table, "given", float("nan"), "")
            sources.sources.append(SensorGiven(given, m.label))
        for error in _states(table, _random_alone(sensor), kinds):
            sources.sources.append(error)
            sources.blocks[error.block] = error.sigma + sources.blocks.get(error.block, 0.0)
    return sources


def _exact(table: str, sensor: AidingSensor, trajectory: Trajectory, seed: int) -> list[Measurements]:
    """Return the readings of a sensor without random errors; they must be the same for every seed."""
    first, second = (
        [readings.measurements for readings in sensor.read(Vehicle(trajectory, s))] for s in (seed, seed + 1)
    )
    for a, b in zip(first, second, strict=True):
        same = np.array_equal(a.value, b.value) and np.array_equal(a.lever_arm, b.lever_arm)
        if not same:
            raise InputError(
                f"[aiding.{table}] has no budget: {a.label} has random errors in addition to those of the keys with "
                f"sigma in their name."
            )
    return first


def _name(text: str) -> str:
    return text.replace("-", "_").replace(" ", "_")


_AXES = {"n": "north", "e": "east", "d": "down"}


def _groups(sigma: Array, axes: Sequence[str]) -> Iterator[tuple[Array, str, str]]:
    """Yield the components of each size, zero for the others, with an ending of their name and of their label."""
    sizes = [size for size in dict.fromkeys(sigma.tolist()) if size]
    for size in sizes:
        equal = [axis for axis, value in zip(axes, sigma.tolist(), strict=True) if value == size]
        words = " and ".join(_AXES.get(axis, axis) for axis in equal)
        ending = ("", "") if len(sizes) == 1 else (f"_{''.join(equal)}", f", {words}")
        yield np.where(sigma == size, size, 0.0), *ending


def _noises(table: str, m: Measurements, sigma: Array) -> Iterator[SensorNoise]:
    kind = measurement_kind(m.kind)
    unit, size = _WRITTEN.get(kind.unit, (kind.unit, 1.0))
    whole = np.array(sigma[0] if len(sigma) else np.zeros(kind.errors), dtype=np.float64)
    what = m.label.removeprefix(f"{table}-").replace("-", " ")
    label = "noise" if what == table.replace("_", " ") else f"{what} noise"
    for part, ending, words in _groups(whole, kind.axes):
        value = float(f"{part.max() / size:.12g}")
        source = Source(_name(f"{m.label} noise") + ending, label + words, table, "random", value, unit)
        yield SensorNoise(source, m.label, part)


def _states(table: str, sensor: AidingSensor, kinds: Mapping[str, str]) -> Iterator[SensorConstant | SensorProcess]:
    for state in sensor.states():
        if not any(state.sigma) or not state.drawn:
            continue
        label = next((label for label in kinds if state.block.startswith(f"{label} ")), "")
        what = state.block.removeprefix(f"{label} ")
        kind = kinds.get(label)
        unit, size = ("m", 1.0)
        if what == "scale":
            unit, size = "ppm", PPM
        elif kind is not None:
            known = measurement_kind(kind)
            unit = known.own_errors[what][1] if what in known.own_errors else known.unit
            unit, size = _WRITTEN.get(unit, (unit, 1.0))
        sigma = np.array(state.sigma, dtype=np.float64)
        words = state.block.removeprefix(f"{table}-").removeprefix(f"{table} ").replace("-", " ")
        constant = not np.isfinite(state.correlation_time)
        axes = ["all"] * len(sigma) if constant or kind is None else measurement_kind(kind).axes
        groups = [(sigma, "", "")] if constant else _groups(sigma, axes)
        for part, ending, also in groups:
            value = float(f"{part.max() / size:.12g}")
            source = Source(_name(state.block) + ending, words + also, table, "random", value, unit)
            if constant:
                yield SensorConstant(source, state.block, part)
            else:
                yield SensorProcess(source, state.block, part, state.correlation_time)


def _zero(value: Any) -> Any:
    return tuple(0.0 for _ in value) if isinstance(value, tuple) else 0.0


def _without_random(sensor: AidingSensor) -> AidingSensor:
    """Return the sensor with only its given errors."""
    return sensor.model_copy(
        update={name: _zero(value) for name, value in sensor if "sigma" in name and value is not None}
    )


def _random_alone(sensor: AidingSensor) -> AidingSensor:
    """Return the sensor without the given errors that have a random part of the same name."""
    names = set(type(sensor).model_fields)
    given = {name.replace("_sigma", "") for name in names if "_sigma" in name} & names
    return sensor.model_copy(update={name: _zero(getattr(sensor, name) or 0.0) for name in given})
