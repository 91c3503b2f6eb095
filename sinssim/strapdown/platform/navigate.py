"""Navigates with a gimballed platform along a motion: `navigate_platform`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from math import degrees
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim import earth, rotation
from sinssim.algorithms import PLATFORM
from sinssim.checks import checked_initial, first_not_finite, not_finite_in
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.transverse import route_pole, too_near
from sinssim.errors import InputError, RunError
from sinssim.jit import bind
from sinssim.sensors.imu.errors import ImuErrors
from sinssim.sensors.sets.platform import PlatformErrors, without_errors_of_turns
from sinssim.strapdown.frames.azimuth import FREE_AZIMUTH, TRANSVERSE, WANDER
from sinssim.strapdown.frames.problem import Models, Rows
from sinssim.strapdown.frames.radii import FORMS
from sinssim.strapdown.frames.vertical import NUMBERS, Channel, HeightReadings, height_reference
from sinssim.strapdown.mechanization import Mechanization, Options, chosen
from sinssim.strapdown.platform.force import Forces
from sinssim.strapdown.polar import POLAR_LIMIT
from sinssim.system.short_repr import short_repr

_RULES = {
    "level": TRANSVERSE,
    "wander": WANDER,
    "free-azimuth": FREE_AZIMUTH,
    "transverse": TRANSVERSE,
    "inertial": WANDER,
}
"""Rule for the azimuth in each frame; "level" is the transverse frame of the Earth's pole."""


@short_repr
@dataclass(frozen=True)
class PlatformSolution(NavSolution):
    """The solution of a platform's navigator, and the platform itself.

    Attributes:
        q_ip: attitude of the platform in inertial axes that coincide with the Earth-fixed ones at t = 0, (N+1, 4).
        gimbals: gimbal angles roll, pitch and azimuth as read, (N+1, 3) rad.
        commanded: commanded rates about the platform's axes, (N, 3) rad/s; 0 for one that is not torqued.
        drift: drift of the gyros about these axes, what they would read at rest in inertial space, (N, 3) rad/s.
        readings: readings of the accelerometers, (N, 3) m/s.
        flags: flags of each sample as in `ImuData`, (N, 6), or None.
    """

    q_ip: Array = field(default_factory=lambda: np.zeros((0, 4)))
    gimbals: Array = field(default_factory=lambda: np.zeros((0, 3)))
    commanded: Array = field(default_factory=lambda: np.zeros((0, 3)))
    drift: Array = field(default_factory=lambda: np.zeros((0, 3)))
    readings: Array = field(default_factory=lambda: np.zeros((0, 3)))
    flags: NDArray[np.uint8] | None = None


@cache
def _engine(form: str) -> Callable[..., None]:
    from sinssim.strapdown.platform.kernel import simulate

    return bind(simulate, f"platform_{form}".replace("-", "_").rstrip("_"), **FORMS.get(form, {}))


# Long: it checks every option, lays out the arrays of the kernel and puts the solution together.
def navigate_platform(
    time: Array,
    forces: Forces,
    initial: NavState,
    errors: ImuErrors | None = None,
    of_platform: PlatformErrors | None = None,
    seed: int = 0,
    mechanization: Mechanization | None = None,
    *,
    height: ArrayLike | HeightReadings | None = None,
    **options: Unpack[Options],
) -> PlatformSolution:
    """Navigate with a platform from a given initial state.

    The gyros' scale factor, misalignment, non-linearity, quantisation and range do not act, because a platform holds
    its gyros at null; all other errors act about the platform's axes.

    Args:
        time: edges of the intervals, (N+1,) s.
        forces: what acts on the platform, from `inertial_forces`.
        initial: computed state at time[0], scalars. The platform stands as its attitude says: the gimbals read it.
        errors: errors of the gyros and accelerometers; none if not given.
        of_platform: errors of torquers and pick-offs; none if not given.
        seed: the run's seed, for the noises.
        mechanization: of the navigator; its algorithm has no effect. In the frames "level", "wander", "free-azimuth"
            and "transverse" the platform is level and turned with the frame; with "inertial" it keeps its direction in
            inertial space, that of north, east and down at the start.
        height: as for `navigate`.

    Returns:
        The solution at every edge. Its attitude is that of the gimbals.

    Raises:
        InputError: an option is unknown or has no effect, or an error is invalid.
        RunError: the frame cannot follow the motion, or the numbers overflow.
    """
    from sinssim.sensors.imu.pack import pack
    from sinssim.statistics.random_numbers import key
    from sinssim.strapdown.platform.kernel import Platform, Sensors

    of = replace(chosen(mechanization, options), algorithm=PLATFORM)  # which has no fast part: rates are refused
    frame = of.frame
    count = len(forces.push)
    time = np.ascontiguousarray(time, dtype=np.float64)
    if count < 1 or time.shape != (count + 1,) or len(forces.q_ib) != count + 1:
        raise InputError(
            f"a platform needs N+1 times and attitudes, and (N, 3) forces, N ≥ 1; got {time.shape}, "
            f"{forces.q_ib.shape} and {forces.push.shape}."
        )
    row = first_not_finite(forces.push)
    if row is not None:
        raise InputError(f"the specific force in the interval from t = {time[row]:.6f} s is not a finite number.")
    reference, climb = height_reference(of.vertical, height, time)
    own, torqued, rule = of_platform or PlatformErrors(), frame != "inertial", _RULES[frame]
    at_null = without_errors_of_turns(errors or ImuErrors())
    at_null = replace(at_null, gyro=replace(at_null.gyro, quantum=0.0, limit=0.0))
    packed = pack([at_null], float(time[0]))
    body, (key_0, key_1) = of.earth, key(seed)

    rows = count + 1
    latitude, longitude, altitude, of_x = (np.empty(rows) for _ in range(4))
    velocity, q_ip = np.empty((rows, 3)), np.empty((rows, 4))
    latitude[0], longitude[0], altitude[0], velocity[0], q_nb = checked_initial(initial)
    pole = np.zeros(3)
    if frame == "level":
        pole[2] = 1.0  # the Earth's
    elif rule == TRANSVERSE:
        pole = route_pole(of.route, float(latitude[0]), float(longitude[0]), velocity[0])
    of_x[0] = of.azimuth if rule != TRANSVERSE else _towards(pole, float(latitude[0]), float(longitude[0]))
    q_wb = rotation.multiply(_about_down(-of_x[0]), q_nb)
    q_ip[0] = rotation.multiply(forces.q_ib[0], rotation.conjugate(q_wb))
    q_wp = np.empty((0 if torqued else rows, 4))
    commanded, readings, drift = (np.empty((count, 3)) for _ in range(3))
    flagged = _flagged(packed.active)
    flags = np.zeros((count if flagged else 0, 6), dtype=np.uint8)
    q_nb, no_defect = np.empty((rows, 4)), np.zeros(rows)
    _engine("" if of.curvature in ("exact", "simplified") else of.curvature)(
        time,
        Models(earth.parameters(body), earth.gravity_number(of.gravity), of.curvature == "simplified"),
        Channel(NUMBERS[of.vertical], reference, climb, of.baro_time_constant),
        Rows(latitude, longitude, altitude, velocity, q_nb, no_defect), rule, pole, of_x,
        Sensors(packed.active, packed.conditions, packed.parameters, key_0, key_1, packed.kinds, packed.spans,
                packed.amounts),
        Platform(forces.push, torqued, own.torquer_scale, q_ip, q_wp, commanded, readings, drift, flags),
    )  # fmt: skip
    _check(frame, pole, time, latitude, longitude, altitude, velocity, q_ip)

    q_pb = rotation.multiply(rotation.conjugate(q_ip), forces.q_ib)
    gimbals = np.stack(rotation.euler_from_quaternion(q_pb), axis=1)
    if own.pickoff.any() or own.pickoff_noise:
        gimbals = gimbals + own.pickoff + own.pickoff_noise * _noise(seed, rows)
        q_pb = rotation.quaternion_from_euler(*gimbals.T)
    q_wb = q_pb if torqued else rotation.multiply(q_wp, q_pb)
    q_nb = rotation.normalize(rotation.multiply(_about_down(of_x), q_wb))
    sign = np.where(np.einsum("ij,ij->i", q_nb[1:], q_nb[:-1]) < 0.0, -1.0, 1.0)
    q_nb[1:] *= np.cumprod(sign)[:, np.newaxis]
    q_nb *= 1.0 if q_nb[0] @ initial.q_nb >= 0.0 else -1.0
    with_azimuth = frame not in ("level", "inertial")
    return PlatformSolution(
        time, latitude, longitude, altitude, velocity, q_nb, no_defect, PLATFORM,
        azimuth=of_x if with_azimuth else None, q_ip=q_ip, gimbals=gimbals, commanded=commanded, drift=drift,
        readings=readings, flags=flags if flagged else None,
    )  # fmt: skip


def _flagged(active: int) -> bool:
    """Return whether the sensors can set flags."""
    from sinssim.sensors.imu.error_kernel import FAULTY, LIMITED

    return bool(active & (FAULTY | LIMITED))


def _noise(seed: int, rows: int) -> Array:
    """Return the noise of the pick-offs, of 1σ = 1, (rows, 3)."""
    from sinssim.statistics.random_numbers import normals

    return np.stack([normals(seed, "gimbal pick-off noise", axis, rows) for axis in range(3)], axis=1)


def _about_down(angle: ArrayLike) -> Array:
    """Return the quaternion of a rotation about the down axis, (..., 4)."""
    half = 0.5 * np.asarray(angle, dtype=np.float64)
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)


def _towards(pole: Array, latitude: float, longitude: float) -> float:
    """Return the azimuth of a point of the Earth, given by its direction, rad."""
    x, y, _ = rotation.rotate(rotation.conjugate(earth.q_en(latitude, longitude)), pole)
    return float(np.arctan2(y, x))


def _check(
    frame: str, pole: Array, time: Array, latitude: Array, longitude: Array, height: Array, velocity: Array, q_ip: Array
) -> None:
    """Raise for a solution that diverged, or came where its frame cannot be used."""
    if wrong := not_finite_in(height, velocity, q_ip):
        name, row = wrong
        raise RunError(
            f"the {name} of the platform's navigation diverged and is not usable at t = {time[row]:.2f} s.",
            time=float(time[row]),
        )
    if frame == "level" and np.abs(latitude).max() > POLAR_LIMIT:
        row = int(np.argmax(np.abs(latitude) > POLAR_LIMIT))
        raise RunError(
            f"a platform that points north cannot be turned fast enough within {90.0 - degrees(POLAR_LIMIT):.1f}° of a "
            f"pole: latitude {degrees(latitude[row]):.4f}° at t = {time[row]:.2f} s. The frames wander, free-azimuth, "
            "transverse and inertial pass the poles.",
            time=float(time[row]),
        )
    if frame == "transverse" and (near := too_near(pole, time, latitude, longitude, velocity)) is not None:
        raise RunError(near[1], time=float(time[near[0]]))
