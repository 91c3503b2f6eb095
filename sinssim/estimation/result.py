"""The result of an estimation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.models import Ellipsoid
from sinssim.errors import RunError
from sinssim.estimation.model import NAVIGATION, ErrorModel
from sinssim.strapdown.nav_error import navigation_error

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Innovations:
    """What became of the readings of one aiding sensor, in the order of their validity.

    Attributes:
        sensor: name of the sensor, or else its kind.
        kind: what it measures.
        time: instants of validity, (M,) s.
        value: reading that inertial navigation and the estimates so far predict less the reading, (M, k); NaN for a
            reading that was not even looked at.
        covariance: S of that, (M, k, k).
        nis: normalised innovation squared νᵀS⁻¹ν, (M,).
        accepted: whether the filter was updated with it, (M,).
        reason: why not, "" if it was, M sentences.
        bound: bound of the gate on nis; infinite without a gate.
    """

    sensor: str
    kind: str
    time: Array
    value: Array
    covariance: Array
    nis: Array
    accepted: Mask
    reason: tuple[str, ...]
    bound: float


@dataclass(frozen=True)
class Divergence:
    """That a filter diverged.

    Attributes:
        time: when it was found, s.
        measurement: which one it was found at, for example "gnss-position 17 (valid at 17.000 s)", or the last that was
            taken in before; "" for none.
        reason: one sentence.
    """

    time: float
    measurement: str
    reason: str


@dataclass(frozen=True)
class Smoothed:
    """The estimate by all measurements, earlier and later.

    Attributes:
        time: (R,) s.
        solution: R rows.
        parameters: estimates of the sensors' parameters by block, (R, size) each.
        covariance: of all states, (R, n, n).
    """

    time: Array
    solution: NavSolution
    parameters: dict[str, Array]
    covariance: Array

    @property
    def sigma(self) -> Array:
        """1σ of every state, (R, n)."""
        return np.asarray(np.sqrt(np.einsum("kii->ki", self.covariance)))


@dataclass(frozen=True)
class History:
    """The filter from one kept row to the next: what smoothing and observability are computed from.

    Attributes:
        time: of the rows, (R,) s.
        transition: Φ from the row before, (R, n, n); of the first row the unit matrix.
        noise: Q from the row before, (R, n, n).
        covariance: P after the row's readings, all of them, however late they arrived, (R, n, n).
        state: x̂ after them and after what was fed back, (R, n).
        fed_back: what was fed back since the row before, and at the row, as an error at the row, (R, n).
        information: sum of ΨᵀHᵀR⁻¹HΨ of the readings since the row before that were taken in, with Ψ the transition
            from that row to each of them, (R, n, n).
        decay: what is left at the row of an error at the row before, product of all Φ and I − KH in between,
            (R, n, n); of the first row the unit matrix.
        navigation: inertial navigation after what was fed back, R rows.
        compensated: values of the parameters that are compensated, zero for the others, (R, n).
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


@dataclass(frozen=True)
class Estimate:
    """The aided solution, as it was known at each instant, with its own account of how good it is.

    Attributes:
        model: the error model.
        time: the filter's epochs, (K,) s.
        solution: aided solution, K rows.
        parameters: estimates of the sensors' parameters by block, in the block's units, (K, size) each.
        sigma: 1σ of every state, in the order of `model.states`, (K, n).
        rows: which epochs have their full covariance kept, (R,).
        covariance: P there, (R, n, n).
        innovations: for each set of measurements what became of them.
        smoothed: the smoothed estimate at `rows`, if it was wanted.
        history: what was wanted for studies of it.
        divergence: that and how the filter diverged, None if it did not; the rows end there.
        remarks: what a person should know, for example that no fix came; whole sentences.
        unaided: navigates without the filter; see `inertial`.
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

    @property
    def inertial(self) -> NavSolution | None:
        """The pure inertial solution from the same start, at every sample; None if it fails on its own.

        It is navigated at each access: nothing keeps it for the length of a run.
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
    """Return the actual errors in the filter's own states: what its standard deviations speak of.

    Args:
        model: the error model.
        estimate: filtered or smoothed, K rows.
        truth: true states at `estimate.time`, K rows.
        parameters: true values of the sensors' parameters by block, (size,) or (K, size) each; what is not given is
            taken for zero.
        ellipsoid: reference ellipsoid.

    Returns:
        (K, n): solution minus truth for navigation, true value minus estimate for parameters.

    Raises:
        InputError: truth and estimate have different numbers of rows.
    """
    return _errors(model, estimate.solution, estimate.parameters, truth, parameters, ellipsoid)


def nominal_errors(
    model: ErrorModel, history: History, truth: NavState, parameters: dict[str, Array], ellipsoid: Ellipsoid
) -> Array:
    """Return the actual errors of inertial navigation and compensation: those that the filter estimates.

    Args:
        model: the error model.
        history: R rows.
        truth: true states at `history.time`, R rows.
        parameters: true values of the sensors' parameters by block, (size,) or (R, size) each.
        ellipsoid: reference ellipsoid.

    Returns:
        (R, n), as of `state_errors`.
    """
    n = history.navigation
    solution = NavSolution(
        history.time, n.latitude, n.longitude, n.height, n.velocity_ned, n.q_nb, np.zeros(len(history.time)), ""
    )
    blocks = model.blocks[len(NAVIGATION) :]
    compensated = {block.name: history.compensated[:, model.slices[block.name]] for block in blocks}
    return _errors(model, solution, compensated, truth, parameters, ellipsoid)


def _errors(
    model: ErrorModel,
    solution: NavSolution,
    estimated: dict[str, Array],
    truth: NavState,
    parameters: dict[str, Array],
    ellipsoid: Ellipsoid,
) -> Array:
    errors = np.empty((len(solution.time), model.size))
    nav = navigation_error(truth, solution, ellipsoid)
    errors[:, :9] = np.hstack([nav.position_ned, nav.velocity_ned, nav.attitude])
    for name, value in estimated.items():
        errors[:, model.slices[name]] = parameters.get(name, 0.0) - value
    return errors


def corrected(state: NavState, error: Array, ellipsoid: Ellipsoid) -> NavState:
    """Return navigation states less their errors.

    Args:
        state: N rows.
        error: position north, east, down [m], velocity [m/s], attitude φ [rad], (N, 9).
        ellipsoid: reference ellipsoid.

    Returns:
        The states, N rows.
    """
    from sinssim import earth

    r1, r2 = earth.radii(state.latitude, ellipsoid)
    q = rotation.multiply(rotation.quaternion_from_rotation_vector(error[:, 6:9]), state.q_nb)
    return NavState(
        state.latitude - error[:, 0] / (r1 + state.height),
        state.longitude - error[:, 1] / ((r2 + state.height) * np.cos(state.latitude)),
        state.height + error[:, 2],
        state.velocity_ned - error[:, 3:6],
        rotation.normalize(q),
    )
