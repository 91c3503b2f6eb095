"""The true motion along a track.

A smooth curve through its knots, its distance from the samples, its largest values.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, get_args

import numpy as np
from numpy.typing import ArrayLike

from sinssim import rotation
from sinssim.arguments import number, numbers, vector
from sinssim.data import Array
from sinssim.earth.ellipsoids import WGS84, Ellipsoid, normal
from sinssim.earth.geodetic_coordinates import ecef_to_geodetic, geodetic_to_ecef
from sinssim.errors import InputError, check_name
from sinssim.truth.curve import Curve
from sinssim.truth.sampling import Channel, FlightEvent
from sinssim.truth.track_samples import TrackSamples, checked_samples
from sinssim.truth.track_smoothing import Knots, TrackOptions, knots_of_samples
from sinssim.truth.vehicle_attitude import Pitch, VehicleName
from sinssim.units import DEG, G0

if TYPE_CHECKING:
    from sinssim.truth.vehicle_attitude import Vehicle


HORIZONTAL, VERTICAL, ANGLE = "horizontal_from_samples_m", "height_above_samples_m", "angle_from_samples_rad"
"""Names of the channels of the distances from the samples."""
_NOTHING = 1e-6
"""Distance that is not worth a number, m."""
_SWINGS, _NOISE = 1.5, 1.0
"""Factor and m/s by which the curve may be faster than any two neighbouring samples."""
_WIDE = 10.0
"""Rms distance from the samples that is doubtful if nobody asked for it, m."""
_FAR = 100.0
"""Distance after which a vehicle that never moves is doubtful, m."""


@dataclass(frozen=True)
class Distance:
    """How far a curve passes from samples."""

    rms: float  # root mean square
    largest: float  # largest absolute value
    at: float  # instant of the largest, s

    @classmethod
    def of(cls, time: Array, values: Array) -> Distance:
        """Return that of values over time, (N,)."""
        row = int(np.argmax(np.abs(values)))
        return cls(float(np.sqrt(np.mean(values**2))), float(abs(values[row])), float(time[row]))


@dataclass(frozen=True)
class TrackFit:
    """A track's curve in numbers."""

    source: str  # file or origin of the samples
    samples: int  # number of samples, or of waypoints of a planned route
    noun: str  # what one of them is called
    interval: float  # median interval of the samples, s; 0 for a planned route
    duration: float
    distance: float  # distance over ground, m
    # distance from the samples, m; None for a planned route
    horizontal: Distance | None
    vertical: Distance | None
    attitude: Distance | None  # angle from the recorded attitudes, rad; None without them
    tau: tuple[float, float, float]  # smoothing of horizontal position, height and attitude, s
    # largest speed relative to the Earth, m/s, acceleration, m/s², angular rate, rad/s
    speed: Distance
    acceleration: Distance
    turn: Distance
    pitch: Distance  # largest pitch, rad
    turning: float  # ∫ω² dt of the rotation relative to the Earth, rad²/s
    standing: float  # part of the time with a held heading
    attitude_words: str  # where the attitude is from
    smoothing_words: str  # how the curve was smoothed
    notes: tuple[str, ...] = ()  # sentences on the samples
    warnings: tuple[str, ...] = ()  # sentences on doubtful numbers


def assess(
    curve: Curve, knots: Knots, samples: TrackSamples, options: TrackOptions, ellipsoid: Ellipsoid, *, planned: bool
) -> tuple[TrackFit, dict[str, Channel]]:
    """Return the numbers of a curve, and its distances from the samples as channels of a trajectory. The samples of a
    planned route are its waypoints; it has no distances."""
    speed = np.linalg.norm(knots.velocity, axis=1)
    rate = np.linalg.norm(_turn_rates(curve, knots, ellipsoid), axis=1)
    fastest = Distance.of(knots.time, speed)
    hardest = Distance.of(knots.time, np.linalg.norm(knots.acceleration, axis=1))
    quickest = Distance.of(knots.time, rate)
    forward = rotation.rotate(knots.q_eb, np.broadcast_to((1.0, 0.0, 0.0), knots.position.shape))
    up = normal(*ecef_to_geodetic(knots.position, ellipsoid)[:2])
    steepest = Distance.of(knots.time, np.arcsin(np.clip(np.einsum("ij,ij->i", forward, up), -1.0, 1.0)))
    warnings = [*_implausible(samples, options.kind, hardest, quickest, steepest, planned=planned)]
    if not planned:
        warnings += _about_speed(knots, samples, fastest, ellipsoid, options.kind)
    channels = {} if planned else _distances(curve, samples, ellipsoid)
    horizontal, vertical, attitude = (
        None if name not in channels else Distance.of(channels[name].time, channels[name].values)
        for name in (HORIZONTAL, VERTICAL, ANGLE)
    )
    if horizontal is not None and options.smoothing is None and options.sigma is None and horizontal.rms > _WIDE:
        warnings.append(
            f"The rms distance of the curve from the samples is {metres(horizontal.rms)}, which cross-validation takes "
            "for noise. Give track.smoothing_s = 0.0 if the samples are more accurate."
        )
    fit = TrackFit(
        samples.source,
        len(samples),
        samples.noun,
        0.0 if planned else float(np.median(np.diff(samples.time))),
        float(knots.time[-1]),
        float(np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(knots.time))),
        horizontal,
        vertical,
        attitude,
        knots.tau,
        fastest,
        hardest,
        quickest,
        steepest,
        float(np.sum(0.5 * (rate[1:] ** 2 + rate[:-1] ** 2) * np.diff(knots.time))),
        float(np.mean(knots.held)),
        _attitude_words(samples, options),
        "planned: the curve is the plan" if planned else _smoothing_words(knots.tau, options),
        (*samples.notes, *knots.notes),
        tuple(warnings),
    )
    return fit, channels


def _implausible(
    samples: TrackSamples, kind: Vehicle, hardest: Distance, quickest: Distance, steepest: Distance, *, planned: bool
) -> Iterator[str]:
    """Yield warnings about an acceleration, m/s², a turn rate, rad/s, and a pitch, rad, that the vehicle hardly has."""
    more = "" if planned else "; smooth more with track.smoothing_s or track.position_sigma_m if the samples are noisy"
    if hardest.largest > kind.odd_acceleration:
        yield (
            f"The largest acceleration, {hardest.largest / G0:.3g} g at {hardest.at:.6g} s, is implausible for "
            f'vehicle = "{kind.name}"{more}.'
        )
    if quickest.largest > kind.odd_turn:
        yield (
            f"The largest turn rate, {quickest.largest / DEG:.3g} °/s at {quickest.at:.6g} s, is implausible for "
            f'vehicle = "{kind.name}"{more}.'
        )
    if samples.q_nb is None and steepest.largest > kind.odd_pitch:
        yield (
            f"The largest assumed pitch, {steepest.largest / DEG:.3g}° at {steepest.at:.6g} s, is implausible for "
            f'vehicle = "{kind.name}"'
            + ("." if planned else ': smooth the heights with track.height_smoothing_s, or give track.pitch = "flat".')
        )


def _about_speed(
    knots: Knots, samples: TrackSamples, fastest: Distance, ellipsoid: Ellipsoid, kind: Vehicle
) -> Iterator[str]:
    """Yield warnings about the speed: of a curve that swings between sparse samples, of a vehicle that never moves."""
    steps = np.linalg.norm(np.diff(samples.ecef(ellipsoid), axis=0), axis=1)
    between = float((steps / np.diff(samples.time)).max())
    if fastest.largest > _SWINGS * between + _NOISE:
        yield (
            f"The curve is faster, {fastest.largest:.4g} m/s at {fastest.at:.6g} s, than any two neighbouring samples, "
            f"{between:.4g} m/s: the samples are too far apart for their turns. Give samples at a higher rate, or "
            "smooth them with track.smoothing_s."
        )
    if samples.q_nb is None and knots.held.all() and float(steps.sum()) > _FAR:
        yield (
            f"The vehicle covers {steps.sum():.4g} m but is never faster than {fastest.largest:.3g} m/s, so that its "
            f"heading is track.heading_deg all the time. Check the unit of the times, or lower "
            f"track.standstill_mps ({kind.standstill:g} by default)."
        )


def _turn_rates(curve: Curve, knots: Knots, ellipsoid: Ellipsoid) -> Array:
    """Return angular rates relative to the Earth, (K, 3) rad/s."""
    omega, _ = curve.rates(knots.time)
    earth = rotation.rotate(rotation.conjugate(knots.q_eb), np.broadcast_to((0.0, 0.0, ellipsoid.omega), omega.shape))
    return np.asarray(omega - earth)


def _distances(curve: Curve, samples: TrackSamples, ellipsoid: Ellipsoid) -> dict[str, Channel]:
    """Return the distances of the curve from the samples by name."""
    time = np.minimum(samples.time - samples.time[0], curve.end)
    state = curve.state(time)
    there = geodetic_to_ecef(state.latitude, state.longitude, state.height, ellipsoid)
    apart = there - samples.ecef(ellipsoid)
    latitude, longitude, _ = ecef_to_geodetic(there, ellipsoid)
    up = normal(latitude, longitude)
    vertical = np.einsum("ij,ij->i", apart, up)
    horizontal = np.linalg.norm(apart - vertical[:, None] * up, axis=1)
    channels = {HORIZONTAL: Channel(time, horizontal, "m"), VERTICAL: Channel(time, vertical, "m")}
    if samples.q_nb is not None:
        turned = rotation.multiply(rotation.conjugate(rotation.normalize(samples.q_nb)), state.q_nb)
        angle = 2.0 * np.arctan2(np.linalg.norm(turned[:, 1:], axis=1), np.abs(turned[:, 0]))
        channels[ANGLE] = Channel(time, angle, "rad")
    return channels


def _attitude_words(samples: TrackSamples, options: TrackOptions) -> str:
    if samples.q_nb is not None:
        return "as recorded"
    kind = options.kind
    pitch = "pitch from climb" if (options.pitch or kind.pitch) == "slope" else "no pitch"
    roll = "roll of a coordinated turn" if kind.banks else "no roll"
    limit = kind.standstill if options.standstill is None else options.standstill
    standstill = f"heading held from below {0.5 * limit:g} m/s until {limit:g} m/s"
    return f"assumed: heading along the track, {pitch}, {roll}; {standstill}"


def _smoothing_words(tau: tuple[float, float, float], options: TrackOptions) -> str:
    parts = []
    for name, value, given, chosen, sigma in zip(
        ("position", "height", "attitude"),
        tau,
        (
            options.smoothing,
            options.smoothing if options.height_smoothing is None else options.height_smoothing,
            options.attitude_smoothing,
        ),
        (options.chosen, options.chosen if options.height_smoothing is None else "as given", "as given"),
        (options.sigma, options.sigma if options.height_sigma is None else options.height_sigma, None),
        strict=True,
    ):
        if not np.isfinite(value):
            continue
        how = chosen if given is not None else "from σ" if sigma is not None else "by cross-validation"
        parts.append(f"{name} {'through the samples' if value == 0.0 else f'τ = {value:.3g} s'}, {how}")
    return "; ".join(parts)


def fit_lines(fit: TrackFit) -> Iterator[tuple[str, str]]:
    """Yield the facts of a track as name and words."""
    if fit.interval:
        many = fit.noun if fit.samples == 1 else {"fix": "fixes"}.get(fit.noun, f"{fit.noun}s")
        yield "samples", f"{fit.samples} {many}, median interval {fit.interval:.4g} s"
    yield "length", f"{fit.distance / 1e3:.3f} km in {fit.duration:.6g} s"
    if fit.interval:
        yield "smoothing", fit.smoothing_words
    if fit.horizontal is not None and fit.vertical is not None:
        yield (
            "distance from the samples",
            f"horizontal {_apart(fit.horizontal)}; vertical {_apart(fit.vertical)}",
        )
    if fit.attitude is not None:
        yield (
            "angle from the samples",
            f"rms {fit.attitude.rms / DEG:.2g}°, largest {fit.attitude.largest / DEG:.2g}° at {fit.attitude.at:.6g} s",
        )
    level = fit.pitch.largest < 1e-6 * DEG
    pitch = "" if level else f", pitch {fit.pitch.largest / DEG:.3g}° at {fit.pitch.at:.6g} s"
    yield (
        "largest",
        f"speed {fit.speed.largest:.4g} m/s at {fit.speed.at:.6g} s, acceleration "
        f"{fit.acceleration.largest / G0:.3g} g at {fit.acceleration.at:.6g} s, turn rate "
        f"{fit.turn.largest / DEG:.3g} °/s at {fit.turn.at:.6g} s{pitch}",
    )
    standstill = f", {fit.standing:.0%} of the time" if fit.standing else ""
    yield "attitude", f"{fit.attitude_words}{standstill}"


def _apart(distance: Distance) -> str:
    if distance.largest < _NOTHING:
        return "below 1 µm"
    return f"rms {metres(distance.rms)}, largest {metres(distance.largest)} at {distance.at:.6g} s"


def fit_sentences(fit: TrackFit) -> Iterator[str]:
    """Yield the facts of a track as sentences below the results of a run; doubtful ones last."""
    facts = dict(fit_lines(fit))
    if fit.horizontal is not None:
        apart = facts["distance from the samples"]
        yield f"Track: {facts['samples']}. Distance of the curve from the samples: {apart}."
        yield f"Smoothing of the track: {facts['smoothing']}."
    else:
        yield f"Planned route: {facts['length']}."
    yield f"Largest along the track: {facts['largest']}. Attitude: {facts['attitude']}."
    yield from fit.notes
    yield from (f"WARNING: {warning}" for warning in fit.warnings)


def fit_numbers(fit: TrackFit) -> dict[str, float | str | list[str]]:
    """Return the numbers of a track for `summary.json`."""

    def of(name: str, unit: str, distance: Distance | None) -> dict[str, float]:
        return {} if distance is None else {f"rms_{name}_{unit}": distance.rms, f"max_{name}_{unit}": distance.largest}

    tau = zip(("position", "height", "attitude"), fit.tau, strict=True)
    return {
        "samples": fit.samples,
        "duration_s": fit.duration,
        "distance_m": fit.distance,
        **of("horizontal_from_samples", "m", fit.horizontal),
        **of("vertical_from_samples", "m", fit.vertical),
        **of("angle_from_samples", "rad", fit.attitude),
        **{f"{name}_smoothing_s": value for name, value in tau if np.isfinite(value)},
        "max_speed_mps": fit.speed.largest,
        "max_acceleration_mps2": fit.acceleration.largest,
        "max_turn_rate_radps": fit.turn.largest,
        "max_pitch_rad": fit.pitch.largest,
        "attitude": fit.attitude_words,
        "notes": list(fit.notes),
        "warnings": list(fit.warnings),
    }


def metres(value: float) -> str:
    """Write a distance with a suitable unit: "0.31 m", "12 mm", "below 1 µm"."""
    if value < _NOTHING:
        return "below 1 µm"
    if value < 1e-3:
        return f"{value * 1e6:.3g} µm"
    return f"{value * 1e3:.3g} mm" if value < 0.1 else f"{value:.3g} m"


class TrackCurve(Curve):
    """The true motion of a sensor block along a recorded or planned track."""

    fit: TrackFit  # how far the curve passes from the samples, largest speed, acceleration and turn rate, assumptions


def track_curve(
    knots: Knots,
    fit: TrackFit,
    lever_arm: ArrayLike = (0.0, 0.0, 0.0),
    q_bs: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    gravity: str = "normal",
    ellipsoid: Ellipsoid = WGS84,
    events: tuple[FlightEvent, ...] = (),
    channels: Mapping[str, Channel] | None = None,
) -> TrackCurve:
    """Return the motion of a sensor block along a track; the arguments are those of `Curve`."""
    curve = TrackCurve(knots.time, knots.position, knots.q_eb, lever_arm, q_bs, gravity, ellipsoid, events, channels)
    curve.fit = fit
    return curve


def fitted(
    samples: TrackSamples, options: TrackOptions, gravity: str, ellipsoid: Ellipsoid
) -> tuple[Knots, TrackFit, dict[str, Channel]]:
    """Return the knots of the curve of a track, how well it fits, and its distances from the samples."""
    knots = knots_of_samples(samples, options, gravity, ellipsoid)
    recorded = Curve(knots.time, knots.position, knots.q_eb, options.point, gravity=gravity, ellipsoid=ellipsoid)
    return knots, *assess(recorded, knots, samples, options, ellipsoid, planned=False)


# Long: the arguments of a public function, each checked by name.
def from_samples(
    time: ArrayLike,
    latitude: ArrayLike,
    longitude: ArrayLike,
    height: ArrayLike,
    quaternion: ArrayLike | None = None,
    *,
    vehicle: str = "land",
    smoothing_s: float | None = None,
    height_smoothing_s: float | None = None,
    attitude_smoothing_s: float | None = None,
    position_sigma_m: float | None = None,
    height_sigma_m: float | None = None,
    pitch: str | None = None,
    standstill_mps: float | None = None,
    heading: float = 0.0,
    gap_s: float | None = None,
    max_speed_mps: float | None = None,
    recorded_point_m: ArrayLike = (0.0, 0.0, 0.0),
    lever_arm_m: ArrayLike = (0.0, 0.0, 0.0),
    q_bs: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    gravity: str = "normal",
    ellipsoid: Ellipsoid = WGS84,
) -> TrackCurve:
    """Return the smooth exact motion along recorded samples: the motion; its attribute `fit` says how far it passes

    from the samples.

    The curve starts at the time of the first sample, counted as 0. Without attitude, heading, pitch and roll follow
    from the motion, see `sinssim.truth.vehicle_attitude`; noise is smoothed as
    `sinssim.truth.track_smoothing` says.

    Args:
        time: instants, increasing, (N,) s, N ≥ 2.
        latitude, longitude: geodetic, (N,) rad.
        height: above the ellipsoid, (N,) m; NaN where unknown.
        quaternion: attitude q_nb, scalar first, v_n = C_nb v_b, body forward-right-down, (N, 4).
        vehicle: "aircraft", "land" or "sea".
        smoothing_s: τ of the position, s; 0 passes through the samples; by cross-validation if not given.
        height_smoothing_s, attitude_smoothing_s: the same for the height and the attitude, s.
        position_sigma_m: rms horizontal distance of the curve from the samples, m, instead of τ.
        height_sigma_m: the same for the height, m.
        pitch: "slope" or "flat"; that of the vehicle if not given.
        standstill_mps: speed at which a held heading is given up, m/s; that of the vehicle if not given.
        heading: heading of a vehicle that never moves, rad.
        gap_s: interval that is bridged at uniform speed, s.
        max_speed_mps: speed between two samples beyond which they are refused, m/s.
        recorded_point_m: from the vehicle's reference point to the recorded point, body axes, (3,) m.
        lever_arm_m: from the reference point to the sensor block, body axes, (3,) m.
        q_bs: mounting of the block, v_b = C_bs v_s, (4,).
        gravity: one of `sinssim.GRAVITY_MODELS`.
    """
    check_name("vehicle", vehicle, get_args(VehicleName))
    if pitch is not None:
        check_name("pitch", pitch, get_args(Pitch))
    if smoothing_s is not None and position_sigma_m is not None:
        raise InputError("smoothing_s and position_sigma_m both determine the smoothing: give one of them.")

    def optional(name: str, value: float | None, unit: str) -> float | None:
        return None if value is None else number(name, value, unit, low=0.0)

    options = TrackOptions(
        vehicle=vehicle,  # type: ignore[arg-type]
        smoothing=optional("smoothing_s", smoothing_s, "s"),
        height_smoothing=optional("height_smoothing_s", height_smoothing_s, "s"),
        attitude_smoothing=optional("attitude_smoothing_s", attitude_smoothing_s, "s"),
        sigma=optional("position_sigma_m", position_sigma_m, "m"),
        height_sigma=optional("height_sigma_m", height_sigma_m, "m"),
        gap=optional("gap_s", gap_s, "s"),
        pitch=pitch,  # type: ignore[arg-type]
        standstill=optional("standstill_mps", standstill_mps, "m/s"),
        heading=number("heading", heading, "rad"),
        point=_three(recorded_point_m),
    )
    samples = _samples(time, latitude, longitude, height, quaternion)
    samples = checked_samples(samples, options.kind, optional("max_speed_mps", max_speed_mps, "m/s"))
    knots, fit, channels = fitted(samples, options, gravity, ellipsoid)
    return track_curve(knots, fit, lever_arm_m, q_bs, gravity, ellipsoid, channels=channels)


def _samples(
    time: ArrayLike, latitude: ArrayLike, longitude: ArrayLike, height: ArrayLike, quaternion: ArrayLike | None
) -> TrackSamples:
    columns = {"time": time, "latitude": latitude, "longitude": longitude, "height": height}
    arrays: dict[str, Array] = {name: numbers(name, values) for name, values in columns.items()}
    t = arrays["time"]
    for name, values in arrays.items():
        if values.ndim != 1 or len(values) != len(t):
            raise InputError(f"{name} has the shape {values.shape}, but time has {t.shape}: one number per sample.")
    far = np.abs(arrays["latitude"]) > 0.5 * np.pi + 1e-9
    if far.any():
        bad = int(np.argmax(far))
        raise InputError(
            f"sample {bad + 1}: latitude = {arrays['latitude'][bad]:g} rad lies beyond ±π/2: give radians, for example "
            f"numpy.radians(latitude); {arrays['latitude'][bad]:g}° would be {arrays['latitude'][bad] * DEG:.6g} rad."
        )
    q = None
    if quaternion is not None:
        q = numbers("quaternion", quaternion)
        if q.shape != (len(t), 4):
            raise InputError(f"quaternion has the shape {q.shape}; with {len(t)} samples it must be ({len(t)}, 4).")
    return TrackSamples(
        "the samples",
        "sample",
        t,
        arrays["latitude"],
        arrays["longitude"],
        arrays["height"],
        None if q is None else _unit(q),
    )


def _three(values: ArrayLike) -> tuple[float, float, float]:
    x, y, z = vector("recorded_point_m", values, 3, "m")
    return float(x), float(y), float(z)


def _unit(q: Array) -> Array:
    """Return quaternions whose norm is 1 to three digits as unit quaternions; others unchanged."""
    good = np.abs(np.linalg.norm(q, axis=1) - 1.0) < 1e-3
    out = q.copy()
    out[good] = rotation.normalize(q[good])
    return out
