"""Computes an aided solution from increments and aiding measurements, with the filter's diagnostics: `estimate`.

Inertial navigation runs ahead over a segment of time. F, Φ, Q, the residuals and H are linearised about it and computed
for the whole segment at once. The filter then processes the segment epoch by epoch. In the closed loop the estimated
errors are fed back into the engine's state and the compensator at the end of the segment, and the next segment starts
from there. A segment ends after `feedback_s`, or earlier as soon as the estimated errors are no longer small; the rest
of it is discarded and navigated again. To first order it makes no difference whether a small error is fed back or
carried in the filter. Segments of one update are the closed loop of textbooks, a single segment is the open loop.

Every reading is processed at its instant of validity, in order, however late it arrived. The returned solution is the
one known at each instant: it uses exactly the readings that had arrived by then.

A zero-rate reading is compared with the mean rate of the gyros since the previous reading. The noise of the gyros is in
that mean and in the attitude, and the update uses the covariance of the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from sinssim.arguments import doubles, number
from sinssim.data import Array, ImuData, Measurements, NavState
from sinssim.earth.models import ellipsoid_by_name
from sinssim.errors import InputError, RunError, check_name, shortened
from sinssim.estimation.branch import Branches
from sinssim.estimation.checks.divergence_checks import Diverged, check_covariance, contradiction, remarks
from sinssim.estimation.dynamics import CORE, PHI, driving_noise
from sinssim.estimation.intake import CheckedMeasurements, take_in
from sinssim.estimation.linearisation import Linearisation, Observed, Surroundings, linearise
from sinssim.estimation.measurements.kind import measurement_kind
from sinssim.estimation.model import NAVIGATION, ErrorModel
from sinssim.estimation.nominal import MeanGyroRates, at, rows_of, solution_of
from sinssim.estimation.record import HistoryRow, InnovationGate, Record
from sinssim.estimation.result import Divergence, Estimate, corrected
from sinssim.estimation.smoother import smooth as smoothed
from sinssim.sensors.imu.compensation import compensate_checked
from sinssim.sensors.imu.errors import ImuErrors, TriadErrors
from sinssim.strapdown import navigate
from sinssim.strapdown.segments import Segments
from sinssim.system.memory import give_back_memory

_SHORTEST, _OPEN = 1.0, 64.0
"""Length of the first segment of the closed loop and of the next after a large update; segments of the open loop, s."""

_SMALL = np.repeat((100.0, 5.0, 1e-3), 3)
"""Largest errors of position [m], velocity [m/s] and attitude [rad] carried in the filter over a segment: their
second-order effects are below 2 mm, 5 µm/s² and 0.1″."""


# Long: the public function checks and prepares its many options before the loop.
def estimate(
    imu: ImuData,
    initial: NavState,
    measurements: Sequence[Measurements],
    model: ErrorModel,
    *,
    covariance: Array | None = None,
    loop: str = "closed",
    rate_hz: float = 10.0,
    gate: float | None = 1e-4,
    feedback_s: float = 64.0,
    smooth: bool = False,
    history: bool = False,
    row_s: float = 0.0,
    algorithm: str = "quaternion",
    gravity: str = "normal",
    ellipsoid: str = "wgs84",
) -> Estimate:
    """Estimate the errors of inertial navigation from aiding measurements, and correct it.

    Args:
        imu: increments, N intervals.
        initial: state at imu.time[0], with the errors that the model describes.
        measurements: one entry for each sensor and kind of measurement; there may be none.
        model: the error model.
        covariance: P₀ of the first m states, (m, m), for example from `sinssim.alignment.initial_covariance`; it
            replaces the diagonal of the model's sigma.
        loop: "closed" feeds errors back into engine and compensator, "open" only corrects the output.
        rate_hz: rate at which the covariance is predicted.
        gate: probability that the χ² test of the innovation rejects a correct reading; None accepts all.
        feedback_s: longest time between feedbacks in the closed loop, s.
        smooth: whether to smooth as well.
        history: whether to keep the history that observability is computed from.
        row_s: least time between stored rows of the history and covariances, s; by default there is one at every
            reading and every second. Each row holds six n × n matrices.
        algorithm: attitude algorithm, one that advances sample by sample.
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: name of the reference ellipsoid.

    Returns:
        The estimate; if the filter diverges, it ends there.

    Raises:
        InputError: the data, the measurements or the model cannot be used, or a name is unknown.
    """
    check_name("loop", loop, ("closed", "open"))
    if not isinstance(model, ErrorModel):
        raise InputError(f"model must be an ErrorModel, as error_model() makes one, not {shortened(repr(model))}.")
    gate = None if gate is None else number("gate", gate, "a probability")
    feedback_s = number("feedback_s", feedback_s, "s") if feedback_s != np.inf else np.inf
    if gate is not None and not 0.0 < gate < 1.0:
        raise InputError(f"gate = {gate} must be a probability between 0 and 1, or None for no gate.")
    if not feedback_s > 0.0:
        raise InputError(f"feedback_s = {feedback_s} s must be positive.")
    engine = Segments(imu, algorithm=algorithm, gravity=gravity, ellipsoid=ellipsoid)
    unaided = partial(navigate, imu, initial, algorithm=algorithm, gravity=gravity, ellipsoid=ellipsoid)
    failure = []
    try:
        unaided()
    except RunError as error:
        failure = [f"The pure inertial solution failed: {error}"]
    readings, epochs = take_in(measurements, model, imu.time, rate_hz)
    give_back_memory()  # what was in between is as large as a quarter of the filter's record
    around = Surroundings(
        model, driving_noise(model), epochs, readings, MeanGyroRates(imu), gravity, ellipsoid_by_name(ellipsoid)
    )
    loops = _Loop(around, engine, _initial_covariance(model, covariance), gate, smooth or history, row_s)
    divergence = loops.run(initial, feedback_s if loop == "closed" else None)

    record, count = loops.record, loops.done
    innovations = tuple(g.innovations() for g in loops.gates)
    rows, covariances = record.rows(count)
    kept = record.history() if count and (smooth or history) else None
    time, solution = epochs.time[:count], record.solution(count, algorithm)
    if not failure and not any(i.accepted.any() for i in innovations):
        # bit for bit, unlike navigation by segments
        inertial = unaided()
        edge = epochs.edge[:count]
        fraction = (time - inertial.time[edge]) / np.diff(inertial.time)[np.minimum(edge, len(imu) - 1)]
        fraction[epochs.on_edge[:count]] = 0.0
        solution = solution_of(time, at(inertial, edge, fraction, around.ellipsoid), algorithm)
    return Estimate(
        model=model,
        time=time,
        solution=solution,
        parameters=record.parameters(count),
        sigma=record.sigma(count),
        rows=rows,
        covariance=covariances,
        innovations=innovations,
        smoothed=smoothed(model, kept, around.ellipsoid, algorithm) if kept is not None and smooth else None,
        history=kept if history else None,
        divergence=divergence or contradiction(innovations),
        remarks=(*failure, *_untold(model), *remarks(innovations, [_too_late(r, imu) for r in readings])),
        unaided=unaided,
    )


def _untold(model: ErrorModel) -> list[str]:
    if not model.untold:
        return []
    return [f"The inertial sensors have errors that no state of the filter describes: {', '.join(model.untold)}."]


def _too_late(readings: CheckedMeasurements, imu: ImuData) -> int:
    """Return the number of usable readings of a sensor that arrive after the end of the data."""
    return int(np.count_nonzero(readings.data.arrival[readings.usable] > imu.time[-1] + 1e-6))


def _initial_covariance(model: ErrorModel, covariance: Array | None) -> Array:
    p = np.diag(model.sigma**2)
    if covariance is None:
        return p
    given = doubles("covariance", covariance)
    count = len(given)
    if given.shape != (count, count) or not CORE <= count <= model.size:
        raise InputError(
            f"the initial covariance has the shape {given.shape}; it must be that of the first {CORE} to {model.size} "
            "states."
        )
    scale = np.sqrt(np.abs(given.diagonal()))
    scale[~(scale > 0.0)] = 1.0
    scaled = given / np.outer(scale, scale)
    if not (
        np.all(np.isfinite(scaled))
        and np.abs(scaled - scaled.T).max() < 1e-9
        and np.linalg.eigvalsh(scaled).min() > -1e-9
    ):
        raise InputError("the initial covariance must be finite, symmetric and positive semi-definite.")
    p[:count, :count] = given
    return p


class _Loop:
    """One pass of the filter through the data."""

    def __init__(
        self,
        around: Surroundings,
        engine: Segments,
        covariance: Array,
        gate: float | None,
        history: bool,
        row_s: float,
    ) -> None:
        self.around, self.engine = around, engine
        zero_rate = {s for s, r in enumerate(around.readings) if measurement_kind(r.data.kind).mean_rate}
        self.branches = Branches(covariance, zero_rate)
        self.filter = self.branches.main.filter
        self.gates = [InnovationGate(readings, gate) for readings in around.readings]
        rows = self._expected_rows(row_s)
        self.record = Record(around.model, around.epochs, around.ellipsoid, rows, history=history)
        self.done = 0  # epochs that are
        self._taken = ""  # the last reading that was processed
        self._compensated = np.zeros(around.model.size)
        self._history, self._row_s, self._row_at = history, row_s, -np.inf
        self._begin_row(around.model.size)
        self._restart = {s: self._begins(s) for s in zero_rate}
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

    def _begin_row(self, n: int) -> None:
        """Reset the sums over the interval from this row to the next."""
        self._transition, self._decay, self._fed = np.eye(n), np.eye(n), np.zeros(n)
        self._noise, self._information = np.zeros((n, n)), np.zeros((n, n))

    def _begins(self, sensor: int) -> set[int]:
        """Return the epochs at which an interval of a zero-rate sensor begins."""
        readings = self.around.readings[sensor]
        begin = readings.data.time[readings.usable] - readings.interval[readings.usable]
        return set(np.searchsorted(self.around.epochs.time, begin - 1e-5).tolist())

    def run(self, state: NavState, feedback_s: float | None) -> Divergence | None:
        """Go through all epochs.

        Args:
            state: at the first.
            feedback_s: longest segment of the closed loop, s; None for the open loop.

        Returns:
            The divergence; None if there is none.
        """
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

        Returns:
            The state at the end, after feedback, and whether the end is `last`: the closed loop ends a segment early if
            its errors become too large.
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
            for one in observed:
                self._update(one, epoch)
            known = self.branches.known(now)
            self.record.note(known.x, known.covariance)
            self.done = epoch + 1
            if closed and observed and np.any(np.abs(self.filter.x[:CORE]) > _SMALL):
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
        end = rows_of(line.state, slice(count - 1, count))
        if feed:
            end = corrected(end, fed[None], around.ellipsoid)
        self.record.end_stretch(first, rows_of(line.state, slice(0, count)), self._compensated, fed, end)
        self._compensated = self._compensated + np.where(np.arange(len(fed)) < CORE, 0.0, fed)
        for branch in self.branches.every():
            branch.filter.x = branch.filter.x - fed
        if self._row_at < around.epochs.time[self.done - 1]:
            self._fed = self._fed + fed
        return NavState(*(part[0] for part in vars(end).values()))

    def _parameters(self) -> dict[str, Array]:
        model = self.around.model
        return {b.name: self._compensated[model.slices[b.name]] for b in model.blocks[len(NAVIGATION) :]}

    def _calibration(self) -> ImuErrors:
        """Return the compensated errors of the inertial sensors."""
        found = self._parameters()

        def triad(name: str) -> TriadErrors:
            matrix = np.zeros((3, 3))
            matrix[~np.eye(3, dtype=bool)] = found.get(f"{name} misalignment", 0.0)
            bias, scale = (found.get(f"{name} {what}", np.zeros(3)) for what in ("bias", "scale"))
            return TriadErrors(bias=bias, scale=scale, misalignment=matrix)

        return ImuErrors(triad("gyro"), triad("accelerometer"))

    def _predict(self, line: Linearisation, k: int, interval: float) -> None:
        phi, q = line.phi[k], line.q[k]
        if self._history:
            self._transition = phi @ self._transition
            self._noise = phi @ self._noise @ phi.T + q
            self._decay = phi @ self._decay
            self._fed = phi @ self._fed
        if not self._restart and not self.branches.waiting:  # by far the most frequent case
            self.filter.predict(phi, q)
            return
        came = {}
        for sensor, begins in self._restart.items():
            if line.first + k - 1 in begins:
                for branch in self.branches.every():
                    branch.cross[sensor] = np.zeros((len(phi), 3))
            # φ̇ = … − C w: noise at mid-interval
            half_way = -0.5 * (phi[:, PHI] + np.eye(len(phi))[:, PHI]) @ line.c_nb[k]
            came[sensor] = half_way * (self.around.model.gyro_noise**2 * interval)
        for branch in self.branches.every():
            branch.predict(phi, q, came)

    def _update(self, one: Observed, epoch: int) -> None:
        readings = self.around.readings[one.sensor]
        data, now = readings.data, float(self.around.epochs.time[epoch])
        interval, gate, main = one.interval, self.gates[one.sensor], self.branches.main
        r = np.diag(one.variance)
        innovation = main.innovation(one, r, interval)
        name = f"{data.label} {one.row} (valid at {data.time[one.row]:.3f} s)"
        if not np.isfinite(innovation.nis):
            raise Diverged(now, name, "the innovation is not finite")
        arrival = float(data.arrival[one.row])
        if arrival > now + 1e-6:
            self.branches.wait(arrival)
        for branch in self.branches.waiting:  # each branch by its own estimate
            if branch.holds(arrival) and gate.admits(branch.innovation(one, r, interval)):
                branch.take(one, r, interval)
        if not gate.passes(one.row, innovation):
            return
        main.take(one, r, interval)
        self._taken = name
        if self._history:
            seen = one.h @ self._transition
            self._information += seen.T @ (seen / one.variance[:, None])
            self._decay = self._decay - self.filter.gain @ (one.h @ self._decay)
        check_covariance(self.filter.covariance, self._varying, now, name)

    def _keep(self, epoch: int, known: Array) -> None:
        row = None
        if self._history:
            row = HistoryRow(
                self.filter.covariance, self.filter.x, self._transition, self._noise, self._information,
                self._decay, self._fed,
            )  # fmt: skip
            self._begin_row(self.around.model.size)
        self._row_at = float(self.around.epochs.time[epoch])
        self.record.keep(epoch, known, row)
