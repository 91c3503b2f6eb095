"""From the samples of a track to the knots of its curve: smoothing spline, gaps, attitude, lever arm.

The smoothing spline s through noisy samples minimises

    Σ Δtᵢ wᵢ |rᵢ − s(tᵢ)|² + τ⁶ ∫ |s‴|² dt

over quintic (C⁴) splines; Δtᵢ is the time that sample i stands for. Far from the ends it is a filter without delay,
whose gain at the angular frequency ω is 1/(1 + (ωτ)⁶): motion slower than a period of 2πτ is kept, quicker motion is
removed. The same curve is the mean of a Kalman smoother for white jerk. Unlike a cubic smoothing spline
(`scipy.interpolate.make_smoothing_spline`), whose acceleration has corners, it has a smooth specific force.

τ is given, or follows from a given rms distance from the samples (C. H. Reinsch, Numer. Math. 10, 1967), or from the
samples by generalised cross-validation (G. Wahba, Spline Models for Observational Data, 1990, eq. 4.3.1).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.ellipsoids import Ellipsoid, normal
from sinssim.earth.geodetic_coordinates import ecef_to_geodetic, q_en
from sinssim.errors import InputError
from sinssim.truth.track_samples import TrackSamples
from sinssim.truth.vehicle_attitude import VEHICLES, Pitch, Vehicle, VehicleName, attitude_from_motion

_DEGREE = 5
_KNOTS = 4.0
"""Knots of the spline within τ; more would only make the equations ill-conditioned."""
_LEAST, _MOST, _STEP = 0.25, 128.0, 2.0**0.5
"""Values of τ that are tried, in median intervals of the samples. Below the least, the spline interpolates."""
_PROBES = 8
"""Random vectors of the trace of the influence matrix: its relative error is below √(2/(8 n))."""
_AS_GOOD = 1.05
"""Factor of the best score up to which the least τ is as good, and the samples are interpolated."""
_FEWEST_SAMPLES = 30
"""Samples below which there are too few to tell noise from motion, and the spline interpolates."""
_ROWS = 20_000
"""Samples in the middle of a track from which τ is chosen."""

Misfit = Callable[[Array, slice], Array]
"""Returns of vectors from curve to samples, (n, m), the components that count, (n, k); the slice says which samples."""


class SmoothingSpline:
    """The least-squares problem of increasing sample times, (n,) s, one τ > 0, s, and weights wᵢ, (n,)."""

    def __init__(self, time: Array, tau: float, weight: Array) -> None:
        from scipy.interpolate import BSpline
        from scipy.linalg import cholesky_banded

        inner = _thinned(time, tau / _KNOTS)
        self.knots = np.concatenate([[time[0]] * _DEGREE, inner, [time[-1]] * _DEGREE])
        self._design = BSpline.design_matrix(time, self.knots, _DEGREE)
        self._weight = weight * _durations(time)
        normal = self._design.T @ self._design.multiply(self._weight[:, None])
        third, gauss = _third_derivatives(self.knots, inner)
        normal = normal + tau**6 * (third.T @ third.multiply(gauss[:, None]))
        lower = np.zeros((_DEGREE + 1, normal.shape[0]))
        for k in range(_DEGREE + 1):
            diagonal = normal.diagonal(-k)
            lower[k, : len(diagonal)] = diagonal
        self._factor = cholesky_banded(lower, lower=True)

    def coefficients(self, values: Array) -> Array:
        """Return the coefficients of the spline for samples (n, m), (K, m)."""
        from scipy.linalg import cho_solve_banded

        right: Any = self._design.T @ (self._weight[:, None] * values)
        return np.asarray(cho_solve_banded((self._factor, True), right))

    def fitted(self, values: Array) -> Array:
        """Return the spline at the samples, (n, m)."""
        return np.asarray(self._design @ self.coefficients(values))

    def spline(self, values: Array) -> Any:
        """Return the spline, a `scipy.interpolate.BSpline`."""
        from scipy.interpolate import BSpline

        return BSpline(self.knots, self.coefficients(values), _DEGREE)


def interpolating_spline(time: Array, values: Array) -> Any:
    """Return the `scipy.interpolate.BSpline` through samples (n, m) at increasing times, n ≥ 2: quintic, of lower
    degree through less than six."""
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(time, values, k=min(_DEGREE, len(time) - 1))


def smooth_spline(time: Array, values: Array, tau: float, weight: Array) -> Any:
    """Return the spline of a given τ; the interpolating one for τ = 0."""
    if tau == 0.0:
        return interpolating_spline(time, values)
    return SmoothingSpline(time, tau, weight).spline(values)


def tau_by_cross_validation(time: Array, values: Array, weight: Array, misfit: Misfit | None = None) -> float:
    """Return τ by generalised cross-validation of the components that count, s; 0 if the samples are best
    interpolated."""
    first = max(0, (len(time) - _ROWS) // 2)
    rows = slice(first, first + _ROWS)
    t, y, w = time[rows], values[rows], weight[rows]
    tried = _tried(t)
    if len(t) < _FEWEST_SAMPLES or not len(tried):
        return 0.0
    probes = np.random.default_rng(1).choice((-1.0, 1.0), (len(t), _PROBES))
    scores = []
    for tau in tried:
        problem = SmoothingSpline(t, tau, w)
        both = problem.fitted(np.concatenate([y, probes], axis=1))
        left = float(np.mean(probes * (probes - both[:, y.shape[1] :])))  # 1 − trace/n
        scores.append(_mean_square(y - both[:, : y.shape[1]], w, misfit, rows) / left**2)
    best = int(np.argmin(scores))
    return 0.0 if scores[0] <= _AS_GOOD * scores[best] else float(tried[best])


def tau_by_distance(time: Array, values: Array, weight: Array, rms: float, misfit: Misfit | None = None) -> float:
    """Return the τ whose curve passes the samples at a given rms distance, in their unit, s; 0 if even the least does
    not reach it, the largest that is tried if no curve is as far as that from the samples."""

    def distance(tau: float) -> float:
        fitted = SmoothingSpline(time, tau, weight).fitted(values)
        return math.sqrt(_mean_square(values - fitted, weight, misfit, slice(None)))

    tried = _tried(time)
    if rms <= 0.0 or len(time) < _FEWEST_SAMPLES or not len(tried) or distance(tried[0]) > rms:
        return 0.0
    low: float = float(tried[0])
    high: float = float(tried[-1])
    if distance(high) < rms:
        return high
    while high / low > 1.001:
        middle = (low * high) ** 0.5
        low, high = (low, middle) if distance(middle) > rms else (middle, high)
    return low


def _mean_square(rest: Array, weight: Array, misfit: Misfit | None, rows: slice) -> float:
    counted = rest if misfit is None else misfit(rest, rows)
    return float(np.sum(weight * np.sum(counted**2, axis=1)) / np.sum(weight))


def _tried(time: Array) -> Array:
    interval = float(np.median(np.diff(time)))
    most = min(_MOST * interval, float(time[-1] - time[0]) / 6.0)
    count = int(np.floor(np.log(max(most / (_LEAST * interval), 1e-9)) / np.log(_STEP))) + 1
    return np.asarray(_LEAST * interval * _STEP ** np.arange(max(count, 0)))


def _durations(time: Array) -> Array:
    """Return the time that each sample stands for, at most three median intervals, (n,) s."""
    step = np.minimum(np.diff(time), 3.0 * np.median(np.diff(time)))
    return np.asarray(0.5 * (np.append(step, step[-1]) + np.insert(step, 0, step[0])))


def _thinned(time: Array, spacing: float) -> Array:
    """Return the times of which none follows the one before by less than a spacing; both ends stay."""
    if float(np.min(np.diff(time))) >= spacing:
        return time
    cells = np.floor((time - time[0]) / spacing)
    instants = time[np.concatenate([[True], np.diff(cells) > 0])]
    far = np.concatenate([[True], np.diff(instants) >= 0.5 * spacing])
    instants = instants[far]
    return np.append(instants[instants < time[-1] - 0.5 * spacing], time[-1])


def _third_derivatives(knots: Array, inner: Array) -> tuple[Any, Array]:
    """Return third derivatives of the basis at Gauss points between the knots, and the points' weights."""
    from scipy.interpolate import BSpline
    from scipy.sparse import csr_array, diags_array, eye_array

    nodes, weights = np.polynomial.legendre.leggauss(3)  # exact for the square of a quadratic
    half = 0.5 * np.diff(inner)
    points = (inner[:-1, None] + half[:, None] * (1.0 + nodes)).ravel()
    # derivatives of B-splines: differences of coefficients, one degree less each time
    size, t = len(knots) - _DEGREE - 1, knots
    matrix: Any = eye_array(size)
    for k in range(_DEGREE, _DEGREE - 3, -1):
        scale = k / (t[k + 1 : -1] - t[1 : -k - 1])
        n = size - 1
        matrix = diags_array(np.stack([-scale, scale]), offsets=[0, 1], shape=(n, size)) @ matrix
        size, t = n, t[1:-1]
    basis = BSpline.design_matrix(points, t, _DEGREE - 3)
    return csr_array(basis @ matrix), (half[:, None] * weights).ravel()


_GAP, _GAP_INTERVALS = 10.0, 5.0
"""A gap is longer than 10 s and than five median intervals."""
_BRIDGE = 20_000
"""Largest number of samples in the bridge of a gap."""
_FEWEST = 6
"""Fewest knots of a curve."""
_MOST_KNOTS = 5_000_000
_TURN = float(np.cos(np.pi / 8.0))
"""Cosine of half the largest turn between two knots, 45°."""


@dataclass(frozen=True)
class TrackOptions:
    """How a track becomes a curve."""

    vehicle: VehicleName = "land"  # "aircraft", "land" or "sea"
    chosen: str = "as given"  # where `smoothing` is from, in words
    smoothing: float | None = None  # τ of the position, s; 0 passes through the samples; None: see `sigma`
    height_smoothing: float | None = None  # the same for the height, s; None: as `smoothing`
    attitude_smoothing: float | None = None  # the same for a recorded attitude, s; None: by cross-validation
    # rms distance from the samples, horizontal, m, that determines τ; None: τ by cross-validation
    sigma: float | None = None
    height_sigma: float | None = None  # the same for the height, m; None: as `sigma`
    # interval between samples that counts as a gap, s; None: ten seconds and five median intervals
    gap: float | None = None
    pitch: Pitch | None = None  # "slope" or "flat"; None: that of the vehicle
    standstill: float | None = None  # speed of standstill, m/s; None: that of the vehicle
    heading: float = 0.0  # heading of a vehicle that never moves, rad
    # from the vehicle's reference point to the recorded point, body axes, (3,) m
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def kind(self) -> Vehicle:
        """What is assumed of the vehicle."""
        return VEHICLES[self.vehicle]


@dataclass(frozen=True)
class Knots:
    """The knots of a track's curve."""

    time: Array  # (K,) s
    position: Array  # of the vehicle's reference point, Earth-fixed, (K, 3) m
    q_eb: Array  # attitude, (K, 4)
    # of the recorded point relative to the Earth, in its axes, (K, 3)
    velocity: Array
    acceleration: Array
    held: Array  # whether the heading is that of a standstill, (K,)
    # smoothing of the horizontal position, the height and the attitude, s; the last is NaN if it was not recorded
    tau: tuple[float, float, float]
    notes: tuple[str, ...] = ()  # sentences on gaps


def knots_of_samples(samples: TrackSamples, options: TrackOptions, gravity: str, ellipsoid: Ellipsoid) -> Knots:
    """Return the knots of the curve of a track; time 0 is the first sample. The model of gravity gives the roll of a
    coordinated turn."""
    time = samples.time - samples.time[0]
    wide = _gaps(time, options.gap)
    gaps = _about_gaps(samples, time, wide)
    if samples.q_nb is None and len(wide):
        samples, time = _bridged(samples, time, wide)
    position = samples.ecef(ellipsoid)
    origin = position[0]
    up = normal(samples.latitude, samples.longitude)
    weights = _weights(samples)
    horizontal, tau_h = _fitted(
        time,
        position - origin,
        weights[:, 0],
        options.smoothing,
        options.sigma,
        lambda rest, rows: rest - _along(rest, up[rows]),
    )
    upright, tau_v = horizontal, tau_h
    wanted = options.height_smoothing if options.height_smoothing is not None else options.smoothing
    sigma = options.height_sigma if options.height_sigma is not None else options.sigma
    if (wanted, sigma) != (options.smoothing, options.sigma) or wanted is None:
        upright, tau_v = _fitted(
            time, position - origin, weights[:, 1], wanted, sigma, lambda rest, rows: _along(rest, up[rows])
        )
    attitude, tau_a = _attitude_spline(samples, time, options)
    at = _knot_times(time, options.kind, (tau_h, tau_v, tau_a), derived=attitude is None)
    r = np.asarray(horizontal(at))
    if upright is not horizontal:
        there = normal(*ecef_to_geodetic(r + origin, ellipsoid)[:2])
        r = r + _along(upright(at) - r, there)
    return _with_attitude(at, r, origin, attitude, options, gravity, ellipsoid, (tau_h, tau_v, tau_a), gaps)


def knots_of_path(time: Array, position: Array, options: TrackOptions, gravity: str, ellipsoid: Ellipsoid) -> Knots:
    """Return the knots of a path that is known exactly, Earth-fixed, with the attitude that follows from its motion."""
    origin = position[0]
    return _with_attitude(time, position - origin, origin, None, options, gravity, ellipsoid, (0.0, 0.0, np.nan), ())


def _with_attitude(
    at: Array,
    relative: Array,
    origin: Array,
    attitude: Any,
    options: TrackOptions,
    gravity: str,
    ellipsoid: Ellipsoid,
    tau: tuple[float, float, float],
    notes: tuple[str, ...],
) -> Knots:
    path = interpolating_spline(at, relative)
    velocity, acceleration = path(at, 1), path(at, 2)
    standing = np.zeros(len(at), bool)
    if attitude is not None:
        q = np.asarray(attitude(at))
        q = q / np.linalg.norm(q, axis=1)[:, None]
    else:
        there = normal(*ecef_to_geodetic(relative + origin, ellipsoid)[:2])
        q, standing = attitude_from_motion(
            at,
            relative + origin,
            velocity,
            acceleration,
            there,
            options.kind,
            gravity,
            ellipsoid,
            pitch=options.pitch,
            standstill=options.standstill,
            heading=options.heading,
            noisy=tau[0] > 0.0,
        )
        cosine = np.abs(np.einsum("ij,ij->i", q[1:], q[:-1]))
        if cosine.min() < _TURN:
            worst = int(np.argmin(cosine))
            raise InputError(
                f"at {at[worst]:.6g} s the course of the track turns by "
                f"{2.0 * np.degrees(np.arccos(cosine[worst])):.0f}° within {at[worst + 1] - at[worst]:.3g} s, at a "
                f"speed of {np.linalg.norm(velocity[worst]):.3g} m/s: smooth more with track.smoothing_s, or raise "
                "track.standstill_mps, below which the heading is held."
            )
    position = relative + origin - rotation.rotate(q, np.broadcast_to(options.point, relative.shape))
    return Knots(at, position, q, velocity, acceleration, standing, tau, notes)


def _along(vectors: Array, up: Array) -> Array:
    """Return the vertical part of vectors, (N, 3)."""
    return np.asarray(np.einsum("ij,ij->i", vectors, up)[:, None] * up)


def _weights(samples: TrackSamples) -> Array:
    """Return the relative weights of horizontal positions and heights, (N, 2): (median σ/σ)², at most 10⁴."""
    if samples.sigma is None:
        return np.ones((len(samples), 2))
    sigma = np.where(np.isfinite(samples.sigma) & (samples.sigma > 0.0), samples.sigma, np.nan)
    typical = np.nanmedian(sigma, axis=0) if np.isfinite(sigma).any(axis=0).all() else np.ones(2)
    return np.asarray(np.clip((typical / np.where(np.isfinite(sigma), sigma, typical)) ** 2, 1e-4, 1e4))


def _fitted(
    time: Array,
    values: Array,
    weight: Array,
    tau: float | None,
    sigma: float | None,
    misfit: Misfit | None,
) -> tuple[Any, float]:
    """Return the spline through samples, and its τ."""
    if tau is None:
        if sigma is not None:
            tau = tau_by_distance(time, values, weight, sigma, misfit)
        else:
            tau = tau_by_cross_validation(time, values, weight, misfit)
    return smooth_spline(time, values, tau, weight), tau


def _attitude_spline(samples: TrackSamples, time: Array, options: TrackOptions) -> tuple[Any, float]:
    """Return the spline of the recorded quaternions e from b, and its τ; (None, NaN) without."""
    if samples.q_nb is None:
        return None, float("nan")
    q = rotation.normalize(rotation.multiply(q_en(samples.latitude, samples.longitude), samples.q_nb))
    cosine = np.einsum("ij,ij->i", q[1:], q[:-1])
    if np.abs(cosine).min() < _TURN:
        worst = int(np.argmin(np.abs(cosine)))
        raise InputError(
            f"{samples.at(worst + 1)}: the attitude turns by "
            f"{2.0 * np.degrees(np.arccos(abs(cosine[worst]))):.0f}° since {samples.noun} {samples.rows[worst]}; it "
            "must turn by less than 45° between two samples."
        )
    q[1:] *= np.cumprod(np.where(cosine < 0.0, -1.0, 1.0))[:, None]
    return _fitted(time, q, np.ones(len(time)), options.attitude_smoothing, None, None)


def _gaps(time: Array, gap: float | None) -> NDArray[np.int64]:
    """Return the samples after which there is a gap."""
    step = np.diff(time)
    limit = max(_GAP, _GAP_INTERVALS * float(np.median(step))) if gap is None else gap
    return np.flatnonzero(step > limit)


def _about_gaps(samples: TrackSamples, time: Array, wide: NDArray[np.int64]) -> tuple[str, ...]:
    """Return a sentence about the gaps of a track."""
    if not len(wide):
        return ()
    step = np.diff(time)
    longest = int(wide[np.argmax(step[wide])])
    many = "a gap" if len(wide) == 1 else f"{len(wide)} gaps, the longest"
    how = "bridged on a great circle at uniform speed" if samples.q_nb is None else "the curve continues smoothly"
    return (
        f"The track has {many} of {step[longest]:.4g} s after {samples.noun} {samples.rows[longest]}, at "
        f"{time[longest]:.6g} s: {how}.",
    )


def _bridged(samples: TrackSamples, time: Array, wide: NDArray[np.int64]) -> tuple[TrackSamples, Array]:
    """Return the samples with gaps filled evenly along the great circle, at uniform speed."""
    step = np.diff(time)
    usual = float(np.median(step))
    up = normal(samples.latitude, samples.longitude)
    times, normals, heights, sigmas, begin = [], [], [], [], 0
    for row in map(int, wide):
        count = int(min(np.ceil(step[row] / usual) - 1, _BRIDGE))
        share = np.arange(1, count + 1)[:, None] / (count + 1)
        times += [time[begin : row + 1], time[row] + share[:, 0] * step[row]]
        normals += [up[begin : row + 1], (1.0 - share) * up[row] + share * up[row + 1]]
        ends = samples.height[row : row + 2]
        heights += [samples.height[begin : row + 1], ends[0] + share[:, 0] * (ends[1] - ends[0])]
        if samples.sigma is not None:
            sigmas += [samples.sigma[begin : row + 1], np.tile(samples.sigma[row], (count, 1))]
        begin = row + 1
    along = np.concatenate([*normals, up[begin:]])
    filled = replace(
        samples,
        time=np.concatenate([*times, time[begin:]]) + samples.time[0],
        latitude=np.arctan2(along[:, 2], np.hypot(along[:, 0], along[:, 1])),
        longitude=np.arctan2(along[:, 1], along[:, 0]),
        height=np.concatenate([*heights, samples.height[begin:]]),
        sigma=None if samples.sigma is None else np.concatenate([*sigmas, samples.sigma[begin:]]),
        rows=np.empty(0, np.int64),
    )
    return filled, filled.time - samples.time[0]


def _knot_times(time: Array, vehicle: Vehicle, tau: tuple[float, float, float], *, derived: bool) -> Array:
    """Return the knots: all samples if the curve passes through them, else evenly spaced."""
    step, usual = np.diff(time), float(np.median(np.diff(time)))
    smoothed = [t for t in tau if np.isfinite(t)]
    through = min(smoothed) == 0.0
    spacing = min(usual, vehicle.knots) if derived else usual
    if not through:
        spacing = min(spacing, vehicle.knots) if derived else max(spacing, min(smoothed) / 4.0)
    spacing = min(spacing, float(time[-1]) / (_FEWEST - 1))
    if time[-1] / spacing > _MOST_KNOTS:
        raise InputError(
            f"the track lasts {time[-1]:.4g} s and needs a knot every {spacing:.3g} s, more than {_MOST_KNOTS:g} in "
            "all; cut it with track.start_s and track.end_s."
        )
    if not through:
        return np.linspace(0.0, time[-1], max(_FEWEST, int(np.ceil(time[-1] / spacing - 1e-9)) + 1))
    if not derived and len(time) >= _FEWEST:
        return time
    pieces = np.maximum(1, np.ceil(step / spacing - 1e-9)).astype(int)
    return np.append(
        np.concatenate([a + d / n * np.arange(n) for a, d, n in zip(time[:-1], step, pieces, strict=True)]), time[-1]
    )
