"""The curve of a track: `TrackCurve`, and `from_samples`, which makes one from arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from sinssim import rotation
from sinssim.arguments import number, numbers, vector
from sinssim.data import Array
from sinssim.earth.models import WGS84, Ellipsoid
from sinssim.errors import InputError, check_name
from sinssim.truth.channel import Channel, FlightEvent
from sinssim.truth.curve import Curve
from sinssim.truth.track.fit import TrackFit, assess
from sinssim.truth.track.knots import Knots, TrackOptions, knots_of_samples
from sinssim.truth.track.samples import TrackSamples, checked_samples
from sinssim.truth.track.vehicles import Pitch, VehicleName
from sinssim.units import DEG


class TrackCurve(Curve):
    """The true motion of a sensor block along a recorded or planned track.

    Attributes:
        fit: how far the curve passes from the samples, largest speed, acceleration and turn rate, assumptions.
    """

    fit: TrackFit


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
    """Return the knots of the curve of a track, how well it fits, and its distances from the samples.

    Args:
        gravity: one of `sinssim.GRAVITY_MODELS`.

    Raises:
        InputError: the samples do not define a curve.
    """
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
    """Return the smooth exact motion along recorded samples.

    The curve starts at the time of the first sample, counted as 0. Without attitude, heading, pitch and roll follow
    from the motion, see `sinssim.truth.track.attitude`; noise is smoothed as `sinssim.truth.track.smoothing` says.

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

    Returns:
        The motion; its attribute `fit` says how far it passes from the samples.

    Raises:
        InputError: the samples cannot be a motion; the message names the sample.
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
