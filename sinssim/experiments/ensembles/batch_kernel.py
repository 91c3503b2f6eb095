"""The kernel of a batch: sensor errors and navigation of lanes of runs, sample by sample (chapter (8.16)).

A lane is a group of LANES runs whose numbers are neighbours in memory. The kernel calls the scalar functions of the
single run (channel_k of the sensors, step_level_k, and the parts of the attitude algorithm) for every run of a lane, so
that the compiler uses the processor's vector units across runs. It is a template: `engine` binds the names ACTIVE,
GRAVITY, VERTICAL and SIMPLIFIED to constants, the parts of the attitude algorithm to their functions, the layout's
functions to the accessors of the sensors' kernel, and what branches in the scalar functions to forms without branches
that hold in the range that `_inside_k` checks.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import cos
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.earth.gravity import EarthParameters, near_gravity_k
from sinssim.experiments.ensembles import batch_layout
from sinssim.experiments.ensembles.batch_layout import (
    ATTITUDE,
    LANES,
    LEFT,
    NAVIGATION_ROWS,
    READING,
    SENSOR_ROWS,
    START,
    keep_level_k,
    keep_noise_k,
    keep_parameter_k,
    level_k,
    noise_k,
)
from sinssim.experiments.ensembles.batch_layout import four_k as attitude_k
from sinssim.experiments.ensembles.batch_layout import keep_four_k as keep_attitude_k
from sinssim.jit import inline, kernel, rebound, strict_inline, strict_kernel, wide_vectors
from sinssim.rotation.quaternions import SERIES, Vector, small_half_angle_change_k, small_half_angle_series_k
from sinssim.sensors.imu.emulation_kernel import (
    NOISES,
    PARAMETERS,
    TERM_NUMBERS,
    FaultTable,
    Packed,
    advance,
    begin,
    channel_k,
)
from sinssim.statistics.random_numbers import Words, direction_k, philox, root_k, square_k, uniform_k
from sinssim.strapdown.attitude import REGISTRY
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.coning_sculling import WINDOW, Weights, fitted_k, small_turn_k
from sinssim.strapdown.engine_assembly import algorithm_file, guarded, parts
from sinssim.strapdown.frames.level import EXACT_EVERY, refreshed_k, start_level_k, step_level_k
from sinssim.strapdown.frames.navigation_problem import FORMS, Increments, Models, forces_k
from sinssim.strapdown.frames.vertical_channel import BARO_LOOP, FREE, HELD, Channel, Loop, error_after_k, loop_gains_k
from sinssim.strapdown.navigation_error import POLAR_LIMIT
from sinssim.system.registries import on_change

_LOW, _1, _32 = np.uint64(0xFFFFFFFF), np.uint64(1), np.uint64(32)
NOISE = 0
"""Number of a noise, bound below."""
ACTIVE, GRAVITY, VERTICAL, SIMPLIFIED = 0, 0, FREE, False
"""Stages of the sensor errors, number of the gravity model, vertical channel, radii (8.16); bound by `engines`."""
LOWEST, HIGHEST = -1e3, 30e3
"""Heights [m] within which a run stays in the kernel; bound by `engines`."""
_FASTEST, _EARTH_RATE, _CURVATURE = 1e4, 1e-4, 1.6e-7  # m/s; rad/s and 1/m, both more than on the Earth
_POLAR = 1.0 / cos(POLAR_LIMIT)

QUANTITIES = 10
"""Rows of the result: latitude, longitude, height, velocity (3), q_nb (4)."""
WORD_ROWS = 2 + 4 * 3 * len(NOISES)
"""Rows of a lane's words: the keys, and a block of four for each noise and axis."""
_HALF = WINDOW // 2


@strict_inline
def _inside_k(angle2: float, dt: float, h: float, v: Vector, secant: float) -> bool:
    """Whether a run is in the range of the forms without branches; false for numbers that are not finite."""
    speed = abs(v[0]) + abs(v[1]) + abs(v[2])
    turn = dt * (_EARTH_RATE + speed * _CURVATURE * secant)  # more than that of the frame in the interval
    low_turns = angle2 < SERIES and turn * turn < SERIES
    return low_turns and h > LOWEST and h < HIGHEST and speed < _FASTEST and secant > 0.0 and secant < _POLAR


@inline
def _moments_k(
    j: int, y: Array, y0: Array, y1: Array, y2: Array, y3: Array, y4: Array, a: Weights, b: Weights
) -> tuple[float, float, float]:
    """Increment, a₂ and a₃ of a run and channel, number j of its sample y, and those of its window y0 … y4."""
    x0, x1, x2, x3, x4 = y0[j], y1[j], y2[j], y3[j], y4[j]
    return (y[j], fitted_k(a, x0, x1, x2, x3, x4), fitted_k(b, x0, x1, x2, x3, x4))


@strict_inline
def _pairs_of_lane(w: Array, words: Words, axis: int, row: int) -> None:
    """Convert two rows of words to normal numbers, in short loops, whose chains of operations overlap."""
    for j in range(LANES):
        exponent, s = uniform_k(words[row, j], words[row + 1, j])
        keep_noise_k(w, NOISE, axis, j, exponent)
        keep_noise_k(w, NOISE, axis + 3, j, s)
    for j in range(LANES):
        keep_noise_k(w, NOISE, axis, j, square_k(noise_k(w, NOISE, axis, j), noise_k(w, NOISE, axis + 3, j)))
    for j in range(LANES):
        keep_noise_k(w, NOISE, axis, j, root_k(noise_k(w, NOISE, axis, j)))
    for j in range(LANES):
        radius, (cosine, sine) = noise_k(w, NOISE, axis, j), direction_k(words[row + 1, j])
        keep_noise_k(w, NOISE, axis, j, radius * cosine)
        keep_noise_k(w, NOISE, axis + 3, j, radius * sine)


@strict_kernel
def _draw_noise(w: Array, words: Words, number: int) -> None:
    """Draw the normal numbers of a sample for noise NOISE; a constant, so that the compiler sees constant rows.

    A block of words serves an even sample and the odd one that follows. The steps of `normal_pair` are separate loops:
    in a single one the processor waits for the results of each step, and takes a tenth longer.
    """
    wide_vectors()
    block = np.uint64(number) >> _1
    low, high, half = block & _LOW, block >> _32, 2 * (number & 1)
    for axis in range(3):
        row = 2 + 4 * (3 * NOISE + axis)
        if half == 0 or number == 1:  # the first sample is number 1, as 0 is the start
            for j in range(LANES):
                words[row, j], words[row + 1, j], words[row + 2, j], words[row + 3, j] = philox(
                    words[0, j], words[1, j], low, high, TERM_NUMBERS[NOISE], np.uint64(axis)
                )
        if half == 0:
            _pairs_of_lane(w, words, axis, row)
        else:
            _pairs_of_lane(w, words, axis, row + 2)


_draw_white, _draw_wander, _draw_rate_walk, _draw_flicker = (
    rebound(_draw_noise, f"_draw_noise_{n}", NOISE=n) for n in range(len(NOISES))
)


@strict_kernel
def _draw_lane(w: Array, words: Words, number: int) -> None:
    """Draw the normal numbers of a sample for the active noises."""
    if ACTIVE & NOISES[0]:
        _draw_white(w, words, number)
    if ACTIVE & NOISES[1]:
        _draw_wander(w, words, number)
    if ACTIVE & NOISES[2]:
        _draw_rate_walk(w, words, number)
    if ACTIVE & NOISES[3]:
        _draw_flicker(w, words, number)


@strict_kernel
def _measure_lane(w: Array, u: Array, c: Array, faults: FaultTable) -> None:
    """Convert an ideal sample to the readings of all runs."""
    wide_vectors()
    for i in range(6):
        for j in range(LANES):
            y, _ = channel_k(ACTIVE, u, i, c, w, w, j, w, j, faults)
            w[(READING + i) * LANES + j] = y


@kernel
def _step_lane(
    x: Array, y: Array, weights: Array, row: int, place: int, slots: NDArray[np.int64],
    p: EarthParameters, gains: tuple[float, float], dt: float, reference: tuple[float, float],
) -> None:  # fmt: skip
    """Advance all runs over the interval whose sample is number `place` of the window in `slots`."""
    wide_vectors()
    a = (weights[row, 0], weights[row, 1], weights[row, 2], weights[row, 3], weights[row, 4])
    b = (weights[row, 5], weights[row, 6], weights[row, 7], weights[row, 8], weights[row, 9])
    y0, y1, y2, y3, y4, sample = y[slots[0]], y[slots[1]], y[slots[2]], y[slots[3]], y[slots[4]], y[slots[place]]
    of = Models(p, GRAVITY, SIMPLIFIED)
    for j in range(LANES):
        m0, m1, m2, m3, m4, m5 = (
            _moments_k(j, sample, y0, y1, y2, y3, y4, a, b),
            _moments_k(LANES + j, sample, y0, y1, y2, y3, y4, a, b),
            _moments_k(2 * LANES + j, sample, y0, y1, y2, y3, y4, a, b),
            _moments_k(3 * LANES + j, sample, y0, y1, y2, y3, y4, a, b),
            _moments_k(4 * LANES + j, sample, y0, y1, y2, y3, y4, a, b),
            _moments_k(5 * LANES + j, sample, y0, y1, y2, y3, y4, a, b),
        )
        turn, angle2 = small_turn_k(
            (m0[0], m1[0], m2[0], m3[0], m4[0], m5[0]),
            (m0[1], m1[1], m2[1], m3[1], m4[1], m5[1]),
            (m0[2], m1[2], m2[2], m3[2], m4[2], m5[2]),
        )
        lon0, gain2 = x[(START + 1) * LANES + j], x[(START + 2) * LANES + j]
        attitude = attitude_k(x, ATTITUDE, j)
        gains_of_run = gains[0], gain2, gains[1]
        forces, run = forces_k(dcm_k(attitude), turn), level_k(x, j)
        state, frame = step_level_k(of, VERTICAL, gains_of_run, dt, lon0, reference, forces, run)
        keep_level_k(x, j, state)
        keep_attitude_k(x, ATTITUDE, j, step_k(attitude, turn, frame))
        inside = _inside_k(angle2, dt, state.h, state.v, state.at.i)
        x[LEFT * LANES + j] = x[LEFT * LANES + j] if inside else 1.0


@kernel
def _refresh_lane(x: Array) -> None:
    """Take sine and cosine of the latitude anew."""
    for j in range(LANES):
        keep_level_k(x, j, refreshed_k(x[START * LANES + j], level_k(x, j)))


@kernel
def _begin_lane(
    x: Array, initial: Array, p: EarthParameters, reference: float, time_constant: float, first: int, last: int
) -> tuple[float, float]:  # fmt: skip
    """Set the navigation of a lane to its initial states; return the first and the third gain of the baro loop."""
    gain1, gain3 = 0.0, 0.0
    for j in range(LANES):
        run = min(first + j, last - 1)
        lat, lon, h = initial[0, run], initial[1, run], initial[2, run]
        error = error_after_k(reference, h, 0.0) if VERTICAL == BARO_LOOP else 0.0
        v = initial[3, run], initial[4, run], initial[5, run]
        state = start_level_k(Models(p, GRAVITY, SIMPLIFIED), lat, h, v, Loop(0.0, error))
        gain1, gain2, gain3 = loop_gains_k(time_constant, state.at.gd, state.at.k2)
        keep_level_k(x, j, state)
        q = initial[6, run], initial[7, run], initial[8, run], initial[9, run]
        keep_attitude_k(x, ATTITUDE, j, start_k(q[0], q[1], q[2], q[3]))
        x[START * LANES + j], x[(START + 1) * LANES + j], x[(START + 2) * LANES + j] = lat, lon, gain2
        x[LEFT * LANES + j] = 0.0
    return gain1, gain3


@kernel
def _keep_lane(x: Array, out: Array, epoch: int, first: int, last: int) -> None:
    """Store the states of a lane at an epoch."""
    for j in range(last - first):
        state, run = level_k(x, j), first + j
        out[0, epoch, run] = x[START * LANES + j] + state.north
        out[1, epoch, run] = x[(START + 1) * LANES + j] + state.east
        out[2, epoch, run] = state.h
        out[3, epoch, run], out[4, epoch, run], out[5, epoch, run] = state.v
        q0, q1, q2, q3, _ = quaternion_k(attitude_k(x, ATTITUDE, j))
        out[6, epoch, run], out[7, epoch, run], out[8, epoch, run], out[9, epoch, run] = q0, q1, q2, q3


@strict_kernel
def _prepare_lane(w: Array, parameters: Array, keys: Words, words: Words, first: int, last: int) -> None:
    """Set the sensors of a lane to the start; the last run fills the lane up."""
    for j in range(LANES):
        run = min(first + j, last - 1)
        words[0, j], words[1, j] = keys[0, run], keys[1, run]
        for i in range(6):
            for slot in range(PARAMETERS):
                keep_parameter_k(w, j, i, slot, parameters[run, i, slot])
        begin(ACTIVE, w, j, keys[0, run], keys[1, run])


@kernel
def navigate_lanes(
    data: Increments, p: EarthParameters, channel: Channel, sensors: Packed, keys: Words, initial: Array,
    epochs: NDArray[np.int64], first_run: int, last_run: int, out: Array, left: Array,
) -> None:  # fmt: skip
    """Measure and navigate the runs first_run … last_run − 1, lane by lane, by ideal increments at the sensors, N ≥
    WINDOW, keys of the runs' seeds (2, R), and initial states (QUANTITIES, R). Write the states at the epochs, numbers
    of edges in order (E,), to `out` (QUANTITIES, E, R); and 1 to `left` (R,) for runs that left the range of the
    kernel, whose states are not valid."""
    w, x, y = np.empty(SENSOR_ROWS * LANES), np.empty(NAVIGATION_ROWS * LANES), np.empty((WINDOW, 6 * LANES))
    words, c = np.empty((WORD_ROWS, LANES), np.uint64), np.empty(len(sensors.conditions))
    for first in range(first_run, last_run, LANES):
        last = min(first + LANES, last_run)
        _prepare_lane(w, sensors.parameters, keys, words, first, last)
        c[:] = sensors.conditions
        reference = channel.height[0] if VERTICAL != FREE else 0.0
        gains = _begin_lane(x, initial, p, reference, channel.time_constant, first, last)
        _navigate_lane(data, p, channel, sensors.faults, gains, initial, epochs, first, last, out, (w, x, y, c), words)
        for j in range(last - first):
            left[first + j] = x[LEFT * LANES + j]


@kernel
def _navigate_lane(
    data: Increments, p: EarthParameters, channel: Channel, faults: FaultTable, gains: tuple[float, float],
    initial: Array, epochs: NDArray[np.int64], first: int, last: int, out: Array, work: tuple[Array, ...],
    words: Words,
) -> None:  # fmt: skip
    """Measure and navigate a lane from its start, sample by sample, until the last epoch."""
    count, number = len(data.dtheta), len(epochs)
    w, x, y, c = work
    u, slots = np.empty(6), np.empty(WINDOW, np.int64)
    k, epoch = 0, 0
    while epoch < number and epochs[epoch] == 0:
        out[:, epoch, first:last] = initial[:, first:last]
        epoch += 1
    for t in range(count):
        if epoch == number:
            break
        advance(ACTIVE, c, data.time[t], data.time[t + 1])
        _draw_lane(w, words, t + 1)
        u[0], u[1], u[2] = data.dtheta[t, 0], data.dtheta[t, 1], data.dtheta[t, 2]
        u[3], u[4], u[5] = data.dvel[t, 0], data.dvel[t, 1], data.dvel[t, 2]
        _measure_lane(w, u, c, faults)
        y[t % WINDOW] = w[READING * LANES : (READING + 6) * LANES]
        if t < WINDOW - 1:
            continue
        while k <= t - _HALF or (t == count - 1 and k < count):
            start = min(max(k - _HALF, 0), count - WINDOW)
            for m in range(WINDOW):
                slots[m] = (start + m) % WINDOW
            if k % EXACT_EVERY == 0:
                _refresh_lane(x)
            reference = channel.height[k + 1] if VERTICAL != FREE else 0.0
            climb = channel.climb[k + 1] if VERTICAL == HELD else 0.0
            _step_lane(
                x, y, data.weights, k - start if data.uniform else k, k - start, slots,
                p, gains, data.time[k + 1] - data.time[k], (reference, climb),
            )  # fmt: skip
            k += 1
            while epoch < number and epochs[epoch] == k:
                _keep_lane(x, out, epoch, first, last)
                epoch += 1


_VARIABLES = {
    4: (batch_layout.four_k, batch_layout.keep_four_k),
    8: (batch_layout.eight_k, batch_layout.keep_eight_k),
    9: (batch_layout.nine_k, batch_layout.keep_nine_k),
}
_IN_RANGE = {
    "half_angle_series_k": small_half_angle_series_k,
    "half_angle_change_k": small_half_angle_change_k,
}
_ANY_HEIGHT = 1e9  # m, either way


@inline
def low_gravity_k(
    p: EarthParameters, model: int, sin_lat: float, cos_lat: float, r2: float, height: float
) -> tuple[float, float]:
    """Normal gravity, north and down, within the heights of `near_gravity_k`."""
    return near_gravity_k(p, sin_lat, cos_lat, height)


def variables_of(algorithm: str) -> int | None:
    """Return the number of an algorithm's attitude variables; None if they are not numbers of one kind."""
    kinds = get_args(getattr(algorithm_file(algorithm), "Attitude", None))
    return len(kinds) if len(kinds) in _VARIABLES and set(kinds) == {float} else None


@cache
def engine(algorithm: str, gravity: int, vertical: int, curvature: str, active: int) -> Callable[..., None]:
    """Return the compiled kernel `navigate_lanes` of an algorithm that `why_algorithm_unsupported` admits."""
    suffix = algorithm.replace("-", "_")
    of_algorithm = {
        name: rebound(parts(algorithm)[name], f"{name}_{suffix}_in_range", **_IN_RANGE)
        for name in ("start_k", "dcm_k", "step_k", "quaternion_k")
    }
    load, keep = _VARIABLES[variables_of(algorithm) or 4]
    constants: dict[str, Any] = {
        "ACTIVE": active, "GRAVITY": gravity, "VERTICAL": vertical, "SIMPLIFIED": curvature == "simplified",
    }  # fmt: skip
    if gravity == 0:
        constants["gravity_ned_k"] = low_gravity_k
    else:
        constants |= {"LOWEST": -_ANY_HEIGHT, "HIGHEST": _ANY_HEIGHT}
    of_layout = {name: getattr(batch_layout, name) for name in ("parameter_k", "state_k", "keep_k", "noise_k")}
    name = f"batch_{algorithm}_{gravity}_{vertical}_{curvature}_{active}".replace("-", "_")
    made: Callable[..., None] = rebound(
        navigate_lanes, name, attitude_k=load, keep_attitude_k=keep,
        **constants, **of_algorithm, **_IN_RANGE, **of_layout, **FORMS.get(curvature, {}),
    )  # fmt: skip
    return guarded(algorithm, made) if REGISTRY[algorithm].path else made


on_change.append(engine.cache_clear)
