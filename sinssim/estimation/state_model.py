"""The error model: blocks of states for the errors of inertial navigation and of the sensors.

The state is an error. For navigation it is solution minus truth, as in `sinssim.strapdown.navigation_error`: position
and velocity north, east, down, and the attitude φ with C_solution = (I − [φ×]) C_true; near a pole velocity and
attitude are compared without a turn about the vertical (`sinssim.strapdown.navigation_error`). For a sensor
parameter it is the true value minus the compensated value, so that the state of a gyro bias is the remaining bias of
the increments that the engine receives.

Every block is one of three processes, ẋ = −x/τ + w: a constant (w = 0, τ = ∞), a random walk (τ = ∞), or a stationary
first-order Gauss-Markov process, whose noise follows from its standard deviation, w = σ √(2/τ) per √Hz. A process over
the distance travelled has a correlation distance D instead; at the horizontal speed v its τ is D/v.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim.arguments import POSITIVE, check_kind, names, number, numbers
from sinssim.data import Array, short_repr
from sinssim.errors import InputError, check_name, shortened, unknown_name
from sinssim.sensors import flicker
from sinssim.sensors.aiding_registry import own_errors
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import FIELDS, SLOTS, TERMS
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors, WarmUp, check_sigmas
from sinssim.strapdown.frames import AXES

_NED = ("north", "east", "down")
_BODY = ("forward", "right", "down")
_ANGLES = ("xy", "xz", "yx", "yz", "zx", "zy")

_LARGEST = np.repeat((100.0, 5.0, 1e-3), 3)
"""Largest errors of position [m], velocity [m/s] and attitude [rad] carried in the filter over a segment: their
second-order effects are below 2 mm, 5 µm/s² and 0.1″."""

_LARGEST_OWN = {" delay": 5e-3, " time offset": 5e-3, " mounting": 1e-2}
"""The same for a delay [s] and for the mounting of a land vehicle [rad]: the second-order effects are below 0.3 mm at
20 m/s², and below 2 mm/s at 30 m/s."""

MOST_PROCESSES = 9
"""Most processes of a triad's flicker noise: nine decades."""

NAVIGATION = ("position", "velocity", "attitude")
"""The first blocks of every model, in this order."""

GRAVITY = "gravity disturbance"
"""The states of the gravity that the navigator does not know."""

_PROCESSES = tuple(f"flicker {k + 1}" for k in range(MOST_PROCESSES))

BLOCKS: dict[str, tuple[tuple[str, ...], str]] = {
    "position": (_NED, "m"),
    "velocity": (_NED, "m/s"),
    "attitude": (_NED, "rad"),
    "gyro bias": (_BODY, "rad/s"),
    "accelerometer bias": (_BODY, "m/s²"),
    "gyro instability": (_BODY, "rad/s"),
    "accelerometer instability": (_BODY, "m/s²"),
    "gyro scale": (_BODY, ""),
    "accelerometer scale": (_BODY, ""),
    "gyro misalignment": (_ANGLES, "rad"),
    "accelerometer misalignment": (_ANGLES, "rad"),
    **{
        f"{triad} {what}": (axes, of_gyro if triad == "gyro" else of_accelerometer)
        for what, axes, of_gyro, of_accelerometer in (
            ("asymmetry", _BODY, "", ""),
            ("quadratic", _BODY, "s/rad", "s²/m"),
            ("cubic", _BODY, "s²/rad²", "s⁴/m²"),
        )
        for triad in ("gyro", "accelerometer")
    },
    "accelerometer cross-axis": (_ANGLES, "s²/m"),
    **{
        f"{triad} {name}": (_BODY, unit)
        for triad, unit in (("gyro", "rad/s"), ("accelerometer", "m/s²"))
        for name in _PROCESSES
    },
    "gyro g-sensitivity": (tuple(f"{i}{j}" for i in "xyz" for j in "xyz"), "rad/s/(m/s²)"),
    GRAVITY: (_NED, "m/s²"),
    "gnss lever arm": (_BODY, "m"),
    "gnss time offset": (("",), "s"),
}
"""The blocks by name: their axes and unit. Instability is a second part of a bias, a Gauss-Markov process in addition
to the constant. The processes of flicker noise are one block each, and only their sum has a true value, which stands in
the first. The component ij of a misalignment is the tilt of sensitive axis i towards the block's axis j. The
gravity disturbance δg is what the true gravity has beyond that of the navigation equations: −γξ and −γη with the
deflections ξ and η of the vertical, and the disturbance, which differs little from the anomaly, down.

An aiding sensor, named by `Measurements.label`, may have its own blocks: "<sensor> bias", with as many components as
its sigma, is added to the true reading (north, east, down in metres for a position, a rotation about the body's axes
for an attitude); "<sensor> scale" is the relative error of a scalar reading. "<sensor> delay" is the time by which a
reading's instant of validity is stated too late [s]; "gnss time offset" is that of all readings of a satellite
receiver, in addition to their own. A heading may have a "<sensor> deviation", A and B of A sin ψ + B cos ψ [rad]. An
airspeed may have a "<sensor> wind" to the north and east [m/s]. A land vehicle's constraint may have a "<sensor>
mounting", pitch and yaw of the vehicle's axes in the block's [rad], a "<sensor> lever arm" [m], and a "<sensor> slip",
the cornering compliance [rad/(m/s²)]."""


def of_sensors() -> tuple[str, ...]:
    """Return the endings of the names of the aiding sensors' blocks."""
    return (" bias", " scale", " delay", *(f" {error}" for error in sorted(own_errors())))


def block_of_term(term: ErrorTerm) -> str:
    """Return the name of the block whose states are the values of a row of the table of error terms."""
    return f"{term.triad.replace('accel', 'accelerometer')} {term.field.replace('_', '-')}"


INERTIAL = {block_of_term(of): of for of in TERMS if of.multiplies is not None and block_of_term(of) in BLOCKS}
"""Rows of the table of error terms whose values are the states of a block, by its name."""


def values_of(term: ErrorTerm, value: Array) -> Array:
    """Return the states of a row's block for a value of its field, (..., n) for (..., 3) or (..., 3, 3)."""
    return value if term.size == 3 else value[..., places_of(term)]


def places_of(term: ErrorTerm) -> NDArray[np.bool_]:
    """Return which elements of a row's field are values, in the shape of the field."""
    return np.ones(term.shape, dtype=bool) if term.size != 6 else ~np.eye(3, dtype=bool)


@dataclass(frozen=True)
class Block:
    """A group of related states.

    Attributes:
        name: one of `BLOCKS`, or a sensor's block.
        sigma: initial 1σ, one for all components or one for each, SI.
        random_walk: density of the white noise that drives a random walk, as `sigma`, SI unit/√s.
        correlation_time: τ of a Gauss-Markov process, s; infinite for a constant or a random walk.
        correlation_distance: D of a Gauss-Markov process over the horizontal distance travelled, m; infinite for
            another.
    """

    name: str
    sigma: ArrayLike
    random_walk: ArrayLike = 0.0
    correlation_time: float = math.inf
    correlation_distance: float = math.inf

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not (self.name in BLOCKS or self.name.endswith(of_sensors())):
            raise unknown_name("block of states", self.name, [*BLOCKS, *(f"<sensor>{end}" for end in of_sensors())])
        sigma = numbers(f"block {self.name!r}: sigma", self.sigma)
        walk = numbers(f"block {self.name!r}: random_walk", self.random_walk)
        for what, value in (("sigma", sigma), ("random_walk", walk)):
            if not (np.all(np.isfinite(value)) and np.all(value >= 0.0)):
                raise InputError(f"block {self.name!r}: {what} = {value} must be finite and not negative.")
            if value.ndim > 1 or (value.ndim == 1 and self.name in BLOCKS and len(value) != self.size):
                raise InputError(f"block {self.name!r}: {what} = {value} must be one number or one for each state.")
        for what, unit in (("correlation_time", "s"), ("correlation_distance", "m")):
            tau = numbers(f"block {self.name!r}: {what}", getattr(self, what))
            if tau.shape != () or not tau > 0.0:
                raise InputError(f"block {self.name!r}: {what} = {getattr(self, what)} {unit} must be positive.")
        if math.isfinite(self.correlation_time) and math.isfinite(self.correlation_distance):
            raise InputError(f"block {self.name!r}: give correlation_time or correlation_distance, not both.")
        if math.isfinite(min(self.correlation_time, self.correlation_distance)) and np.any(walk):
            raise InputError(
                f"block {self.name!r}: the noise of a Gauss-Markov process follows from sigma and correlation_time or "
                "correlation_distance; "
                "random_walk belongs to a process without either."
            )

    @cached_property
    def size(self) -> int:
        """Number of states."""
        return len(BLOCKS[self.name][0]) if self.name in BLOCKS else np.size(self.sigma)

    @property
    def unit(self) -> str:
        """SI unit of the states; "" for pure numbers and for a sensor's block, which has its measurements' unit."""
        return BLOCKS[self.name][1] if self.name in BLOCKS else ""

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states, for example "gyro bias right"."""
        axes = BLOCKS[self.name][0] if self.name in BLOCKS else tuple(map(str, range(1, self.size + 1)))
        return (self.name,) if len(axes) == 1 else tuple(f"{self.name} {axis}" for axis in axes)

    @property
    def density(self) -> Array:
        """Density of the white noise that drives the states, one for each, unit/√s."""
        if math.isfinite(self.correlation_time):
            return np.broadcast_to(np.asarray(self.sigma) * math.sqrt(2.0 / self.correlation_time), self.size)
        return np.broadcast_to(np.asarray(self.random_walk, dtype=np.float64), self.size)


@short_repr
@dataclass(frozen=True)
class ErrorModel:
    """An error model: its blocks of states, and the white noise of the inertial sensors.

    Attributes:
        blocks: position, velocity and attitude first; the others in any order, each once.
        gyro_noise: angle random walk N, rad/√s.
        accel_noise: velocity random walk, m/s/√s.
        gyro_quantum: weight of a pulse of the gyros, rad.
        accel_quantum: weight of a pulse of the accelerometers, m/s.
        untold: further errors of the inertial sensors that no block describes, in words.
        axes: axes in which velocity and attitude are compared with the true ones, "north", or "transported" for a run
            near a pole, see `sinssim.strapdown.frames.AXES`; `estimate` chooses them.
        correlations: covariances at the start between states of blocks: two blocks, and the matrix.
    """

    blocks: tuple[Block, ...]
    gyro_noise: float
    accel_noise: float
    gyro_quantum: float = 0.0
    accel_quantum: float = 0.0
    untold: tuple[str, ...] = ()
    axes: str = "north"
    correlations: tuple[tuple[str, str, Array], ...] = ()

    def __post_init__(self) -> None:
        for block in self.blocks:
            check_kind("a block of an error model", block, Block, "Block(name, sigma)")
        present = [block.name for block in self.blocks]
        twice = [name for name, count in Counter(present).items() if count > 1]
        if twice:
            raise InputError(f"state block {twice[0]!r} is given twice; give each block once.")
        if tuple(present[: len(NAVIGATION)]) != NAVIGATION:
            raise InputError(f"an error model begins with the blocks {', '.join(NAVIGATION)}, not {present[:3]}.")
        for name in ("gyro_noise", "accel_noise", "gyro_quantum", "accel_quantum"):
            number(f"error model: {name}", getattr(self, name), low=0.0)
        check_name("axes of errors", self.axes, AXES)

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Place of each block's states, by name."""
        ends = np.cumsum([block.size for block in self.blocks])
        return {b.name: slice(int(end) - b.size, int(end)) for b, end in zip(self.blocks, ends, strict=True)}

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Names of all states."""
        return tuple(state for block in self.blocks for state in block.states)

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.states)

    @cached_property
    def sigma(self) -> Array:
        """Standard deviation of every state at the start, (n,)."""
        return np.concatenate([np.broadcast_to(np.asarray(b.sigma, dtype=np.float64), b.size) for b in self.blocks])

    @cached_property
    def covariance(self) -> Array:
        """Covariance of all states at the start, (n, n)."""
        covariance = np.diag(self.sigma**2)
        for row, column, matrix in self.correlations:
            if row in self.slices and column in self.slices:
                covariance[self.slices[row], self.slices[column]] = matrix
                covariance[self.slices[column], self.slices[row]] = matrix.T
        return covariance

    @cached_property
    def decay(self) -> Array:
        """Inverse correlation time 1/τ of every state, (n,) 1/s."""
        return np.concatenate([np.full(b.size, 1.0 / b.correlation_time) for b in self.blocks])

    @cached_property
    def per_metre(self) -> Array:
        """Inverse correlation distance 1/D of every state, (n,) 1/m."""
        return np.concatenate([np.full(b.size, 1.0 / b.correlation_distance) for b in self.blocks])

    @cached_property
    def density(self) -> Array:
        """Density of each state's own driving noise over time, (n,) unit/√s."""
        return np.concatenate([b.density for b in self.blocks])

    @cached_property
    def largest(self) -> Array:
        """Largest errors that the closed loop carries in the filter, instead of feeding them back at once, (n,)."""
        large = np.full(self.size, math.inf)
        large[: len(_LARGEST)] = _LARGEST
        for name, where in self.slices.items():
            for end, value in _LARGEST_OWN.items():
                if name.endswith(end) and self.decay[where.start] == 0.0:
                    large[where] = value
        return large

    @cached_property
    def sums(self) -> dict[str, tuple[str, ...]]:
        """Blocks of processes of which only the sum has a true value, by its name."""
        names = [name for name in self.slices if name.endswith(_PROCESSES)]
        ends = dict.fromkeys(name[:-2] for name in names)
        return {end: tuple(name for name in names if name[:-2] == end) for end in ends}

    @cached_property
    def compared(self) -> dict[str, Array]:
        """By block, or sum of blocks, the matrix from the states to those that have true values, (m, n)."""
        unit = np.eye(self.size)
        added = {end: sum((unit[self.slices[name]] for name in names), np.zeros(1)) for end, names in self.sums.items()}
        processes = {name for names in self.sums.values() for name in names}
        return {name: unit[where] for name, where in self.slices.items() if name not in processes} | added

    @cached_property
    def fed_back(self) -> NDArray[np.bool_]:
        """Which states the closed loop feeds back into engine and compensator: all but Gauss-Markov processes, (n,).

        A compensated value stays constant, whereas a Gauss-Markov process decays; its estimate therefore stays in the
        filter.
        """
        return np.asarray((self.decay == 0.0) & (self.per_metre == 0.0))


UNTOLD = {name: FIELDS[name].untold for name in SLOTS if FIELDS[name].untold}
"""Fields of `TriadErrors` that a filter neglects unless they are states."""

_FLOOR = math.sqrt(2.0 * math.log(2.0) / math.pi)
"""Ratio of the Allan deviation of flicker noise to its B."""

FLICKER = "flicker"
"""The part of a name, after that of the triad, that stands for all processes of its flicker."""

_INERTIAL_NAMES = [
    *(n for n in BLOCKS if n.split()[0] in ("gyro", "accelerometer") and not n.endswith(_PROCESSES)),
    f"gyro {FLICKER}", f"accelerometer {FLICKER}",
]  # fmt: skip

IMU_BLOCKS = ("gyro bias", "accelerometer bias")
"""The blocks of the inertial sensors that every filter has."""


def error_model(
    sigma: ImuErrors,
    *,
    position: ArrayLike = (10.0, 10.0, 10.0),
    velocity: ArrayLike = (0.1, 0.1, 0.1),
    attitude: ArrayLike = (1e-3, 1e-3, 1e-2),
    imu: Sequence[str] = IMU_BLOCKS,
    extra: Iterable[Block] = (),
    duration: float = 3600.0,
    flicker_processes: int | None = None,
) -> ErrorModel:
    """Compose a model from the errors of the inertial sensors and of the initial state.

    Biases are constant, or random walks if the sensors have a rate random walk K or another drift. A bias instability
    is an additional block, and flicker noise, if `imu` names it, a sum of processes (`sinssim.sensors.flicker`). A
    drift is modelled as the random walk whose 1σ bounds it over the duration T: K = R√T for a ramp R, and K = βΔΘ/√τ
    for a bias with β per degree and a warm-up by ΔΘ with the time constant τ. Other flicker B is modelled as the random
    walk whose Allan deviation K√(τ/3) crosses flicker's √(2 ln 2/π) B where the white noise's N/√τ does, because the
    estimate of a bias takes that long. This is right for the estimate, and too wide for long times. No block describes
    the errors in `UNTOLD`.

    Args:
        sigma: standard deviations of the sensor block's errors, and its noise;
            `sinssim.alignment.alignment_budget.expected_errors` computes them from a scenario's [imu] section.
        position, velocity, attitude: 1σ of the initial state, one number or north, east, down; m, m/s, rad.
        imu: blocks of the inertial sensors; instabilities are added automatically if `sigma` has any.
        extra: other blocks, for example of aiding sensors.
        duration: duration of the run, for ramps and flicker, s.
        flicker_processes: number of processes of a triad's flicker, 2 to 9; default: as many as it needs.

    Returns:
        The model; its `untold` names the errors in `sigma` that no block describes.

    Raises:
        InputError: a block is unknown or given twice, or a standard deviation is invalid.
    """
    check_sigmas(sigma)
    duration = number("duration", duration, "s", low=POSITIVE)
    try:
        more = tuple(extra)
    except TypeError as error:
        raise InputError(f"extra = {shortened(repr(extra))} must be a list of blocks.") from error
    triads = {"gyro": sigma.gyro, "accelerometer": sigma.accel}
    blocks = [Block("position", position), Block("velocity", velocity), Block("attitude", attitude)]
    chosen = names("imu", "block of the inertial sensors", imu, _INERTIAL_NAMES)
    chosen += [f"{n} instability" for n, t in triads.items() if t.instability and f"{n} instability" not in chosen]
    noise = {n: triad.random_walk for n, triad in triads.items()}
    for name in chosen:
        triad_name, _, what = name.partition(" ")
        triad = triads[triad_name]
        if what == FLICKER:
            if triad.flicker:
                added, rest = _processes(name, triad, duration, flicker_processes)
                blocks += added
                noise[triad_name] = math.hypot(triad.random_walk, rest)
            continue
        if f"{triad_name} {FLICKER}" in chosen:
            triad = replace(triad, flicker=0.0)
        blocks.append(_imu_block(name, what, triad, sigma.warm_up, duration))
    untold = [
        f"{name} of the {triad_name}s"
        for triad_name, triad in triads.items()
        for field, name in UNTOLD.items()
        if np.any(getattr(triad, field)) and f"{triad_name} {field.replace('_', '-')}" not in chosen
    ]
    untold += ["the accelerometers' arms"] if np.any(sigma.arms) else []
    untold += ["the accelerometers' delay"] if sigma.delay else []
    untold += ["the null shift of the gyros"] if sigma.null_shift is not None else []
    untold += ["faults of the sensors"] if sigma.faults else []
    return ErrorModel(
        (*blocks, *more), noise["gyro"], noise["accelerometer"], sigma.gyro.quantum, sigma.accel.quantum, tuple(untold)
    )


def _processes(name: str, triad: TriadErrors, duration: float, count: int | None) -> tuple[list[Block], float]:
    """Return the blocks of a triad's flicker, and the density of what is faster."""
    sigma, times, rest = flicker.processes(triad.flicker, triad.random_walk, duration, count)
    pairs = zip(sigma.tolist(), times.tolist(), strict=True)
    return [Block(f"{name} {k}", s, correlation_time=tau) for k, (s, tau) in enumerate(pairs, start=1)], rest


def _imu_block(name: str, what: str, triad: TriadErrors, warm_up: WarmUp, duration: float) -> Block:
    if what == "instability":
        return Block(name, triad.instability, correlation_time=triad.correlation_time)
    if what != "bias":
        return Block(name, values_of(INERTIAL[name], getattr(triad, INERTIAL[name].field)))
    warming = triad.bias_temperature * (warm_up.steady - warm_up.start)
    start = triad.bias**2 + (triad.bias_temperature * warm_up.start) ** 2
    walk = triad.rate_walk**2 + triad.ramp**2 * duration + warming**2 / warm_up.time_constant
    if triad.flicker:
        crossing = crossing_time(triad)
        start = start + triad.flicker**2 * flicker.variance_of_mean(crossing * flicker.SAMPLES_PER_SECOND)
        walk = walk + 3.0 * (_FLOOR * triad.flicker) ** 2 / crossing
    return Block(name, np.sqrt(start), random_walk=np.sqrt(walk))


def crossing_time(triad: TriadErrors) -> float:
    """Return the averaging time τ, s, at which flicker noise is as large as the random walk, N/√τ = √(2 ln 2/π) B.

    It is at least one second, which is short for any estimate of a bias.
    """
    return float(max((triad.random_walk / (_FLOOR * triad.flicker)) ** 2, 1.0))
