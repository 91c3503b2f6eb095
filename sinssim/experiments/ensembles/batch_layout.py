"""The rows of a lane: where the numbers of its runs are, and how the tuples of a run are loaded from them and stored.

All numbers are in one array, a row of LANES numbers, one for each run, for every quantity. The offsets between rows are
constants, from which the compiler sees that stores and loads do not overlap; otherwise it would not vectorise the loops
over a lane's runs.
"""

from __future__ import annotations

from sinssim.data import Array
from sinssim.jit import inline, strict_inline
from sinssim.rotation.quaternions import Matrix, Quaternion
from sinssim.sensors.imu.emulation_kernel import NOISES, PARAMETERS, STATES
from sinssim.strapdown.frames.level import LevelState, Place
from sinssim.strapdown.frames.vertical_channel import Loop

LANES = 64
"""Number of runs in a lane: a multiple of the numbers in any vector register, and few enough for the first cache."""

# sensors: rows of the array of a lane
_NOISE = 0
_STATE = _NOISE + 6 * len(NOISES)
_PARAMETER = _STATE + 6 * STATES
READING = _PARAMETER + 6 * PARAMETERS
"""First row of the six measured increments of the last sample."""
SENSOR_ROWS = READING + 6
"""Number of rows of the sensors."""

# navigation: rows of another array
LEVEL = 18
"""Number of rows of the state of the level frame."""
ATTITUDE = LEVEL
"""First row of the attitude variables."""
_MOST_VARIABLES = 9
START = ATTITUDE + _MOST_VARIABLES
"""First row of what is constant in a run: latitude and longitude of the start, second gain of the baro loop."""
LEFT = START + 3
"""Row of the mark of runs that left the range of the kernel: 0 or 1."""
NAVIGATION_ROWS = LEFT + 1
"""Number of rows of the navigation."""


@strict_inline
def parameter_k(p: Array, run: int, i: int, slot: int) -> float:
    """Parameter of a run's channel, as `emulation_kernel.parameter_k`."""
    return p[(_PARAMETER + 6 * slot + i) * LANES + run]  # type: ignore[no-any-return]


@strict_inline
def keep_parameter_k(p: Array, run: int, i: int, slot: int, value: float) -> None:
    """Store a parameter of a run's channel."""
    p[(_PARAMETER + 6 * slot + i) * LANES + run] = value


@strict_inline
def state_k(s: Array, run: int, i: int, n: int) -> float:
    """State of a run's channel, as `emulation_kernel.state_k`."""
    return s[(_STATE + 6 * n + i) * LANES + run]  # type: ignore[no-any-return]


@strict_inline
def keep_k(s: Array, run: int, i: int, n: int, value: float) -> None:
    """Store a state of a run's channel, as `emulation_kernel.keep_k`."""
    s[(_STATE + 6 * n + i) * LANES + run] = value


@strict_inline
def noise_k(z: Array, n: int, i: int, j: int) -> float:
    """Normal number of a noise and a channel, as `emulation_kernel.noise_k`."""
    return z[(_NOISE + 6 * n + i) * LANES + j]  # type: ignore[no-any-return]


@strict_inline
def keep_noise_k(z: Array, n: int, i: int, j: int, value: float) -> None:
    """Store a normal number."""
    z[(_NOISE + 6 * n + i) * LANES + j] = value


Eight = tuple[float, float, float, float, float, float, float, float]


@inline
def level_k(x: Array, j: int) -> LevelState:
    """State in the level frame of run j."""
    return LevelState(
        (x[j], x[LANES + j], x[2 * LANES + j]),
        (x[3 * LANES + j], x[4 * LANES + j], x[5 * LANES + j]),
        x[6 * LANES + j], x[7 * LANES + j], x[8 * LANES + j],
        Place(x[9 * LANES + j], x[10 * LANES + j], x[11 * LANES + j], x[12 * LANES + j],
        x[13 * LANES + j], x[14 * LANES + j], x[15 * LANES + j]),
        Loop(x[16 * LANES + j], x[17 * LANES + j]),
    )  # fmt: skip


@inline
def keep_level_k(x: Array, j: int, state: LevelState) -> None:
    """Store the state of run j."""
    x[j], x[LANES + j], x[2 * LANES + j] = state.v
    x[3 * LANES + j], x[4 * LANES + j], x[5 * LANES + j] = state.a
    x[6 * LANES + j], x[7 * LANES + j], x[8 * LANES + j] = state.h, state.north, state.east
    (
        x[9 * LANES + j], x[10 * LANES + j], x[11 * LANES + j], x[12 * LANES + j],
        x[13 * LANES + j], x[14 * LANES + j], x[15 * LANES + j]
    ) = state.at  # fmt: skip
    x[16 * LANES + j], x[17 * LANES + j] = state.loop


@inline
def four_k(x: Array, row: int, j: int) -> Quaternion:
    """Four attitude variables of run j, from a row on."""
    i = row * LANES + j
    return x[i], x[i + LANES], x[i + 2 * LANES], x[i + 3 * LANES]


@inline
def keep_four_k(x: Array, row: int, j: int, v: Quaternion) -> None:
    """Store four attitude variables of run j."""
    i = row * LANES + j
    x[i], x[i + LANES], x[i + 2 * LANES], x[i + 3 * LANES] = v


@inline
def eight_k(x: Array, row: int, j: int) -> Eight:
    """Eight attitude variables of run j, from a row on."""
    i = row * LANES + j
    return (
        x[i],
        x[i + LANES],
        x[i + 2 * LANES],
        x[i + 3 * LANES],
        x[i + 4 * LANES],
        x[i + 5 * LANES],
        x[i + 6 * LANES],
        x[i + 7 * LANES],
    )


@inline
def keep_eight_k(x: Array, row: int, j: int, v: Eight) -> None:
    """Store eight attitude variables of run j."""
    i = row * LANES + j
    (
        x[i],
        x[i + LANES],
        x[i + 2 * LANES],
        x[i + 3 * LANES],
        x[i + 4 * LANES],
        x[i + 5 * LANES],
        x[i + 6 * LANES],
        x[i + 7 * LANES],
    ) = v


@inline
def nine_k(x: Array, row: int, j: int) -> Matrix:
    """Nine attitude variables of run j, from a row on."""
    i = row * LANES + j
    return (
        x[i], x[i + LANES], x[i + 2 * LANES], x[i + 3 * LANES], x[i + 4 * LANES],
        x[i + 5 * LANES], x[i + 6 * LANES], x[i + 7 * LANES], x[i + 8 * LANES],
    )  # fmt: skip


@inline
def keep_nine_k(x: Array, row: int, j: int, v: Matrix) -> None:
    """Store nine attitude variables of run j."""
    i = row * LANES + j
    (
        x[i], x[i + LANES], x[i + 2 * LANES], x[i + 3 * LANES], x[i + 4 * LANES],
        x[i + 5 * LANES], x[i + 6 * LANES], x[i + 7 * LANES], x[i + 8 * LANES],
    ) = v  # fmt: skip
