"""The backward solution: the filter run over the data in reverse time, from the end to the start.

With τ = −t position and attitude stay, the velocity changes its sign, and so do the rate of the body and that of the
Earth; specific force and gravity stay, because dv'/dτ = d(−v)/d(−t). In these variables the equations of navigation
and of its errors are the same, so that the same engine and the same filter run on

    v' = −v,   Ω' = −Ω,   Δθ' = −Δθ and ΔV' = ΔV in reverse order,

and on readings whose velocities and rates have the other sign. Biases of gyros and of measured velocities, delays and
the wind change their sign as well; scale factors, misalignments, biases of accelerometers and mounting angles do not. A
Gauss-Markov process is the same in reverse time.

The run starts from the last state of the forward solution, with `WIDER` times its standard deviations and without its
correlations. The forward solution then counts for little: C = σσᵀ∘ρ of nine states is at most nine times its diagonal,
so that in no direction more than 9/100 of the information of the forward run, and 1/100 in each state by itself, is
used again. The estimates of the sensors' parameters start from zero and their own standard deviations, those of random
walks being the ones at the end of the run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sinssim.data import Array, ImuData, Measurements, NavSolution, measurements_at
from sinssim.earth.ellipsoids import in_reverse_time
from sinssim.estimation import ErrorModel, Estimate, Innovations
from sinssim.estimation.estimate import estimate
from sinssim.estimation.measurement_epochs import averaging_intervals
from sinssim.estimation.state_model import FLICKER, NAVIGATION
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.sensors.vibration_noise import AddedNoise, vibration, vibration_noise
from sinssim.strapdown.mechanization import Mechanization

WIDER = 10.0
"""1σ of the first state of the backward run, relative to that of the forward solution there."""

_LARGEST_ANGLE = 0.5
"""Largest 1σ of an attitude error at that start, unless the forward solution's is larger, rad: errors of attitude are
taken for small ones."""

_OTHER_SIGN = (
    "velocity", "gyro bias", "gyro instability", "gyro g-sensitivity", "gyro asymmetry", "gyro quadratic",
)  # fmt: skip
"""Blocks that change their sign with the rates: errors of the gyros that are even in the rate, or without it."""
_OTHER_SIGN_OF_SENSORS = (" delay", " time offset")


def run_backward(
    forward: Estimate,
    imu: ImuData,
    measurements: Sequence[Measurements],
    vibration_share: float,
    options: Mapping[str, Any],
    bridged: AddedNoise | None = None,
) -> Estimate:
    """Run the filter in reverse time from the last row of the forward estimate; return the estimate in forward time, in
    which every row uses the readings at its instant and later. The vibration's share is `filter.vibration_noise`;
    options, mechanization and noise of bridged gaps are those of the forward run."""
    forwards: Mechanization = options["mechanization"]
    count = int(np.searchsorted(imu.time, forward.time[-1] + 1e-6)) - 1
    imu = ImuData(imu.time[: count + 1], imu.dtheta[:count], imu.dvel[:count])
    turned = reversed_imu(imu)
    kinds = {m.label: m.kind for m in measurements}
    added = None if bridged is None else bridged.mirrored(float(imu.time[0]), float(imu.time[-1]))
    if vibration_share:
        added = vibration_noise(vibration(turned), vibration_share, vibration_share).plus(added)
    last = forward.solution.state(-1)
    backward = estimate(
        turned,
        replace(last, velocity_ned=-last.velocity_ned),
        [reversed_readings(m, imu.time) for m in measurements],
        start_model(forward),
        axes=forward.model.axes,
        added_noise=added,
        **{**options, "mechanization": replace(forwards, ellipsoid=in_reverse_time(forwards.ellipsoid))},
    )
    return _in_forward_time(backward, imu.time, kinds)


def start_model(forward: Estimate) -> ErrorModel:
    """Return the error model with the standard deviations at the start of the backward run; see the text of this
    file."""
    model, lasts = forward.model, float(forward.time[-1] - forward.time[0])
    blocks = []
    for block in model.blocks:
        if block.name in NAVIGATION:
            last_sigma = forward.sigma[-1, model.slices[block.name]]
            sigma = WIDER * last_sigma
            if block.name == "attitude":
                sigma = np.minimum(sigma, np.maximum(last_sigma, _LARGEST_ANGLE))
        elif math.isfinite(min(block.correlation_time, block.correlation_distance)):
            sigma = np.asarray(block.sigma)
        else:
            sigma = np.hypot(block.sigma, np.asarray(block.random_walk) * math.sqrt(lasts))
        blocks.append(replace(block, sigma=sigma))
    return replace(model, blocks=tuple(blocks))


def reversed_imu(imu: ImuData) -> ImuData:
    """Return increments in reverse time, between the same first and last instants: N intervals in reverse order; the
    angles have the other sign."""
    return ImuData(_mirrored(imu.time, imu.time), -imu.dtheta[::-1], np.ascontiguousarray(imu.dvel[::-1]))


def reversed_readings(readings: Measurements, edges: Array) -> Measurements:
    """Return the readings of a sensor within the edges of the IMU's intervals, (N+1,) s, in reverse time; velocities
    and rates have the other sign. A reading counts from its instant of validity on, because everything is known
    already. A mean over the time before an instant is in reverse time a mean over the time before the other end of this
    interval."""
    m, kind = readings, measurement_kind(readings.kind)
    order = np.argsort(m.time, kind="stable")
    time = m.time[order]
    if kind.mean_rate:
        time = time - averaging_intervals(time, float(edges[0]))
    inside = (time >= edges[0] - 1e-6) & (time <= edges[-1] - (1e-6 if kind.mean_rate else -1e-6))
    rows = order[inside][::-1]
    mirrored = _mirrored(time[inside], edges)
    m = measurements_at(m, rows)  # a copy
    m.value[:, : kind.velocities] *= -1.0
    return replace(m, time=mirrored, arrival=mirrored)


def signs_in_reverse_time(model: ErrorModel, kinds: Mapping[str, str]) -> Array:
    """Return the sign that every state takes in reverse time: 1 or −1 for each state, (n,). `kinds`: kind of
    measurement of each aiding sensor, by its label."""
    signs = np.ones(model.size)
    for name, where in model.slices.items():
        sensor = next((label for label in kinds if name.startswith(f"{label} ")), "")
        of_velocity = sensor and measurement_kind(kinds[sensor]).is_velocity(name.removeprefix(f"{sensor} "))
        if (
            name in (*_OTHER_SIGN, *model.sums.get(f"gyro {FLICKER}", ()))
            or name.endswith(_OTHER_SIGN_OF_SENSORS)
            or of_velocity
        ):
            signs[where] = -1.0
    return signs


def _mirrored(time: Array, edges: Array) -> Array:
    """Return instants in reverse time, in order, within the edges."""
    return np.asarray(np.clip(edges[0] + edges[-1] - time[::-1], edges[0], edges[-1]))


def _in_forward_time(backward: Estimate, edges: Array, kinds: Mapping[str, str]) -> Estimate:
    """Return an estimate of the backward run in forward time."""
    model, time = backward.model, _mirrored(backward.time, edges)
    signs = signs_in_reverse_time(model, kinds)
    last, s = len(time) - 1, backward.solution
    solution = NavSolution(
        time, s.latitude[::-1], s.longitude[::-1], s.height[::-1], -s.velocity_ned[::-1], s.q_nb[::-1],
        s.defect[::-1], s.algorithm,
    )  # fmt: skip
    divergence = backward.divergence
    if divergence is not None:
        divergence = replace(divergence, time=float(edges[0] + edges[-1] - divergence.time))
    return replace(
        backward,
        time=time,
        solution=solution,
        parameters={name: signs[model.slices[name]] * p[::-1] for name, p in backward.parameters.items()},
        sigma=backward.sigma[::-1],
        rows=last - backward.rows[::-1],
        covariance=signs[:, None] * backward.covariance[::-1] * signs,
        innovations=tuple(_innovations(i, edges) for i in backward.innovations),
        divergence=divergence,
    )


def _innovations(innovations: Innovations, edges: Array) -> Innovations:
    signs = np.ones(innovations.value.shape[1])
    signs[: measurement_kind(innovations.kind).velocities] = -1.0
    i, j = np.tril_indices(len(signs))
    return replace(
        innovations,
        time=_mirrored(innovations.time, edges),
        value=signs * innovations.value[::-1],
        lower=(signs[i] * signs[j]) * innovations.lower[::-1],
        nis=innovations.nis[::-1],
        accepted=innovations.accepted[::-1],
        reason=list(innovations.reason)[::-1],
    )
