"""Single gyros and accelerometers with errors: those of a redundant set, and six accelerometers without gyros.

Sensor set 1 of the chapter (section 8.1) is six accelerometers spread over the body. An accelerometer at r with its
axis along s measures

    A = s·f + (r × s)·ω̇ + s·(ω × (ω × r))

Six of them give ω̇ and f once ω is known. In the cube of Chen, Lee and DeBra (J. Guidance, Control, and Dynamics 17,
1994, pp. 286-290) they sit in the middle of the faces with their axes along face diagonals, and the products of ω
cancel in ω̇, which is then linear in the readings. ω is its integral, including the sign, which products of rates do
not determine. The readings are converted to increments of angle and velocity and navigated like those of any block.

The position error of a level block follows from (8.12) and (8.14): an error δω̇ of the angular acceleration tilts the
block by ½ δω̇ t², so that with an error δf of the specific force

    Δp = δf (1 − cos ω_s t)/ω_s² ∓ R δω̇ (½ t² − (1 − cos ω_s t)/ω_s²)  →  ½ δf t² ∓ g δω̇ t⁴/24

In the cube of half-edge ℓ, accelerometer errors of standard deviation σ cause σ{δf} = σ/√2, σ{δω̇} = σ/(√2 ℓ). White
noise N of every accelerometer causes, for ω_s t → 0, σ{Δp} = (N/√2) √(t³/3 + (g/ℓ)² t⁷/252).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim.arguments import check_finite, check_increasing, check_kind, doubles, numbers, vector
from sinssim.data import Array, ImuData
from sinssim.errors import InputError, shortened
from sinssim.sensors.imu.compensation import compensate_checked
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.error_term_table import CALIBRATED
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu, draw
from sinssim.sensors.sensor_set_section import Redundant, along

# Each further triad of accelerometers has its own seed, far from those of scenarios.
APART = 1 << 32


def draw_accelerometers(imu: Imu, count: int, seed: int = 0) -> list[TriadErrors]:
    """Return the errors of single accelerometers, drawn in threes like those of a triad; the first three have the draws
    of the triad of a usual block."""
    if count % 3:
        raise InputError(f"the number of accelerometers must be a multiple of three, not {count}.")
    return [draw(imu, seed + triad * APART).accel for triad in range(count // 3)]


def emulate_accelerometers(
    time: Array,
    force: Array,
    direction: Array,
    imu: Imu,
    seed: int = 0,
    errors: Sequence[TriadErrors] | None = None,
) -> Array:
    """Return the measured increments of single accelerometers of a grade, (N, K) m/s.

    Each has all the errors that the block gives an accelerometer of a triad. It is emulated as one axis of a triad at
    its own place, with the two other axes perpendicular to it, so that its misalignment tilts it towards them. The
    specific force at each place is integrated, (N, K, 3) m/s, K a multiple of three; `direction` are unit vectors in
    the same axes, (K, 3).
    """
    from sinssim.statistics.random_numbers import key

    time, force, direction = doubles("time", time), doubles("force", force), doubles("direction", direction)
    count = len(direction)
    if direction.shape != (count, 3) or force.shape != (len(time) - 1, count, 3) or time.ndim != 1 or count < 3:
        raise InputError(
            f"accelerometers need (N+1,) times, (N, K, 3) increments and (K, 3) directions, K ≥ 3; got arrays of "
            f"shapes {time.shape}, {force.shape} and {direction.shape}."
        )
    if count % 3:
        raise InputError(f"the number of accelerometers must be a multiple of three, not {count}.")
    check_finite("force", force, "m/s")
    if not np.allclose(np.linalg.norm(direction, axis=1), 1.0, rtol=0.0, atol=1e-6):
        raise InputError(f"direction = {shortened(str(direction.tolist()))} must be unit vectors.")
    check_kind("imu", imu, Imu, "Imu, for example Imu(grade='tactical')")
    key(seed)  # refuses an invalid seed
    seed = int(seed)
    triads = draw_accelerometers(imu, count, seed) if errors is None else errors
    if not isinstance(triads, list | tuple) or len(triads) * 3 != count:
        raise InputError(f"errors = {shortened(repr(triads))} must be a list of {count // 3} TriadErrors.")
    for triad in triads:
        check_kind("each of errors", triad, TriadErrors)
    measured = np.empty(force.shape[:2])
    for k, sensitive in enumerate(direction):
        axis = k % 3
        increments = force[:, k] @ axes_about(sensitive, axis).T
        block = ImuErrors(accel=triads[k // 3], warm_up=imu.warm_up)
        read = emulate(ImuData(time, np.zeros_like(increments), increments), block, seed + k // 3 * APART)
        measured[:, k] = read.dvel[:, axis]
    return measured


def axes_about(direction: Array, axis: int) -> Array:
    """Return a right-handed triad as a rotation matrix whose row `axis` is a given direction, (3, 3)."""
    across = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    across /= np.linalg.norm(across)
    return np.roll(np.stack([direction, across, np.cross(direction, across)]), axis, axis=0)


@dataclass(frozen=True)
class SingleSensors:
    """Increments of the m single gyros and the m single accelerometers of a redundant set."""

    time: Array  # edges of the samples, (N+1,) s; stamps with jitter if there is any
    dtheta: Array  # angle increments along the sensitive axes, (N, m) rad
    dvel: Array  # velocity increments along the sensitive axes, (N, m) m/s
    # flags of the gyros and of the accelerometers, (N, 2m), as in `ImuData`; None without limits and faults
    flags: NDArray[np.uint8] | None = None


def draw_single_sensors(imu: Imu, count: int, seed: int = 0) -> tuple[ImuErrors, ...]:
    """Return the errors of single sensors, drawn in threes like those of a triad: a block without faults for every
    three gyros and three accelerometers. Sensor i is axis i mod 3 of block i // 3; the first three have the draws of a
    usual block."""
    sound = imu.model_copy(update={"faults": ()})
    return tuple(draw(sound, seed + number * APART) for number in range(-(-count // 3)))


def perfect_readings(ideal: ImuData, directions: Array) -> SingleSensors:
    """Return the readings of sensors without errors along axes, (m, 3)."""
    return SingleSensors(ideal.time, along(ideal.dtheta, directions), along(ideal.dvel, directions))


def emulate_single_sensors(ideal: ImuData, imu: Imu, blocks: tuple[ImuErrors, ...], seed: int = 0) -> SingleSensors:
    """Return the measured increments of the single sensors of a redundant set, whose errors `draw_single_sensors`
    returned.

    Each has all the errors that the block gives a sensor of a triad. A gyro and an accelerometer are emulated as one
    axis of a block whose two other axes are perpendicular to it, so that misalignment tilts it towards them.
    """
    assert isinstance(imu.sensor_set, Redundant)
    directions = imu.sensor_set.axes
    count = len(directions)
    dtheta, dvel = np.empty((len(ideal), count)), np.empty((len(ideal), count))
    flags: NDArray[np.uint8] | None = None
    time = ideal.time
    for i, direction in enumerate(directions):
        axis, of = i % 3, blocks[i // 3]
        block = axes_about(direction, axis)
        increments = ImuData(ideal.time, along(ideal.dtheta, block), along(ideal.dvel, block))
        faults = tuple(fault.fault(i) for fault in imu.faults)
        read = emulate(increments, replace(of, faults=faults), seed + i // 3 * APART)
        dtheta[:, i], dvel[:, i] = read.dtheta[:, axis], read.dvel[:, axis]
        if i == 0:
            time = read.time  # all sensors of the set have the same stamps
        if read.flags is not None:
            flags = np.zeros((len(ideal), 2 * count), np.uint8) if flags is None else flags
            flags[:, i], flags[:, count + i] = read.flags[:, axis], read.flags[:, 3 + axis]
    return SingleSensors(time, dtheta, dvel, flags)


def compensate_single_sensors(
    readings: SingleSensors, calibrations: tuple[ImuErrors, ...], directions: Array, estimate: ImuData
) -> SingleSensors:
    """Compensate the errors of single sensors by calibration values, in the order of `draw_single_sensors`, before they
    are combined. The estimate, increments in the axes of the block, gives the input across the sensitive axes."""
    dtheta, dvel = readings.dtheta.copy(), readings.dvel.copy()
    for i, direction in enumerate(directions):
        axis, block = i % 3, axes_about(direction, i % 3)
        increments = ImuData(readings.time, along(estimate.dtheta, block), along(estimate.dvel, block))
        increments.dtheta[:, axis], increments.dvel[:, axis] = readings.dtheta[:, i], readings.dvel[:, i]
        known = calibrations[i // 3]
        compensated = compensate_checked(
            increments, replace(known, gyro=_alone(known.gyro, axis), accel=_alone(known.accel, axis))
        )
        dtheta[:, i], dvel[:, i] = compensated.dtheta[:, axis], compensated.dvel[:, axis]
    return replace(readings, dtheta=dtheta, dvel=dvel)


def _alone(triad: TriadErrors, axis: int) -> TriadErrors:
    """Return the errors of one axis of a triad; the others have none."""
    fields: dict[str, Any] = {}
    for name in CALIBRATED:
        value = getattr(triad, name)
        fields[name] = np.where((np.arange(3) == axis).reshape((3,) + (1,) * (value.ndim - 1)), value, 0.0)
    return TriadErrors(**fields)


_CANCELS = 1e-9


@dataclass(frozen=True)
class AccelerometerSet:
    """Six accelerometers that form an inertial block."""

    position: Array  # positions from the block's reference point, in its axes, (6, 3) m
    direction: Array  # sensitive axes, unit vectors, (6, 3)

    @cached_property
    def solution(self) -> Array:
        """The matrix from six readings to (ω̇, f) of a body that does not rotate, (6, 6)."""
        r, s = numbers("position", self.position), numbers("direction", self.direction)
        if not np.all(np.isfinite(r)):
            raise InputError("the positions of the accelerometers must be finite numbers, m.")
        if r.shape != (6, 3) or s.shape != (6, 3) or not np.allclose(np.linalg.norm(s, axis=1), 1.0, atol=1e-9):
            raise InputError("a gyro-free block has six accelerometers: (6, 3) positions and (6, 3) unit directions.")
        matrix = np.concatenate([np.cross(r, s), s], axis=1)
        size = float(np.abs(r).max())
        if not (size > 0.0 and np.linalg.cond(matrix / np.array([size] * 3 + [1.0] * 3)) < 1e6):
            raise InputError(
                "the six accelerometers cannot separate angular from linear acceleration: their axes and lever arms "
                "must be such that the vectors (r × s, s) are linearly independent, as in `cube`."
            )
        inverse = np.linalg.inv(matrix)
        leak = np.abs(np.einsum("ij,jkl->ikl", inverse[:3], self.products)).max()
        if leak > _CANCELS:
            raise InputError(
                f"products of the rate affect the angular acceleration of this set of accelerometers (factor "
                f"{leak:.2g}); use a set in which they cancel, as in `cube`."
            )
        return np.asarray(inverse)

    def feel(self, force: Array) -> Array:
        """Return the velocity increments of ideal accelerometers, (N, 6) m/s, from the integrals of the specific force
        at each place, (N, 6, 3) m/s."""
        return np.asarray(np.einsum("nij,ij->ni", force, self.direction))

    @property
    def products(self) -> Array:
        """Symmetric matrices Q_i with s·(ω × (ω × r)) = Σ Q_i,kl ω_k ω_l, (6, 3, 3) m."""
        both = np.einsum("ik,il->ikl", self.direction, self.position)
        along = np.einsum("ik,ik->i", self.direction, self.position)
        return np.asarray(0.5 * (both + np.swapaxes(both, 1, 2)) - along[:, None, None] * np.eye(3))


def cube(arm: float) -> AccelerometerSet:
    """Return the set of Chen, Lee and DeBra: at the middles of the faces of a cube, `arm` m from its centre, with axes
    along face diagonals."""
    if not (np.isfinite(arm) and arm > 0.0):
        raise InputError(f"arm = {arm!r} m of the cube of accelerometers must be positive and finite.")
    position = arm * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64)
    direction = np.array([[0, 1, 1], [0, 1, -1], [1, 0, 1], [-1, 0, 1], [1, 1, 0], [1, -1, 0]]) / np.sqrt(2.0)
    return AccelerometerSet(position, direction)


def gyro_free_increments(time: Array, dvel: Array, layout: AccelerometerSet, rate: ArrayLike) -> ImuData:
    """Convert the increments of six accelerometers to those of a block with gyros.

    Args:
        time: edges of the intervals, (N+1,) s.
        dvel: increments of each accelerometer, (N, 6) m/s.
        rate: inertial angular rate at time[0], (3,) rad/s; the Earth's rate for a parked vehicle.

    Returns:
        Increments of angle and velocity at the block's reference point, for `navigate`.
    """
    from scipy.interpolate import make_interp_spline

    check_kind("layout", layout, AccelerometerSet, "an AccelerometerSet, for example cube(arm)")
    solution = layout.solution
    time, dvel, rate = doubles("time", time), doubles("dvel", dvel), vector("rate", rate, 3, "rad/s")
    if len(dvel) < 2 or dvel.shape != (len(dvel), 6) or time.shape != (len(dvel) + 1,):
        raise InputError(
            f"a gyro-free block needs N+1 times and (N, 6) increments, N ≥ 2; got shapes {time.shape}, {dvel.shape}."
        )
    check_finite("time", time, "s")
    check_finite("dvel", dvel, "m/s", time)
    check_increasing("time", time)
    solved = dvel @ solution.T  # exact ∫ω̇ dt, and ∫f dt without the products of the rate
    omega = np.concatenate([[np.zeros(3)], np.cumsum(solved[:, :3], axis=0)]) + rate
    # ω at the edges is exact; splines through the edges give its values in between, and its products
    row, column = np.triu_indices(3)
    products = omega[:, row] * omega[:, column]
    degree = min(5, len(dvel) - (len(dvel) + 1) % 2)  # odd, and less than the number of edges
    try:
        curve = make_interp_spline(time, np.concatenate([omega, products], axis=1), k=degree)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise InputError(
            f"rates of up to {np.abs(omega).max():g} rad/s at the given times cannot be interpolated: {error}."
        ) from error
    integrals = curve.antiderivative()(time)
    turned = np.diff(integrals, axis=0)
    quadratic = np.einsum("ij,jkl->ikl", solution[3:], layout.products)
    weights = quadratic[:, row, column] * np.where(row == column, 1.0, 2.0)
    return ImuData(time, np.ascontiguousarray(turned[:, :3]), solved[:, 3:] - turned[:, 3:] @ weights.T)


def position_error(
    time: ArrayLike,
    layout: AccelerometerSet,
    bias: float,
    random_walk: float = 0.0,
    gravity: float = 9.81,
    radius: float = 6371000.0,
) -> Array:
    """Return the 1σ position error of a level gyro-free block; see the module's text.

    Args:
        time: time since an exact initial state, (N,) s.
        bias: 1σ of every accelerometer's bias, m/s².
        random_walk: white noise of every accelerometer, m/s/√s.
        gravity: m/s².
        radius: radius of the Earth, m.

    Returns:
        1σ of the north and east error of a block that points north, (N, 2) m.
    """
    t = np.atleast_1d(np.asarray(time, dtype=np.float64))
    rate = np.sqrt(gravity / radius)
    turn, push = layout.solution[:3], layout.solution[3:]
    # a tilt about east causes an acceleration of −g to the north, one about north of +g to the east
    pairs = ((push[0], -turn[1]), (push[1], turn[0]))

    def squared(of_push: Array, of_turn: Array) -> Array:
        """Return the sum over accelerometers of (of_push · row + of_turn · row)², (..., 2)."""
        both = [np.multiply.outer(of_push, f) + np.multiply.outer(of_turn, w) for f, w in pairs]
        return np.stack([np.sum(rows * rows, axis=-1) for rows in both], axis=-1)

    versine = 2.0 * np.sin(0.5 * rate * t) ** 2 / rate**2  # (1 − cos ω_s t)/ω_s²
    variance = bias**2 * squared(versine, radius * (0.5 * t * t - versine))
    # noise: the squared response to an impulse u seconds ago, summed over u
    nodes, weights = np.polynomial.legendre.leggauss(32)
    u = 0.5 * t[:, None] * (1.0 + nodes)
    sine = np.sin(rate * u) / rate
    variance += random_walk**2 * 0.5 * t[:, None] * np.einsum("j,njk->nk", weights, squared(sine, radius * (u - sine)))
    return np.asarray(np.sqrt(variance))
