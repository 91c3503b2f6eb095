"""Where the numbers of a lane are: in one array, a row of LANES numbers, one for each run, for every quantity.

The offsets between rows are constants, from which the compiler sees that stores and loads do not overlap; otherwise it
would not vectorise the loops over a lane's runs.
"""

from __future__ import annotations

from sinssim.data import Array
from sinssim.jit import strict_inline
from sinssim.sensors.imu.error_kernel import NOISES, PARAMETERS, STATES

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
    """Parameter of a run's channel, as `error_kernel.parameter_k`."""
    return p[(_PARAMETER + 6 * slot + i) * LANES + run]  # type: ignore[no-any-return]


@strict_inline
def keep_parameter_k(p: Array, run: int, i: int, slot: int, value: float) -> None:
    """Store a parameter of a run's channel."""
    p[(_PARAMETER + 6 * slot + i) * LANES + run] = value


@strict_inline
def state_k(s: Array, run: int, i: int, n: int) -> float:
    """State of a run's channel, as `error_kernel.state_k`."""
    return s[(_STATE + 6 * n + i) * LANES + run]  # type: ignore[no-any-return]


@strict_inline
def keep_k(s: Array, run: int, i: int, n: int, value: float) -> None:
    """Store a state of a run's channel, as `error_kernel.keep_k`."""
    s[(_STATE + 6 * n + i) * LANES + run] = value


@strict_inline
def noise_k(z: Array, n: int, i: int, j: int) -> float:
    """Normal number of a noise and a channel, as `error_kernel.noise_k`."""
    return z[(_NOISE + 6 * n + i) * LANES + j]  # type: ignore[no-any-return]


@strict_inline
def keep_noise_k(z: Array, n: int, i: int, j: int, value: float) -> None:
    """Store a normal number."""
    z[(_NOISE + 6 * n + i) * LANES + j] = value
