"""Compiled kernel of the sensor errors, stages 2 to 8 of `emulate` for one sample of one run, and its arrays.

A kernel that runs a sensor block through an ensemble holds, for R runs of six channels (three gyros, three
accelerometers):

    p[run, channel, parameter]   constants of a run, SI (`pack` fills it from `ImuErrors`)
    s[run, channel, state]       states carried from sample to sample (`begin` sets them)
    c[condition]                 conditions of a sample common to all runs (`advance` updates them)
    z[noise, channel, run]       normal numbers of the sample (`draw_sample` fills it), or of a block of samples

and calls, for each sample, `advance` and `draw_sample` once and `measure` for every run. Nothing else is kept; in
particular, no samples are stored. `active` gives the active stages; if it is a constant, the other stages are omitted
from the machine code.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from sinssim.data import DROPPED, FROZEN, SATURATED, Array
from sinssim.jit import rebound, strict_inline, strict_kernel
from sinssim.sensors.flicker import DIRECT, RATES, STATIONARY, WEIGHTS
from sinssim.sensors.imu.error_term import ErrorTerm, Regressor
from sinssim.sensors.imu.error_term_table import DTHETA_STEP, DVEL_STEP, FIELDS, SLOTS, STAGES
from sinssim.sensors.imu.imu_errors import Fault, ImuErrors, check_errors
from sinssim.statistics.random_numbers import (
    Words,
    lost,
    mean_step,
    normal_pair,
    normal_pairs,
    normal_pairs_of_runs,
    term_number,
)

# Stages of what needs the temperature and of the noises, as bits of `active`; faults are not in the table of terms
WARMING = sum({STAGES[term.stage] for term in FIELDS.values() if term.of_temperature})
WHITE, WANDERING, RATE_WALKING, FLICKERING = (
    STAGES[name] for name in ("WHITE", "WANDERING", "RATE_WALKING", "FLICKERING")
)
LIMITED, QUANTISED, FAULTY = STAGES["LIMITED"], STAGES["QUANTISED"], 2 * max(STAGES.values())

# Parameters of the noises
(RANDOM_WALK,), (INSTABILITY,), (RATE_WALK,) = SLOTS["random_walk"], SLOTS["instability"], SLOTS["rate_walk"]
(FLICKER,), (LIMIT,), (QUANTUM,) = SLOTS["flicker"], SLOTS["limit"], SLOTS["quantum"]
PARAMETERS = sum(map(len, SLOTS.values()))

# States
WANDER, WALKED, REMAINDER, LAST, FLICKERS = range(5)
STATES = FLICKERS + len(RATES)

# Conditions: edges of the interval, length, its root, and time of its middle since the start; temperature above the
# steady one at its start, factor over half of it, temperature in its middle; the length that the coefficients are valid
# for
FROM, TO, T, ROOT_T, MIDDLE, EXCESS, HALF_DECAY, WARMTH, FOR_T = range(9)
# constants: first edge, steady temperature, time constants of warm-up and instabilities
START, STEADY, WARM_UP, GYRO_TIME, ACCEL_TIME = range(9, 14)
# the four Gauss-Markov coefficients of the gyros and of the accelerometers
GYRO, ACCEL = 14, 18
CONDITIONS = 22
_BLOCK = 256  # number of samples whose random numbers are drawn together
_SAME = 1e-6  # relative; intervals that differ by less share their decay

# Noises
NOISES = (WHITE, WANDERING, RATE_WALKING, FLICKERING)
TERM_NUMBERS = tuple(
    term_number(name) for name in ("random walk", "bias instability", "rate random walk", "flicker", "flicker start")
)
_WHITE, _WANDERING, _RATE_WALKING, _FLICKERING, _START = range(5)

# The means of a Wiener process over equal intervals: their increments have the variance 2/3 and the covariance 1/6 of
# K²T, which a (1 − a, a) pair of weights on successive normal numbers gives if a(1 − a) = 1/6.
_MEAN_OF_WALK = 0.5 * (1.0 + 1.0 / math.sqrt(3.0))

_NEXT_AXIS, _OTHER_AXIS = (1, 2, 0), (2, 0, 1)  # the axes after x, y, z
_NEXT, _OTHER = (1, 2, 0, 4, 5, 3), (2, 0, 1, 5, 3, 4)  # the axes after each channel's own

# Faults
STEP, SPIKE, NARROW, DROP, FREEZE = range(5)
_KINDS = {"bias-step": STEP, "spike": SPIKE, "saturation": NARROW, "dropout": DROP, "freeze": FREEZE}

_KEPT = tuple(1.0 - rate for rate in RATES)
_FLICKERS = len(RATES)

Counts = NDArray[np.int64]


class FaultTable(NamedTuple):
    """Kinds of F faults, (F,), their first and last instants, (F, 2) s, and their effects on each channel, (F, 6)."""

    kinds: Counts
    spans: Array
    amounts: Array


class Packed(NamedTuple):
    """The errors of R runs.

    nothing: whether no run has any error.
    active: the stages that at least one run needs.
    parameters: (R, 6, PARAMETERS).
    conditions: the conditions common to all runs at the start, (CONDITIONS,).
    """

    nothing: bool
    active: int
    parameters: Array
    conditions: Array
    faults: FaultTable


@strict_inline
def parameter_k(p: Array, run: int, i: int, slot: int) -> float:
    """Parameter of a run's channel; like the next three, a kernel of another layout has its own in its place."""
    return p[run, i, slot]  # type: ignore[no-any-return]


@strict_inline
def state_k(s: Array, run: int, i: int, n: int) -> float:
    """State of a run's channel."""
    return s[run, i, n]  # type: ignore[no-any-return]


@strict_inline
def keep_k(s: Array, run: int, i: int, n: int, value: float) -> None:
    """Store a state of a run's channel."""
    s[run, i, n] = value


@strict_inline
def noise_k(z: Array, n: int, i: int, j: int) -> float:
    """Normal number of a noise and a channel."""
    return z[n, i, j]  # type: ignore[no-any-return]


@strict_inline
def begin(active: int, s: Array, run: int, key_0: np.uint64, key_1: np.uint64) -> None:
    """Set one run's initial state: stationary instability and flicker, zero sums.

    Args:
        s: states, (R, 6, STATES); those of the run are written.
        key_0, key_1: key of the run's seed.
    """
    for i in range(6):
        for n in range(STATES):
            keep_k(s, run, i, n, 0.0)
    for axis in range(3):
        if active & WANDERING:
            gyro_normal, two = normal_pair(key_0, key_1, np.int64(0), TERM_NUMBERS[_WANDERING], np.uint64(axis))
            keep_k(s, run, axis, WANDER, gyro_normal)
            keep_k(s, run, axis + 3, WANDER, two)
        if active & FLICKERING:
            for n in range(_FLICKERS):
                gyro_normal, two = normal_pair(key_0, key_1, np.int64(n), TERM_NUMBERS[_START], np.uint64(axis))
                for m in range(n, _FLICKERS):
                    place, weight = FLICKERS + m, STATIONARY[m, n]
                    keep_k(s, run, axis, place, state_k(s, run, axis, place) + weight * gyro_normal)
                    keep_k(s, run, axis + 3, place, state_k(s, run, axis + 3, place) + weight * two)


@strict_inline
def advance(active: int, c: Array, t0: float, t1: float) -> None:
    """Advance the conditions to the next interval. `c`: conditions, (CONDITIONS,); `t0`, `t1`: edges of the interval,
    s."""
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


@strict_kernel
def draw_sample(active: int, z: Array, k: int, key_0: Words, key_1: Words) -> None:
    """Draw the normal numbers of sample k of all runs, from 0, by the keys of the runs' seeds, (R,), into z, (4, 6, R),
    several at a time where the processor has vector units."""
    for n in range(4):
        if active & NOISES[n]:
            for axis in range(3):
                normal_pairs_of_runs(z[n, axis], z[n, axis + 3], key_0, key_1, k + 1, TERM_NUMBERS[n], np.uint64(axis))


@strict_inline
def _before(
    total: float, active: int, p: Array, run: int, i: int, u: Array, x: float, length: float, c: Array
) -> float:  # fmt: skip
    """Return the total: what precedes the first stage, and the first term."""
    return total


FIRST, STAGE = 0, 0
multiplies_k: Any = _before
terms_k: Any = _before
"""First parameter of a term, bit of a stage, what a term's values multiply, terms of a stage; bound by `_effect`."""


@strict_inline
def _of_three(
    total: float, active: int, p: Array, run: int, i: int, u: Array, x: float, length: float, c: Array
) -> float:  # fmt: skip
    """Add the effect of a term with one value for each axis, on an input of x/length along the sensitive axis."""
    sensitive_input, f = x / length, u[3 + i % 3] / length
    total = _before(total, active, p, run, i, u, x, length, c)
    total += parameter_k(p, run, i, FIRST) * multiplies_k(sensitive_input, sensitive_input, f, c[WARMTH], c[MIDDLE])
    return total


@strict_inline
def _of_six(
    total: float, active: int, p: Array, run: int, i: int, u: Array, x: float, length: float, c: Array
) -> float:  # fmt: skip
    """Add the effect of a term with values for the two other axes."""
    sensitive_input, after, other = x / length, _NEXT[i], _OTHER[i]
    first_factor = multiplies_k(sensitive_input, u[after] / length, u[3 + after % 3] / length, c[WARMTH], c[MIDDLE])
    two = multiplies_k(sensitive_input, u[other] / length, u[3 + other % 3] / length, c[WARMTH], c[MIDDLE])
    total = _before(total, active, p, run, i, u, x, length, c)
    total += parameter_k(p, run, i, FIRST) * first_factor + parameter_k(p, run, i, FIRST + 1) * two
    return total


@strict_inline
def _of_nine(
    total: float, active: int, p: Array, run: int, i: int, u: Array, x: float, length: float, c: Array
) -> float:  # fmt: skip
    """Add the effect of a term with values for the three axes of the block."""
    sensitive_input, k = x / length, i - i % 3
    first_factor = multiplies_k(sensitive_input, u[k] / length, u[3] / length, c[WARMTH], c[MIDDLE])
    two = multiplies_k(sensitive_input, u[k + 1] / length, u[4] / length, c[WARMTH], c[MIDDLE])
    three = multiplies_k(sensitive_input, u[k + 2] / length, u[5] / length, c[WARMTH], c[MIDDLE])
    total = _before(total, active, p, run, i, u, x, length, c)
    first = parameter_k(p, run, i, FIRST) * first_factor + parameter_k(p, run, i, FIRST + 1) * two
    total += first + parameter_k(p, run, i, FIRST + 2) * three
    return total


@strict_inline
def _if_active(
    total: float, active: int, p: Array, run: int, i: int, u: Array, x: float, length: float, c: Array
) -> float:  # fmt: skip
    """Add the terms of a stage, if a run needs it."""
    total = _before(total, active, p, run, i, u, x, length, c)
    if active & STAGE:
        total += terms_k(-0.0, active, p, run, i, u, x, length, c)
    return total


def _effect(acts_on: str) -> Any:
    """Compose the compiled function of all terms that act on one part of the reading, as `ErrorTerm.acts_on`, stage by
    stage. It takes the sum of what precedes them (−0 for nothing, because x + −0 is x for every x), the active stages,
    the arrays of `measure`, an increment x along the sensitive axis and its duration."""
    whole = _before
    acting_terms = [term for term in FIELDS.values() if term.multiplies and term.acts_on == acts_on]
    for stage in dict.fromkeys(term.stage for term in acting_terms):
        terms = whole if stage == "" else _before
        for term in acting_terms:
            if term.stage == stage:
                terms = rebound(
                    {3: _of_three, 6: _of_six, 9: _of_nine}[term.size], f"{term.field}_k", _before=terms,
                    FIRST=SLOTS[term.field][0], multiplies_k=strict_inline(cast(Regressor, term.multiplies)),
                )  # fmt: skip
        if stage == "":
            whole = terms
        else:
            name = f"{acts_on}_{stage.lower()}_k"
            whole = rebound(_if_active, name, _before=whole, STAGE=STAGES[stage], terms_k=terms)
    return whole


axis_k, response_k, scale_k, output_k = map(_effect, ("axis", "response", "scale", "output"))
BENDING = sum({STAGES[term.stage] for term in FIELDS.values() if term.multiplies and term.acts_on == "response"})


@strict_inline
def _sensed(active: int, u: Array, i: int, c: Array, p: Array, s: Array, run: int, z: Array, j: int) -> float:
    """Return channel i's increment after stages 2 to 5, without faults."""
    interval = c[T]
    x = axis_k(u[i], active, p, run, i, u, u[i], 1.0, c)
    n = x
    if active & BENDING:
        n += interval * response_k(-0.0, active, p, run, i, u, x, interval, c)
    scale = scale_k(-0.0, active, p, run, i, u, 1.0, 1.0, c)
    rate = output_k(-0.0, active, p, run, i, u, x, interval, c)
    if active & WANDERING:
        first = GYRO if i < 3 else ACCEL
        fresh, before = noise_k(z, _WANDERING, i, j), state_k(s, run, i, WANDER)
        rate += parameter_k(p, run, i, INSTABILITY) * (c[first + 2] * before + c[first + 3] * fresh)
        keep_k(s, run, i, WANDER, c[first] * before + c[first + 1] * fresh)
    if active & RATE_WALKING:
        fresh, before = c[ROOT_T] * noise_k(z, _RATE_WALKING, i, j), state_k(s, run, i, WALKED)
        rate += parameter_k(p, run, i, RATE_WALK) * (before + _MEAN_OF_WALK * fresh)
        keep_k(s, run, i, WALKED, before + fresh)
    if active & FLICKERING:
        fresh = noise_k(z, _FLICKERING, i, j)
        total = DIRECT * fresh
        for m in range(_FLICKERS):
            value = _KEPT[m] * state_k(s, run, i, FLICKERS + m) + fresh
            keep_k(s, run, i, FLICKERS + m, value)
            total += WEIGHTS[m] * value
        rate += parameter_k(p, run, i, FLICKER) * total
    y: float = (1.0 + scale) * n + rate * interval  # (2)
    if active & WHITE:
        y += parameter_k(p, run, i, RANDOM_WALK) * c[ROOT_T] * noise_k(z, _WHITE, i, j)
    return y


@strict_inline
def _delivered(
    active: int, y: float, i: int, c: Array, p: Array, s: Array, run: int, faults: FaultTable
) -> tuple[float, int]:
    """Return the output of channel i for its increment, stages 5 (faults) to 8, and its flags."""
    flags = 0
    limit = parameter_k(p, run, i, LIMIT) if parameter_k(p, run, i, LIMIT) > 0.0 else math.inf
    kinds, spans, amounts = faults.kinds, faults.spans, faults.amounts
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
    if active & QUANTISED and parameter_k(p, run, i, QUANTUM) > 0.0:
        # Whole pulses; the remainder stays in the counter.
        due = state_k(s, run, i, REMAINDER) + y
        y = np.rint(due / parameter_k(p, run, i, QUANTUM)) * parameter_k(p, run, i, QUANTUM)
        keep_k(s, run, i, REMAINDER, due - y)
    if active & FAULTY:
        for n in range(len(kinds)):
            if amounts[n, i] > 0.0 and spans[n, 0] < c[TO] and spans[n, 1] > c[FROM]:
                if kinds[n] == DROP:
                    y = 0.0
                    flags |= DROPPED
                elif kinds[n] == FREEZE:
                    y = state_k(s, run, i, LAST)
                    flags |= FROZEN
        keep_k(s, run, i, LAST, y)
    return y, flags


@strict_inline
def channel_k(
    active: int, u: Array, i: int, c: Array, p: Array, s: Array, run: int, z: Array, j: int, faults: FaultTable
) -> tuple[float, int]:
    """Return channel i's output for one sample, and its flags; the arguments are those of `measure`."""
    y = _sensed(active, u, i, c, p, s, run, z, j)
    if active & (FAULTY | LIMITED | QUANTISED):
        return _delivered(active, y, i, c, p, s, run, faults)
    return y, 0


@strict_inline
def measure(
    active: int, u: Array, y: Array, flags: NDArray[np.uint8], c: Array, p: Array, s: Array, run: int, z: Array, j: int,
    faults: FaultTable,
) -> None:  # fmt: skip
    """Convert one ideal sample to the output of a run's sensors.

    Args:
        u: ideal increments, gyros first, (6,) rad and m/s.
        y: measured increments, (6,), written.
        flags: flags of the channels, (6,), written if the sensors have a range or a fault.
        c: conditions of the sample, (CONDITIONS,).
        p: parameters, (R, 6, PARAMETERS).
        s: states, (R, 6, STATES), updated.
        z: normal numbers, (4, 6, J).
    """
    for i in range(6):
        y[i], flag = channel_k(active, u, i, c, p, s, run, z, j, faults)
        if active & (FAULTY | LIMITED):
            flags[i] = flag


@strict_kernel
def draw_block(active: int, z: Array, first: int, size: int, key_0: np.uint64, key_1: np.uint64) -> None:
    """Draw the normal numbers of consecutive samples of one run, from number `first` on, by the key of the run's seed,
    into the first `size` columns of z, (4, 6, J), for the processor's vector units."""
    for n in range(4):
        if active & NOISES[n]:
            for axis in range(3):
                normal_pairs(
                    z[n, axis, :size], z[n, axis + 3, :size], key_0, key_1, first + 1, TERM_NUMBERS[n], np.uint64(axis)
                )


@strict_kernel
def measure_all(
    of: Packed, key_0: np.uint64, key_1: np.uint64, time: Array, dtheta: Array, dvel: Array,
    gyro: Array, accel: Array, flags: NDArray[np.uint8],
) -> None:  # fmt: skip
    """Convert all samples of one run, with the edges `time`, (N+1,) s, and ideal increments, (N, 3) rad and m/s, to the
    output of its sensors, `gyro` and `accel`, (N, 3), by the key of the run's seed; the conditions are advanced. The
    flags of the channels, (N, 6), are written if the sensors can set any; else they are (0, 6)."""
    _, active, p, c, faults = of  # once: each attribute in the loop would count references to its arrays
    count = len(dtheta)
    z = np.empty((4, 6, _BLOCK))
    s = np.empty((1, 6, STATES))
    u, y, f = np.empty(6), np.empty(6), np.zeros(6, np.uint8)
    begin(active, s, 0, key_0, key_1)
    for base in range(0, count, _BLOCK):
        size = min(_BLOCK, count - base)
        draw_block(active, z, base, size, key_0, key_1)
        for j in range(size):
            k = base + j
            advance(active, c, time[k], time[k + 1])
            u[0], u[1], u[2] = dtheta[k, 0], dtheta[k, 1], dtheta[k, 2]
            u[3], u[4], u[5] = dvel[k, 0], dvel[k, 1], dvel[k, 2]
            measure(active, u, y, f, c, p, s, 0, z, j, faults)
            gyro[k, 0], gyro[k, 1], gyro[k, 2] = y[0], y[1], y[2]
            accel[k, 0], accel[k, 1], accel[k, 2] = y[3], y[4], y[5]
            if active & (FAULTY | LIMITED):
                for i in range(6):
                    flags[k, i] = f[i]


def pack(runs: Sequence[ImuErrors], start: float, *, rounded: bool = False) -> Packed:
    """Pack the errors of runs, of which correlation times, warm-up and faults are the same, into arrays, for samples
    from a first edge, s. Rounded sensors without pulses have steps of 2⁻⁵² rad and 2⁻⁴⁶ m/s."""
    parameters = np.zeros((len(runs), 6, PARAMETERS))
    for run, errors in enumerate(runs):
        check_errors(errors)
        for first, triad in ((0, errors.gyro), (3, errors.accel)):
            for field, slots in SLOTS.items():
                for slot, column in zip(slots, _parameter_columns(getattr(triad, field), FIELDS[field]), strict=True):
                    parameters[run, first : first + 3, slot] = column
    shared_errors = runs[0]
    faults = [fault for fault in shared_errors.faults if fault.kind != "jitter"]
    nothing = not (parameters.any() or faults)
    if rounded and not nothing:
        for first, step in ((0, DTHETA_STEP), (3, DVEL_STEP)):
            quantum = parameters[:, first : first + 3, QUANTUM]
            quantum[quantum == 0.0] = step
    needed: dict[str, list[int]] = {}
    for field, slots in SLOTS.items():
        needed.setdefault(FIELDS[field].stage, []).extend(slots)
    active = sum(bit for stage, bit in STAGES.items() if parameters[:, :, needed[stage]].any())
    conditions = np.zeros(CONDITIONS)
    conditions[START] = start
    conditions[STEADY], conditions[WARM_UP] = shared_errors.warm_up.steady, shared_errors.warm_up.time_constant
    conditions[EXCESS] = shared_errors.warm_up.start - shared_errors.warm_up.steady
    conditions[GYRO_TIME], conditions[ACCEL_TIME] = (
        shared_errors.gyro.correlation_time,
        shared_errors.accel.correlation_time,
    )
    return Packed(nothing, active + (FAULTY if faults else 0), parameters, conditions, _fault_table(faults))


def _parameter_columns(value: Any, term: ErrorTerm) -> Iterable[Any]:
    """Return the parameters of one term for the kernel's channels, one number or (3,) each."""
    if term.size == 6:
        return value[range(3), _NEXT_AXIS], value[range(3), _OTHER_AXIS]
    if term.size == 9:
        return tuple(np.asarray(value).T)
    return (value,) if term.slots is None else ()


def _fault_table(faults: Sequence[Fault]) -> FaultTable:
    return FaultTable(
        np.array([_KINDS[fault.kind] for fault in faults], dtype=np.int64),
        np.array([(fault.start, fault.end) for fault in faults]).reshape(-1, 2),
        np.array([fault.amount for fault in faults]).reshape(-1, 6),
    )
