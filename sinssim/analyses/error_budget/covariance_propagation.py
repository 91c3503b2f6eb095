"""Propagates all sources of a budget: of inertial navigation with its vertical loop, and with a filter.

With a filter it is a consider analysis with the filter's own gains.

The filter's covariance run about the true motion gives the gains K, as the filter would compute them. Its model may
know less than the truth. The core state is

    ε   errors of the corrected navigation,   p̂   the filter's estimates of the sensors' parameters

and with the filter's Φ and H, split into navigation (ε) and parameters (p), a step and a reading with the innovation
z are

ε ← Φ_εε ε + B y − Φ_εp p̂, p̂ ← Φ_pp p̂, z = H_true ε + H_y y − H_p p̂ + v, ε ← ε − K_ε z, p̂ ← p̂ + K_p z (1)

in which y are the true errors of the sensors. That the filter's loop is closed or open makes no difference to first
order. The gate, which rejects one correct reading in ten thousand, is not considered.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.analyses.error_budget.error_dynamics import TrueMotion, exponential
from sinssim.analyses.error_budget.error_sources import SensorAngle
from sinssim.analyses.error_budget.source_effects import (
    Marks,
    Shares,
    Snapshot,
    StepEffects,
    sensor_effects,
    snapshot,
    step_effects,
)
from sinssim.analyses.error_budget.source_propagation import Propagation, Reading
from sinssim.data import Array, Measurements, rows_of, solution_of
from sinssim.estimation.error_dynamics import NominalMotion, driving_noise
from sinssim.estimation.linearisation import (
    Linearisation,
    Observed,
    Prediction,
    Surroundings,
    linearise,
    observe,
    of_vehicle,
)
from sinssim.estimation.measurement_epochs import Branches, CheckedMeasurements, take_in
from sinssim.estimation.state_model import Block, ErrorModel
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.rotation_encoder import encoders_of
from sinssim.sensors.measurement_kind import CORE, PHI, V
from sinssim.strapdown.frames.vertical_channel import OVERDUE_AFTER, loop_gains_k


@dataclass(frozen=True)
class FilterRun:
    """What the filter of a scenario is told, and where it starts."""

    model: ErrorModel  # its error model
    covariance: Array  # P₀, (n, n)
    measurements: Sequence[Measurements]  # readings without random errors, with the 1σ that the filter assumes
    rate_hz: float  # of its prediction
    start: int  # first edge of its samples


_SEGMENT = 64.0
"""Length of the segments that are linearised at once, s."""

_SAME = 1e-6
_GYRO_NOISE = "gyro_arw"
"""The source that readings of a mean rate share with the attitude."""


@dataclass
class _Branch:
    """The estimate from the readings that arrive before an instant, as in `sinssim.estimation.kalman_filter`."""

    until: float
    covariance: Array
    propagation: Propagation
    cross: Array
    """Covariance of the state's error with the gyros' noise since the last zero-rate reading, (n, 3)."""

    def fork(self, until: float) -> _Branch:
        return _Branch(until, self.covariance, self.propagation.copy(), self.cross)


@dataclass(frozen=True)
class FilterSnapshot:
    """Result at one instant: the shares, and the filter's own covariance of the navigation errors, (9, 9)."""

    shares: Snapshot
    covariance: Array


class Consider:
    """The consider analysis of one run."""

    def __init__(
        self,
        motion: TrueMotion,
        shares: Shares,
        series: tuple[Array, Array],
        filter_run: FilterRun,
        blocks: Mapping[str, Array],
    ) -> None:
        """Prepare the epochs and the truth's model of the readings; `blocks` are 1σ of the aiding sensors' errors."""
        self._motion, self._shares, self._series, self._filter = motion, shares, series, filter_run
        time = motion.ideal.time[filter_run.start :]
        self._readings, self._epochs = take_in(filter_run.measurements, filter_run.model, time, filter_run.rate_hz)
        self._begins = self._beginnings()
        self._angles = [sensor for sensor in shares.sensors if isinstance(sensor, SensorAngle)]
        self._encoders = encoders_of(motion.trajectory, None, motion.ideal.time)
        self._around = Surroundings(
            filter_run.model, driving_noise(filter_run.model), self._epochs, self._readings, motion.rates,
            motion.gravity, motion.trajectory.ellipsoid, long_rows=False, encoders=self._encoders,
        )  # fmt: skip
        self._truth = ErrorModel(
            (
                Block("position", 1.0), Block("velocity", 1.0), Block("attitude", 1.0), Block("gyro bias", 1.0),
                *(Block(name, sigma) for name, sigma in blocks.items()),
            ),
            0.0,
            0.0,
        )  # fmt: skip

    def _beginnings(self) -> set[int]:
        """Return the epochs at which the interval of a zero-rate reading begins."""
        beginnings: set[int] = set()
        for readings in self._readings:
            if measurement_kind(readings.data.kind).mean_rate:
                begin = (readings.data.time - readings.interval)[readings.usable]
                beginnings |= set(np.searchsorted(self._epochs.time, begin - 1e-5).tolist())
        return beginnings

    @property
    def on_edge(self) -> Array:
        """Epochs of the filter at edges of samples, s."""
        return self._epochs.time[self._epochs.on_edge]

    @property
    def core(self) -> int:
        """Number of core states."""
        return self._filter.model.size

    def run(
        self, propagation: Propagation, outputs: Array, progress: Callable[[float], None], marks: Marks | None = None
    ) -> list[FilterSnapshot]:
        """Propagate all sources from their shares at the filter's start, with the core states of (1).

        Returns the shares and the filter's covariance at `outputs`, (E,) s, which are epochs of the filter. The changes
        are wanted between the instants of `marks`, which are among `outputs`.
        """
        epochs = self._epochs.time
        self._marks = marks
        if marks is not None:
            marks.start([propagation], float(epochs[0]))
        wanted = set(np.searchsorted(epochs, outputs - 1e-7).tolist())
        main = _Branch(np.inf, self._filter.covariance.copy(), propagation, np.zeros((self.core, 3)))
        branches = Branches(main)
        snapshots: list[FilterSnapshot] = []
        first = 0
        while first < len(epochs):
            progress(first / len(epochs))
            last = int(np.searchsorted(epochs, epochs[first] + _SEGMENT, side="right")) - 1
            last = max(last, first)
            line = self._linearise(first, last)
            within = {e for e in wanted | self._begins if first <= e <= last}
            events = sorted(set(line.observed) | within | {last})
            self._segment(line, events, wanted, branches, snapshots)
            first = last + 1
        progress(1.0)
        return snapshots

    def _linearise(self, first: int, last: int) -> Linearisation:
        time = self._motion.ideal.time
        begin, end = self._epochs.time[max(first - 1, 0)], self._epochs.time[last]
        rows = slice(max(int(np.searchsorted(time, begin)) - 2, 0), int(np.searchsorted(time, end)) + 3)
        nominal = solution_of(time[rows], rows_of(self._motion.state, rows), "quaternion")
        zero = {b.name: np.zeros(b.size) for b in self._filter.model.blocks}
        return linearise(self._around, first, last, nominal, ImuErrors(), zero)

    def _segment(
        self,
        line: Linearisation,
        events: list[int],
        wanted: set[int],
        branches: Branches[_Branch],
        snapshots: list[FilterSnapshot],
    ) -> None:
        """Go through the epochs of one segment; between readings, steps are combined."""
        epochs, first = self._epochs.time, line.first
        begin = max(first - 1, 0)
        time = epochs[[begin, *(e for e in events if e > begin)]]
        steps = self._steps(time)
        true = self._true_readings(line)
        done, number = first, 0
        for event in events:
            phi, q, came = self._combined(line, done - first, event - first + 1)
            done = event + 1
            now = float(epochs[event])
            branches.known(now)  # drops those that are no longer needed
            if event > begin and steps is not None:
                self._advance(phi, q, came, steps, number, branches.every())
                number += 1
            self._take(line.observed.get(event, ()), true, now, branches)
            if event in self._begins:
                for branch in branches.every():
                    branch.cross = np.zeros_like(branch.cross)
                    branch.propagation.reset(_GYRO_NOISE)
            if event in wanted:
                published = branches.known(now)
                seen = snapshot(published.propagation, self._shares, rounded=now > self._motion.ideal.time[0])
                self._turn_out(seen, now)
                snapshots.append(FilterSnapshot(seen, published.covariance[:CORE, :CORE]))
                if self._marks is not None:
                    self._marks.pass_by(published.propagation, [branch.propagation for branch in branches.every()], now)

    def _turn_out(self, seen: Snapshot, now: float) -> None:
        """Add the errors of the angles to the attitude, which is that of the vehicle."""
        for angle in self._angles:
            phi = angle.error.phi(np.array([now]))[0]
            if angle.error.what == "noise":
                turned = phi * angle.error.size
                seen.covariances[angle.source.name][PHI, PHI] += turned @ turned.T
            else:
                seen.sensitivity[PHI, self._shares.parts[angle.source.name][0]] += phi

    def _steps(self, time: Array) -> StepEffects | None:
        """Return noise and effects of constant errors over the steps between events."""
        if len(time) < 2:
            return None
        nominal = self._motion.nominal(time)
        f = self._motion.dynamics(nominal)
        return step_effects(self._motion, self._shares, self._series, time, nominal, f, self.core)

    def _combined(self, line: Linearisation, begin: int, end: int) -> tuple[Array, Array, Array]:
        """Return Φ, Q and the increase of `cross` over some epochs of a segment."""
        n, variance = self.core, self._filter.model.gyro_noise**2
        phi, q, came = np.eye(n), np.zeros((n, n)), np.zeros((n, 3))
        for k in range(begin, end):
            if line.interval[k]:
                transition = line.phi[k]
                phi, q = transition @ phi, transition @ q @ transition.T + line.q[k]
                if self._begins:  # noise at mid-interval, as the filter has it
                    half_way = -0.5 * (transition[:, PHI] + np.eye(n)[:, PHI]) @ line.c_nb[k]
                    came = transition @ came + half_way * (variance * line.interval[k])
        return phi, q, came

    def _advance(
        self, phi: Array, q: Array, came: Array, steps: StepEffects, k: int, branches: Sequence[_Branch]
    ) -> None:
        core = phi.copy()
        core[:CORE, CORE:] *= -1.0  # (1)
        step = steps.step(k, core)
        for branch in branches:
            branch.covariance = phi @ branch.covariance @ phi.T + q
            branch.cross = phi @ branch.cross + came
            branch.propagation.step(step)
        self._mean_errors = steps.mean[k]

    def _take(
        self,
        observed: Sequence[Observed],
        true: Mapping[tuple[int, int], Array],
        now: float,
        branches: Branches[_Branch],
    ) -> None:
        """Correct by the readings of an event, in the order of their arrival."""
        for reading in observed:
            data = self._readings[reading.sensor].data
            arrival = float(data.arrival[reading.row])
            if arrival > now + _SAME:
                branches.wait(arrival)
            for branch in (*branches.holding(arrival), branches.main):
                self._correct(branch, reading, true[reading.sensor, reading.row], data)

    def _correct(self, branch: _Branch, reading: Observed, h_true: Array, data: Measurements) -> None:
        p, h = branch.covariance, reading.h
        seen = p @ h.T
        if reading.interval:  # the reading shares the gyros' noise with the state
            seen = seen + branch.cross / reading.interval
            both = h @ branch.cross / reading.interval
            innovation = h @ seen + both.T + np.diag(reading.variance)
        else:
            innovation = h @ seen + np.diag(reading.variance)
        gain = np.asarray(np.linalg.solve(innovation, seen.T).T, dtype=np.float64)
        if reading.interval:
            branch.covariance = p - gain @ seen.T
        else:
            reduced = np.eye(len(p)) - gain @ h
            branch.covariance = reduced @ p @ reduced.T + (gain * reading.variance) @ gain.T
        branch.cross = branch.cross - gain @ (h @ branch.cross)
        signed = gain.copy()
        signed[:CORE] *= -1.0  # (1)
        branch.propagation.read(self._reading(signed, reading, h_true, data))

    def _reading(self, gain: Array, reading: Observed, h_true: Array, data: Measurements) -> Reading:
        """Return the true dependence of the innovation on all errors."""
        shares, slices = self._shares, self._truth.slices
        core = -reading.h
        core[:, :CORE] = h_true[:, :CORE]
        gyro = h_true[:, slices["gyro bias"]]
        through_blocks = {name: h_true[:, where] for name, where in slices.items()}
        constants, processes, noise = sensor_effects(shares, data.label, through_blocks, reading.residual)
        constants[:, : shares.inertial] = gyro @ self._mean_errors[:3, : shares.inertial]
        c_nb = self._c_nb[reading.sensor, reading.row]
        for inertial in shares.noises:
            if inertial.source.name == _GYRO_NOISE:
                if reading.interval:  # the mean of the noise since the previous reading
                    processes[inertial.source.name] = gyro @ inertial.mix / reading.interval
            elif inertial.process is not None and inertial.triad == 0 and gyro.any():
                processes[inertial.source.name] = gyro @ inertial.mix
            elif inertial.what == "white" and inertial.process is None and reading.interval and inertial.triad == 0:
                noise[inertial.source.name] = (
                    np.sum((gyro @ inertial.mix) ** 2, axis=1) * inertial.size**2 / reading.interval
                )
            elif inertial.what == "quantum" and reading.interval and inertial.triad == 0:
                rounding = inertial.size**2 / (6.0 * reading.interval**2)
                noise[inertial.source.name] = np.full(
                    len(reading.h), rounding * np.mean(np.sum(inertial.mix**2, axis=1))
                )
            elif inertial.what == "quantum":
                through = h_true[:, PHI if inertial.triad == 0 else V] @ c_nb @ inertial.mix
                noise[inertial.source.name] = np.sum(through**2, axis=1) * inertial.size**2 / 12.0
        for angle in self._angles:
            off = h_true[:, PHI] @ angle.error.phi(data.time[reading.row : reading.row + 1])[0]
            if angle.error.what == "noise":
                noise[angle.source.name] = np.sum((off * angle.error.size) ** 2, axis=1)
            else:
                constants[:, shares.parts[angle.source.name][0]] = off
        return Reading(gain, core, constants, processes, noise)

    def _true_readings(self, line: Linearisation) -> dict[tuple[int, int], Array]:
        """Return H of the truth's model for the readings of a segment, by sensor and row."""
        matrices: dict[tuple[int, int], Array] = {}
        self._c_nb: dict[tuple[int, int], Array] = {}
        zero = {b.name: np.zeros(b.size) for b in self._truth.blocks}
        for sensor, readings in enumerate(self._readings):
            rows = readings.between(line.first, line.first + len(line.interval) - 1)
            if not len(rows):
                continue
            data, epoch = readings.data, readings.epoch[rows].astype(np.intp)
            state = rows_of(line.state, epoch - line.first)
            rate = self._rate(readings, rows, self._epochs.time[epoch])
            time = data.time[rows]
            some = Measurements(data.kind, time, time, data.value[rows], data.sigma[rows], data.lever_arm, data.name)
            predicted = Prediction(state, rate, self._around.ellipsoid)
            if self._encoders is not None:
                predicted = of_vehicle(predicted, self._encoders, time)
            h = observe(some, predicted, self._truth, zero)[1]
            matrices |= {(sensor, row): h[k] for k, row in enumerate(rows.tolist())}
            c_nb = rotation.dcm_from_quaternion(state.q_nb)
            self._c_nb |= {(sensor, row): c_nb[k] for k, row in enumerate(rows.tolist())}
        return matrices

    def _rate(self, readings: CheckedMeasurements, rows: NDArray[np.intp], time: Array) -> Array:
        if measurement_kind(readings.data.kind).mean_rate:
            return self._motion.rates.mean(time - readings.interval[rows], time, ImuErrors())
        return self._motion.rates.at(time, ImuErrors())


_INTEGRAL, _HELD = CORE, CORE + 1
STATES = CORE + 2
"""Core states: navigation errors, the loop's k₃∫e dt, and the error e that it holds between readings."""

_LONGEST = 1.0
"""Longest step, s. Within it the increments are integrated sample by sample; between steps the specific force is the
mean one, which is wrong for second-order effects by f Δφ (dt)²/12 of the tilt: 1e-4 in a turn at 3°/s."""

_OF_LOOP = 0.05
"""Longest step relative to the time constant of the vertical loop."""


@dataclass(frozen=True)
class HeightErrors:
    """An altimeter's readings for the vertical loop."""

    arrival: Array  # arrival times, (M,) s
    height: Array  # true height that a scale factor multiplies, (M,) m
    given: Array  # error of each reading that is the same in every run, reading less true height at arrival, (M,) m
    interval: float  # time between readings, s
    label: str  # name of the readings


@dataclass(frozen=True)
class Vertical:
    """The vertical channel."""

    kind: str  # "free", "baro-loop" or "truth"
    time_constant: float  # of the loop, s
    readings: HeightErrors | None  # of its altimeter; None for the exact height at every sample


def _boundaries(motion: TrueMotion, vertical: Vertical, outputs: Array) -> Array:
    """Return the boundaries of the steps: at most a second apart, all at edges of samples."""
    edges = motion.ideal.time
    longest = min(_LONGEST, _OF_LOOP * vertical.time_constant) if vertical.kind == "baro-loop" else _LONGEST
    sample = float(edges[-1] - edges[0]) / (len(edges) - 1)
    stride = max(int(longest / sample + 1e-6), 1)
    wanted = [np.arange(0, len(edges), stride), np.array([len(edges) - 1]), np.searchsorted(edges, outputs - 1e-9)]
    if (readings := vertical.readings) is not None:
        overdue = readings.arrival + OVERDUE_AFTER * readings.interval
        wanted += [np.searchsorted(edges, readings.arrival - 1e-9), np.searchsorted(edges, overdue, side="right")]
    chosen = np.unique(np.concatenate(wanted).astype(np.int64))
    return np.asarray(edges[chosen[chosen < len(edges)]])


def _with_loop(
    f: Array, nominal: NominalMotion, vertical: Vertical, motion: TrueMotion, open_loop: NDArray[np.bool_]
) -> Array:
    """Return F of navigation errors and loop, (K, 11, 11).

    With e = δh − δh_ref, δh = −δr_D: δṙ_D = δv_D + k₁ e, δv̇_D = … + k₂ e + s, ṡ = k₃ e.
    """
    whole = np.zeros((len(f), STATES, STATES))
    whole[:, :CORE, :CORE] = f
    if vertical.kind != "baro-loop":
        return whole
    ellipsoid = motion.trajectory.ellipsoid
    gravity = earth.gravity_ned(nominal.latitude, nominal.height, motion.gravity, ellipsoid)[:, 2]
    curvature = 1.0 / (earth.radii(nominal.latitude, ellipsoid)[1] + nominal.height)
    rule = loop_gains_k.py_func  # type: ignore[attr-defined]  # of the navigator's kernel, over arrays
    gains = np.broadcast_arrays(*rule(vertical.time_constant, gravity, curvature))
    sampled = vertical.readings is not None
    whole[:, 5, _INTEGRAL] = 1.0
    for row, gain in zip((2, 5, _INTEGRAL), gains, strict=True):
        if sampled:
            whole[:, row, _HELD] = np.where(open_loop, 0.0, gain)
        else:
            whole[:, row, 2] -= gain
    return whole


_BLOCK = 512
"""Steps whose effects are computed at once."""


def propagate(
    motion: TrueMotion,
    shares: Shares,
    series: tuple[Array, Array],
    vertical: Vertical,
    outputs: Array,
    progress: Callable[[float], None],
    begun: tuple[int, Propagation] | None = None,
    marks: Marks | None = None,
) -> list[Snapshot]:
    """Propagate all sources along the whole run; return their shares at `outputs`, edges of samples, (E,) s.

    Navigation begins after an alignment at the sample and with the shares of `begun`. The changes are wanted between
    the instants of `marks`, which are among `outputs`.
    """
    start, propagation = (0, shares.begin(STATES)) if begun is None else begun
    time = _boundaries(motion, vertical, outputs)
    time = time[time >= motion.ideal.time[start] - 1e-9]
    keep = np.eye(STATES)
    if vertical.kind == "truth":  # height and vertical velocity have no errors
        keep[2, 2] = keep[5, 5] = 0.0
        propagation.map(keep)
    if marks is not None:
        marks.start([propagation], float(time[0]))
    wanted = set(np.searchsorted(time, outputs - 1e-9).tolist())
    snapshots = [snapshot(propagation, shares, rounded=False)] if 0 in wanted else []
    readings = vertical.readings
    at_boundary, overdue = _readings_at(time, readings)
    for first in range(0, len(time) - 1, _BLOCK):
        progress(first / len(time))
        part = time[first : first + _BLOCK + 1]
        phi, effects = _steps(motion, shares, series, vertical, part, overdue[first : first + len(part) - 1], keep)
        for k in range(len(phi)):
            propagation.step(effects.step(k, phi[k], keep))
            row = first + k + 1
            if readings is not None and at_boundary[row] >= 0:
                propagation.read(_height_reading(shares, readings, int(at_boundary[row])))
            if row in wanted:
                seen, core = snapshot(propagation, shares), keep[:CORE, :CORE]  # nor does a pulse round what is held
                snapshots.append(
                    Snapshot(seen.sensitivity, {name: core @ p @ core for name, p in seen.covariances.items()})
                )
                if marks is not None:
                    marks.pass_by(propagation, [propagation], float(time[row]))
    progress(1.0)
    return snapshots


def _steps(
    motion: TrueMotion,
    shares: Shares,
    series: tuple[Array, Array],
    vertical: Vertical,
    time: Array,
    open_loop: NDArray[np.bool_],
    keep: Array,
) -> tuple[Array, StepEffects]:
    """Return Φ, (K, 11, 11), and the effects over steps; the states that `keep` projects away have no errors."""
    nominal = motion.nominal(time)
    f = _with_loop(motion.dynamics(nominal), nominal, vertical, motion, open_loop)
    f = np.where(np.diag(keep)[:, None] > 0.0, f, 0.0)
    effects = step_effects(motion, shares, series, time, nominal, f, STATES)
    constants, bias = keep @ effects.constants, keep @ effects.bias
    noise = {name: keep @ q @ keep for name, q in effects.noise.items()}
    return keep @ exponential(f, np.diff(time)), effects._replace(constants=constants, bias=bias, noise=noise)


def _readings_at(time: Array, readings: HeightErrors | None) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Return the number of the reading that arrives at each boundary, −1 for none, and whether the loop is open."""
    at_boundary, overdue = np.full(len(time), -1), np.zeros(len(time), dtype=bool)
    if readings is None:
        return at_boundary, overdue
    last = np.searchsorted(readings.arrival, time + 1e-9, side="right") - 1
    new = np.diff(last, prepend=-1) > 0
    at_boundary[new] = last[new]
    overdue = (last < 0) | (time - readings.arrival[np.maximum(last, 0)] > OVERDUE_AFTER * readings.interval)
    return at_boundary, overdue


def _height_reading(shares: Shares, readings: HeightErrors, number: int) -> Reading:
    """Return the correction that replaces the held error by −δr_D − δh_ref."""
    gain = np.zeros((STATES, 1))
    gain[_HELD] = 1.0
    core = np.zeros((1, STATES))
    core[0, _HELD], core[0, 2] = -1.0, -1.0
    through = {
        f"{readings.label} scale": np.array([[-readings.height[number]]]),
        f"{readings.label} bias": -np.ones((1, 1)),
    }
    given = np.array([-readings.given[number]])
    return Reading(gain, core, *sensor_effects(shares, readings.label, through, given))
