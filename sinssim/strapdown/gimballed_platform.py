"""Navigation with a gimballed platform along a motion, in the closed loop of platform and navigator.

The platform p turns in inertial space at the rate at which its gyros are torqued, and with their drift d:

    ω_ip = (1 + κ) ω_commanded − d,     readings of the accelerometers   Δv = ∫C_pi f dt + errors

The navigator takes the platform's axes for those of its frame w (see
`sinssim.strapdown.frames.wander_free_transverse`) and integrates

    v̇ = f + g − (2ω_ie + ω_ew) × v,     position from ω_ew,     ω_commanded = ω_ie + ω_ew

so that the platform turns with what the navigator computes from the platform's own readings: the loop is closed. The
level frame is the transverse one whose pole is the Earth's: ω_z = ω_x k_z/k_x = −v_E tan φ/(R₂+h) + … keeps x to the
north.

Nothing is known before it is read. The rate commanded during an interval is extrapolated from the computed rates at its
beginning and at that of the interval before; what the interval's own integral ∫ω dt then turns out to differ by is
commanded in the next one. The platform therefore follows the frame to some 1e-10 rad at 100 Hz, and without growth.

A platform that is not torqued keeps its direction in inertial space. The navigator then resolves the readings by the
attitude q_wp that it computes from its own ω_ie + ω_ew.

The step over an interval is that of the frame, `step_azimuth_k`, with increments in axes that turn with it; the
specific force at the ends comes from the reading and the one before it.

The rotation of the vehicle does not reach the platform, so the force is taken from the velocity of the motion and not
from the increments of a block that rotates with the vehicle: ∫f dt = Δv − ∫gravitation dt in inertial axes. Gravitation
is integrated by Simpson's rule, with the position in the middle from the cubic Hermite curve; its error in an hour at
100 Hz is below 1e-12 m/s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from math import degrees
from typing import NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim import earth, rotation
from sinssim.arguments import checked_initial, first_not_finite, not_finite_in
from sinssim.data import Array, NavSolution, NavState, short_repr
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.errors import InputError, RunError
from sinssim.jit import bind, inline
from sinssim.rotation.quaternions import Quaternion, Vector, multiply_k, quaternion_from_rotation_vector_k, rotate_k
from sinssim.rotation.vectors import add, along, cross, mul, simpson, sub
from sinssim.sensors.imu.emulation_kernel import (
    FAULTY,
    LIMITED,
    STATES,
    Packed,
    advance,
    begin,
    draw_block,
    measure,
    pack,
)
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.sensor_set_readings import PlatformErrors, without_errors_of_turns
from sinssim.statistics.random_numbers import key, normals
from sinssim.strapdown.attitude import PLATFORM
from sinssim.strapdown.frames.navigation_problem import FORMS, Models, Rows, channel_of, form_of, models_of
from sinssim.strapdown.frames.route_pole import route_pole, too_near
from sinssim.strapdown.frames.vertical_channel import (
    Channel,
    HeightReadings,
    height_reference,
    loop_gains_k,
    reference_k,
    start_loop_k,
)
from sinssim.strapdown.frames.wander_free_transverse import (
    FREE_AZIMUTH,
    TRANSVERSE,
    WANDER,
    north_k,
    rates_k,
    start_azimuth_k,
    step_azimuth_k,
)
from sinssim.strapdown.mechanization import Mechanization, Options, chosen
from sinssim.strapdown.navigation_error import POLAR_LIMIT

_BLOCK = 256  # number of samples whose random numbers are drawn together
_ZERO = (0.0, 0.0, 0.0)


class Platform(NamedTuple):
    """The platform; N intervals. The first rows of q_ip and q_wp hold the start, all other rows are written.

    push: integrals of the specific force, inertial axes, (N, 3) m/s; not written.
    torqued: whether the platform turns with the frame.
    torquer: κ, (3,).
    q_ip: attitude, (N+1, 4).
    q_wp: attitude in the frame as the navigator computes it, (N+1, 4); (0, 4) if torqued.
    commanded: commanded rates about the platform's axes, (N, 3) rad/s.
    readings: readings of the accelerometers, (N, 3) m/s.
    drift: drift of the gyros, (N, 3) rad/s.
    flags: flags of the accelerometers, (N, 6), if the sensors can set any; else (0, 6).
    """

    push: Array
    torqued: bool
    torquer: Array
    q_ip: Array
    q_wp: Array
    commanded: Array
    readings: Array
    drift: Array
    flags: NDArray[np.uint8]


@inline
def moving_k(x: Vector, g: Vector, z: Vector) -> Vector:
    """∫a dt in axes that turn by ζ during the interval: x − ζ × (x/2 + g/12) + ½ ζ × (ζ × x)/3.

    x is the integral in the axes of the start, g the change of a·dt over the interval.
    """
    return along(sub(x, cross(z, along(mul(0.5, x), 1.0 / 12.0, g))), 1.0 / 6.0, cross(z, cross(z, x)))


@inline
def _felt_k(push: Array, k: int, q: Quaternion, turn: Vector) -> Vector:
    """What the accelerometers of a platform at q_ip, which turns during interval k, integrate."""
    low, high = max(k - 1, 0), min(k + 1, push.shape[0] - 1)
    half = 1.0 / (high - low) if high > low else 0.0
    x = rotate_k(q[0], -q[1], -q[2], -q[3], push[k, 0], push[k, 1], push[k, 2])
    change = push[high, 0] - push[low, 0], push[high, 1] - push[low, 1], push[high, 2] - push[low, 2]
    return moving_k(x, mul(half, rotate_k(q[0], -q[1], -q[2], -q[3], *change)), turn)


@inline
def _keep_k(out: Array, k: int, a: Vector) -> None:
    """Store a vector as row k."""
    out[k, 0], out[k, 1], out[k, 2] = a


# `bind` gives it the form of the radii of curvature.
def simulate(
    time: Array, of: Models, channel: Channel, rows: Rows, rule: int, axis: Array, of_x: Array,
    sensors: Packed, key_0: np.uint64, key_1: np.uint64, platform: Platform,
) -> None:  # fmt: skip
    """Run the loop. `time`: edges, (N+1,) s; `of`, `channel`, `rows`, `rule`, `axis`, `of_x`: the navigator, as in
    `sinssim.strapdown.frames.wander_free_transverse`; attitude and defect are not written."""
    c, p, count = sensors, platform, time.shape[0] - 1
    z, s = np.empty((4, 6, _BLOCK)), np.empty((1, 6, STATES))
    u, y, f = np.zeros(6), np.zeros(6), np.zeros(6, np.uint8)
    begin(c.active, s, 0, key_0, key_1)
    x, of_x[0], _, _ = start_azimuth_k(of, rule, axis, of_x[0], rows, start_loop_k(channel, rows.height[0]))
    gains = loop_gains_k(channel.time_constant, x.x.down, x.x.k2)
    ip = (p.q_ip[0, 0], p.q_ip[0, 1], p.q_ip[0, 2], p.q_ip[0, 3])
    wp = (1.0, 0.0, 0.0, 0.0)
    if not p.torqued:
        p.q_wp[0, 0], p.q_wp[0, 1], p.q_wp[0, 2], p.q_wp[0, 3] = wp
    owed, drift, d_before, w_before, dt_before = _ZERO, _ZERO, _ZERO, _ZERO, 1.0
    for k in range(count):
        dt = time[k + 1] - time[k]
        # what is commanded: the frame's rate, extrapolated to mid-interval, and what the last command missed
        _, _, w = rates_k(rule, of.earth.omega, x.x, x.v)
        expected = mul(dt, along(w, 0.5 * dt / dt_before if k > 0 else 0.0, sub(w, w_before)))
        command = add(expected, owed) if p.torqued else _ZERO
        w_before, dt_before = w, dt
        _keep_k(p.commanded, k, mul(1.0 / dt, command))
        turn = (1.0 + p.torquer[0]) * command[0], (1.0 + p.torquer[1]) * command[1], (1.0 + p.torquer[2]) * command[2]
        # the platform: its accelerometers, its gyros' drift, its turn
        u[3], u[4], u[5] = _felt_k(p.push, k, ip, sub(turn, drift))
        if k % _BLOCK == 0:
            draw_block(c.active, z, k, min(_BLOCK, count - k), key_0, key_1)
        advance(c.active, c.conditions, time[k], time[k + 1])
        measure(c.active, u, y, f, c.conditions, c.parameters, s, 0, z, k % _BLOCK, c.faults)
        drift, d = (y[0], y[1], y[2]), (y[3], y[4], y[5])
        ip = multiply_k(*ip, *quaternion_from_rotation_vector_k(*sub(turn, drift)))
        p.q_ip[k + 1, 0], p.q_ip[k + 1, 1], p.q_ip[k + 1, 2], p.q_ip[k + 1, 3] = ip
        _keep_k(p.readings, k, d)
        _keep_k(p.drift, k, mul(1.0 / dt, drift))
        if c.active & (FAULTY | LIMITED):
            p.flags[k] = f
        # the readings in the frame, its step, and what the command missed; or the platform in the turned frame
        if not p.torqued:
            d = moving_k(rotate_k(*wp, *d), _ZERO, expected)
        change = sub(d, d_before) if k > 0 else _ZERO  # of the acceleration times dt
        d_before = d
        x, rate = step_azimuth_k(
            of, rule, axis, False, channel.number, gains, dt, reference_k(channel, k + 1),
            (d, along(d, -0.5, change), along(d, 0.5, change)), x,
        )  # fmt: skip
        turn = simpson(*rate)
        owed = sub(turn, expected)
        if not p.torqued:
            wp = multiply_k(*quaternion_from_rotation_vector_k(*mul(-1.0, turn)), *wp)
            p.q_wp[k + 1, 0], p.q_wp[k + 1, 1], p.q_wp[k + 1, 2], p.q_wp[k + 1, 3] = wp
        rows.latitude[k + 1], rows.longitude[k + 1], v, of_x[k + 1], _, _ = north_k(x)
        rows.height[k + 1] = x.x.h
        _keep_k(rows.velocity, k + 1, v)


class Forces(NamedTuple):
    """The motion as a platform experiences it; inertial axes that coincide with the Earth-fixed ones at t = 0."""

    push: Array  # integrals of the specific force over the intervals, (N, 3) m/s
    q_ib: Array  # attitudes of the vehicle at the edges, (N+1, 4)


def inertial_forces(
    time: Array, truth: NavState, gravity: str, ellipsoid: Ellipsoid, disturbance: Array | None = None
) -> Forces:
    """Return the specific force along a motion and the vehicle's attitude in inertial axes.

    `time` are the edges of the intervals, (N+1,) s, `gravity` the model of the truth, and `disturbance` that of the
    true gravity at the edges, north, east, down, (N+1, 3) m/s².
    """
    longitude = truth.longitude + ellipsoid.omega * time
    q_in = earth.q_en(truth.latitude, longitude)
    position = earth.geodetic_to_ecef(truth.latitude, longitude, truth.height, ellipsoid)
    velocity = rotation.rotate(q_in, truth.velocity_ned)
    velocity[:, 0] -= ellipsoid.omega * position[:, 1]
    velocity[:, 1] += ellipsoid.omega * position[:, 0]
    dt = np.diff(time)[:, np.newaxis]
    middle = 0.5 * (position[1:] + position[:-1]) - 0.125 * dt * np.diff(velocity, axis=0)
    at_edges = earth.gravitation_ecef(position, gravity, ellipsoid)
    between = earth.gravitation_ecef(middle, gravity, ellipsoid)
    push = np.diff(velocity, axis=0) - dt / 6.0 * (at_edges[1:] + 4.0 * between + at_edges[:-1])
    if disturbance is not None:
        felt = rotation.rotate(q_in, disturbance)
        push -= 0.5 * dt * (felt[1:] + felt[:-1])
    return Forces(push, rotation.multiply(q_in, truth.q_nb))


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
    """The solution of a platform's navigator, and the platform itself."""

    q_ip: Array = field(default_factory=lambda: np.zeros((0, 4)))
    """Attitude of the platform in inertial axes that coincide with the Earth-fixed ones at t = 0, (N+1, 4)."""
    gimbals: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """Gimbal angles roll, pitch and azimuth as read, (N+1, 3) rad."""
    commanded: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """Commanded rates about the platform's axes, (N, 3) rad/s; 0 for one that is not torqued."""
    drift: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """Drift of the gyros about these axes, what they would read at rest in inertial space, (N, 3) rad/s."""
    readings: Array = field(default_factory=lambda: np.zeros((0, 3)))  # readings of the accelerometers, (N, 3) m/s
    flags: NDArray[np.uint8] | None = None  # flags of each sample as in `ImuData`, (N, 6), or None


@cache
def _engine(form: str) -> Callable[..., None]:

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
    """Navigate with a platform from a given initial state, as its attitude says: the gimbals read it.

    `time` are the edges of the intervals, (N+1,) s, and `forces` what acts on the platform, from `inertial_forces`.
    Without errors, sensors, torquers and pick-offs have none. The gyros' scale factor, misalignment, non-linearity,
    quantisation and range do not act, because a platform holds its gyros at null; all other errors act about the
    platform's axes. In the frames "level", "wander", "free-azimuth" and "transverse" the platform is level and turned
    with the frame; with "inertial" it keeps its direction in inertial space, that of north, east and down at the start.
    The algorithm of the mechanization has no effect; `height` is as for `navigate`. The attitude of the solution is
    that of the gimbals.
    """
    of = replace(chosen(mechanization, options), algorithm=PLATFORM)  # which has no fast part: rates are refused
    frame = of.frame
    time, count = _checked(time, forces), len(forces.push)
    reference, climb = height_reference(of.vertical, height, time)
    imperfect, torqued, rule = of_platform or PlatformErrors(), frame != "inertial", _RULES[frame]
    at_null = without_errors_of_turns(errors or ImuErrors())
    at_null = replace(at_null, gyro=replace(at_null.gyro, quantum=0.0, limit=0.0))
    packed = pack([at_null], float(time[0]))
    (key_0, key_1), rows = key(seed), count + 1

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
    flagged = bool(packed.active & (FAULTY | LIMITED))
    flags = np.zeros((count if flagged else 0, 6), dtype=np.uint8)
    q_nb, no_defect = np.empty((rows, 4)), np.zeros(rows)
    _engine(form_of(of))(
        time,
        models_of(of), channel_of(of, reference, climb),
        Rows(latitude, longitude, altitude, velocity, q_nb, no_defect), rule, pole, of_x,
        packed, key_0, key_1,
        Platform(forces.push, torqued, imperfect.torquer_scale, q_ip, q_wp, commanded, readings, drift, flags),
    )  # fmt: skip
    _check(frame, pole, time, latitude, longitude, altitude, velocity, q_ip)

    gimbals, q_pb = _read_gimbals(rotation.multiply(rotation.conjugate(q_ip), forces.q_ib), imperfect, seed)
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


def _checked(time: Array, forces: Forces) -> Array:
    """Return the edges of the intervals, s, as doubles, if the forces fit them."""
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
    return time


def _read_gimbals(q_pb: Array, of_platform: PlatformErrors, seed: int) -> tuple[Array, Array]:
    """Return the angles that the pick-offs read, (N, 3) rad, and the attitude on the platform that they give."""
    gimbals = np.stack(rotation.euler_from_quaternion(q_pb), axis=1)
    if not (of_platform.pickoff.any() or of_platform.pickoff_noise):
        return gimbals, q_pb
    gimbals = gimbals + of_platform.pickoff + of_platform.pickoff_noise * _noise(seed, len(gimbals))
    return gimbals, rotation.quaternion_from_euler(*gimbals.T)


def _noise(seed: int, rows: int) -> Array:
    """Return the noise of the pick-offs, of 1σ = 1, (rows, 3)."""
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
