"""Error dynamics along a motion: F and driving noise of ẋ = F x + w, Φ and Q over intervals, also at the poles.

The north-east-down error equations in full (Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed.
2004, 12.21 and 12.28; Savage, Strapdown Analytics, 2000, chapter 12), φ with C_solution = (I − [φ×]) C_true and
position in metres, δr = ((R₁+h) δlatitude, (R₂+h) cos(latitude) δlongitude, −δh):

    (1) φ̇  = −ω_in × φ + δω_ie + δω_en − C_nb δω
    (2) δv̇ = f × φ + C_nb δf − (2ω_ie + ω_en) × δv + v × (2δω_ie + δω_en) + δg
    (3) δṙ = δv + terms in δr from the rotation and the curvature of the local level

where δω and δf are the errors of the increments that the engine receives, each a linear function of the sensors'
states. No first-order term is dropped: radii of curvature and gravity vary with latitude and height. δg in (2) has the
change of the engine's gravity with position, less the states of the gravity that the engine does not know.

The equations that are regular at the poles have F in Earth-fixed axes, and Φ and Q in transported local axes. The
errors in Earth-fixed axes, with r, v and C_eb of the solution less the true ones, φ with C_solution = (I − [φ×])
C_true, and gravity g of the position (Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation
Systems, 2nd ed. 2013, 14.2.3):

    φ̇  = −ω_ie × φ − C_eb δω
    δv̇ = f × φ + C_eb δf − 2ω_ie × δv + (∂g/∂r) δr
    δṙ = δv

The filter's state has them along north, east and down of the solution, and velocity and attitude relative to a local
level that goes along with the position's error: the level turns by θ = (δr_E/(R₂+h), −δr_N/(R₁+h), 0), and not about
the vertical (`sinssim.strapdown.navigation_error`). With C from Earth-fixed axes into north, east, down

    δr_n = C δr_e,   δv_n = C δv_e + v × θ,   φ_n = C φ_e + θ      (4)

The state relative to north at its own place, in which `dynamics` of the north-east-down equations and the measurements
are written, turns with north by ψ = δr_E tan φ/(R₂+h) in addition, k̂ down:

    δv = δv_n + ψ k̂ × v,   φ = φ_n − ψ k̂      (5)

Errors of gyros and accelerometers. A triad reads G u + b with G = (1 + k)(1 + M). Compensated by Ĝ and b̂, it gives û =
Ĝ⁻¹(G u + b − b̂), whose error is linear in û without a remainder,

    û − u = X û + y,   X = 1 − G⁻¹Ĝ,   y = G⁻¹(b − b̂)      (6)

The states of scale factor and misalignment are X, the diagonal and the rest, and those of the bias are y; to first
order they are the differences of the parameters. Where X̂ and ŷ are fed back,

    Ĝ⁺ = Ĝ (1 − X̂)⁻¹,   b̂⁺ = b̂ + Ĝ⁺ ŷ,   X⁺ = (X − X̂)(1 − X̂)⁻¹,   y⁺ = y − ŷ + X⁺ ŷ      (7)

also without a remainder: squares of large errors do not count as new errors. Further errors of the sensors are linear.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.estimation.state_model import FLICKER, GRAVITY, INERTIAL, ErrorModel, places_of
from sinssim.sensors.measurement_kind import CORE, PHI, R, V, earth_rate, earth_rate_slope, skew
from sinssim.strapdown.navigation_error import turn_of_north

_LATITUDE_STEP, _HEIGHT_STEP = 1e-4, 100.0  # rad, m: steps for differences of gravity, accurate to 1e-8 of its gradient


@dataclass(frozen=True)
class NominalMotion:
    """The motion that F depends on, at K instants."""

    latitude: Array  # (K,) rad
    height: Array  # (K,) m
    velocity: Array  # north, east, down, (K, 3) m/s
    c_nb: Array  # (K, 3, 3)
    force_n: Array  # specific force in north, east, down, (K, 3) m/s²
    rate_b: Array  # inertial rate in body axes, (K, 3) rad/s
    force_b: Array  # specific force in body axes, (K, 3) m/s²


def transport_rate(latitude: Array, height: Array, velocity: Array, ellipsoid: Ellipsoid) -> Array:
    """Return ω_en in north, east, down, (K, 3) rad/s, from (K,) rad, (K,) m and (K, 3) m/s."""
    r1, r2 = earth.radii(latitude, ellipsoid)
    east = velocity[:, 1] / (r2 + height)
    return np.stack([east, -velocity[:, 0] / (r1 + height), -east * np.tan(latitude)], axis=-1)


def reading_error(model: ErrorModel, triad: str, reading: Array, force: Array) -> Array:
    """Return the matrix of δω, or δf, the error of a compensated reading of "gyro" or "accelerometer", (K, 3, n).

    δω = matrix · x; the reading is the inertial rate, rad/s, or the specific force, m/s², in body axes, (K, 3), as is
    the `force`, on which the gyros may depend.
    """
    out = np.zeros((len(reading), 3, model.size))
    for name, where in model.slices.items():
        if name.startswith((f"{triad} instability", f"{triad} {FLICKER} ")):
            out[:, :, where] = np.eye(3)
        if name.startswith(f"{triad} ") and (term := INERTIAL.get(name)) is not None:
            inputs = np.broadcast_to(term.inputs(reading, force), (len(reading), *term.shape))
            for state, at in enumerate(np.argwhere(places_of(term)), start=where.start):
                out[:, at[0], state] = inputs[:, *at]
    return out


_EYE, _AXES = np.eye(3), ~np.eye(3, dtype=bool)
_FAR = 0.1
"""Largest estimate X̂ that is fed back by (7): a filter that takes a sensor for wrong by more is lost, and 1 − X̂ may not
have an inverse. Then the differences of the parameters are fed back."""


def _instrument(triad: str, values: Mapping[str, Array]) -> Array:
    """Return G = (1 + k)(1 + M) of a triad, (..., 3, 3), by the values of its states."""
    scale, tilts = 1.0 + values[f"{triad} scale"], values.get(f"{triad} misalignment", np.zeros(6))
    axes = np.broadcast_to(_EYE, (*np.broadcast_shapes(scale.shape[:-1], tilts.shape[:-1]), 3, 3)).copy()
    axes[..., _AXES] = tilts
    return np.asarray(scale[..., None] * axes)


def remaining(model: ErrorModel, true: Mapping[str, Array], known: Mapping[str, Array]) -> dict[str, Array]:
    """Return the errors that the states stand for where parameters with `true` values are compensated by `known` ones,
    by block: (6), and the difference of all others."""
    out = {name: true.get(name, np.zeros(1)) - value for name, value in known.items()}
    for triad in ("gyro", "accelerometer"):
        scale, tilts, bias = (f"{triad} {what}" for what in ("scale", "misalignment", "bias"))
        if scale not in model.slices:
            continue
        back = np.linalg.inv(_instrument(triad, {name: true.get(name, 0.0 * known[name]) for name in known}))
        x = _EYE - back @ _instrument(triad, known)
        out[scale] = np.einsum("...ii->...i", x)
        if tilts in model.slices:
            out[tilts] = x[..., _AXES]
        if bias in model.slices:
            out[bias] = np.einsum("...ij,...j->...i", back, out[bias])
    return out


def with_products(model: ErrorModel, covariance: Array) -> Array:
    """Return a covariance of parameters, (n, n), as that of the states (6): the diagonal of X has −(M²)_ii beside the
    scale factor, which matters where this is known better than the square of a misalignment."""
    out = covariance.copy()
    for triad in ("gyro", "accelerometer"):
        scale, tilts = (model.slices.get(f"{triad} {what}") for what in ("scale", "misalignment"))
        if scale is not None and tilts is not None:
            variance = np.zeros((3, 3))
            variance[_AXES] = covariance[tilts, tilts].diagonal()
            out[scale, scale] += np.diag(np.sum(variance * variance.T, axis=1))
    return out


def calibrated(model: ErrorModel, known: Array, fed: Array) -> tuple[Array, Array | None]:
    """Return the compensated values after errors, (n,), were fed back to `known` ones, (n,), and the matrix by which
    the remaining errors are those about the old values less what was fed back, (n, n), None for 1: (7)."""
    out, turn = np.where(np.arange(len(fed)) < CORE, 0.0, known + fed), np.eye(len(fed))
    values = {block.name: known[model.slices[block.name]] for block in model.blocks}
    for triad in ("gyro", "accelerometer"):
        scale, tilts, bias = (model.slices.get(f"{triad} {what}") for what in ("scale", "misalignment", "bias"))
        if scale is None or not fed[scale].any():
            continue
        place = np.full((3, 3), -1)
        place[~_AXES] = np.arange(scale.start, scale.stop)
        if tilts is not None:
            place[_AXES] = np.arange(tilts.start, tilts.stop)
        x = np.where(place < 0, 0.0, fed[place])
        if np.abs(x).max() > _FAR:
            continue
        after = np.linalg.inv(_EYE - x)
        g = _instrument(triad, values) @ after
        out[scale] = g.diagonal() - 1.0
        if tilts is not None:
            out[tilts] = (g / g.diagonal()[:, None])[_AXES]
        for i, j in np.argwhere(place >= 0):
            inside = place[i] >= 0
            turn[place[i, j], place[i, inside]] = after[inside, j]
        if bias is not None:
            out[bias] = known[bias] + g @ fed[bias]
            for i in range(3):
                turn[bias.start + i, place[i, place[i] >= 0]] = (after @ fed[bias])[place[i] >= 0]
    return out, None if np.array_equal(turn, np.eye(len(fed))) else turn


def rates_of_decay(model: ErrorModel, velocity: Array) -> Array:
    """Return 1/τ of the parameters' states at velocities north, east, down, (K, 3) m/s: (K, n − 9) 1/s."""
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    return np.asarray(model.decay[CORE:] + np.multiply.outer(speed, model.per_metre[CORE:]))


def _fill_parameters(f: Array, model: ErrorModel, velocity: Array) -> None:
    parameters = np.arange(CORE, model.size)
    f[:, parameters, parameters] = -rates_of_decay(model, velocity)


def dynamics(model: ErrorModel, motion: NominalMotion, gravity: str, ellipsoid: Ellipsoid) -> Array:
    """Return F of ẋ = F x + w, (K, n, n), in north-east-down axes along the motion at K instants."""
    lat, h, v = motion.latitude, motion.height, motion.velocity
    n, e, d = v.T
    s, c = np.sin(lat), np.cos(lat)
    t = s / c
    r1, r2 = earth.radii(lat, ellipsoid)
    e2 = ellipsoid.e2
    w = 1.0 - e2 * s * s
    dr1, dr2 = 3.0 * r1 * e2 * s * c / w, r2 * e2 * s * c / w  # with respect to latitude
    p, q = r1 + h, r2 + h
    ie, en = earth_rate(lat, ellipsoid), transport_rate(lat, h, v, ellipsoid)

    # derivatives of ω_ie, ω_en with respect to δr north and down, of ω_en with respect to δv
    d_ie = earth_rate_slope(lat, h, ellipsoid)
    d_en = np.zeros_like(d_ie)
    d_en[:, 0, 0], d_en[:, 0, 2] = -e * dr2 / (q * q * p), e / (q * q)
    d_en[:, 1, 0], d_en[:, 1, 2] = n * dr1 / p**3, -n / (p * p)
    d_en[:, 2, 0], d_en[:, 2, 2] = (e * t * dr2 / q - e / (c * c)) / (q * p), -e * t / (q * q)
    over_v = np.zeros_like(d_ie)
    over_v[:, 0, 1], over_v[:, 1, 0], over_v[:, 2, 1] = 1.0 / q, -1.0 / p, -t / q

    # derivatives of gravity with respect to δr north and down, for the engine's gravity model
    g_north = earth.gravity_ned(lat + _LATITUDE_STEP, h, gravity, ellipsoid)
    g_north -= earth.gravity_ned(lat - _LATITUDE_STEP, h, gravity, ellipsoid)
    g_up = earth.gravity_ned(lat, h + _HEIGHT_STEP, gravity, ellipsoid)
    g_up -= earth.gravity_ned(lat, h - _HEIGHT_STEP, gravity, ellipsoid)

    f = np.zeros((len(lat), model.size, model.size))
    f[:, PHI, PHI] = -skew(ie + en)  # (1)
    f[:, PHI, V] = over_v
    f[:, PHI, R] = d_ie + d_en
    f[:, V, PHI] = skew(motion.force_n)  # (2)
    across = skew(v)
    f[:, V, V] = across @ over_v - skew(2.0 * ie + en)
    f[:, V, R] = across @ (2.0 * d_ie + d_en)
    f[:, V, 0] += g_north / (2.0 * _LATITUDE_STEP * p)[:, None]
    f[:, V, 2] -= g_up / (2.0 * _HEIGHT_STEP)
    # (3): d/dt of (R₁+h) δlatitude and (R₂+h) cos(latitude) δlongitude, with d((R₂+h) cos)/dlatitude = −(R₁+h) sin
    f[:, R, V] = np.eye(3)
    f[:, 0, 0], f[:, 0, 2] = -d / p, n / p
    f[:, 1, 0], f[:, 1, 1], f[:, 1, 2] = e * t / q, -(n * t + d) / q, e / q
    f[:, PHI, CORE:] = -motion.c_nb @ reading_error(model, "gyro", motion.rate_b, motion.force_b)[:, :, CORE:]
    f[:, V, CORE:] = motion.c_nb @ reading_error(model, "accelerometer", motion.force_b, motion.force_b)[:, :, CORE:]
    if GRAVITY in model.slices:
        f[:, V, model.slices[GRAVITY]] = -np.eye(3)
    _fill_parameters(f, model, v)
    return f


def driving_noise(model: ErrorModel) -> Array:
    """Return the diagonal of the spectral density of w, (n,) unit²/s: the noise of a triad is equal in all axes.

    That of processes over the distance is in `noise_at_speed`.
    """
    density = model.density**2
    density[PHI] += model.gyro_noise**2
    density[V] += model.accel_noise**2
    return density


def noise_at_speed(model: ErrorModel, density: Array, velocity: Array) -> Array:
    """Return the diagonal of the spectral density of w at velocities, (K, 3) m/s: `density`, (n,), and 2σ²v/D of
    processes over the distance, (K, n) unit²/s; the density itself, (n,), without any."""
    if not model.per_metre.any():
        return density
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    return np.asarray(density + np.multiply.outer(speed, 2.0 * model.sigma**2 * model.per_metre))


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_ORDER = 4
_LONGEST = 1.0  # s: F⁵t⁵/5! is below 1e-7 of Φ − I, because the Schuler frequency is the highest of the system
_DECAY = 0.1  # t/τ for which the same holds of exp(−t/τ)


def transition(f: Array, density: Array, interval: Array) -> tuple[Array, Array]:
    """Return Φ and Q, (K, n, n) each, over intervals T, (K,) s, in each of which F is constant.

    Φ = exp(F T) is a power series. Q = ∫ Φ(t) S Φ(t)ᵀ dt from 0 to T, which Van Loan's matrix exponential also gives
    (IEEE Trans. Automatic Control 23, 1978, 395), is computed by Gauss-Legendre quadrature on the same series, so that
    Q stays positive semi-definite under truncation. Long intervals are halved, and Φ and Q are doubled up again. F is
    as `dynamics` returns it, with only a diagonal below the rows of the navigation errors; `density` is the diagonal of
    S, (n,), or (K, n) where it changes.
    """
    count, n = f.shape[:2]
    decay = -np.einsum("kii->ki", f[:, CORE:, CORE:])
    density = np.broadcast_to(density, (count, n))
    longest = float(interval.max(initial=0.0))
    fastest = float(decay.max(initial=0.0))
    doublings = int(np.ceil(np.log2(max(longest / _LONGEST, longest * fastest / _DECAY, 1.0))))
    t = interval / 2**doublings

    # the navigation errors' rows of F^k t^k/k!
    top = f[:, :CORE] * t[:, None, None]
    terms = [top]
    for k in range(2, _ORDER + 1):
        term = terms[-1][:, :, :CORE] @ top
        term[:, :, CORE:] -= terms[-1][:, :, CORE:] * (decay * t[:, None])[:, None, :]
        term /= k
        terms.append(term)

    noisy = np.flatnonzero(density.any(axis=0))
    root = np.zeros((count, n, len(_NODES) * len(noisy)))
    by_parameter = noisy >= CORE
    for i, (node, weight) in enumerate(zip(0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS, strict=True)):
        amplitude = np.sqrt(weight * t[:, None] * density[:, noisy])
        part = root[:, :, i * len(noisy) : (i + 1) * len(noisy)]
        rows = terms[-1][:, :, noisy] * node
        for term in terms[-2::-1]:
            rows = (rows + term[:, :, noisy]) * node
        rows[:, noisy[~by_parameter], np.flatnonzero(~by_parameter)] += 1.0
        part[:, :CORE] = rows * amplitude[:, None, :]
        part[:, noisy[by_parameter], np.flatnonzero(by_parameter)] = (
            np.exp(-node * t[:, None] * decay[:, noisy[by_parameter] - CORE]) * amplitude[:, by_parameter]
        )
    q = root @ root.transpose(0, 2, 1)

    phi = np.zeros((count, n, n))
    phi[:, :CORE] = sum(terms[1:], terms[0])
    diagonal = np.arange(n)
    phi[:, diagonal[:CORE], diagonal[:CORE]] += 1.0
    phi[:, diagonal[CORE:], diagonal[CORE:]] = np.exp(-t[:, None] * decay)
    for _ in range(doublings):
        q = q + phi @ q @ phi.transpose(0, 2, 1)
        phi = phi @ phi
    return phi, q


_STEP = 100.0  # m: step for differences of gravity, accurate to 1e-8 of its gradient


def earth_from_ned(latitude: Array, longitude: Array) -> Array:
    """Return C_en, from north, east, down into Earth-fixed axes, (K, 3, 3), at (K,) rad."""
    return rotation.dcm_from_quaternion(earth.q_en(latitude, longitude))


def earth_dynamics(
    model: ErrorModel, motion: NominalMotion, longitude: Array, gravity: str, ellipsoid: Ellipsoid
) -> Array:
    """Return F of ẋ = F x + w, (K, n, n), with position, velocity and attitude in Earth-fixed axes.

    The motion is in north, east, down at the longitudes, (K,) rad.
    """
    c_en = earth_from_ned(motion.latitude, longitude)
    c_eb = c_en @ motion.c_nb
    place = earth.geodetic_to_ecef(motion.latitude, longitude, motion.height, ellipsoid)
    spin = skew(np.array([0.0, 0.0, ellipsoid.omega]))
    f = np.zeros((len(longitude), model.size, model.size))
    f[:, R, V] = np.eye(3)
    for axis in range(3):
        step = _STEP * np.eye(3)[axis]
        change = earth.gravitation_ecef(place + step, gravity, ellipsoid)
        change -= earth.gravitation_ecef(place - step, gravity, ellipsoid)
        f[:, V, R.start + axis] = change / (2.0 * _STEP)
    f[:, V, R] -= spin @ spin  # the centrifugal acceleration −ω × (ω × r)
    f[:, V, V] = -2.0 * spin
    f[:, V, PHI] = skew(np.einsum("kij,kj->ki", c_en, motion.force_n))
    f[:, PHI, PHI] = -spin
    f[:, PHI, CORE:] = -c_eb @ reading_error(model, "gyro", motion.rate_b, motion.force_b)[:, :, CORE:]
    f[:, V, CORE:] = c_eb @ reading_error(model, "accelerometer", motion.force_b, motion.force_b)[:, :, CORE:]
    if GRAVITY in model.slices:
        f[:, V, model.slices[GRAVITY]] = -c_en
    _fill_parameters(f, model, motion.velocity)
    return f


def local_from_earth(state: NavState, ellipsoid: Ellipsoid) -> tuple[Array, Array]:
    """Return the matrices of (4), (K, 9, 9), from errors in Earth-fixed axes to transported local axes, and back."""
    c_en = earth_from_ned(state.latitude, state.longitude)
    c_ne = c_en.transpose(0, 2, 1)
    r1, r2 = earth.radii(state.latitude, ellipsoid)
    tilt = np.zeros_like(c_en)  # θ of δr, both north, east, down
    tilt[:, 0, 1], tilt[:, 1, 0] = 1.0 / (r2 + state.height), -1.0 / (r1 + state.height)
    across = skew(state.velocity_ned) @ tilt
    to, back = np.zeros((2, len(c_en), CORE, CORE))
    for part in (R, V, PHI):
        to[:, part, part], back[:, part, part] = c_ne, c_en
    to[:, V, R], to[:, PHI, R] = across @ c_ne, tilt @ c_ne  # (4)
    back[:, V, R], back[:, PHI, R] = -c_en @ across, -c_en @ tilt
    return to, back


def transported_transition(
    f: Array, density: Array, interval: Array, state: NavState, ellipsoid: Ellipsoid
) -> tuple[Array, Array]:
    """Return Φ and Q over intervals, (K, n, n) each, for the state in transported local axes.

    F is that of `earth_dynamics` in each interval; the density, as for `transition`, is the same in all axes of a
    navigation block;
    `state` is the solution at the intervals' ends, K+1 rows.
    """
    phi, q = transition(f, density, interval)
    to, back = local_from_earth(state, ellipsoid)
    end, start = to[1:], back[:-1]
    phi[:, :CORE] = end @ phi[:, :CORE]
    phi[:, :, :CORE] = phi[:, :, :CORE] @ start
    q[:, :CORE] = end @ q[:, :CORE]
    q[:, :, :CORE] = q[:, :, :CORE] @ end.transpose(0, 2, 1)
    return phi, q


def turn_of_axes(before: NavState, after: NavState, size: int) -> Array:
    """Return the matrix, (n, n), that refers a state to a corrected solution's own north and east."""
    psi = turn_of_north(before.latitude, before.longitude, after.latitude, after.longitude)[0]
    c, s = np.cos(psi), np.sin(psi)
    out = np.eye(size)
    for part in (R, V, PHI):
        out[part, part] = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return out


def refer_to_transported(h: Array, state: NavState, ellipsoid: Ellipsoid) -> None:
    """Change H, (M, k, n), from a state relative to north to one in transported axes, in place, by (5)."""
    r2 = earth.radii(state.latitude, ellipsoid)[1]
    turn = np.tan(state.latitude) / (r2 + state.height)  # ψ/δr_E
    north, east, _ = state.velocity_ned.T[:, :, None]
    change = h[:, :, V.start + 1] * north - h[:, :, V.start] * east - h[:, :, PHI.start + 2]  # (5)
    h[:, :, R.start + 1] += turn[:, None] * change
