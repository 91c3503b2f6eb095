"""The start after an alignment at rest: attitude errors by the mean readings of the session."""

from __future__ import annotations

import numpy as np

from sinssim import rotation
from sinssim.alignment.determination import determine
from sinssim.alignment.initial_conditions import initial_state
from sinssim.analyses.error_budget.motion import TrueMotion
from sinssim.analyses.error_budget.propagation import NavigationStep, Propagation
from sinssim.analyses.error_budget.shares import Shares
from sinssim.data import Array
from sinssim.sensors.aiding.base.measurement import CORE, PHI, V

_STEPS = np.repeat((1e-9, 1e-5), 3)
"""Steps of the differences, rad/s and m/s²: small against the Earth's rate and gravity, far above rounding."""


def by_mean_readings(motion: TrueMotion, count: int) -> Array:
    """Return the derivative of the aligned attitude's error φ with respect to the mean readings.

    Args:
        motion: the true motion, at rest.
        count: number of samples of the session.

    Returns:
        By gyros and accelerometers, (3, 6) s and s²/m, from central differences of eq. (1) itself.
    """
    seconds = float(motion.ideal.time[count] - motion.ideal.time[0])
    mean = np.concatenate([part[:count].sum(axis=0) for part in (motion.ideal.dtheta, motion.ideal.dvel)]) / seconds

    def aligned(readings: Array) -> Array:
        return initial_state(determine(readings[:3], readings[3:]), 0.0, 0.0, 0.0).q_nb

    found = np.empty((3, 6))
    for k, step in enumerate(_STEPS):
        off = step * np.eye(6)[k]
        plus, minus = aligned(mean + off), aligned(mean - off)
        turn = rotation.multiply(minus, rotation.conjugate(plus))  # q(φ₊ − φ₋)
        found[:, k] = rotation.rotation_vector_from_quaternion(turn) / (2.0 * step)
    return found


def align(
    motion: TrueMotion, shares: Shares, series: tuple[Array, Array], count: int, propagation: Propagation
) -> None:
    """Take all sources through the session, at whose end the filter or the navigator starts.

    During the session, the rows of velocity and attitude hold the sums of the reading errors of accelerometers and
    gyros. The end turns them into the attitude's error. Velocity is exact, and the position keeps its initial error.

    Args:
        propagation: at the start; changed.
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
        for own in shares.noises:
            if own.what == "white":
                noise[own.source.name] = np.zeros((n, n))
                where = slice(6, 9) if own.triad == 0 else slice(3, 6)
                noise[own.source.name][where, where] = own.size**2 * interval * own.mix @ own.mix.T
        fields = np.zeros((n, 3))
        fields[V] = interval * c_bn
        both = bias[:, :3], bias[:, 3:]
        propagation.step(NavigationStep(np.eye(n), constants, noise, both, interval, fields, 0.0))
    for number, name in enumerate(propagation.white):  # the rounding of the last pulse
        for own in shares.noises:
            if own.source.name == name and own.what == "quantum":
                axes = slice(6, 9) if own.triad == 0 else slice(3, 6)
                propagation.covariance[number, axes, axes] += own.size**2 / 12.0 * own.mix @ own.mix.T
    of_readings = by_mean_readings(motion, count) / float(time[-1] - time[0])
    last = only_position.copy()
    last[PHI, PHI], last[PHI, V] = of_readings[:, :3], of_readings[:, 3:]
    propagation.map(last)
