"""Noise that vibration adds to inertial readings, from the level of vibration that the readings show.

Under vibration gyros and accelerometers err more than at rest: their scale factors and linearity turn a shaking of rms
s into errors that scatter with it, samples are taken at instants that jitter, and what lies above half the sampling
rate is folded down. The part of it that is white from sample to sample, with the standard deviation κ s of a reading,
adds the density

    N_v = κ s √Δt

to the sensor's own N, N² + N_v² (IEEE Std 1293, 10.4, and IEEE Std 528: vibration-induced noise), with the sampling
interval Δt. Of an oscillation of frequency f that is sampled at instants which jitter by σ_t, an increment holds the
error s σ_t; so that much of κ, σ_t/Δt, follows from the time stamps alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.arguments import POSITIVE, checked_increments, number
from sinssim.data import Array, ImuData
from sinssim.errors import InputError

SLOW_S = 0.2
"""Time over which the readings' running mean is taken for the motion of the vehicle, s; the rest is vibration."""


class Change(NamedTuple):
    """Noise that drives the states of one block of an error model from an instant on."""

    time: float  # the instant, s
    block: str  # name of the block
    jump: Array  # covariance of a jump of the states at the instant, (b, b)
    density: Array  # spectral density of the additional noise from then on, (b, b) per second


@dataclass(frozen=True)
class AddedNoise:
    """Densities of white noise that add to those of an error model, in quadrature, from one instant to the next."""

    time: Array  # instants, in order, (W,) s; each row holds from its instant to the next
    # of the block's three axes, (W, 3) rad/√s; or a root L of the matrix L Lᵀ of spectral densities, (W, 3, 3)
    gyro: Array
    accel: Array  # the same, m/s/√s
    changes: tuple[Change, ...] = ()  # changes of the sensors' own errors

    def roots(self, begin: Array) -> Array:
        """Return the roots of the matrices of spectral densities of gyros and accelerometers from instants on, (K, 2,
        3, 3)."""
        row = self._row(begin)
        both = [
            density if density.ndim == 3 else density[:, :, None] * np.eye(3)
            for density in (self.gyro[row], self.accel[row])
        ]
        return np.stack(both, axis=1)

    def _row(self, begin: Array) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(self.time, begin + 1e-9, side="right") - 1, 0, None)

    def of_states(self, time: Array, places: Mapping[str, slice]) -> Iterator[tuple[int, slice, Array]]:
        """Yield the covariances by which the changes drive the states of an error model over intervals between edges,
        (K+1,) s."""
        for change in self.changes:
            if change.block in places:
                lasts = np.clip(time[1:] - np.maximum(time[:-1], change.time), 0.0, None)
                for k in np.flatnonzero((time[:-1] < change.time) & (change.time <= time[1:])):
                    yield int(k), places[change.block], change.jump
                for k in np.flatnonzero(lasts) if change.density.any() else ():
                    yield int(k), places[change.block], change.density * lasts[k]

    def plus(self, other: AddedNoise | None) -> AddedNoise:
        """Return the noise of both, of densities by axis, in quadrature; this one if there is no other."""
        if other is None:
            return self
        time = np.union1d(self.time, other.time)
        rows, more = self._row(time), other._row(time)
        return AddedNoise(
            time, np.hypot(self.gyro[rows], other.gyro[more]), np.hypot(self.accel[rows], other.accel[more])
        )

    def mirrored(self, begin: float, end: float) -> AddedNoise:
        """Return the noise of a run in reverse time between the same instants, s."""
        time = np.append(-np.inf, begin + end - self.time[:0:-1])
        return AddedNoise(time, self.gyro[::-1], self.accel[::-1])


@dataclass(frozen=True)
class Vibration:
    """Level of vibration along a run."""

    time: Array  # ends of the windows, (W,) s
    gyro: Array  # rms of the rates less their running mean, (W, 3) rad/s
    accel: Array  # rms of the specific forces less their running mean, (W, 3) m/s²
    interval: float  # mean sampling interval Δt, s
    jitter: float  # 1σ of the sampling interval relative to Δt


def vibration(imu: ImuData, window_s: float = 1.0) -> Vibration:
    """Return the level of vibration in windows of a run."""
    checked_increments(imu)
    window_s = number("window_s", window_s, "s", low=POSITIVE)
    steps = np.diff(imu.time)
    interval = float(np.mean(steps))
    wide, window = 2 * round(0.5 * SLOW_S / interval) + 1, max(round(window_s / interval), 1)
    if wide < 3 or window < wide or len(steps) < window:
        raise InputError(
            f"a level of vibration needs samples every {SLOW_S / 3.0:.3g} s or more often, windows of {SLOW_S:g} s or "
            f"longer, and at least one window of data; here are {len(steps)} samples of {interval:.3g} s for windows "
            f"of {window_s:g} s."
        )
    ends = np.arange(window, len(steps) + 1, window)
    gyro, accel = (_levels(part / steps[:, None], wide, ends) for part in (imu.dtheta, imu.dvel))
    return Vibration(imu.time[ends], gyro, accel, interval, float(np.std(steps)) / interval)


def _levels(rate: Array, wide: int, ends: NDArray[np.intp]) -> Array:
    """Return the rms of readings less their running mean, in windows, (W, 3)."""
    half = wide // 2
    padded = np.concatenate([np.repeat(rate[:1], half, axis=0), rate, np.repeat(rate[-1:], half, axis=0)])
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(padded - rate.mean(axis=0), axis=0)])
    fast = rate - rate.mean(axis=0) - (sums[wide:] - sums[:-wide]) / wide
    squares = np.concatenate([np.zeros((1, 3)), np.cumsum(fast * fast, axis=0)])
    begins = np.concatenate([[0], ends[:-1]])
    mean = (squares[ends] - squares[begins]) / (ends - begins)[:, None]
    return np.asarray(np.sqrt(mean * wide / (wide - 1)))  # the running mean holds 1/wide of white noise


def vibration_noise(vibration_levels: Vibration, gyro: float, accel: float) -> AddedNoise:
    """Return the noise κ s √Δt that vibration adds, with κ of gyros and accelerometers.

    The level of a window is that of the window before, as a filter in real time knows it; that of the first is its own.
    """
    kappa = [number(f"κ of the {name}", value, low=0.0) for name, value in (("gyros", gyro), ("accelerometers", accel))]
    start = vibration_levels.time[0] - (
        vibration_levels.time[1] - vibration_levels.time[0] if len(vibration_levels.time) > 1 else 1.0
    )
    parts = [
        k * np.sqrt(vibration_levels.interval) * np.concatenate([level[:1], level])
        for k, level in zip(kappa, (vibration_levels.gyro, vibration_levels.accel), strict=True)
    ]
    return AddedNoise(np.concatenate([[start], vibration_levels.time]), *parts)
