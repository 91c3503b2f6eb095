"""The result of an estimation, and its explanation of innovations that speak against the filter."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array, NavSolution, NavState, short_repr, solution_of
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.errors import RunError
from sinssim.estimation.error_dynamics import remaining
from sinssim.estimation.state_model import NAVIGATION, ErrorModel
from sinssim.strapdown.navigation_error import carried, navigation_error

Kind = Literal["state", "initial state", "measurement noise", "inertial noise", "bias walk"]
"""Kinds of hypotheses."""

ALIKE = 2.0 * math.log(100.0)
"""Difference of gains below which two explanations are called alike: one is at most a hundred times more probable."""


@dataclass(frozen=True)
class Refusals:
    """Consecutive refused readings of one sensor, more than chance explains."""

    sensor: str
    start: float  # instant of the first one, s
    end: float  # instant of the last one, s
    count: int  # number of them
    mean: tuple[float, ...] = ()
    """Mean of the readings less their predictions, in the axes and the unit of the kind of measurement."""


@dataclass(frozen=True)
class Hypothesis:
    """One explanation that was tried."""

    name: str
    """Block of states; "initial heading" and the like; sensors whose σ is wrong, joined by ", "; "inertial noise"; or
    "gyro", "accelerometer".
    """
    kind: Kind  # what it is
    value: tuple[float, ...]  # estimates of the states, or the factor or density that explains the innovations best
    sigma: tuple[float, ...]  # 1σ of the estimates, or of the factors of σ; empty for another fitted size
    gain: float  # see `sinssim.estimation.filter_diagnosis.gain`
    needed: float  # gain from which it is named


@dataclass(frozen=True)
class Diagnosis:
    """What the innovations of a filter say about its faults."""

    until: float  # end of the time that was looked at, s
    refusals: tuple[Refusals, ...]  # spans of refused readings
    sizes: Mapping[str, float]  # factor by which the innovations of each sensor are larger than assumed
    hypotheses: tuple[Hypothesis, ...]  # all that were tried, the one with the largest gain first
    runs: int = 0  # number of runs of the filter that the search took
    seconds: float = 0.0  # their duration

    @property
    def cause(self) -> Hypothesis | None:
        """The best explanation; None if no hypothesis explains enough."""
        named = [hypothesis for hypothesis in self.hypotheses if hypothesis.gain > hypothesis.needed]
        return named[0] if named else None

    @property
    def alike(self) -> tuple[Hypothesis, ...]:
        """Other explanations that the readings can hardly tell from the cause."""
        cause = self.cause
        if cause is None:
            return ()
        return tuple(
            hypothesis
            for hypothesis in self.hypotheses
            if hypothesis is not cause and hypothesis.gain > hypothesis.needed and cause.gain - hypothesis.gain < ALIKE
        )


Mask = NDArray[np.bool_]
Rows = slice | NDArray[np.integer[Any]]


class Reasons(Sequence[str]):
    """Why readings were not used: one sentence per reading, "" for a reading that was used.

    Only the sentences that are not empty take memory; they are given by the number of the reading.
    """

    def __init__(self, count: int, sentences: Mapping[int, str]) -> None:
        self._count, self.sentences = count, sentences

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, row: int) -> str: ...
    @overload
    def __getitem__(self, row: slice) -> list[str]: ...
    def __getitem__(self, row: int | slice) -> str | list[str]:
        if isinstance(row, slice):
            return [self.sentences.get(k, "") for k in range(self._count)[row]]
        return self.sentences.get(range(self._count)[row], "")

    def __iter__(self) -> Iterator[str]:
        return (self.sentences.get(k, "") for k in range(self._count))


@short_repr
@dataclass(frozen=True)
class Innovations:
    """The innovations of one aiding sensor, in the order of validity, and the decisions of the gate.

    Attributes:
        sensor: name of the sensor, or else its kind.
        kind: kind of measurement.
        time: times of validity, (M,) s.
        value: measurement predicted by inertial navigation and the estimate, minus the measurement, (M, k); NaN for a
            skipped measurement.
        lower: lower triangle of its covariance S, row by row, (M, k (k + 1)/2); see `covariance`.
        nis: normalised innovation squared νᵀS⁻¹ν, (M,).
        accepted: whether the filter was updated with the measurement, (M,).
        reason: reason of a rejection, "" if the measurement was accepted, M sentences.
        bound: the gate's bound on nis; infinite without a gate.
        withdrawn: instant from which on a monitor has the sensor's readings refused, s; infinite if it has not.
    """

    sensor: str
    kind: str
    time: Array
    value: Array
    lower: Array
    nis: Array
    accepted: Mask
    reason: Sequence[str]
    bound: float
    withdrawn: float = math.inf

    @property
    def covariance(self) -> Array:
        """The covariance S of every measurement, (M, k, k); made anew at each access, as it is large."""
        return self.covariance_at(slice(None))

    def covariance_at(self, rows: Rows) -> Array:
        """Return the covariance S of some measurements.

        Args:
            rows: which R of them.

        Returns:
            (R, k, k), in the square of the measurements' units.
        """
        lower, k = self.lower[rows], self.value.shape[1]
        full = np.empty((len(lower), k, k))
        for column, (i, j) in enumerate(zip(*np.tril_indices(k), strict=True)):
            full[:, i, j] = full[:, j, i] = lower[:, column]
        return full

    def sigma_at(self, rows: Rows) -> Array:
        """Return 1σ of the innovation of some measurements.

        Args:
            rows: which R of them.

        Returns:
            (R, k), in the measurements' units.
        """
        first, second = np.tril_indices(self.value.shape[1])
        return np.asarray(np.sqrt(self.lower[rows][:, first == second]))


@dataclass(frozen=True)
class Divergence:
    """Divergence of a filter.

    Attributes:
        time: time at which it was detected, s.
        measurement: the measurement at which it was detected, for example "gnss-position 17 (valid at 17.000 s)", or
            the last one processed before; "" for none.
        reason: one sentence.
    """

    time: float
    measurement: str
    reason: str


@short_repr
@dataclass(frozen=True)
class Smoothed:
    """The smoothed estimate, from all earlier and later measurements.

    Attributes:
        time: (R,) s.
        solution: R rows.
        parameters: estimates of the sensors' parameters by block, (R, size) each.
        covariance: covariance of all states, (R, n, n).
    """

    time: Array
    solution: NavSolution
    parameters: dict[str, Array]
    covariance: Array

    @property
    def sigma(self) -> Array:
        """1σ of every state, (R, n)."""
        return np.asarray(np.sqrt(np.einsum("kii->ki", self.covariance)))


@short_repr
@dataclass(frozen=True)
class History:
    """History of the filter from one stored row to the next, for smoothing and observability.

    Attributes:
        time: times of the rows, (R,) s.
        transition: Φ from the previous row, (R, n, n); the unit matrix for the first row.
        noise: Q from the previous row, (R, n, n).
        covariance: P after all of the row's measurements, late ones included, (R, n, n).
        state: x̂ after them and after the feedback, (R, n).
        fed_back: feedback since the previous row and at the row, as an error at the row, (R, n).
        information: sum of ΨᵀHᵀR⁻¹HΨ of the accepted measurements since the previous row, with Ψ the transition from
            that row to each of them, (R, n, n).
        decay: factor by which an error at the previous row remains, the product of all Φ and I − KH in between, (R, n,
            n); the unit matrix for the first row.
        navigation: inertial navigation after the feedback, R rows.
        compensated: values of the compensated parameters, zero for the others, (R, n).
        on_edge: whether the row lies at the end of a sample, (R,); the state between two is interpolated. None if all
            do.
    """

    time: Array
    transition: Array
    noise: Array
    covariance: Array
    state: Array
    fed_back: Array
    information: Array
    decay: Array
    navigation: NavState
    compensated: Array
    on_edge: Mask | None = None


@short_repr
@dataclass(frozen=True)
class Estimate:
    """The causal aided solution, with covariances and diagnostics.

    Attributes:
        model: the error model.
        time: the filter's epochs, (K,) s.
        solution: aided solution, K rows.
        parameters: estimates of the sensors' parameters by block, in the block's units, (K, size) each.
        sigma: 1σ of every state, in the order of `model.states`, (K, n).
        rows: epochs whose full covariance is stored, (R,).
        covariance: P at these epochs, (R, n, n).
        innovations: innovations of each set of measurements.
        smoothed: the smoothed estimate at `rows`, if requested.
        history: history of the filter, if requested.
        divergence: divergence of the filter, at which the rows end; None if there is none.
        remarks: remarks for the user, for example that there was no fix; whole sentences.
        unaided: function that navigates without the filter; see `inertial`.
        backward: the estimate of the same filter in reverse time, from the measurements at each time and later, if
            there is one.
        diagnosis: explanation of innovations that are inconsistent with the filter; None if they are consistent, or
            without a request.
    """

    model: ErrorModel
    time: Array
    solution: NavSolution
    parameters: dict[str, Array]
    sigma: Array
    rows: NDArray[np.intp]
    covariance: Array
    innovations: tuple[Innovations, ...]
    smoothed: Smoothed | None
    history: History | None
    divergence: Divergence | None
    remarks: tuple[str, ...]
    unaided: Callable[[], NavSolution]
    backward: Estimate | None = None
    diagnosis: Diagnosis | None = None

    @property
    def inertial(self) -> NavSolution | None:
        """The pure inertial solution from the same start, at every sample; None if it fails.

        It is computed anew at each access, so that it takes no memory during a run.
        """
        try:
            return self.unaided()
        except RunError:
            return None


def state_errors(
    model: ErrorModel,
    estimate: Estimate | Smoothed,
    truth: NavState,
    parameters: dict[str, Array],
    ellipsoid: Ellipsoid,
) -> Array:
    """Return the actual errors in the filter's own states, to which its standard deviations refer.

    Args:
        model: the error model.
        estimate: filtered or smoothed, K rows.
        truth: true states at `estimate.time`, K rows.
        parameters: true values of the sensors' parameters by block, (size,) or (K, size) each; missing ones are zero.
        ellipsoid: reference ellipsoid.

    Returns:
        (K, n): solution minus truth for navigation, true value minus estimate for parameters, for those of the inertial
        sensors relative to the true sensor (`sinssim.estimation.error_dynamics`).

    Raises:
        InputError: truth and estimate have different numbers of rows.
    """
    errors = np.empty((len(estimate.solution.time), model.size))
    nav = navigation_error(truth, estimate.solution, ellipsoid, model.axes)
    errors[:, :9] = np.hstack([nav.position_ned, nav.velocity_ned, nav.attitude])
    for name, error in remaining(model, parameters, estimate.parameters).items():
        errors[:, model.slices[name]] = error
    return errors


def nominal_errors(
    model: ErrorModel, history: History, truth: NavState, parameters: dict[str, Array], ellipsoid: Ellipsoid
) -> Array:
    """Return the actual errors of inertial navigation and compensation, which the filter estimates, at the R rows of
    its history, (R, n), as `state_errors` from the true states and the true values of the sensors' parameters by block,
    (size,) or (R, size) each."""
    solution = solution_of(history.time, history.navigation)
    blocks = model.blocks[len(NAVIGATION) :]
    compensated = {block.name: history.compensated[:, model.slices[block.name]] for block in blocks}
    nominal = Smoothed(history.time, solution, compensated, history.covariance)
    return state_errors(model, nominal, truth, parameters, ellipsoid)


def corrected(state: NavState, error: Array, ellipsoid: Ellipsoid, axes: str = "north") -> NavState:
    """Return navigation states with errors subtracted: position [m], velocity [m/s] and attitude φ [rad], (N, 9)."""
    from sinssim import earth

    q = rotation.multiply(rotation.quaternion_from_rotation_vector(error[:, 6:9]), state.q_nb)
    if axes == "transported":
        there = NavState(state.latitude, state.longitude, state.height, state.velocity_ned - error[:, 3:6], q)
        north, east, down = -error[:, :3].T
        place = earth.displaced(state.latitude, state.longitude, state.height, north, east, ellipsoid)
        moved = carried(there, *place, state.height - down)
        return replace(moved, q_nb=rotation.normalize(moved.q_nb))
    r1, r2 = earth.radii(state.latitude, ellipsoid)
    return NavState(
        state.latitude - error[:, 0] / (r1 + state.height),
        state.longitude - error[:, 1] / ((r2 + state.height) * np.cos(state.latitude)),
        state.height + error[:, 2],
        state.velocity_ned - error[:, 3:6],
        rotation.normalize(q),
    )
