"""Vibration, lever arm and mounting of a sensor block, added to any other motion.

The block's attitude is that of the vehicle rotated by the rotation vector φ(t), q_nb' = q_nb ∘ q(φ) ∘ q_bs, and its
place is displaced by p(t) in the vehicle's axes, r' = r + C_eb p. Both are sums of sinusoids (p also has a constant
part, the lever arm). Band-limited noise is a sum of many sinusoids with random frequencies and phases (Shinozuka and
Deodatis, Applied Mechanics Reviews 44, 1991). All derivatives are therefore exact. With ω the vehicle's inertial rate,
w that of the block relative to the vehicle, D = C_b'b, and γ gravitation:

    ω' = Dω + w,    w = φ̇ − (1 − cos φ)/φ² φ × φ̇ + (φ − sin φ)/φ³ φ × (φ × φ̇)
    f' = D [f + p̈ + 2ω × ṗ + ω̇ × p + ω × (ω × p) − C_be (γ(r') − γ(r))]

(Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, sec. 3.6; Groves 2013, eq. 2.165). The
increments do not need ω̇, which trajectories do not provide: integration by parts with Ḋ = −w × D gives

    ∫D(ω̇ × p) dt = [D(ω × p)] + ∫ w × D(ω × p) dt − ∫D(ω × ṗ) dt

They are the vehicle's own increments plus the changes by vibration, computed to rounding by Gauss-Legendre quadrature.
At the many instants that a fast vibration needs, polynomials give the motion of a vehicle that is smooth.
Only `rates`, at single instants, computes ω̇ from differences of ω over a millisecond.

`velocity_increments` are the exact integrals of the specific force at several points on lever arms.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, NavState
from sinssim.errors import InputError, unknown_name
from sinssim.jit import kernel
from sinssim.truth.motions.vibration import COORDINATE_NUMBER, COORDINATES, Tone
from sinssim.truth.sampling import (
    block_state,
    breaks_between,
    check_instants,
    integrate_samples,
    panels,
    sample_edges,
)
from sinssim.truth.trajectory import DerivedMotion, Trajectory

_STEP = 2.5e-4  # s, of the five-point difference for ω̇
_REACH = 2.01 * _STEP  # s, of its middle from the ends of a piece
# Coefficients by power of the offset, in steps, of the polynomial through values at offsets −2...2.
_FIVE_POINTS = np.linalg.inv(np.vander(np.arange(-2.0, 3.0), increasing=True))


@kernel
def _sum_tones(
    t: Array, first_tone: NDArray[np.intp], amplitude: Array, omega: Array, phase: Array, sine: Array, cosine: Array,
    value: Array, first: Array, second: Array,
) -> None:  # fmt: skip
    """Sum the tones and their derivatives; those of coordinate j are first_tone[j]...first_tone[j+1]-1.

    Sine and cosine of a tone are computed anew after each radian of its phase. In between, the addition theorems with
    series for the remainder are exact to rounding and several times as fast.
    """
    fastest = 0.0
    for k in range(len(omega)):
        fastest = max(fastest, omega[k])
    taken, fresh = 0.0, False
    for i in range(len(t)):
        if not fresh or abs(t[i] - taken) * fastest > 1.0:
            taken, fresh = t[i], True
            for k in range(len(omega)):
                x = omega[k] * taken + phase[k]
                sine[k], cosine[k] = amplitude[k] * np.sin(x), amplitude[k] * np.cos(x)
        since = t[i] - taken
        for j in range(6):
            v0, v1, v2 = 0.0, 0.0, 0.0
            for k in range(first_tone[j], first_tone[j + 1]):
                w = omega[k]
                x = w * since
                y = x * x
                s = 1.0 - y / 110.0 * (1.0 - y / 156.0 * (1.0 - y / 210.0 * (1.0 - y / 272.0)))
                s = x * (1.0 - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * s))))
                c = 1.0 - y / 90.0 * (1.0 - y / 132.0 * (1.0 - y / 182.0 * (1.0 - y / 240.0 * (1.0 - y / 306.0))))
                c = 1.0 - y / 2.0 * (1.0 - y / 12.0 * (1.0 - y / 30.0 * (1.0 - y / 56.0 * c)))
                a = sine[k] * c + cosine[k] * s
                v0 += a
                v1 += w * (cosine[k] * c - sine[k] * s)
                v2 -= w * w * a
            value[i, j], first[i, j], second[i, j] = v0, v1, v2


_NODES, _PIECE = 16, 2.0
"""Chebyshev nodes of a polynomial, and phase of the fastest oscillation along it, rad: its error is (φ/2)^n / (2^(n−1)
n!), 1.5e-18 of the amplitude (Abramowitz and Stegun 25.2.2 at the zeros of T_n)."""


@kernel
def _sum_chebyshev(t: Array, left: Array, length: Array, terms: Array, out: Array) -> None:
    """Evaluate the polynomials of pieces at increasing instants by Clenshaw's recurrence; terms (P, n, C)."""
    piece, columns = 0, terms.shape[2]
    last, before = np.empty(columns), np.empty(columns)
    for i in range(len(t)):
        while piece + 1 < len(left) and t[i] >= left[piece + 1]:
            piece += 1
        x = min(max(2.0 * (t[i] - left[piece]) / length[piece] - 1.0, -1.0), 1.0)
        last[:], before[:] = 0.0, 0.0
        for n in range(terms.shape[1] - 1, 0, -1):
            for j in range(columns):
                now = terms[piece, n, j] + 2.0 * x * last[j] - before[j]
                before[j], last[j] = last[j], now
        for j in range(columns):
            out[i, j] = terms[piece, 0, j] + x * last[j] - before[j]


def interpolated(of: Callable[[Array], Array], fastest: float, breaks: ArrayLike) -> Callable[[Array], Array]:
    """Return a function that gives the values of another one, to rounding, at many increasing instants from few.

    The other takes instants, (M,) s, returns (M, C), and is smooth between `breaks`, (K,) s, without significant
    content beyond `fastest`, rad/s.
    """
    angle = np.pi * (np.arange(_NODES) + 0.5) / _NODES
    to_terms = 2.0 / _NODES * np.cos(np.multiply.outer(np.arange(_NODES), angle))
    to_terms[0] *= 0.5

    def values(t: Array) -> Array:
        corners = np.concatenate([t[:1], np.unique(breaks_between(breaks, t[0], t[-1])), t[-1:]])
        left, length = panels(corners, fastest / _PIECE)
        nodes = left[:, None] + 0.5 * length[:, None] * (1.0 + np.cos(angle))
        at_nodes = of(nodes.ravel())
        terms = np.matmul(to_terms, at_nodes.reshape(len(left), _NODES, -1))
        out = np.empty((len(t), at_nodes.shape[1]))
        _sum_chebyshev(t, left, length, terms, out)
        return out

    return values


class Vibrating(DerivedMotion):
    """A motion with added vibration, lever arm and mounting; see the module's text.

    The angular rate of the vehicle, `base`, must be continuous. Tones of one coordinate, in the vehicle's axes, are
    added. The lever arm is from the vehicle's point to the block's mean place, in the vehicle's axes; v_b' = C_bs v_s.
    `part` gives the part of the vibration that acts at instants, (N,) s, with its two derivatives by time, (3, N); the
    second must be bounded. Without it, all of it acts at all times.
    """

    def __init__(
        self,
        base: Trajectory,
        tones: Sequence[Tone] = (),
        lever_arm: ArrayLike = (0.0, 0.0, 0.0),
        q_bs: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        part: Callable[[Array], Array] | None = None,
    ) -> None:
        self._part = part
        for number, tone in enumerate(tones, start=1):
            if tone.coordinate not in COORDINATE_NUMBER:
                raise unknown_name(f"coordinate of vibration tone {number}", tone.coordinate, COORDINATES)
            if not (np.isfinite([tone.amplitude, tone.phase]).all() and 0.0 <= tone.frequency_hz < np.inf):
                raise InputError(
                    f"vibration tone {number} on {tone.coordinate}: amplitude {tone.amplitude!r}, frequency "
                    f"{tone.frequency_hz!r} Hz and phase {tone.phase!r} must be finite, the frequency not negative."
                )
        super().__init__(base)
        tones = sorted(tones, key=lambda tone: COORDINATE_NUMBER[tone.coordinate])
        self._first_tone = np.searchsorted([COORDINATE_NUMBER[tone.coordinate] for tone in tones], np.arange(7))
        self._amplitude = np.array([tone.amplitude for tone in tones], dtype=np.float64)
        self._omega = 2.0 * np.pi * np.array([tone.frequency_hz for tone in tones], dtype=np.float64)
        self._phase = np.array([tone.phase for tone in tones], dtype=np.float64)
        self._lever = np.asarray(lever_arm, dtype=np.float64)
        self._q_bs = rotation.normalize(q_bs)
        self._spin = np.array([0.0, 0.0, base.ellipsoid.omega])
        smooth = bool(getattr(base, "smooth", False))
        self.smooth = smooth and not tones and part is None
        self._fastest_of_base = self.fastest if smooth else np.inf
        # Products of two vibrating quantities have twice the frequency.
        self.fastest = 2.0 * float(self._omega.max(initial=0.0)) + self.fastest

    def _vibration(self, t: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Return conj(q(φ)), i.e. D; w; p, ṗ, p̈."""
        value, first, second = (np.empty((len(t), 6)) for _ in range(3))
        sine, cosine = np.empty_like(self._omega), np.empty_like(self._omega)
        _sum_tones(
            t, self._first_tone, self._amplitude, self._omega, self._phase, sine, cosine, value, first, second
        )  # fmt: skip
        if self._part is not None:  # Leibniz
            p = self._part(t)[:, :, None]
            value, first, second = (
                p[0] * value, p[0] * first + p[1] * value, p[0] * second + 2.0 * p[1] * first + p[2] * value,
            )  # fmt: skip
        phi, rate = value[:, :3], first[:, :3]
        x = np.linalg.norm(phi, axis=1)[:, None]
        # (1 − cos x)/x² = ½ sinc²(x/2); (x − sin x)/x³ is summed as a series where the difference would cancel
        b = 0.5 * np.sinc(x / (2.0 * np.pi)) ** 2
        y = x * x
        series = 1 / 6 - y * (1 / 120 - y * (1 / 5040 - y * (1 / 362880 - y / 39916800)))
        c = np.where(x < 0.3, series, (1.0 - np.sinc(x / np.pi)) / np.maximum(y, 1e-30))
        across = np.cross(phi, rate)
        w = rate - b * across + c * np.cross(phi, across)
        q_b = rotation.conjugate(rotation.quaternion_from_rotation_vector(phi))
        return q_b, w, value[:, 3:] + self._lever, first[:, 3:], second[:, 3:]

    def _base_state(self, t: Array) -> tuple[Array, Array, Array]:
        """Return position and velocity of the vehicle, Earth-fixed, and q_eb."""
        s = self.base.state(t)
        q_en = earth.q_en(s.latitude, s.longitude)
        position = earth.geodetic_to_ecef(s.latitude, s.longitude, s.height, self.ellipsoid)
        return position, rotation.rotate(q_en, s.velocity_ned), rotation.multiply(q_en, s.q_nb)

    def state(self, t: ArrayLike) -> NavState:
        instants = check_instants(t, self.start, self.end)
        time, shape = np.atleast_1d(instants), instants.shape
        position, velocity, q_eb = self._base_state(time)
        q_vb, _, p, p1, _ = self._vibration(time)
        omega_eb = self.base.rates(time)[0] - rotation.rotate(rotation.conjugate(q_eb), self._spin)
        position = position + rotation.rotate(q_eb, p)
        velocity = velocity + rotation.rotate(q_eb, np.cross(omega_eb, p) + p1)
        q_es = rotation.multiply(rotation.multiply(q_eb, rotation.conjugate(q_vb)), self._q_bs)
        return block_state(
            position.reshape(*shape, 3), velocity.reshape(*shape, 3), q_es.reshape(*shape, 4), self.ellipsoid
        )

    def _gravitation_change(self, position: Array, q_eb: Array, p: Array) -> Array:
        """Return C_be (γ(r') − γ(r)), (N, 3) m/s²."""
        change = earth.gravitation_ecef(position + rotation.rotate(q_eb, p), self.gravity, self.ellipsoid)
        change -= earth.gravitation_ecef(position, self.gravity, self.ellipsoid)
        return rotation.rotate(rotation.conjugate(q_eb), change)

    def _angular_acceleration(self, t: Array) -> Array:
        """Return ω̇ of the vehicle from the polynomial through five neighbouring instants, (N, 3) rad/s²."""
        corners = np.array([self.start, *np.unique(breaks_between(self.breaks, self.start, self.end)), self.end])
        piece = np.clip(np.searchsorted(corners, t, side="right"), 1, len(corners) - 1)
        first, last = corners[piece - 1] + _REACH, corners[piece] - _REACH  # on one side of every break
        centre = np.where(first < last, np.clip(t, first, last), 0.5 * (first + last))
        centre = np.clip(centre, self.start + 2.0 * _STEP, self.end - 2.0 * _STEP)
        x = (t - centre) / _STEP
        slope = np.stack([np.zeros_like(x), np.ones_like(x), 2.0 * x, 3.0 * x**2, 4.0 * x**3], axis=1)
        weights = slope @ _FIVE_POINTS / _STEP
        around = [self.base.rates(centre + k * _STEP)[0] for k in range(-2, 3)]
        return np.asarray(np.einsum("nk,kni->ni", weights, np.stack(around)))

    def _rates(self, time: Array) -> tuple[Array, Array]:
        omega, force = self.base.rates(time)
        q_vb, w, p, p1, p2 = self._vibration(time)
        force = force + p2 + np.cross(omega, 2.0 * p1 + np.cross(omega, p))
        if p.any():
            position, _, q_eb = self._base_state(time)
            force -= self._gravitation_change(position, q_eb, p)
            force += np.cross(self._angular_acceleration(time), p)
        q_sb = rotation.conjugate(self._q_bs)
        return rotation.rotate(q_sb, rotation.rotate(q_vb, omega) + w), rotation.rotate(
            q_sb, rotation.rotate(q_vb, force)
        )

    def _vehicle(self, t: Array) -> Array:
        """Return ω, f, position and q_eb of the vehicle, side by side, (N, 13); the quaternion's sign is continuous."""
        position, _, q_eb = self._base_state(t)
        turned = np.cumprod(np.where(np.einsum("ni,ni->n", q_eb[1:], q_eb[:-1]) < 0.0, -1.0, 1.0))
        q_eb[1:] *= turned[:, None]
        return np.concatenate([*self.base.rates(t), position, q_eb], axis=1)

    def _change(self, t: Array, vehicle: Callable[[Array], Array]) -> Array:
        """Return the contribution of the vibration to the integrands, side by side, (N, 6)."""
        omega, force, position, q_eb = np.split(vehicle(t), (3, 6, 9), axis=1)
        q_vb, w, p, p1, p2 = self._vibration(t)
        arm = np.cross(omega, p)
        extra = p2 + np.cross(omega, p1 + arm)
        if p.any():
            extra -= self._gravitation_change(position, q_eb, p)
        extra = rotation.rotate(q_vb, extra) + np.cross(w, rotation.rotate(q_vb, arm))
        # (D − I) v without the cancellation in Dv − v: −2 s₀ u × v + 2 u × (u × v) for D = conj(s₀, u)
        u, s0 = -q_vb[:, 1:], q_vb[:, :1]
        turned = [2.0 * np.cross(u, np.cross(u, v) - s0 * v) for v in (omega, force)]
        return np.concatenate([turned[0] + w, turned[1] + extra], axis=1)

    def increments(self, rate_hz: float) -> ImuData:
        """Return exact increments by Gauss-Legendre quadrature; see `Trajectory.increments`."""
        edges = sample_edges(self.start, self.end, rate_hz)
        base = self.base.increments(rate_hz)
        slow = self._fastest_of_base  # beyond the rate, the nodes of the polynomials are not fewer
        vehicle = interpolated(self._vehicle, slow, self.breaks) if slow < rate_hz else self._vehicle
        change = integrate_samples(lambda t: self._change(t, vehicle), edges, self.fastest, self.breaks)
        q_vb, _, p, _, _ = self._vibration(edges)
        arm = rotation.rotate(q_vb, np.cross(self.base.rates(edges)[0], p))
        q_sb = rotation.conjugate(self._q_bs)
        return ImuData(
            edges,
            rotation.rotate(q_sb, base.dtheta + change[:, :3]),
            rotation.rotate(q_sb, base.dvel + change[:, 3:] + np.diff(arm, axis=0)),
        )


def velocity_increments(trajectory: Trajectory, position: ArrayLike, rate_hz: float) -> tuple[Array, Array]:
    """Return the edges of the intervals, (N+1,) s, and the integrals of the specific force, (N, K, 3) m/s, at points on
    lever arms from the vehicle's reference point, (K, 3) m, all in the trajectory's axes."""
    places = np.asarray(position, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or not len(places) or not np.isfinite(places).all():
        raise InputError(f"accelerometers need (K, 3) finite positions, K ≥ 1; got an array of shape {places.shape}.")
    each = [Vibrating(trajectory, lever_arm=place).increments(rate_hz) for place in places]
    return each[0].time, np.stack([imu.dvel for imu in each], axis=1)
