"""The start of the budget after an alignment at rest: all sources through the session.

Quiet: attitude errors by the mean readings of the session, as for a filter.

Disturbed: the fit of gravity's cone. In the inertial frame ib0 of the block at the first instant, the attitude error φ
and the error u of the measured velocity follow

    φ̇ = −C δω,   u̇ = f × φ + C δf                                                                     (1)

and the fit is linear in u about its own solution: its unknowns x, a rotation δ of the cone, the latitude if it is free,
g and v₀, are the least-squares solution x = Σ_b W_b ū_b over the block means ū_b. The aligned attitude and velocity are

    φ_n = C_n,ib0 (φ(T) + δ),   δv_n = C_n,ib0 (u(T) − J(T) x) + v × (C_n,ib0 δ)                       (2)

with the velocity v of the sway that is left at the end. Errors that persist go on acting after the session, and are
correlated with the start: a tilt by a bias of the accelerometers cancels this bias.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sinssim import rotation
from sinssim.alignment.alignment_budget import expected_errors
from sinssim.alignment.determination import determine
from sinssim.alignment.disturbed_base import cone_jacobian, fit_of_session, inertial_curve, mean_blocks
from sinssim.alignment.initial_conditions import aligned_state, alignment_samples, initial_state
from sinssim.analyses.error_budget.error_dynamics import TrueMotion, exponential, white_covariance
from sinssim.analyses.error_budget.source_effects import Shares
from sinssim.analyses.error_budget.source_propagation import NavigationStep, Propagation
from sinssim.data import Array, ImuData, NavState, rows_of
from sinssim.earth import radii
from sinssim.scenario import Scenario
from sinssim.sensors.measurement_kind import CORE, PHI, R, V, skew

_STEPS = np.repeat((1e-9, 1e-5), 3)
"""Steps of the differences, rad/s and m/s²: small against the Earth's rate and gravity, far above rounding."""


def by_mean_readings(motion: TrueMotion, count: int) -> Array:
    """Return the derivative of the aligned attitude's error φ to the mean readings of `count` samples at rest.

    By gyros and accelerometers, (3, 6) s and s²/m, from central differences of the determination itself.
    """
    seconds = float(motion.ideal.time[count] - motion.ideal.time[0])
    mean = np.concatenate([part[:count].sum(axis=0) for part in (motion.ideal.dtheta, motion.ideal.dvel)]) / seconds

    def aligned(readings: Array) -> Array:
        return initial_state(determine(readings[:3], readings[3:]), 0.0, 0.0, 0.0).q_nb

    derivative = np.empty((3, 6))
    for k, step in enumerate(_STEPS):
        off = step * np.eye(6)[k]
        plus, minus = aligned(mean + off), aligned(mean - off)
        turn = rotation.multiply(minus, rotation.conjugate(plus))  # q(φ₊ − φ₋)
        derivative[:, k] = rotation.rotation_vector_from_quaternion(turn) / (2.0 * step)
    return derivative


def align(
    motion: TrueMotion, shares: Shares, series: tuple[Array, Array], count: int, propagation: Propagation
) -> None:
    """Take all sources through the session, at whose end the filter or the navigator starts; `propagation` is changed.

    During the session, the rows of velocity and attitude hold the sums of the reading errors of accelerometers and
    gyros. The end turns them into the attitude's error. Velocity is exact, and the position keeps its initial error.
    """
    n = len(propagation.sensitivity)
    only_position = np.zeros((n, n))
    only_position[:3, :3] = np.eye(3)
    only_position[CORE:, CORE:] = np.eye(n - CORE)
    propagation.map(only_position)
    time = motion.ideal.time[: count + 1]
    stride = max(count // max(round(float(time[-1] - time[0])), 1), 1)
    edges = time[np.unique(np.append(np.arange(0, count, stride), count))]
    c_bn = rotation.dcm_from_quaternion(motion.state.q_nb[0]).T
    mean = motion.responses(edges, shares.kernel_columns, *series).mean
    for k, interval in enumerate(np.diff(edges).tolist()):
        constants, bias = np.zeros((n, shares.count)), np.zeros((n, 6))
        for rows, of in ((PHI, slice(0, 3)), (V, slice(3, 6))):
            constants[rows, : shares.inertial] = interval * mean[k, of, : shares.inertial]
            bias[rows] = interval * mean[k, of, shares.inertial :]
        noise = {}
        for inertial in shares.noises:
            if inertial.what == "white":
                noise[inertial.source.name] = np.zeros((n, n))
                where = slice(6, 9) if inertial.triad == 0 else slice(3, 6)
                noise[inertial.source.name][where, where] = inertial.size**2 * interval * inertial.mix @ inertial.mix.T
        fields = np.zeros((n, 3))
        fields[V] = interval * c_bn
        both = bias[:, :3], bias[:, 3:]
        propagation.step(NavigationStep(np.eye(n), constants, noise, both, interval, fields, 0.0))
    for number, name in enumerate(propagation.white):  # the rounding of the last pulse
        for inertial in shares.noises:
            if inertial.source.name == name and inertial.what == "quantum":
                axes = slice(6, 9) if inertial.triad == 0 else slice(3, 6)
                propagation.covariance[number, axes, axes] += inertial.size**2 / 12.0 * inertial.mix @ inertial.mix.T
    of_readings = by_mean_readings(motion, count) / float(time[-1] - time[0])
    last = only_position.copy()
    last[PHI, PHI], last[PHI, V] = of_readings[:, :3], of_readings[:, 3:]
    propagation.map(last)


_FITTED = 8
_X = slice(CORE, CORE + _FITTED)
"""The unknowns of the fit beside the navigation errors."""

_LONGEST = 1.0
_ANGLE = 1e-7
"""Step of the latitude for differences, rad."""


def samples_of_alignment(scenario: Scenario, motion: TrueMotion) -> int:
    """Return the number of samples that the navigator's own alignment takes, 0 without one."""
    section = scenario.navigation.alignment
    if section is None:
        return 0
    return alignment_samples(motion.ideal.time, section.duration_s, "navigation.alignment.duration_s")


def begin_aligned(
    scenario: Scenario, motion: TrueMotion, shares: Shares, series: tuple[Array, Array], count: int, core: int
) -> Propagation:
    """Return all sources' shares at the end of the navigator's own alignment, with `core` states, 9 or more."""
    section = scenario.navigation.alignment
    assert section is not None
    if section.method == "quiet":
        propagation = shares.begin(core)
        align(motion, shares, series, count, propagation)
        return propagation
    return _disturbed(scenario, motion, shares, series, count, core)


class _Session(NamedTuple):
    """The session in the inertial frame of the block's first instant."""

    motion: TrueMotion  # the true motion of the session, with the attitude in this frame
    edges: Array  # boundaries of the steps, (K+1,) s
    weight: Array  # W of the block of each step, over the share of the step in it, (K, 8, 3)
    gained: Array  # velocity gained by the specific force in each step, (K, 3) m/s
    last: Array  # J at the end, (3, 8)


def _session(motion: TrueMotion, count: int) -> _Session:
    """Linearise the fit about the true motion."""
    ideal = ImuData(motion.ideal.time[: count + 1], motion.ideal.dtheta[:count], motion.ideal.dvel[:count])
    q, velocity = inertial_curve(ideal)
    state = replace(rows_of(motion.state, slice(0, count + 1)), q_nb=q)
    fit, (rows, t, _) = fit_of_session(ideal, float(motion.state.latitude[0])), mean_blocks(ideal, velocity)
    jacobian = cone_jacobian(fit, t, fixed=True)
    weights = np.linalg.pinv(jacobian.reshape(-1, _FITTED) * _SCALE, rcond=1e-13) * _SCALE[:, None]
    weights = weights.reshape(_FITTED, len(t), 3).transpose(1, 0, 2)
    bounds = np.append(rows[:-1], count)
    parts = max(int(np.ceil(float(ideal.time[-1] - ideal.time[0]) / len(t) / _LONGEST)), 1)
    inner = [np.linspace(a, b, parts + 1)[:-1] for a, b in pairwise(bounds)]
    samples = np.unique(np.append(np.concatenate(inner), count).astype(np.int64))
    edges = ideal.time[samples]
    block = np.clip(np.searchsorted(bounds, samples[:-1], side="right") - 1, 0, len(t) - 1)
    within = np.diff(samples) / np.diff(bounds)[block]
    last = cone_jacobian(fit, ideal.time[-1:] - ideal.time[0], fixed=True)[0]
    weight = weights[block] * within[:, None, None]
    return _Session(replace(motion, ideal=ideal, state=state), edges, weight, np.diff(velocity[samples], axis=0), last)


_SCALE = np.array([1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1.0, 1.0, 1.0])
"""Sizes of the unknowns, as in the fit itself."""


def _disturbed(
    scenario: Scenario, motion: TrueMotion, shares: Shares, series: tuple[Array, Array], count: int, core: int
) -> Propagation:
    """Take all sources through the fit of the cone, by (1) and (2)."""
    session = _session(motion, count)
    n = CORE + _FITTED
    propagation = shares.begin(n)
    only_position = np.zeros((n, n))
    only_position[R, R] = np.eye(3)
    propagation.map(only_position)
    interval = np.diff(session.edges)
    f = np.zeros((len(interval), CORE, CORE))
    f[:, V, PHI] = skew(session.gained / interval[:, None])  # (1)
    phi = exponential(f, interval)
    drive = np.zeros((2, len(interval), CORE, 3))  # by gyros and accelerometers; the noise has no direction
    drive[0, :, PHI], drive[1, :, V] = -np.eye(3), np.eye(3)
    noise = {
        white.source.name: white_covariance(f, drive[white.triad] @ (white.size * white.mix), interval)
        for white in shares.noises
        if white.what == "white" and white.process is None
    }
    theta, velocity = (part[:, :count] for part in series)
    effects = session.motion.responses(session.edges, shares.kernel_columns, theta, velocity).core
    q_nb, q_ib = motion.state.q_nb[: count + 1], session.motion.state.q_nb
    to_frame = rotation.dcm_from_quaternion(rotation.multiply(q_ib, rotation.conjugate(q_nb)))
    middle = np.searchsorted(motion.ideal.time[: count + 1], 0.5 * (session.edges[1:] + session.edges[:-1]))
    for k, length in enumerate(interval.tolist()):
        over = np.zeros((n, CORE))  # what a change of the navigation errors in the step adds to the fit
        over[:CORE] = np.eye(CORE)
        over[_X, V] = 0.5 * session.weight[k]
        whole = np.eye(n)
        whole[:, :CORE] = over @ phi[k]
        whole[_X, V] += 0.5 * session.weight[k]
        constants = np.zeros((n, shares.count))
        constants[:, : shares.inertial] = over @ effects[k, :, : shares.inertial]
        bias = over @ effects[k, :, shares.inertial :]
        fields = over[:, V] @ (length * to_frame[middle[k]])
        driven = {name: over @ q[k] @ over.T for name, q in noise.items()}
        propagation.step(NavigationStep(whole, constants, driven, (bias[:, :3], bias[:, 3:]), length, fields, 0.0))
    propagation.project(_end(scenario, motion, session, count, core))
    return propagation


def _end(scenario: Scenario, motion: TrueMotion, session: _Session, count: int, core: int) -> Array:
    """Return the map to the navigation errors at the end of the session, (2), (core, 17)."""
    q_nb, q_ib = motion.state.q_nb[count], session.motion.state.q_nb[count]
    c = rotation.dcm_from_quaternion(rotation.multiply(q_nb, rotation.conjugate(q_ib)))
    matrix = np.zeros((core, CORE + _FITTED))
    matrix[R, R] = np.eye(3)
    matrix[V, V], matrix[PHI, PHI] = c, c  # (2)
    place = rows_of(motion.state, slice(0, 1))
    starts = [_aligned(scenario, motion, session, place, step) for step in (-_ANGLE, 0.0, _ANGLE)]
    turn = skew(np.asarray(starts[1].velocity_ned)[None])[0] @ c
    matrix[V, _X] = -c @ session.last
    matrix[V, _X][:, :3] += turn
    matrix[PHI, _X][:, :3] = c
    # the latitude that the navigator is given opens the cone of the fit
    meridian = float(radii(place.latitude, motion.trajectory.ellipsoid)[0][0] + place.height[0])
    between = rotation.multiply(starts[0].q_nb, rotation.conjugate(starts[2].q_nb))
    matrix[PHI, 0] = rotation.rotation_vector_from_quaternion(between) / (2.0 * _ANGLE * meridian)
    matrix[V, 0] = (starts[2].velocity_ned - starts[0].velocity_ned) / (2.0 * _ANGLE * meridian)
    return matrix


def _aligned(scenario: Scenario, motion: TrueMotion, session: _Session, place: NavState, step: float) -> NavState:
    """Return the state that perfect sensors align, given a latitude that is a step off."""
    given = replace(place, latitude=place.latitude[0] + step, longitude=place.longitude[0], height=place.height[0])
    return aligned_state(
        session.motion.ideal, given, "disturbed", expected_errors(scenario.imu), motion.gravity,
        motion.trajectory.ellipsoid,
    )[0]  # fmt: skip
