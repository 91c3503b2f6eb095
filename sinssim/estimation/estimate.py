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

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Unpack

import numpy as np

from sinssim.arguments import checked_initial, doubles, number
from sinssim.data import Array, ImuData, Measurements, NavSolution, NavState, solution_of
from sinssim.earth.gravity_disturbance import DisturbingField
from sinssim.errors import InputError, RunError, check_name, shortened
from sinssim.estimation import GATE, LINEAR, SHIPPED
from sinssim.estimation.error_dynamics import driving_noise, with_products
from sinssim.estimation.filter_loop import Loop
from sinssim.estimation.filter_result import Estimate, Innovations
from sinssim.estimation.innovation_gate import contradiction
from sinssim.estimation.linearisation import Surroundings, at
from sinssim.estimation.measurement_epochs import CheckedMeasurements, take_in
from sinssim.estimation.smoother import smooth as smoothed
from sinssim.estimation.state_model import ErrorModel
from sinssim.sensors.imu.compensation import MeanGyroRates
from sinssim.sensors.imu.rotation_encoder import Encoders
from sinssim.sensors.measurement_kind import CORE
from sinssim.sensors.vibration_noise import AddedNoise, vibration
from sinssim.strapdown.frames.route_pole import route_along
from sinssim.strapdown.mechanization import Mechanization, Options, chosen
from sinssim.strapdown.navigate import Segments, navigate, navigate_in_field
from sinssim.strapdown.navigation_error import axes_of
from sinssim.system.process import give_back_memory


def neglected(model: ErrorModel) -> list[str]:
    """Name the errors of the inertial sensors that no state describes."""
    if not model.untold:
        return []
    return [f"The inertial sensors have errors that no state of the filter describes: {', '.join(model.untold)}."]


def remarks(innovations: Sequence[Innovations], late: Sequence[int]) -> list[str]:
    """Return sentences on readings that were not used; `late` readings of each sensor arrive after the end."""
    sentences = [] if innovations else ["There are no measurements: the result is the inertial solution."]
    for i, later in zip(innovations, late, strict=True):
        count = len(i.time)
        if later > max(1, count // 10) or later == count > 0:  # a few readings pending at the end are normal
            sentences.append(
                f"{i.sensor}: {later} of {count} measurements arrive after the end of the run; only the smoothed "
                "solution uses them."
            )
        rejected = int(np.count_nonzero(~i.accepted & ~np.isnan(i.nis)))
        unusable = Counter(reason for reason, nis in zip(i.reason, i.nis, strict=True) if reason and np.isnan(nis))
        if not count:
            stood = " (the vehicle was never at rest)" if i.kind in ("zero-velocity", "zero-rate") else ""
            sentences.append(f"{i.sensor}: there was no measurement{stood}; the sensor corrects nothing.")
            continue
        why = ", ".join(f"{number} {reason}" for reason, number in unusable.items())
        if not i.accepted.any():
            detail = "; ".join(filter(None, [why, f"{rejected} rejected by the gate" if rejected else ""]))
            sentences.append(
                f"{i.sensor}: none of {count} measurements was used{f' ({detail})' if detail else ''}; the sensor "
                "corrects nothing."
            )
            continue
        if np.isfinite(i.withdrawn):
            sentences.append(
                f"{i.sensor}: withdrawn from {i.withdrawn:.0f} s on, because the sum of innovations contradicts the "
                "filter."
            )
        elif why:
            sentences.append(f"{i.sensor}: some of {count} measurements could not be used ({why}).")
        if rejected:
            sentences.append(f"{i.sensor}: the gate rejected {rejected} of {count} measurements.")
    if innovations and not any(i.accepted.any() for i in innovations):
        sentences.append("No measurement was used: the result is the inertial solution.")
    return sentences


REFUSED = 0.02
"""Share of refused readings from which a cause is looked for; a gate refuses a ten-thousandth of correct ones."""

SHAKEN = 3.0
"""Ratio of the shaking to the assumed noise from which it is named."""

_AXES = ("forward", "right", "down")


def vibration_untold(
    innovations: Sequence[Innovations], imu: ImuData, model: ErrorModel, added: AddedNoise | None
) -> list[str]:
    """Name the vibration in the inertial readings if readings are rejected and the filter assumes none.

    White noise of density N scatters the readings of one sample by N/√Δt. Readings that scatter more hold either more
    noise or vibration, which adds noise.
    """
    tested = sum(int(np.count_nonzero(~np.isnan(i.nis))) for i in innovations)
    refused = sum(int(np.count_nonzero(~np.isnan(i.nis) & ~i.accepted)) for i in innovations)
    if added is not None or refused <= REFUSED * tested:
        return []
    try:
        level_of = vibration(imu)
    except InputError:  # sampled too slowly to show vibration
        return []
    triads = (
        ("gyros", level_of.gyro, model.gyro_noise, 180.0 / np.pi, "°/s"),
        ("accelerometers", level_of.accel, model.accel_noise, 1.0, "m/s²"),
    )
    words = []
    for name, level, density, unit, symbol in triads:
        rms = np.sqrt(np.mean(level**2, axis=0))
        axis, assumed = int(np.argmax(rms)), density / np.sqrt(level_of.interval)
        if rms[axis] > SHAKEN * assumed:
            times = f"{rms[axis] / assumed:.0f} times the assumed noise of a sample" if assumed else "none is assumed"
            words.append(f"the {name} by {unit * rms[axis]:.3g} {symbol} (rms, {_AXES[axis]}), {times}")
    if not words:
        return []
    return [
        f"The gate rejected {100.0 * refused / tested:.0f} % of all measurements, and the inertial data contain "
        f"vibration: {'; '.join(words)}. Vibration adds noise that the filter does not model: set "
        "filter.vibration_noise (about 0.4), or increase filter.inertial_noise_factor."
    ]


@dataclass(frozen=True, kw_only=True)
class FilterOptions:
    """How a filter runs: the options of `estimate`, which describes and sets them, with their checks."""

    covariance: Array | None
    loop: str
    rate_hz: float
    gate: float | None
    monitor_s: float
    feedback_s: float
    smooth: bool
    history: bool
    row_s: float
    axes: str | None
    added_noise: AddedNoise | None
    field: DisturbingField | None
    encoders: Encoders | None
    kind: str
    seed: int

    def __post_init__(self) -> None:
        check_name("kind", self.kind, SHIPPED)
        if self.kind == "invariant" and self.loop == "open":
            raise InputError('kind = "invariant" feeds back after each reading; it needs loop = "closed".')
        if self.kind not in LINEAR and self.smooth:
            raise InputError(f"smooth: the filter {self.kind} has no smoother; {' and '.join(LINEAR)} have one.")
        check_name("loop", self.loop, ("closed", "open"))
        gate = None if self.gate is None else number("gate", self.gate, "a probability")
        feedback_s = number("feedback_s", self.feedback_s, "s") if self.feedback_s != np.inf else np.inf
        if gate is not None and not 0.0 < gate < 1.0:
            raise InputError(f"gate = {gate} must be a probability between 0 and 1, or None for no gate.")
        if not feedback_s > 0.0:
            raise InputError(f"feedback_s = {feedback_s} s must be positive.")
        monitor_s = number("monitor_s", self.monitor_s, "s")
        if not monitor_s >= 0.0:
            raise InputError(f"monitor_s = {monitor_s} s must be an interval, or 0 for no monitor.")
        object.__setattr__(self, "gate", gate)
        object.__setattr__(self, "monitor_s", monitor_s)
        object.__setattr__(self, "feedback_s", feedback_s)


def estimate(
    imu: ImuData,
    initial: NavState,
    measurements: Sequence[Measurements],
    model: ErrorModel,
    mechanization: Mechanization | None = None,
    *,
    covariance: Array | None = None,
    loop: str = "closed",
    rate_hz: float = 10.0,
    gate: float | None = GATE,
    monitor_s: float = 0.0,
    feedback_s: float = 64.0,
    smooth: bool = False,
    history: bool = False,
    row_s: float = 0.0,
    axes: str | None = None,
    added_noise: AddedNoise | None = None,
    field: DisturbingField | None = None,
    encoders: Encoders | None = None,
    kind: str = "error-state",
    seed: int = 0,
    **options: Unpack[Options],
) -> Estimate:
    """Estimate the errors of inertial navigation from aiding measurements, and correct it.

    Args:
        imu: increments, N intervals.
        initial: state at imu.time[0], with the errors that the model describes.
        measurements: one entry for each sensor and kind of measurement; there may be none.
        model: the error model.
        mechanization: that of the engine: a free vertical channel, and any algorithm but functional-iteration. With
            rates_hz, or an algorithm of several samples, the engine is corrected at its rows, and measurements between
            two rows are compared with a state between them.
        covariance: P₀ of the first m states, (m, m), for example from `sinssim.alignment.initial_covariance`; it
            replaces the diagonal of the model's sigma.
        loop: "closed" feeds errors back into engine and compensator, "open" only corrects the output.
        rate_hz: rate at which the covariance is predicted.
        gate: probability that the χ² test of the innovation rejects a correct measurement; None accepts all.
        monitor_s: interval over which the innovations of GNSS are summed, s. If a sum contradicts a right filter
            (probability 1e-6), all fixes are refused from then on. 0: there is no monitor.
        feedback_s: longest time between feedbacks in the closed loop, s.
        smooth: whether to smooth as well.
        history: whether to keep the history that observability is computed from.
        row_s: least time between stored rows of the history and covariances, s; by default there is one at every
            measurement and every second. Each row holds six n × n matrices.
        axes: axes of the errors, see `ErrorModel.axes`; by default those of
            `sinssim.strapdown.navigation_error.axes_of` for the pure inertial solution and the position
            measurements.
        added_noise: noise of the inertial sensors in addition to the model's, along the run, for example by vibration
            (`sinssim.sensors.vibration_noise`).
        field: disturbing field that the engine knows beside normal gravity.
        encoders: of a block that turns in the vehicle: the state is that of the block, the measurements are those of
            the vehicle.
        kind: kind of filter, one of `sinssim.estimation.SHIPPED`.
        seed: of the members that an ensemble filter draws.
        **options: fields of the mechanization by name instead.

    Returns:
        The estimate; if the filter diverges, it ends there.

    Raises:
        InputError: the data, the measurements or the model cannot be used, or a name is unknown.
    """
    how = FilterOptions(
        covariance=covariance, loop=loop, rate_hz=rate_hz, gate=gate, monitor_s=monitor_s, feedback_s=feedback_s,
        smooth=smooth, history=history, row_s=row_s, axes=axes, added_noise=added_noise, field=field, encoders=encoders,
        kind=kind, seed=seed,
    )  # fmt: skip
    if not isinstance(model, ErrorModel):
        raise InputError(f"model must be an ErrorModel, as error_model() makes one, not {shortened(repr(model))}.")
    return _estimate(imu, initial, measurements, model, chosen(mechanization, options), how)


def _estimate(
    imu: ImuData,
    initial: NavState,
    measurements: Sequence[Measurements],
    model: ErrorModel,
    mechanization: Mechanization,
    how: FilterOptions,
) -> Estimate:
    latitude, longitude, _, velocity, _ = checked_initial(initial)
    in_segments = mechanization
    if mechanization.route is None and mechanization.in_frame.takes_route:  # one for all segments
        in_segments = replace(mechanization, route=route_along(latitude, longitude, velocity))
    engine = Segments(imu, in_segments, field=how.field)
    unaided = _unaided(imu, initial, mechanization, how.field)
    failure, latitudes = [], [np.asarray(latitude)]
    try:
        latitudes.append(unaided().latitude)
    except RunError as error:
        failure = [f"The pure inertial solution failed: {error}"]
    readings, epochs = take_in(measurements, model, engine.time, how.rate_hz)
    latitudes += [r.data.value[r.usable, 0] for r in readings if r.data.kind == "gnss-position"]
    model = replace(model, axes=how.axes or axes_of(mechanization.frame, *latitudes))
    del latitudes
    give_back_memory()  # what was in between is as large as a quarter of the filter's record
    around = Surroundings(
        model, driving_noise(model), epochs, readings, MeanGyroRates(imu), mechanization.gravity, mechanization.earth,
        long_rows=len(engine.time) - 1 < len(imu), added=how.added_noise, encoders=how.encoders,
    )  # fmt: skip
    covariance = with_products(model, _initial_covariance(model, how.covariance))
    loop = Loop(
        around, engine, covariance, how.gate, how.monitor_s, how.smooth or how.history, how.row_s, how.kind, how.seed
    )
    divergence = loop.run(initial, how.feedback_s if how.loop == "closed" else None)

    record, count, algorithm = loop.record, loop.done, mechanization.algorithm
    innovations = tuple(gate.innovations() for gate in loop.gates)
    rows, covariances = record.rows(count)
    history = record.history() if count and (how.smooth or how.history) else None
    solution = record.solution(count, algorithm)
    if not failure and not any(i.accepted.any() for i in innovations):
        solution = _inertial(unaided(), around, count, algorithm)
    return Estimate(
        model=model,
        time=epochs.time[:count],
        solution=solution,
        parameters=record.parameters(count),
        sigma=record.sigma(count),
        rows=rows,
        covariance=covariances,
        innovations=innovations,
        smoothed=smoothed(model, history, around.ellipsoid, algorithm) if history is not None and how.smooth else None,
        history=history if how.history else None,
        divergence=divergence or contradiction(innovations),
        remarks=(
            *failure,
            *neglected(model),
            *remarks(innovations, [_too_late(r, imu) for r in readings]),
            *vibration_untold(innovations, imu, model, how.added_noise),
        ),
        unaided=unaided,
    )


def _unaided(
    imu: ImuData, initial: NavState, mechanization: Mechanization, field: DisturbingField | None
) -> Callable[[], NavSolution]:
    """Return the function that navigates without the filter."""
    if field is None:
        return partial(navigate, imu, initial, mechanization)
    along = partial(navigate, initial=initial, mechanization=mechanization)
    return partial(navigate_in_field, imu, field, mechanization.earth, along)


def _inertial(inertial: NavSolution, around: Surroundings, count: int, algorithm: str) -> NavSolution:
    """Return the inertial solution at the first epochs, bit for bit that of `navigate`, which segments are not."""
    epochs = around.epochs
    time, edge = epochs.time[:count], epochs.edge[:count].astype(np.intp)
    fraction = (time - inertial.time[edge]) / np.diff(inertial.time)[np.minimum(edge, len(inertial.time) - 2)]
    fraction[epochs.on_edge[:count]] = 0.0
    return solution_of(time, at(inertial, edge, fraction, around.ellipsoid, around.model.axes), algorithm)


def _too_late(readings: CheckedMeasurements, imu: ImuData) -> int:
    """Return the number of usable readings of a sensor that arrive after the end of the data."""
    return int(np.count_nonzero(readings.data.arrival[readings.usable] > imu.time[-1] + 1e-6))


def _initial_covariance(model: ErrorModel, covariance: Array | None) -> Array:
    p = model.covariance.copy()
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
