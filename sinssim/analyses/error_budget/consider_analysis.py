"""The budget with a filter: consider analysis with the filter's own gains.

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

from sinssim.analyses.error_budget.error_dynamics import TrueMotion, gravity_input, noise_inputs, white_covariance
from sinssim.analyses.error_budget.propagation import NavigationStep, Propagation, Reading
from sinssim.analyses.error_budget.source_shares import (
    SensorAngle,
    SensorConstant,
    SensorGiven,
    SensorNoise,
    SensorProcess,
    Shares,
)
from sinssim.analyses.error_budget.unaided_budget import Marks, Snapshot, snapshot
from sinssim.data import Array, Measurements, NavSolution
from sinssim.estimation.error_dynamics import driving_noise
from sinssim.estimation.linearisation import (
    Linearisation,
    Observed,
    Prediction,
    Surroundings,
    linearise,
    observe,
    of_vehicle,
)
from sinssim.estimation.measurement_epochs import CheckedMeasurements, take_in
from sinssim.estimation.nominal_motion import rows_of
from sinssim.estimation.state_model import Block, ErrorModel
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.sensors.imu.encoder import encoders_of
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.measurement_kind import CORE, PHI, V


@dataclass(frozen=True)
class FilterRun:
    """What the filter of a scenario is told, and where it starts.

    Attributes:
        model: its error model.
        covariance: P₀, (n, n).
        measurements: readings without random errors, with the 1σ that the filter assumes.
        rate_hz: of its prediction.
        start: first edge of its samples.
    """

    model: ErrorModel
    covariance: Array
    measurements: Sequence[Measurements]
    rate_hz: float
    start: int


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
    own: Array


class Consider:
    """The consider analysis of one run."""

    def __init__(
        self,
        motion: TrueMotion,
        shares: Shares,
        series: tuple[Array, Array],
        told: FilterRun,
        blocks: Mapping[str, Array],
    ) -> None:
        """Prepare the epochs and the truth's model of the readings.

        Args:
            blocks: 1σ of the aiding sensors' true errors, by block.
        """
        self._motion, self._shares, self._series, self._told = motion, shares, series, told
        time = motion.ideal.time[told.start :]
        self._readings, self._epochs = take_in(told.measurements, told.model, time, told.rate_hz)
        self._begins = self._beginnings()
        self._angles = [one for one in shares.sensors if isinstance(one, SensorAngle)]
        self._encoders = encoders_of(motion.trajectory, None, motion.ideal.time)
        self._around = Surroundings(
            told.model, driving_noise(told.model), self._epochs, self._readings, motion.rates, motion.gravity,
            motion.trajectory.ellipsoid, encoders=self._encoders,
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
        found: set[int] = set()
        for readings in self._readings:
            if measurement_kind(readings.data.kind).mean_rate:
                begin = (readings.data.time - readings.interval)[readings.usable]
                found |= set(np.searchsorted(self._epochs.time, begin - 1e-5).tolist())
        return found

    @property
    def on_edge(self) -> Array:
        """Epochs of the filter at edges of samples, s."""
        return self._epochs.time[self._epochs.on_edge]

    @property
    def core(self) -> int:
        """Number of core states."""
        return self._told.model.size

    def run(
        self,
        propagation: Propagation,
        outputs: Array,
        progress: Callable[[float], None],
        marks: Marks | None = None,
    ) -> list[FilterSnapshot]:
        """Propagate all sources.

        Args:
            propagation: shares at the filter's start, with the core states of (1).
            outputs: instants of the results, epochs of the filter at or after its start, (E,) s.
            progress: called with the fraction done.
            marks: instants between which the changes are wanted, among `outputs`.

        Returns:
            The shares and the filter's covariance at those instants.
        """
        epochs = self._epochs.time
        self._marks = marks
        if marks is not None:
            marks.start([propagation], float(epochs[0]))
        wanted = set(np.searchsorted(epochs, outputs - 1e-7).tolist())
        main = _Branch(np.inf, self._told.covariance.copy(), propagation, np.zeros((self.core, 3)))
        branches: list[_Branch] = [main]
        found: list[FilterSnapshot] = []
        first = 0
        while first < len(epochs):
            progress(first / len(epochs))
            last = int(np.searchsorted(epochs, epochs[first] + _SEGMENT, side="right")) - 1
            last = max(last, first)
            line = self._linearise(first, last)
            within = {e for e in wanted | self._begins if first <= e <= last}
            events = sorted(set(line.observed) | within | {last})
            self._segment(line, events, wanted, branches, found)
            first = last + 1
        progress(1.0)
        return found

    def _linearise(self, first: int, last: int) -> Linearisation:
        time = self._motion.ideal.time
        begin, end = self._epochs.time[max(first - 1, 0)], self._epochs.time[last]
        rows = slice(max(int(np.searchsorted(time, begin)) - 2, 0), int(np.searchsorted(time, end)) + 3)
        s = rows_of(self._motion.state, rows)
        own = time[rows]
        nominal = NavSolution(
            own, s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb, np.zeros(len(own)), "quaternion"
        )
        zero = {b.name: np.zeros(b.size) for b in self._told.model.blocks}
        return linearise(self._around, first, last, nominal, ImuErrors(), zero)

    def _segment(
        self,
        line: Linearisation,
        events: list[int],
        wanted: set[int],
        branches: list[_Branch],
        found: list[FilterSnapshot],
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
            while len(branches) > 1 and branches[0].until <= now + _SAME:
                branches.pop(0)
            if event > begin:
                self._advance(phi, q, came, steps, number, branches)
                number += 1
            self._take(line.observed.get(event, ()), true, now, branches)
            if event in self._begins:
                for branch in branches:
                    branch.cross = np.zeros_like(branch.cross)
                    branch.propagation.reset(_GYRO_NOISE)
            if event in wanted:
                published = branches[0]
                seen = snapshot(published.propagation, self._shares, rounded=now > self._motion.ideal.time[0])
                self._turn_out(seen, now)
                found.append(FilterSnapshot(seen, published.covariance[:CORE, :CORE]))
                if self._marks is not None:
                    self._marks.pass_by(published.propagation, [branch.propagation for branch in branches], now)

    def _turn_out(self, seen: Snapshot, now: float) -> None:
        """Add the errors of the angles to the attitude, which is that of the vehicle."""
        for one in self._angles:
            phi = one.error.phi(np.array([now]))[0]
            if one.error.what == "noise":
                turned = phi * one.error.size
                seen.covariances[one.source.name][PHI, PHI] += turned @ turned.T
            else:
                seen.sensitivity[PHI, self._shares.parts[one.source.name][0]] += phi

    def _steps(self, time: Array) -> dict[str, Array]:
        """Return noise and effects of constant errors over the steps between events."""
        if len(time) < 2:
            return {}
        shares, n = self._shares, self.core
        nominal = self._motion.nominal(time)
        f, interval, inputs = self._motion.dynamics(nominal), np.diff(time), noise_inputs(nominal)
        effects = self._motion.responses(time, shares.kernel_columns, *self._series)
        constants = np.zeros((len(interval), n, shares.count))
        constants[:, :CORE, : shares.inertial] = effects.core[:, :, : shares.inertial]
        bias = np.zeros((len(interval), n, 6))
        bias[:, :CORE] = effects.core[:, :, shares.inertial :]
        distance = self._motion.distance(time)
        found = {"interval": interval, "distance": distance, "constants": constants, "bias": bias, "mean": effects.mean}
        for noise in shares.noises:
            if noise.process is None:
                q = np.zeros((len(interval), n, n))
                q[:, :CORE, :CORE] = white_covariance(
                    f, inputs[noise.triad, noise.what] @ (noise.density * noise.mix), interval
                )
                found[noise.source.name] = q
        return found

    def _combined(self, line: Linearisation, begin: int, end: int) -> tuple[Array, Array, Array]:
        """Return Φ, Q and the increase of `cross` over some epochs of a segment."""
        n, variance = self.core, self._told.model.gyro_noise**2
        phi, q, came = np.eye(n), np.zeros((n, n)), np.zeros((n, 3))
        for k in range(begin, end):
            if line.interval[k]:
                one = line.phi[k]
                phi, q = one @ phi, one @ q @ one.T + line.q[k]
                if self._begins:  # noise at mid-interval, as the filter has it
                    half_way = -0.5 * (one[:, PHI] + np.eye(n)[:, PHI]) @ line.c_nb[k]
                    came = one @ came + half_way * (variance * line.interval[k])
        return phi, q, came

    def _advance(
        self, phi: Array, q: Array, came: Array, steps: Mapping[str, Array], k: int, branches: Sequence[_Branch]
    ) -> None:
        core = phi.copy()
        core[:CORE, CORE:] *= -1.0  # (1)
        noise = {n.source.name: steps[n.source.name][k] for n in self._shares.noises if n.process is None}
        bias = steps["bias"][k]
        both, length = (bias[:, :3], bias[:, 3:]), float(steps["interval"][k])
        fields, distance = gravity_input(core, length), float(steps["distance"][k])
        step = NavigationStep(core, steps["constants"][k], noise, both, length, fields, distance)
        for branch in branches:
            branch.covariance = phi @ branch.covariance @ phi.T + q
            branch.cross = phi @ branch.cross + came
            branch.propagation.step(step)
        self._mean_errors = steps["mean"][k]

    def _take(
        self,
        observed: Sequence[Observed],
        true: Mapping[tuple[int, int], Array],
        now: float,
        branches: list[_Branch],
    ) -> None:
        """Correct by the readings of an event, in the order of their arrival."""
        for one in observed:
            data = self._readings[one.sensor].data
            arrival = float(data.arrival[one.row])
            if arrival > now + _SAME:
                k = next(k for k, branch in enumerate(branches) if branch.until > arrival - _SAME)
                if branches[k].until > arrival + _SAME:
                    branches.insert(k, branches[k].fork(arrival))
            for branch in branches:
                if arrival < branch.until - _SAME or branch.until == np.inf:
                    self._correct(branch, one, true[one.sensor, one.row], data)

    def _correct(self, branch: _Branch, one: Observed, h_true: Array, data: Measurements) -> None:
        p, h = branch.covariance, one.h
        seen = p @ h.T
        if one.interval:  # the reading shares the gyros' noise with the state
            seen = seen + branch.cross / one.interval
            both = h @ branch.cross / one.interval
            innovation = h @ seen + both.T + np.diag(one.variance)
        else:
            innovation = h @ seen + np.diag(one.variance)
        gain = np.asarray(np.linalg.solve(innovation, seen.T).T, dtype=np.float64)
        if one.interval:
            branch.covariance = p - gain @ seen.T
        else:
            kept = np.eye(len(p)) - gain @ h
            branch.covariance = kept @ p @ kept.T + (gain * one.variance) @ gain.T
        branch.cross = branch.cross - gain @ (h @ branch.cross)
        signed = gain.copy()
        signed[:CORE] *= -1.0  # (1)
        branch.propagation.read(self._reading(signed, one, h_true, data))

    def _reading(self, gain: Array, one: Observed, h_true: Array, data: Measurements) -> Reading:
        """Return the true dependence of the innovation on all errors."""
        shares, slices = self._shares, self._truth.slices
        core = -one.h
        core[:, :CORE] = h_true[:, :CORE]
        gyro = h_true[:, slices["gyro bias"]]
        constants = np.zeros((len(one.h), shares.count))
        constants[:, : shares.inertial] = gyro @ self._mean_errors[:3, : shares.inertial]
        processes: dict[str, Array] = {}
        noise: dict[str, Array] = {}
        c_nb = self._c_nb[one.sensor, one.row]
        for own in shares.noises:
            if own.source.name == _GYRO_NOISE:
                if one.interval:  # the mean of the noise since the previous reading
                    processes[own.source.name] = gyro @ own.mix / one.interval
            elif own.process is not None and own.triad == 0 and gyro.any():
                processes[own.source.name] = gyro @ own.mix
            elif own.what == "white" and own.process is None and one.interval and own.triad == 0:
                noise[own.source.name] = np.sum((gyro @ own.mix) ** 2, axis=1) * own.size**2 / one.interval
            elif own.what == "quantum" and one.interval and own.triad == 0:
                rounding = own.size**2 / (6.0 * one.interval**2)
                noise[own.source.name] = np.full(len(one.h), rounding * np.mean(np.sum(own.mix**2, axis=1)))
            elif own.what == "quantum":
                through = h_true[:, PHI if own.triad == 0 else V] @ c_nb @ own.mix
                noise[own.source.name] = np.sum(through**2, axis=1) * own.size**2 / 12.0
        for sensor in shares.sensors:
            if isinstance(sensor, SensorConstant):
                first = shares.of_block[sensor.block]
                constants[:, first : first + len(sensor.sigma)] = h_true[:, slices[sensor.block]]
            elif isinstance(sensor, SensorProcess):
                if (through := h_true[:, slices[sensor.block]]).any():
                    processes[sensor.source.name] = through
            elif isinstance(sensor, SensorNoise):
                if sensor.label == data.label:
                    noise[sensor.source.name] = sensor.sigma**2
            elif isinstance(sensor, SensorGiven) and sensor.label == data.label:
                constants[:, shares.of_label[sensor.label]] = one.residual
            elif isinstance(sensor, SensorAngle):
                off = h_true[:, PHI] @ sensor.error.phi(data.time[one.row : one.row + 1])[0]
                if sensor.error.what == "noise":
                    noise[sensor.source.name] = np.sum((off * sensor.error.size) ** 2, axis=1)
                else:
                    constants[:, shares.parts[sensor.source.name][0]] = off
        return Reading(gain, core, constants, processes, noise)

    def _true_readings(self, line: Linearisation) -> dict[tuple[int, int], Array]:
        """Return H of the truth's model for the readings of a segment, by sensor and row."""
        from sinssim import rotation

        found: dict[tuple[int, int], Array] = {}
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
            found |= {(sensor, row): h[k] for k, row in enumerate(rows.tolist())}
            c_nb = rotation.dcm_from_quaternion(state.q_nb)
            self._c_nb |= {(sensor, row): c_nb[k] for k, row in enumerate(rows.tolist())}
        return found

    def _rate(self, readings: CheckedMeasurements, rows: NDArray[np.intp], time: Array) -> Array:
        if measurement_kind(readings.data.kind).mean_rate:
            return self._motion.rates.mean(time - readings.interval[rows], time, ImuErrors())
        return self._motion.rates.at(time, ImuErrors())
