"""One pass of the filter through the data: segments of inertial navigation, and the epochs in each; see `estimate`.

Estimates, covariances and innovations are recorded and assembled into the result.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, NavSolution, NavState, rows_of, solution_of
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.errors import InputError, RunError
from sinssim.estimation import LINEAR
from sinssim.estimation.error_dynamics import calibrated, turn_of_axes
from sinssim.estimation.filter_result import Divergence, History, corrected
from sinssim.estimation.innovation_gate import WITHDRAWN, InnovationGate
from sinssim.estimation.kalman_filter import Branch, Diverged, ErrorFilter, check_covariance
from sinssim.estimation.linearisation import Linearisation, Observed, Surroundings, linearise
from sinssim.estimation.measurement_epochs import Branches, Epochs
from sinssim.estimation.state_model import INERTIAL, NAVIGATION, ErrorModel
from sinssim.estimation.unscented_cubature_ensemble import by_group, filter_of
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.sensors.imu.compensation import compensate_checked
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.measurement_kind import CORE, PHI
from sinssim.strapdown.navigate import Segments


@dataclass
class HistoryRow:
    """The filter from one stored row to the next; see `History`."""

    transition: Array
    noise: Array
    information: Array
    decay: Array
    fed_back: Array

    @classmethod
    def begin(cls, n: int) -> HistoryRow:
        """Return the row before the first step from the last one."""
        return cls(np.eye(n), np.zeros((n, n)), np.zeros((n, n)), np.eye(n), np.zeros(n))

    def predict(self, phi: Array, q: Array) -> None:
        """Advance by Φ and Q, (n, n)."""
        self.transition, self.decay, self.fed_back = phi @ self.transition, phi @ self.decay, phi @ self.fed_back
        self.noise = phi @ self.noise @ phi.T + q


class _Rows:
    """Arrays of one shape, gathered one by one in one block of memory, whose number is roughly expected."""

    def __init__(self, shape: tuple[int, ...], expected: int) -> None:
        self._all, self.count = np.empty((expected, *shape)), 0

    def append(self, row: Array) -> None:
        """Add one array."""
        if self.count == len(self._all):
            more = np.empty((1 + self.count // 8, *self._all.shape[1:]))
            self._all = np.concatenate([self._all, more])
        self._all[self.count] = row
        self.count += 1

    def first(self, count: int) -> Array:
        """Return the first `count` arrays, (count, …)."""
        return self._all[:count]


class Record:
    """The record of the estimate at all epochs, and of the covariance, with a history on request, at some rows."""

    def __init__(
        self, model: ErrorModel, epochs: Epochs, ellipsoid: Ellipsoid, expected: int, *, history: bool
    ) -> None:
        count, n = len(epochs.time), model.size
        self._model, self._epochs, self._ellipsoid = model, epochs, ellipsoid
        self._sensors, self._variance = np.zeros((count, n - CORE)), np.zeros((count, n))
        self._stretch: list[tuple[Array, Array]] = []  # estimate and variances at the epochs of the current segment
        self._solution = NavState(*(np.empty((count, *shape)) for shape in ((), (), (), (3,), (4,))))
        self._rows: list[int] = []
        self._expected = expected if history else 0
        self._covariance = _Rows((n, n), expected)
        self._complete = self._covariance  # with all readings; it differs only where a late one is pending
        vectors, matrices = ("state", "fed_back", "compensated"), ("transition", "noise", "information", "decay")
        self._history = {name: _Rows((n,), self._expected) for name in vectors}
        self._history |= {name: _Rows((n, n), self._expected) for name in matrices}
        self._navigation: list[NavState] = []

    def note(self, x: Array, covariance: Array) -> None:
        """Record the estimate at the next epoch of the segment; the arrays must not change afterwards."""
        self._stretch.append((x, covariance.diagonal()))

    def keep(self, epoch: int, covariance: Array, main: ErrorFilter, row: HistoryRow | None) -> None:
        """Keep the covariance at an epoch, and in a history the estimate from all readings, late ones included."""
        if row is not None:
            if self._complete is self._covariance and main.covariance is not covariance:
                self._complete = _Rows(covariance.shape, self._expected)
                for earlier in self._covariance.first(len(self._rows)):
                    self._complete.append(earlier)
            if self._complete is not self._covariance:
                self._complete.append(main.covariance)
            for name, value in (*vars(row).items(), ("state", main.x)):
                self._history[name].append(value)
        self._rows.append(epoch)
        self._covariance.append(covariance)

    def end_stretch(
        self,
        first: int,
        navigation: NavState,
        compensated: tuple[Array, Array],
        fed_back: Array,
        corrected_end: NavState,
        turn: Array | None = None,
    ) -> None:
        """Record the solution of a segment.

        `compensated` are the values of the parameters in it and after it, and `fed_back` the errors fed back at its
        end, (n,) each.
        `turn` is the matrix into the axes there, (n, n); None if they are the same.
        """
        count = len(navigation.latitude)
        part = slice(first, first + count)
        errors = np.array([x for x, _ in self._stretch])
        self._variance[part] = [variance for _, variance in self._stretch]
        self._stretch = []
        for name, value in vars(corrected(navigation, errors[:, :CORE], self._ellipsoid, self._model.axes)).items():
            getattr(self._solution, name)[part] = value
        within, after = compensated
        self._sensors[part] = errors[:, CORE:] + within[CORE:]
        history = self._history
        for row in range(len(self._navigation), history["state"].count):
            k = self._rows[row] - first
            if k < count - 1:
                self._navigation.append(rows_of(navigation, np.array([k])))  # a copy: a slice would keep all rows
                history["compensated"].append(within)
            else:
                self._navigation.append(corrected_end)
                history["compensated"].append(after)
                history["fed_back"].first(row + 1)[row] += fed_back
                history["state"].first(row + 1)[row] -= fed_back
        if turn is not None and self._rows and self._rows[-1] == first + count - 1:
            self._turn_last(turn)

    def _turn_last(self, turn: Array) -> None:
        """Refer the last row to other axes."""
        for rows in {id(r): r for r in (self._covariance, self._complete)}.values():
            last = rows.first(rows.count)[-1]
            last[...] = turn @ last @ turn.T
        if not self._history["state"].count:
            return
        for name in ("state", "fed_back", "transition", "decay"):
            last = self._history[name].first(self._history[name].count)[-1]
            last[...] = turn @ last
        last = self._history["noise"].first(self._history["noise"].count)[-1]
        last[...] = turn @ last @ turn.T

    def solution(self, count: int, algorithm: str) -> NavSolution:
        """Return the solution at the first `count` epochs."""
        return solution_of(self._epochs.time[:count], rows_of(self._solution, slice(0, count)), algorithm)

    def parameters(self, count: int) -> dict[str, Array]:
        """Return the estimated parameters at the first `count` epochs, by block."""
        blocks = self._model.blocks[len(NAVIGATION) :]
        at = ((block.name, self._model.slices[block.name]) for block in blocks)
        return {name: self._sensors[:count, part.start - CORE : part.stop - CORE] for name, part in at}

    def sigma(self, count: int) -> Array:
        """Return 1σ of every state at the first `count` epochs; it overwrites the variances, so call it once."""
        return np.asarray(np.sqrt(self._variance[:count], out=self._variance[:count]))

    def rows(self, count: int) -> tuple[NDArray[np.intp], Array]:
        """Return which of the first `count` epochs have a stored covariance, and the covariances."""
        stored = np.array([row for row in self._rows if row < count], dtype=np.intp)
        return stored, self._covariance.first(len(stored))

    def history(self) -> History:
        """Return the history of the stored rows."""
        count = len(self._navigation)
        names = vars(self._navigation[0])
        return History(
            time=self._epochs.time[self._rows[:count]],
            on_edge=self._epochs.on_edge[self._rows[:count]],
            covariance=self._complete.first(count),
            navigation=NavState(*(np.concatenate([getattr(n, name) for n in self._navigation]) for name in names)),
            **{name: rows.first(count) for name, rows in self._history.items()},
        )


class Witness(Protocol):
    """What follows a pass of the filter, segment by segment."""

    def begin(self, around: Surroundings, covariance: Array) -> None:
        """Take the data that stay the same, and the covariance at the start, (n, n)."""
        ...

    def segment(self, line: Linearisation, count: int, fed: Array, turn: Array | None) -> None:
        """Take a linearised segment, of which the first `count` epochs were processed; the errors that were fed back at
        its end, (n,), and the matrix into the axes there, (n, n), None if they are the same."""
        ...


_WITNESS: ContextVar[Witness | None] = ContextVar("witness", default=None)


@contextmanager
def followed(by: Witness) -> Iterator[None]:
    """Have the passes of the filter inside the block followed."""
    token = _WITNESS.set(by)
    try:
        yield
    finally:
        _WITNESS.reset(token)


_SHORTEST, _OPEN = 1.0, 64.0
"""Length of the first segment of the closed loop and of the next after a large update; segments of the open loop, s."""


def _unused(errors: Array) -> Array:
    """Stand for the function that refers errors of any size, which a covariance has no use for."""
    return errors


_NO_NORTH = "relative to north within 0.1° of a pole, where north depends on the position itself"
"""Why a reading is skipped near a pole."""


class Loop:
    """One pass of the filter through the data."""

    def __init__(
        self, around: Surroundings, engine: Segments, covariance: Array, gate: float | None, monitor_s: float,
        history: bool, row_s: float, kind: str = "error-state", seed: int = 0,
    ) -> None:  # fmt: skip
        self.around, self.engine = around, engine
        self._invariant, self._by_points = kind == "invariant", kind not in LINEAR
        zero_rate = {s for s, r in enumerate(around.readings) if measurement_kind(r.data.kind).mean_rate}
        self.branches = Branches(Branch.start(filter_of(kind, covariance, seed), zero_rate))
        self.filter = self.branches.main.filter
        of_gnss = [measurement_kind(readings.data.kind).on_gnss_clock for readings in around.readings]
        self.gates = [InnovationGate(readings, gate, monitor_s if monitored else 0.0)
                      for readings, monitored in zip(around.readings, of_gnss, strict=True)]  # fmt: skip
        self._fixes = [gate for gate, monitored in zip(self.gates, of_gnss, strict=True) if monitored]
        rows = self._expected_rows(row_s)
        self.record = Record(around.model, around.epochs, around.ellipsoid, rows, history=history)
        self.done = 0  # epochs that are
        self._taken = ""  # the last reading that was processed
        self._compensated = np.zeros(around.model.size)
        self._largest = around.model.largest
        self._history, self._row_s, self._row_at = history, row_s, -np.inf
        self._row = HistoryRow.begin(around.model.size)
        self._restart = {s: self._begins(s) for s in zero_rate}
        self._witness = _WITNESS.get()
        if self._witness is not None:
            self._witness.begin(around, covariance)
        self._varying = np.flatnonzero((covariance.diagonal() > 0.0) | (around.density > 0.0))

    def _expected_rows(self, row_s: float) -> int:
        """Return about how many rows will be stored."""
        epochs = self.around.epochs
        due = epochs.second.copy()
        for readings in self.around.readings:
            due[readings.epoch[readings.usable]] = True
        rows = int(np.count_nonzero(due))
        if row_s:
            rows = min(rows, int(float(epochs.time[-1] - epochs.time[0]) / row_s) + 1)
        return rows + 1

    def _begins(self, sensor: int) -> set[int]:
        """Return the epochs at which an interval of a zero-rate sensor begins."""
        readings = self.around.readings[sensor]
        begin = readings.data.time[readings.usable] - readings.interval[readings.usable]
        return set(np.searchsorted(self.around.epochs.time, begin - 1e-5).tolist())

    def run(self, state: NavState, feedback_s: float | None) -> Divergence | None:
        """Go through all epochs, in the closed loop in segments of at most `feedback_s`; return a divergence."""
        epochs = self.around.epochs
        ends = np.flatnonzero(epochs.on_edge)
        length, edge = _SHORTEST if feedback_s else _OPEN, 0
        try:
            while self.done < len(epochs.time):
                now = epochs.time[max(self.done - 1, 0)]
                reach = np.searchsorted(epochs.time[ends], now + length + 1e-7, side="right") - 1
                last = int(ends[max(reach, int(np.searchsorted(ends, max(self.done, 1))))])
                state, as_far = self._stretch(last, edge, state, closed=feedback_s is not None)
                edge = int(epochs.edge[self.done - 1])
                if feedback_s is not None:
                    length = min(2.0 * length, feedback_s) if as_far else min(_SHORTEST, feedback_s)
        except Diverged as diverged:
            return diverged.divergence
        except RunError as error:
            return Divergence(float(now), self._taken, f"inertial navigation failed: {str(error).rstrip('.')}")
        return None

    def _stretch(self, last: int, edge: int, state: NavState, *, closed: bool) -> tuple[NavState, bool]:
        """Process the epochs up to `last`, starting from a state at an edge.

        Returns the state at the end, after feedback, and whether the end is `last`: the closed loop ends a segment
        early if its errors become too large.
        """
        around, first = self.around, self.done
        calibration, parameters = self._calibration(), self._parameters()
        final = int(around.epochs.edge[last])
        _, samples = self.engine.samples(edge, final)
        try:
            nominal = self.engine.navigate(edge, final, state, compensate_checked(samples, calibration))
        except InputError as error:  # the data are valid; the feedback is not
            now = float(around.epochs.time[max(first - 1, 0)])
            why = f"navigation is impossible after the feedback: {str(error).rstrip('.')}"
            raise Diverged(now, self._taken, why) from error
        line = linearise(around, first, last, nominal, calibration, parameters)
        for sensor, row in line.skipped:
            self.gates[sensor].skip(row, _NO_NORTH)
        try:
            self._through(line, last, closed)
        except Diverged:
            if self.done > first:
                self._finish(line, first, feed=False)
            raise
        return self._finish(line, first, feed=closed), self.done == last + 1

    def _through(self, line: Linearisation, last: int, closed: bool) -> None:
        """Filter the epochs of a segment, up to `last` or until its errors become too large."""
        epochs, small = self.around.epochs, True
        part = slice(line.first, last + 1)
        rows = zip(epochs.time[part].tolist(), epochs.second[part].tolist(), line.interval.tolist(), strict=True)
        for k, (now, second, interval) in enumerate(rows):
            epoch = line.first + k
            if interval:
                self._predict(line, k, interval)
            observed = line.observed.get(epoch, ())
            for reading in observed:
                self._update(reading, epoch)
            known = self.branches.known(now).filter
            self.record.note(known.x, known.covariance)
            self.done = epoch + 1
            if closed and observed and (self._invariant or np.any(np.abs(self.filter.x) > self._largest)):
                small = False
            ends = epoch == last or (not small and bool(epochs.on_edge[epoch]))
            due = observed or ends or second
            if due and (now - self._row_at >= self._row_s - 1e-6 or epoch == len(epochs.time) - 1):
                self._keep(epoch, known.covariance)
            if ends:
                return

    def _finish(self, line: Linearisation, first: int, *, feed: bool) -> NavState:
        """Record the results of a segment, and return the state at its end after feedback."""
        around, count = self.around, self.done - first
        fed = np.where(around.model.fed_back, self.filter.x, 0.0) if feed else np.zeros(around.model.size)
        end, turn = rows_of(line.state, slice(count - 1, count)), None
        if feed:
            subtracted = fed
            if self._invariant:
                subtracted, turn = by_group(fed)
            nominal, end = end, corrected(end, subtracted[None], around.ellipsoid, around.model.axes)
            if around.model.axes == "transported":
                turn = turn_of_axes(nominal, end, len(fed)) @ (np.eye(len(fed)) if turn is None else turn)
        before, (self._compensated, within) = self._compensated, calibrated(around.model, self._compensated, fed)
        if within is not None:
            turn = within if turn is None else turn @ within
        if self._witness is not None:
            self._witness.segment(line, count, fed, turn)
        known = before, self._compensated
        self.record.end_stretch(first, rows_of(line.state, slice(0, count)), known, fed, end, turn)
        if feed:
            refer = _unused
            if self._by_points:
                refer = partial(line.motion().referred, count - 1, fed=fed, after=end, within=within)
            for branch in self.branches.every():
                branch.feed(fed, turn, refer)
        inside = self._row_at < around.epochs.time[self.done - 1]  # of the interval between two rows
        if inside:
            self._row.fed_back = self._row.fed_back + fed
        if turn is not None and inside:
            self._row.predict(turn, np.zeros_like(turn))  # into the new axes
        return NavState(*(part[0] for part in vars(end).values()))

    def _parameters(self) -> dict[str, Array]:
        model = self.around.model
        return {b.name: self._compensated[model.slices[b.name]] for b in model.blocks[len(NAVIGATION) :]}

    def _calibration(self) -> ImuErrors:
        """Return the compensated errors of the inertial sensors."""
        parameters = self._parameters()

        def triad(name: str) -> TriadErrors:
            terms = (
                (INERTIAL[b], value) for b, value in parameters.items() if b in INERTIAL and b.startswith(f"{name} ")
            )
            return TriadErrors(**dict[str, Any]({term.field: term.shaped(value) for term, value in terms}))

        return ImuErrors(triad("gyro"), triad("accelerometer"))

    def _predict(self, line: Linearisation, k: int, interval: float) -> None:
        phi, q = line.phi[k], line.q[k]
        if self._history:
            self._row.predict(phi, q)
        if not self._restart and not self.branches.waiting:  # by far the most frequent case
            self.filter.predict_along(line, k)
            return
        came = {}
        for sensor, begins in self._restart.items():
            if line.first + k - 1 in begins:
                for branch in self.branches.every():
                    branch.cross[sensor] = np.zeros((len(phi), 3))
            # φ̇ = … − C w: noise at mid-interval
            at_start = phi[:, PHI] if line.turn is None else phi[:, PHI] @ line.turn[k]
            half_way = -0.5 * (at_start + np.eye(len(phi))[:, PHI]) @ line.c_nb[k]
            density = self.around.model.gyro_noise**2 * np.eye(3)
            if line.added is not None:
                density = density + line.added[k, 0] @ line.added[k, 0].T
            came[sensor] = half_way @ (density * interval)
        for branch in self.branches.every():
            branch.predict(line, k, came)

    def _update(self, reading: Observed, epoch: int) -> None:
        readings = self.around.readings[reading.sensor]
        data, now = readings.data, float(self.around.epochs.time[epoch])
        interval, gate, main = reading.interval, self.gates[reading.sensor], self.branches.main
        if self._by_points:  # points have no H
            reading = reading._replace(still=None)
        if now > gate.withdrawn:
            gate.skip(reading.row, WITHDRAWN)
            return
        r = readings.covariance(reading.row, reading.variance)
        innovation = main.innovation(reading, r, interval)
        name = f"{data.label} {reading.row} (valid at {data.time[reading.row]:.3f} s)"
        if not np.isfinite(innovation.nis):
            raise Diverged(now, name, "the innovation is not finite")
        arrival = float(data.arrival[reading.row])
        if arrival > now + 1e-6:
            self.branches.wait(arrival)
        for branch in self.branches.holding(arrival):  # each branch by its own estimate
            if gate.admits(branch.innovation(reading, r, interval)):
                branch.take(reading, r, interval)
        if not gate.passes(reading.row, innovation):
            return
        h = main.filter.linearised(reading).h
        moved = main.take(reading, r, interval)
        self._taken = name
        if self._history:
            seen = h @ self._row.transition
            self._row.information += seen.T @ (
                seen / reading.variance[:, None] if data.correlation is None else np.linalg.solve(r, seen)
            )
            self._row.decay = self._row.decay - self.filter.gain @ (h @ self._row.decay)
            if moved is not None:
                self._row.predict(moved, np.zeros_like(moved))
        check_covariance(self.filter.covariance, self._varying, now, name)
        if gate.alarms(reading.row, innovation):
            for fixes in self._fixes:
                fixes.withdrawn = now

    def _keep(self, epoch: int, known: Array) -> None:
        self._row_at = float(self.around.epochs.time[epoch])
        self.record.keep(epoch, known, self.filter, self._row if self._history else None)
        self._row = HistoryRow.begin(self.around.model.size) if self._history else self._row
