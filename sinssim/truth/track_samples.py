"""The samples of a recorded track, and the checks that they can be a motion."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.earth.geodetic_coordinates import geodetic_to_ecef
from sinssim.errors import InputError
from sinssim.truth.vehicle_attitude import Vehicle
from sinssim.units import DEG

_NEAR_ZERO = 1.6 * DEG, 3.2 * DEG
"""Latitude and longitude within which a whole track is suspected to be given in radians."""
_CLOSE = 1e-3
"""Part of the median interval below which two samples are one."""
_SAME = 5.0
"""Distance between two samples of one instant up to which the second one is left out, m."""
_LOW, _HIGH = -12_000.0, 1e6
_HALF_TURN_COSINE = float(np.cos(np.pi / 8))


@dataclass(frozen=True)
class TrackSamples:
    """Timed positions, with or without attitude."""

    source: str  # where they are from, for messages: a file, or "the samples"
    noun: str  # a sample in messages: "row", "point", "fix"
    time: Array  # (N,) s
    # (N,) rad
    latitude: Array
    longitude: Array
    height: Array  # above the ellipsoid, (N,) m
    q_nb: Array | None = None  # attitude, (N, 4); None if unknown
    # 1σ of the horizontal position and of the height, (N, 2) m, from which relative weights follow; None if unknown
    sigma: Array | None = None
    # number of each sample in its source, from 1, (N,)
    rows: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    notes: tuple[str, ...] = ()  # sentences on what was done with them

    def __post_init__(self) -> None:
        if len(self.rows) != len(self.time):
            object.__setattr__(self, "rows", np.arange(1, len(self.time) + 1))

    def __len__(self) -> int:
        return len(self.time)

    def at(self, index: int) -> str:
        """Return where a sample is, for messages: "drive.gpx, point 17 (at 16 s)"."""
        when = f" (at {self.time[index] - self.time[0]:.10g} s)" if np.isfinite(self.time[index]) else ""
        return f"{self.source}, {self.noun} {self.rows[index]}{when}"

    def part(self, rows: NDArray[np.int64] | NDArray[np.bool_] | slice) -> TrackSamples:
        """Return some of the samples."""
        return replace(
            self,
            time=self.time[rows],
            latitude=self.latitude[rows],
            longitude=self.longitude[rows],
            height=self.height[rows],
            q_nb=None if self.q_nb is None else self.q_nb[rows],
            sigma=None if self.sigma is None else self.sigma[rows],
            rows=self.rows[rows],
        )

    def noting(self, *sentences: str) -> TrackSamples:
        """Return the samples with further notes."""
        return replace(self, notes=(*self.notes, *sentences))

    def ecef(self, ellipsoid: Ellipsoid = WGS84) -> Array:
        """Return Earth-fixed positions, (N, 3) m."""
        return geodetic_to_ecef(self.latitude, self.longitude, self.height, ellipsoid)


def checked_samples(samples: TrackSamples, vehicle: Vehicle, most_speed: float | None = None) -> TrackSamples:
    """Return the samples without repetitions, if they can be a motion: below a speed between two samples, m/s, by
    default that of the vehicle."""
    check_numbers(samples)
    samples = _filled_heights(samples)
    samples = _without_repetitions(samples)
    if len(samples) < 2:
        raise InputError(
            f"{samples.source} has a single {samples.noun}, which is not a motion: a track needs at least two at "
            f"different times. For a stationary vehicle, use a scenario with [parked]."
        )
    _check_speed(samples, vehicle.most_speed if most_speed is None else most_speed, given=most_speed is not None)
    _check_turns(samples)
    latitude, longitude = _NEAR_ZERO
    moved = float(np.ptp(samples.latitude) + np.ptp(samples.longitude)) > 0.0
    if moved and np.abs(samples.latitude).max() < latitude and np.abs(samples.longitude).max() < longitude:
        return samples.noting(
            "The whole track lies within 1.6° of the equator and 3.2° of Greenwich, in the Gulf of Guinea: if the "
            "angles of the file are radians, name their columns latitude_rad and longitude_rad."
        )
    return samples


def check_numbers(samples: TrackSamples) -> None:
    """Raise for samples without a finite time or a place on the Earth."""
    if not len(samples):
        raise InputError(f"{samples.source} has no {samples.noun} with a position.")
    columns = [("time", samples.time), ("latitude", samples.latitude), ("longitude", samples.longitude)]
    if samples.q_nb is not None:
        columns.append(("attitude", samples.q_nb.sum(axis=1)))
    for name, values in columns:
        if not np.isfinite(values).all():
            bad = int(np.argmin(np.isfinite(values)))
            raise InputError(
                f"{samples.at(bad)}: its {name} is {values[bad]:g}; remove the {samples.noun}, or give a number"
                + (", or leave the attitude out with track.attitude = false." if name == "attitude" else ".")
            )
    beyond = np.abs(samples.latitude) > 90.0 * DEG + 1e-12
    if beyond.any():
        bad = int(np.argmax(beyond))
        raise InputError(
            f"{samples.at(bad)}: its latitude, {samples.latitude[bad] / DEG:.8g}°, lies beyond ±90°: latitude and "
            "longitude may be exchanged, or degrees and radians."
        )
    round_ = np.abs(samples.longitude) > 360.0 * DEG + 1e-12
    if round_.any():
        bad = int(np.argmax(round_))
        raise InputError(
            f"{samples.at(bad)}: its longitude, {samples.longitude[bad] / DEG:.8g}°, lies beyond ±360°: degrees and "
            "radians may be exchanged."
        )
    high = (samples.height < _LOW) | (samples.height > _HIGH)
    if high.any():
        bad = int(np.argmax(high))
        raise InputError(
            f"{samples.at(bad)}: its height, {samples.height[bad]:.8g} m, is not from {_LOW:g} to {_HIGH:g} m."
        )


def _filled_heights(samples: TrackSamples) -> TrackSamples:
    """Return the samples with heights where they are missing, interpolated in time."""
    known = np.isfinite(samples.height)
    if known.all():
        return samples
    missing = int(np.count_nonzero(~known))
    if not known.any():
        return replace(samples, height=np.zeros(len(samples))).noting(
            f"No {samples.noun} has a height: 0 m above the ellipsoid is assumed for all; track.height_offset_m gives "
            "another height."
        )
    first = int(np.argmin(known))
    order = np.argsort(samples.time[known], kind="stable")
    height = np.interp(samples.time, samples.time[known][order], samples.height[known][order])
    return replace(samples, height=np.where(known, samples.height, height)).noting(
        f"{missing} of {len(samples)} {_plural(samples.noun, len(samples))} {'has' if missing == 1 else 'have'} no "
        f"height, first {samples.noun} {samples.rows[first]}; it is interpolated in time."
    )


def _without_repetitions(samples: TrackSamples) -> TrackSamples:
    """Return the samples without those that repeat the one before; raise if time does not advance otherwise."""
    step = np.diff(samples.time)
    positive = step[step > 0.0]
    least = _CLOSE * float(np.median(positive)) if len(positive) else 0.0
    late = np.flatnonzero(step <= least)
    if not len(late):
        return samples
    position = samples.ecef()
    for row in map(int, late):
        apart = float(np.linalg.norm(position[row + 1] - position[row]))
        if step[row] < 0.0:
            raise InputError(
                f"{samples.at(row + 1)}: its time lies {-step[row]:.6g} s before that of {samples.noun} "
                f"{samples.rows[row]}: times must increase. Sort the file, or split it where its clock was reset."
            )
        if apart > _SAME:
            raise InputError(
                f"{samples.at(row + 1)}: it has the same time as {samples.noun} {samples.rows[row]}, but lies "
                f"{apart:.3g} m from it: remove one of them."
            )
    regular = np.ones(len(samples), bool)
    regular[late + 1] = False
    return samples.part(regular).noting(
        f"{len(late)} {_plural(samples.noun, len(late))} with the time of the previous one left out, the first of them "
        f"{samples.noun} {samples.rows[late[0] + 1]}."
    )


def _check_speed(samples: TrackSamples, most: float, *, given: bool) -> None:
    position, step = samples.ecef(), np.diff(samples.time)
    speed = np.linalg.norm(np.diff(position, axis=0), axis=1) / step
    if not (speed > most).any():
        return
    bad = int(np.argmax(speed > most))
    apart = float(np.linalg.norm(position[bad + 1] - position[bad]))
    raise InputError(
        f"{samples.at(bad + 1)}: it lies {apart:.6g} m from {samples.noun} {samples.rows[bad]}, {step[bad]:.6g} s "
        f"before: a speed of {speed[bad]:.6g} m/s, more than {most:g} m/s"
        + (", max_speed_mps" if given else " of such a vehicle; max_speed_mps allows more")
        + f". Remove the wrong {samples.noun}, or check the unit of the times and angles."
    )


def _check_turns(samples: TrackSamples) -> None:
    """Raise if attitudes turn by too much between two samples; the curve through them would be arbitrary."""
    if samples.q_nb is None:
        return
    norm = np.linalg.norm(samples.q_nb, axis=1)
    if (np.abs(norm - 1.0) > 1e-3).any():
        bad = int(np.argmax(np.abs(norm - 1.0)))
        raise InputError(f"{samples.at(bad)}: its quaternion has the norm {norm[bad]:.6g}; it must be 1.")
    cosine = np.abs(np.einsum("ij,ij->i", samples.q_nb[1:], samples.q_nb[:-1])) / (norm[1:] * norm[:-1])
    # within a few degrees of a pole, meridians converge: the attitude relative to the Earth is checked by the curve
    if not (cosine < _HALF_TURN_COSINE).any() or np.abs(samples.latitude).max() > 85.0 * DEG:
        return
    bad = int(np.argmin(cosine))
    raise InputError(
        f"{samples.at(bad + 1)}: the attitude turns by {2.0 * np.degrees(np.arccos(min(1.0, cosine[bad]))):.0f}° since "
        f"{samples.noun} {samples.rows[bad]}, {samples.time[bad + 1] - samples.time[bad]:.6g} s before; it must turn "
        "by less than 45° between two samples: record it at a higher rate, or leave the attitude out with "
        "track.attitude = false."
    )


def _plural(noun: str, count: int) -> str:
    return noun if count == 1 else {"fix": "fixes"}.get(noun, f"{noun}s")
