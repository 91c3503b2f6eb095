"""Effects of the sources: places in the propagation, effects over a step, shares; sources that are equal in every run.

Unaided and aided budgets have them in common. A source that is the same in every run is computed in one run with it
alone. Reading errors that no constant describes linearly (faults, a limited range, arms and delay of the
accelerometers, the null shift of laser gyros) are the emulated readings less the true increments, and drive the linear
error equations. The budget follows the motion in normal gravity: the part of the field that the navigator does not know
enters as readings that are −∫C_bn δg dt off, and its random remainder as a process over the distance travelled, in
north, east and down. The error of the navigation algorithm is that of a run on perfect increments.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from sinssim import earth
from sinssim.analyses.error_budget.error_dynamics import TrueMotion, gravity_input, noise_inputs, white_covariance
from sinssim.analyses.error_budget.error_sources import (
    Column,
    Constants,
    InertialNoise,
    InitialErrors,
    SensorAngle,
    SensorConstant,
    SensorGiven,
    SensorNoise,
    SensorProcess,
    SensorSource,
    Source,
)
from sinssim.analyses.error_budget.source_propagation import AlongWay, GaussMarkov, NavigationStep, Propagation
from sinssim.data import Array, ImuData, NavState
from sinssim.errors import InputError
from sinssim.estimation.error_dynamics import NominalMotion
from sinssim.scenario import Scenario
from sinssim.scenario.navigation_section import InitialErrorSection
from sinssim.scenario.true_motion import unknown_field
from sinssim.sensors.imu.compensation import compensate
from sinssim.sensors.imu.emulation import emulate, perfect_increments
from sinssim.sensors.imu.error_term_table import FIELDS, TERMS
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.measurement_kind import CORE
from sinssim.sensors.sensor_set_section import Redundant, along
from sinssim.simulation.navigation_stage import solve
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.truth.trajectory import Trajectory
from sinssim.truth.true_gravity_disturbance import Disturbed
from sinssim.units import ARCSEC, MGAL

_BIASES = [Column(triad, axis, axis, axis, FIELDS["bias"]) for triad in (0, 1) for axis in np.eye(3)]


class Shares:
    """The columns and covariances of all sources.

    The constant columns are those of the inertial sensors, of the series, of the initial errors, and of the aiding
    sensors, in this order.
    """

    def __init__(
        self,
        constants: Constants,
        noises: list[InertialNoise],
        series: list[Source],
        initial: InitialErrors,
        sensors: list[SensorSource],
    ) -> None:
        """Lay out the columns; `series` are the sources of one run, in the order of the given readings."""
        self.noises, self.initial, self.sensors = noises, initial, sensors
        self.sources = [*constants.sources, *(n.source for n in noises), *series, *initial.sources]
        self.sources += [s.source for s in sensors]
        self.kernel_columns: list[Column | int] = [*constants.columns, *range(len(series)), *_BIASES]
        self.inertial = len(constants.columns) + len(series)
        self.parts = dict(constants.parts)
        for k, source in enumerate(series):
            self.parts[source.name] = ([len(constants.columns) + k], np.ones(1))
        self.starts: dict[int, Array] = {}
        count = self.inertial
        for name, start in initial.parts.items():
            columns = list(range(count, count + start.shape[1]))
            self.starts |= dict(zip(columns, start.T, strict=True))
            self.parts[name] = (columns, np.ones(len(columns)))
            count += len(columns)
        for sensor in sensors:
            if (sizes := _sizes(sensor)) is not None:
                self.parts[sensor.source.name] = (list(range(count, count + len(sizes))), sizes)
                count += len(sizes)
        self.count = count

    def begin(self, core: int) -> Propagation:
        """Return the propagation at the start, with the initial errors."""
        white = [n.source.name for n in self.noises if n.process is None]
        for sensor in self.sensors:
            if isinstance(sensor, SensorNoise) or (isinstance(sensor, SensorAngle) and sensor.error.what == "noise"):
                white.append(sensor.source.name)
        propagation = Propagation.start(core, self.count, white)
        for column, start in self.starts.items():
            propagation.sensitivity[:CORE, column] = start
        for noise in self.noises:
            if noise.process is not None:
                sizes = np.full(3, noise.size) if noise.sizes is None else noise.sizes
                propagation.add(noise.source.name, noise.process, sizes, noise.triad, noise.mix)
        for sensor in self.sensors:
            if isinstance(sensor, SensorProcess):
                propagation.add(sensor.source.name, GaussMarkov(sensor.correlation_time), sensor.sigma, None)
        return propagation


def _sizes(sensor: SensorSource) -> Array | None:
    """Return the sizes of the constant columns of an aiding sensor's error; None for one without."""
    if isinstance(sensor, SensorConstant):
        return sensor.sigma
    if isinstance(sensor, SensorAngle) and sensor.error.what != "noise":
        return sensor.error.size
    return np.ones(1) if isinstance(sensor, SensorGiven) else None


def sensor_effects(
    shares: Shares, label: str, through: Mapping[str, Array], given: Array
) -> tuple[Array, dict[str, Array], dict[str, Array]]:
    """Return H_θ, H_y by process and variance by white noise of the aiding sensors' errors in a reading of k numbers.

    `through` are the effects of the blocks of states, (k, n) each, and `given` are the errors equal in every run.
    """
    constants = np.zeros((len(given), shares.count))
    processes: dict[str, Array] = {}
    noise: dict[str, Array] = {}
    for sensor in shares.sensors:
        name = sensor.source.name
        if isinstance(sensor, SensorNoise):
            if sensor.label == label:
                noise[name] = sensor.sigma**2
        elif isinstance(sensor, SensorGiven):
            if sensor.label == label:
                constants[:, shares.parts[name][0]] = given[:, None]
        elif isinstance(sensor, SensorConstant | SensorProcess) and through.get(sensor.block, np.zeros(1)).any():
            if isinstance(sensor, SensorConstant):
                constants[:, shares.parts[name][0]] = through[sensor.block]
            else:
                processes[name] = through[sensor.block]
    return constants, processes, noise


class Snapshot(NamedTuple):
    """The shares of the navigation errors at one instant."""

    sensitivity: Array  # (9, m)
    covariances: dict[str, Array]  # by random source, (9, 9)


_SAME_INSTANT = 1e-6


@dataclass
class Marks:
    """Instants between which the changes of the errors are wanted."""

    time: Array  # increasing, at edges of samples, s; those before the navigation begins do not count
    begin: float = 0.0  # the instant from which the first change counts, filled in, s
    changes: list[Snapshot] = field(default_factory=list)
    """Of the navigation errors from one instant to the next, filled in."""
    reached: list[float] = field(default_factory=list)  # ends of the changes, filled in, s

    def start(self, propagations: Iterable[Propagation], now: float) -> None:
        """Begin the first interval."""
        self.begin = now
        for propagation in propagations:
            propagation.mark(CORE)

    def pass_by(self, published: Propagation, all_of_them: Iterable[Propagation], now: float) -> None:
        """End an interval and begin the next, if an instant is reached."""
        if len(self.time) and np.abs(self.time - now).min() < _SAME_INSTANT and now > self.begin + _SAME_INSTANT:
            self.changes.append(Snapshot(*published.changes()))
            self.reached.append(now)
            for propagation in all_of_them:
                propagation.mark(CORE)


def snapshot(propagation: Propagation, shares: Shares, *, rounded: bool = True) -> Snapshot:
    """Return the shares of the navigation errors now, with the rounding of pulses once they have been counted."""
    covariances = {name: p.copy() for name, p in propagation.covariances(CORE).items()}
    if rounded:
        add_rounding(covariances, shares)
    return Snapshot(propagation.sensitivity[:CORE].copy(), covariances)


def add_rounding(covariances: Mapping[str, Array], shares: Shares) -> None:
    """Add the rounding of the last pulse, Q²/12 on each axis, to the attitude's and the velocity's (9, 9) by source."""
    for noise in shares.noises:
        if noise.what == "quantum":
            rows = slice(6, 9) if noise.triad == 0 else slice(3, 6)
            covariances[noise.source.name][rows, rows] += noise.size**2 / 12.0 * noise.mix @ noise.mix.T


class StepEffects(NamedTuple):
    """What happens to n core states over K steps."""

    interval: Array  # (K,) s
    distance: Array  # travelled horizontally, (K,) m
    constants: Array  # effect of the constant errors, (K, n, m)
    bias: Array  # effect of a unit error of each inertial sensor, gyros first, (K, n, 6)
    noise: Mapping[str, Array]  # covariance by white source, (K, n, n)
    mean: Array  # mean reading errors by the inertial sensors' constant errors, gyros first, (K, 6, m)

    def step(self, k: int, phi: Array, keep: Array | None = None) -> NavigationStep:
        """Return one step with Φ; `keep` projects the effect of gravity."""
        length = float(self.interval[k])
        gravity = gravity_input(phi, length)
        return NavigationStep(
            phi, self.constants[k], {name: q[k] for name, q in self.noise.items()},
            (self.bias[k, :, :3], self.bias[k, :, 3:]), length, gravity if keep is None else keep @ gravity,
            float(self.distance[k]),
        )  # fmt: skip


def step_effects(
    motion: TrueMotion,
    shares: Shares,
    series: tuple[Array, Array],
    time: Array,
    nominal: NominalMotion,
    f: Array,
    size: int,
) -> StepEffects:
    """Return the effects on `size` core states of all sources over the steps between K+1 instants, s.

    F of the first states, which the noises drive, is (K, k, k); `series` are the given reading errors.
    """
    effects, interval, inputs = (
        motion.responses(time, shares.kernel_columns, *series),
        np.diff(time),
        noise_inputs(nominal),
    )
    constants, bias = np.zeros((len(interval), size, shares.count)), np.zeros((len(interval), size, 6))
    constants[:, :CORE, : shares.inertial] = effects.core[:, :, : shares.inertial]
    bias[:, :CORE] = effects.core[:, :, shares.inertial :]
    noise = {}
    for source in shares.noises:
        if source.process is None:
            count = f.shape[1]
            driven = np.zeros((len(f), count, 3))
            driven[:, :CORE] = inputs[source.triad, source.what] @ (source.density * source.mix)
            q = noise[source.source.name] = np.zeros((len(interval), size, size))
            q[:, :count, :count] = white_covariance(f, driven, interval)
    return StepEffects(interval, motion.distance(time), constants, bias, noise, effects.mean)


def given_readings(scenario: Scenario, ideal: ImuData) -> tuple[list[Source], Array, Array]:
    """Return reading errors of one run: the sources, and their series of rad and m/s, (s, N, 3) each."""
    block = scenario.imu.with_triads(TriadErrors(), TriadErrors())
    limits = {
        term.triad: TriadErrors(limit=float(scenario.imu.stated(term)[0])) for term in TERMS if term.field == "limit"
    }
    if isinstance(sensors := scenario.imu.sensor_set, Redundant):
        for (kind, limit), increments in zip(limits.items(), (ideal.dtheta, ideal.dvel), strict=True):
            largest = float(np.abs(along(increments, sensors.axes) / np.diff(ideal.time)[:, None]).max())
            if 0.0 < limit.limit < largest:
                raise InputError(
                    f"the {kind} range of a redundant set has no budget: single sensors reach it. Remove the range, or "
                    "use an ensemble."
                )
        return [], _stacked([], ideal), _stacked([], ideal)
    left = scenario.compensation is None  # which removes arms and delay
    warming = ImuErrors(null_shift=block.null_shift, warm_up=block.warm_up)
    alone = (
        (any(limit.limit for limit in limits.values()), "range", "range of the sensors", "gyros",
         ImuErrors(limits["gyro"], limits["accel"])),
        (bool(block.faults), "faults", "faults", "gyros", ImuErrors(faults=block.faults)),
        (block.null_shift is not None, "null_shift", "null shift", "gyros", warming),
        (left and np.any(block.arms), "accel_arms", "arms", "accelerometers", ImuErrors(arms=block.arms)),
        (left and block.delay, "accel_delay", "delay", "accelerometers", ImuErrors(delay=block.delay)),
    )  # fmt: skip
    sources, theta, velocity = [], [], []
    for there, name, label, group, errors in alone:
        if not there:
            continue
        read = emulate(ideal, errors, scenario.seed)
        if scenario.compensation is not None:
            read = compensate(read, ImuErrors())
        read = replace(read, time=ideal.time)
        error = read.dtheta - ideal.dtheta, read.dvel - ideal.dvel
        if not (error[0].any() or error[1].any()):
            continue
        sources.append(Source(name, label, group, "one run", float("nan"), ""))
        theta.append(error[0])
        velocity.append(error[1])
    return sources, _stacked(theta, ideal), _stacked(velocity, ideal)


def _stacked(series: list[Array], ideal: ImuData) -> Array:
    return np.array(series) if series else np.zeros((0, len(ideal), 3))


TRIAD = 2
"""Number of the three components of gravity beside those of gyros, 0, and accelerometers, 1."""


def in_normal_gravity(scenario: Scenario) -> Scenario:
    """Return a scenario without its gravity field."""
    if scenario.gravity is None:
        return scenario
    navigation = scenario.navigation.model_copy(update={"gravity_degree": None})
    return scenario.model_copy(update={"gravity": None, "navigation": navigation})


def field_readings(scenario: Scenario, trajectory: Trajectory, ideal: ImuData) -> tuple[list[Source], Array, Array]:
    """Return what the unknown field, if there is one, does to the readings, as `given_readings` does."""
    field = unknown_field(scenario)
    if field is None:
        return [], np.zeros((0, len(ideal), 3)), np.zeros((0, len(ideal), 3))
    motion = Disturbed(trajectory, field)
    velocity = -motion.felt(ideal.time, ideal.dtheta)
    largest = float(np.linalg.norm(velocity, axis=1).max() / np.diff(ideal.time).mean() / MGAL)
    source = Source("gravity_model", "gravity field", "gravity", "given", float(f"{largest:.3g}"), "mGal")
    return [source], np.zeros((1, len(ideal), 3)), velocity[None]


def remainder_noise(scenario: Scenario, state: NavState) -> list[InertialNoise]:
    """Return the random remainder of gravity, if there is one, as a process, with normal gravity at the true states."""
    model = None if scenario.gravity is None else scenario.gravity.remainder_model()
    if model is None or not any(model.sigma):
        return []
    some = slice(None, None, max(1, len(state.latitude) // 100))
    gamma = float(earth.gravity_ned(state.latitude[some], state.height[some])[:, 2].mean())
    sizes = np.array([gamma * model.sigma[0], gamma * model.sigma[1], model.sigma[2]])
    value = float(f"{max(model.sigma[:2]) / ARCSEC:.3g}")
    source = Source("gravity_remainder", "remainder of gravity, deflection", "gravity", "random", value, "arcsec")
    process = AlongWay(replace(model, sigma=(1.0, 1.0, 1.0)))
    return [InertialNoise(source, TRIAD, "process", float(sizes.max()), process=process, sizes=sizes)]


ALGORITHM = Source("algorithm", "algorithm, gravity model, ellipsoid", "navigation", "one run", float("nan"), "")
"""The algorithm as a source."""


def of_algorithm(scenario: Scenario, motion: TrueMotion, outputs: Array) -> Array:
    """Return the errors of the scenario's first algorithm with perfect sensors, from the true state.

    Position, velocity and attitude errors at `outputs`, (E,) s, are (E, 9) SI.
    """
    exact = scenario.navigation.model_copy(
        update={"algorithms": scenario.navigation.algorithms[:1], "initial_error": InitialErrorSection()}
    )
    # that of the block, whose attitude is not turned out: errors of its encoders are sources of their own
    block = scenario.imu.model_copy(update={"rotation": None})
    plain = scenario.model_copy(update={"navigation": exact, "navigator": (), "imu": block})
    trajectory, height = motion.trajectory, motion.state.height
    increments = perfect_increments(trajectory, motion.ideal, scenario.imu)
    truth = Truth.along(trajectory, trajectory, scenario.imu.rate_hz, motion.ideal, motion.state)
    (solution,) = solve(plain, truth, increments, None, height)[0].values()
    error = truth.error_of(solution, "north")
    columns = np.hstack([error.position_ned, error.velocity_ned, error.attitude])
    return np.column_stack([np.interp(outputs, solution.time, column) for column in columns.T])
