"""The errors of one sample of one run, as a function that any kernel can call: stages 2 to 8 of `emulate`.

A kernel that runs a sensor block through an ensemble holds, for R runs of six channels (three gyros, three
accelerometers):

    p[parameter, channel, run]   what is constant in a run, SI (`pack` fills it from `ImuErrors`)
    s[state, channel, run]       what goes on from sample to sample (`begin` sets it)
    c[condition]                 what all runs share at a sample (`advance` moves it on)
    z[noise, channel, run]       the normal numbers of the sample (`draw_sample` fills it), or of a block of samples

and calls `advance` once a sample, then for every run `draw_sample` and `measure`. Nothing is kept but that: no run's
samples are stored. `active` says which stages there are; a constant there leaves the others out of the machine code.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sinssim.data import DROPPED, FROZEN, SATURATED, Array
from sinssim.jit import strict_inline, strict_kernel
from sinssim.sensors.flicker import DIRECT, RATES, STATIONARY, WEIGHTS
from sinssim.sensors.gauss_markov import lost, mean_step
from sinssim.sensors.random_numbers import normal_pair, normal_pairs, term_number

# Stages, bits of `active`
TILTED, BENT, WARMING, RAMPING, G_SENSITIVE = 1, 2, 4, 8, 16
WHITE, WANDERING, RATE_WALKING, FLICKERING = 32, 64, 128, 256
FAULTY, LIMITED, QUANTISED = 512, 1024, 2048

# Parameters; "next" and "other" are the two axes after the channel's own, in the order x, y, z, x, …
(
    BIAS, SCALE, TILT_NEXT, TILT_OTHER, ASYMMETRY, QUADRATIC, CUBIC, CROSS_NEXT, CROSS_OTHER, SCALE_WARM, BIAS_WARM,
    RAMP, G_X, G_Y, G_Z, RANDOM_WALK, INSTABILITY, RATE_WALK, FLICKER, LIMIT, QUANTUM,
) = range(21)  # fmt: skip
PARAMETERS = 21

# States
WANDER, WALKED, REMAINDER, LAST, FLICKERS = range(5)
STATES = FLICKERS + len(RATES)

# Conditions: the interval's edges, length, its root, and its middle since the start; temperature above the steady one
# at its start, factor over half of it, temperature in its middle; the length that the coefficients are for
FROM, TO, T, ROOT_T, MIDDLE, EXCESS, HALF_DECAY, WARMTH, FOR_T = range(9)
# the constants: first edge, steady temperature, time constants of warm-up and instabilities
START, STEADY, WARM_UP, GYRO_TIME, ACCEL_TIME = range(9, 14)
# the four Gauss-Markov coefficients of the gyros and of the accelerometers
GYRO, ACCEL = 14, 18
CONDITIONS = 22
_BLOCK = 256  # samples whose random numbers are drawn together
_SAME = 1e-6  # relative; intervals that differ by less have the same decay

# Noises
NOISES = (WHITE, WANDERING, RATE_WALKING, FLICKERING)
TERMS = tuple(
    term_number(name) for name in ("random walk", "bias instability", "rate random walk", "flicker", "flicker start")
)
_WHITE, _WANDERING, _RATE_WALKING, _FLICKERING, _START = range(5)

# The means of a Wiener process over equal intervals: their increments have the variance 2/3 and the covariance 1/6 of
# K²T, which a (1 − a, a) pair of weights on successive normal numbers gives if a(1 − a) = 1/6.
_MEAN_OF_WALK = 0.5 * (1.0 + 1.0 / math.sqrt(3.0))

# Faults
STEP, SPIKE, NARROW, DROP, FREEZE = range(5)

_KEPT = tuple(1.0 - rate for rate in RATES)
_FLICKERS = len(RATES)

Words = NDArray[np.uint64]
Counts = NDArray[np.int64]


@strict_inline
def begin(active: int, p: Array, s: Array, run: int, key_0: np.uint64, key_1: np.uint64) -> None:
    """Set one run's state at the start: stationary instability and flicker, nothing accumulated.

    Args:
        active: stages there are.
        p: parameters, (PARAMETERS, 6, R).
        s: states, (STATES, 6, R), of which the run's are written.
        run: which run.
        key_0, key_1: of the run's seed.
    """
    s[:, :, run] = 0.0
    for axis in range(3):
        if active & WANDERING:
            one, two = normal_pair(key_0, key_1, np.int64(0), TERMS[_WANDERING], np.uint64(axis))
            s[WANDER, axis, run], s[WANDER, axis + 3, run] = one, two
        if active & FLICKERING:
            for n in range(_FLICKERS):
                one, two = normal_pair(key_0, key_1, np.int64(n), TERMS[_START], np.uint64(axis))
                for m in range(n, _FLICKERS):
                    s[FLICKERS + m, axis, run] += STATIONARY[m, n] * one
                    s[FLICKERS + m, axis + 3, run] += STATIONARY[m, n] * two


@strict_inline
def advance(active: int, c: Array, t0: float, t1: float) -> None:
    """Move the conditions on to the next interval.

    Args:
        active: stages there are.
        c: conditions, (CONDITIONS,).
        t0, t1: edges of the interval, s.
    """
    interval = t1 - t0
    c[FROM], c[TO], c[T] = t0, t1, interval
    c[ROOT_T] = math.sqrt(interval)
    c[MIDDLE] = 0.5 * ((t0 - c[START]) + (t1 - c[START]))
    if active & (WANDERING | WARMING) and abs(interval - c[FOR_T]) > _SAME * c[FOR_T]:
        c[FOR_T] = interval
        c[GYRO], c[GYRO + 1], c[GYRO + 2], c[GYRO + 3] = mean_step(interval / c[GYRO_TIME])
        c[ACCEL], c[ACCEL + 1], c[ACCEL + 2], c[ACCEL + 3] = mean_step(interval / c[ACCEL_TIME])
        c[HALF_DECAY] = 1.0 - lost(0.5 * interval / c[WARM_UP])
    if active & WARMING:
        middle = c[EXCESS] * c[HALF_DECAY]
        c[WARMTH] = c[STEADY] + middle
        c[EXCESS] = middle * c[HALF_DECAY]


@strict_inline
def draw_sample(active: int, z: Array, j: int, k: int, key_0: np.uint64, key_1: np.uint64) -> None:
    """Draw the normal numbers of one sample of one run.

    Args:
        active: stages there are.
        z: (4, 6, J), of which column j is written.
        j: which column.
        k: number of the sample, from 0.
        key_0, key_1: of the run's seed.
    """
    for n in range(4):
        if active & NOISES[n]:
            for axis in range(3):
                one, two = normal_pair(key_0, key_1, np.int64(k + 1), TERMS[n], np.uint64(axis))
                z[n, axis, j], z[n, axis + 3, j] = one, two


@strict_inline
def _channel(
    active: int,
    own: float,
    after: float,
    other: float,
    force_x: float,
    force_y: float,
    force_z: float,
    c: Array,
    gauss_markov: int,
    i: int,
    p: Array,
    s: Array,
    run: int,
    z: Array,
    j: int,
) -> float:
    """Return channel i's increment after stages 2 to 5, faults apart."""
    interval = c[T]
    x = own
    if active & TILTED:
        x += p[TILT_NEXT, i, run] * after + p[TILT_OTHER, i, run] * other
    n = x
    if active & BENT:
        mean = x / interval
        n += mean * (p[QUADRATIC, i, run] + p[CUBIC, i, run] * mean) * x + 0.5 * p[ASYMMETRY, i, run] * abs(x)
        n += mean * (p[CROSS_NEXT, i, run] * after + p[CROSS_OTHER, i, run] * other)
    scale, rate = p[SCALE, i, run], p[BIAS, i, run]
    if active & WARMING:
        scale += p[SCALE_WARM, i, run] * c[WARMTH]
        rate += p[BIAS_WARM, i, run] * c[WARMTH]
    if active & RAMPING:
        rate += p[RAMP, i, run] * c[MIDDLE]
    if active & G_SENSITIVE and i < 3:
        rate += (p[G_X, i, run] * force_x + p[G_Y, i, run] * force_y + p[G_Z, i, run] * force_z) / interval
    if active & WANDERING:
        fresh, before = z[_WANDERING, i, j], s[WANDER, i, run]
        rate += p[INSTABILITY, i, run] * (c[gauss_markov + 2] * before + c[gauss_markov + 3] * fresh)
        s[WANDER, i, run] = c[gauss_markov] * before + c[gauss_markov + 1] * fresh
    if active & RATE_WALKING:
        fresh, before = c[ROOT_T] * z[_RATE_WALKING, i, j], s[WALKED, i, run]
        rate += p[RATE_WALK, i, run] * (before + _MEAN_OF_WALK * fresh)
        s[WALKED, i, run] = before + fresh
    if active & FLICKERING:
        fresh = z[_FLICKERING, i, j]
        total = DIRECT * fresh
        for m in range(_FLICKERS):
            value = _KEPT[m] * s[FLICKERS + m, i, run] + fresh
            s[FLICKERS + m, i, run] = value
            total += WEIGHTS[m] * value
        rate += p[FLICKER, i, run] * total
    y: float = (1.0 + scale) * n + rate * interval  # (2)
    if active & WHITE:
        y += p[RANDOM_WALK, i, run] * c[ROOT_T] * z[_WHITE, i, j]
    return y


@strict_inline
def _output(
    active: int,
    y: float,
    c: Array,
    i: int,
    p: Array,
    s: Array,
    run: int,
    kinds: Counts,
    spans: Array,
    amounts: Array,
) -> tuple[float, int]:
    """Return what channel i gives out for its increment, stages 5 (faults) to 8, and its flags."""
    flags = 0
    limit = p[LIMIT, i, run] if active & LIMITED else math.inf
    if active & FAULTY:
        for n in range(len(kinds)):
            if spans[n, 0] < c[TO] and spans[n, 1] > c[FROM]:
                if kinds[n] == STEP:
                    y += amounts[n, i] * (min(spans[n, 1], c[TO]) - max(spans[n, 0], c[FROM]))
                elif kinds[n] == NARROW and amounts[n, i] > 0.0:
                    limit = min(limit, amounts[n, i])
            if kinds[n] == SPIKE and c[FROM] < spans[n, 0] <= c[TO]:
                y += amounts[n, i]
    if active & (LIMITED | FAULTY):
        most = limit * c[T]
        if abs(y) > most:
            y = math.copysign(most, y)
            flags |= SATURATED
    if active & QUANTISED and p[QUANTUM, i, run] > 0.0:
        # Whole pulses; the remainder stays in the counter, so that nothing is lost.
        due = s[REMAINDER, i, run] + y
        y = np.rint(due / p[QUANTUM, i, run]) * p[QUANTUM, i, run]
        s[REMAINDER, i, run] = due - y
    if active & FAULTY:
        for n in range(len(kinds)):
            if amounts[n, i] > 0.0 and spans[n, 0] < c[TO] and spans[n, 1] > c[FROM]:
                if kinds[n] == DROP:
                    y = 0.0
                    flags |= DROPPED
                elif kinds[n] == FREEZE:
                    y = s[LAST, i, run]
                    flags |= FROZEN
        s[LAST, i, run] = y
    return y, flags


@strict_inline
def measure(
    active: int,
    gx: float,
    gy: float,
    gz: float,
    ax: float,
    ay: float,
    az: float,
    c: Array,
    p: Array,
    s: Array,
    run: int,
    z: Array,
    j: int,
    kinds: Counts,
    spans: Array,
    amounts: Array,
) -> tuple[float, float, float, float, float, float, int, int, int, int, int, int]:
    """Return one sample as a run's sensors give it.

    Args:
        active: stages there are.
        gx, gy, gz: ideal angle increments, rad.
        ax, ay, az: ideal velocity increments, m/s.
        c: conditions of the sample, (CONDITIONS,).
        p: parameters, (PARAMETERS, 6, R).
        s: states, (STATES, 6, R), moved on.
        run: which run.
        z: normal numbers, (4, 6, J).
        j: which column of them is the sample's.
        kinds: of the faults, (F,).
        spans: their first and last instants, (F, 2) s.
        amounts: what they do to each channel, (F, 6).

    Returns:
        Six increments and the six channels' flags.
    """
    y0 = _channel(active, gx, gy, gz, ax, ay, az, c, GYRO, 0, p, s, run, z, j)
    y1 = _channel(active, gy, gz, gx, ax, ay, az, c, GYRO, 1, p, s, run, z, j)
    y2 = _channel(active, gz, gx, gy, ax, ay, az, c, GYRO, 2, p, s, run, z, j)
    y3 = _channel(active, ax, ay, az, ax, ay, az, c, ACCEL, 3, p, s, run, z, j)
    y4 = _channel(active, ay, az, ax, ax, ay, az, c, ACCEL, 4, p, s, run, z, j)
    y5 = _channel(active, az, ax, ay, ax, ay, az, c, ACCEL, 5, p, s, run, z, j)
    f0 = f1 = f2 = f3 = f4 = f5 = 0
    if active & (FAULTY | LIMITED | QUANTISED):
        y0, f0 = _output(active, y0, c, 0, p, s, run, kinds, spans, amounts)
        y1, f1 = _output(active, y1, c, 1, p, s, run, kinds, spans, amounts)
        y2, f2 = _output(active, y2, c, 2, p, s, run, kinds, spans, amounts)
        y3, f3 = _output(active, y3, c, 3, p, s, run, kinds, spans, amounts)
        y4, f4 = _output(active, y4, c, 4, p, s, run, kinds, spans, amounts)
        y5, f5 = _output(active, y5, c, 5, p, s, run, kinds, spans, amounts)
    return y0, y1, y2, y3, y4, y5, f0, f1, f2, f3, f4, f5


@strict_kernel
def measure_all(
    active: int,
    time: Array,
    dtheta: Array,
    dvel: Array,
    c: Array,
    p: Array,
    key_0: np.uint64,
    key_1: np.uint64,
    kinds: Counts,
    spans: Array,
    amounts: Array,
    gyro: Array,
    accel: Array,
    flags: NDArray[np.uint8],
) -> None:
    """Pass all samples of one run through its sensors.

    Args:
        active: stages there are.
        time: edges of the intervals, (N+1,) s.
        dtheta, dvel: ideal increments, (N, 3) rad and m/s.
        c: conditions at the start, (CONDITIONS,).
        p: parameters, (PARAMETERS, 6, 1).
        key_0, key_1: of the run's seed.
        kinds, spans, amounts: faults, as in `measure`.
        gyro, accel: measured increments, (N, 3), written.
        flags: of the channels, (N, 6), written where the sensors can set any; else (0, 6).
    """
    count = len(dtheta)
    z = np.empty((4, 6, _BLOCK))
    s = np.empty((STATES, 6, 1))
    begin(active, p, s, 0, key_0, key_1)
    for base in range(0, count, _BLOCK):
        size = min(_BLOCK, count - base)
        for n in range(4):  # a block of numbers at a time: eight at once in the machine's lanes
            if active & NOISES[n]:
                for axis in range(3):
                    normal_pairs(
                        z[n, axis, :size], z[n, axis + 3, :size], key_0, key_1, base + 1, TERMS[n], np.uint64(axis)
                    )
        for j in range(size):
            k = base + j
            advance(active, c, time[k], time[k + 1])
            y0, y1, y2, y3, y4, y5, f0, f1, f2, f3, f4, f5 = measure(
                active, dtheta[k, 0], dtheta[k, 1], dtheta[k, 2], dvel[k, 0], dvel[k, 1], dvel[k, 2],
                c, p, s, 0, z, j, kinds, spans, amounts,
            )  # fmt: skip
            gyro[k, 0], gyro[k, 1], gyro[k, 2] = y0, y1, y2
            accel[k, 0], accel[k, 1], accel[k, 2] = y3, y4, y5
            if active & (FAULTY | LIMITED):
                flags[k, 0], flags[k, 1], flags[k, 2], flags[k, 3], flags[k, 4], flags[k, 5] = f0, f1, f2, f3, f4, f5
