"""Quiet spans of an inertial log, and what the sensors read there: gravity, the Earth's rate, noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.inspection.stream_findings import Finding, doubt, fact, span_text, wrong
from sinssim.analyses.inspection.velocity_match import Seen
from sinssim.data import Array
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.logs.recorded_streams import InertialStream
from sinssim.units import DEG, DEG_H, FOOT, G0

SLOWEST = 0.1
"""Speed from which a vehicle moves, m/s: twice the noise of a velocity that receivers' data sheets state, 0.05 m/s."""
_SIGMAS = 3.0
_MEAN_S = 16.0
"""Longest time over which velocities of fixes are averaged to tell motion from noise, s: as long as a stop lasts."""


@dataclass(frozen=True)
class Moves:
    """The motion that fixes show."""

    time: Array  # on the unit's clock, (M,) s
    speed: Array  # horizontal speed, averaged, (M,) m/s
    limit: float  # speed from which it is no noise, m/s

    def at(self, begin: Array, end: Array) -> NDArray[np.bool_]:
        """Return whether the vehicle moves between instants, (W,); not where there are no fixes."""
        middle = 0.5 * (begin + end)
        known = (middle >= self.time[0]) & (middle <= self.time[-1])
        return np.asarray(known & (np.interp(middle, self.time, self.speed) > self.limit))


def motion_of(fixes: Seen, offset: float) -> Moves:
    """Return the motion that fixes show, by the unit's clock minus that of the fixes, s: the speed, averaged over as
    many fixes as it takes to tell `SLOWEST` from their noise, which is that of the third differences."""
    from scipy.ndimage import uniform_filter1d

    velocity = fixes.relative - np.sum(fixes.relative * fixes.up, axis=1)[:, None] * fixes.up
    step = float(np.median(np.diff(fixes.time)))
    # white noise of unit variance has third differences of variance 20, and a median of |x| of 0.6745
    noise = float(np.median(np.abs(np.diff(velocity, n=3, axis=0)))) / (0.6745 * np.sqrt(20.0))
    count = int(np.clip(np.ceil((_SIGMAS * noise / SLOWEST) ** 2), 1, max(_MEAN_S / step, 1.0)))
    mean = uniform_filter1d(velocity, count, axis=0, mode="nearest")
    limit = max(SLOWEST, _SIGMAS * noise / np.sqrt(count))
    return Moves(fixes.time + offset, np.linalg.norm(mean, axis=1), float(limit))


WINDOW = 1.0
"""Length of the windows, s: longer than a period of an engine, shorter than a stop at a crossing."""
LOUDER = 2.5
"""A window is quiet if its noise is at most this many times that of the quietest twentieth of the log."""
_QUIETEST = 5.0
"""Percentage of the windows that are surely at rest, if fixes do not say which are: a stop or two in a drive. Of the
windows in which fixes stand, the middle one counts, so that an engine may run at one stop and not at another."""
SHORTEST = 3.0
"""Shortest quiet span, s."""
TOLERANCE = 0.02
"""Relative departure of the specific force at rest from gravity: a bias of 20 mg is beyond any navigation sensor."""

IN_MOTION = (0.8, 1.4)
"""Range of the median of a whole log over gravity: 1.4 in turns of 45° of bank all the time."""
IMPOSSIBLE = (0.7, 1.5)
"""Range outside of which no calibration explains the specific force at rest; units differ by a factor of three."""

OTHER_UNITS = (1.0 / 3.0, 3.0)
"""Range of the median of a log without a quiet span in which no unit explains it: units differ by more than a factor of
three (ft/s² and m/s²)."""
_LARGEST_BIAS = 20.0 * DEG
"""Largest bias of gyros in data sheets, rad/s: the rate at rest of cheap MEMS gyros, ±20 °/s."""

_SCALES: dict[str, float] = {
    "the numbers are in g": 1.0 / G0,
    "the numbers are in m/s² and were taken for g": G0,
    "the numbers are in mg": 1e3 / G0,
    "the numbers are in cm/s²": 1e2,
    "the numbers are in ft/s²": 1.0 / FOOT,
}
"""What the specific force at rest is, over gravity, if the unit is not the stated one."""


@dataclass(frozen=True)
class AtRest:
    """The readings of quiet spans."""

    spans: list[tuple[float, float]]  # beginning and end of each, s
    rows: NDArray[np.bool_]  # whether each sample is quiet, (N,)
    specific_force: Array  # mean of all of them, (3,) m/s²
    rate: Array  # mean, (3,) rad/s
    gyro_density: Array  # white noise, as the random walk of the integral, (3,) rad/√s
    accel_density: Array  # the same, (3,) m/s/√s
    # 1σ of a sample that a resolution or a dead band may hide, gyros and accelerometers, (2, 3) rad/s and m/s²; 0 where
    # most samples at rest differ
    hidden: Array
    in_motion: float = 0.0  # time that would be quiet by the readings, but in which the fixes move, s


def rates_of(stream: InertialStream) -> tuple[Array, Array, Array]:
    """Return times (N,) s, angular rates (N, 3) rad/s and specific forces (N, 3) m/s² of a stream, whether it holds
    rates or increments."""
    if stream.kind == "rates":
        return stream.time, stream.gyro, stream.accel
    if stream.interval is not None:
        lengths = stream.interval
    else:
        steps = np.diff(stream.time)
        lengths = np.append(steps[:1], steps)[:, None]
    lengths = np.where(lengths > 0.0, lengths, np.nan)
    return stream.time, stream.gyro / lengths[:, :1], stream.accel / lengths[:, -1:]


def at_rest(time: Array, rate: Array, force: Array, moves: Moves | None = None) -> AtRest | None:
    """Find the quiet spans of a log, of increasing times: standing still, or else the steadiest motion. Return the
    readings there; None if there is none of `SHORTEST`. The fixes, if any, show how the unit moves."""
    interval = float(np.median(np.diff(time)))
    number = np.floor((time - time[0]) / WINDOW)
    first = np.flatnonzero(np.append(True, np.diff(number) > 0))
    counts = np.diff(np.append(first, len(time)))
    enough = counts >= max(0.5 * WINDOW / interval, 2)

    def loud(values: Array) -> Array:
        mean = np.add.reduceat(values, first) / counts[:, None]
        square = np.add.reduceat(values * values, first) / counts[:, None]
        return np.asarray(np.sqrt(np.maximum(square - mean * mean, 0.0).sum(axis=1)))

    gyro, accel = loud(rate), loud(force)
    if not enough.any():
        return None
    ends = np.append(time[first[1:]], time[-1])
    moving = np.zeros(len(first), dtype=bool) if moves is None else moves.at(time[first], ends)
    some = enough & ~moving if (enough & ~moving).any() else enough
    share = _QUIETEST if moves is None or not (enough & ~moving).any() else 50.0
    cells = np.array([[cell(axis) for axis in values.T] for values in (rate, force)])
    floor = [
        max(float(np.percentile(x[some], share)), float(np.linalg.norm(of)), 1e-12)
        for x, of in zip((gyro, accel), cells, strict=True)
    ]
    quiet = enough & (gyro <= LOUDER * floor[0]) & (accel <= LOUDER * floor[1])
    mean = np.linalg.norm(np.add.reduceat(force, first) / counts[:, None], axis=1)
    quiet &= np.abs(mean / np.median(mean[enough]) - 1.0) < TOLERANCE
    in_motion = float(np.sum((ends - time[first])[quiet & moving]))
    quiet &= ~moving
    spans: list[tuple[float, float]] = []
    for k in np.flatnonzero(quiet):
        if spans and k and quiet[k - 1]:
            spans[-1] = (spans[-1][0], float(ends[k]))
        else:
            spans.append((float(time[first[k]]), float(ends[k])))
    spans = [s for s in spans if s[1] - s[0] >= SHORTEST - 1e-9]
    if not spans:
        return None
    rows = np.zeros(len(time), dtype=bool)
    density = np.zeros((2, 3))
    total = 0
    for begin, end in spans:
        inside = slice(int(np.searchsorted(time, begin)), int(np.searchsorted(time, end)))
        rows[inside] = True
        for triad, values in enumerate((rate[inside], force[inside])):
            density[triad] += len(values) * np.var(values - _line(values), axis=0) * interval
        total += len(rate[inside])
    equal = np.array([[_share_of_mode(axis[rows]) for axis in values.T] for values in (rate, force)])
    hidden = np.where(equal > _MOST_EQUAL, cells, 0.0)
    gyro_density, accel_density = np.maximum(np.sqrt(density / total), hidden * np.sqrt(interval))
    means = force[rows].mean(axis=0), rate[rows].mean(axis=0)
    return AtRest(spans, rows, *means, gyro_density, accel_density, hidden, in_motion)


_MOST_EQUAL = 0.5
"""Share of equal samples at rest from which their scatter does not show the noise: with a resolution q and a noise of
less than 0.74 q, that share lies within half a step of the mean."""


def _share_of_mode(axis: Array) -> float:
    return float(np.unique(axis, return_counts=True)[1].max()) / len(axis)


def cell(axis: Array) -> float:
    """Return the 1σ of what is written as the most frequent value of a channel, (N,); 0 if no two values are equal.
    Values between its neighbours are written as that value: a resolution q has cells of the width q and the 1σ q/√12; a
    dead band reaches to both neighbours."""
    values, counts = np.unique(axis, return_counts=True)
    steps = np.diff(values)
    steps = steps[steps > 1e-9 * max(float(np.max(np.abs(values))), 1e-300)]
    k = int(np.argmax(counts))
    if counts[k] < 2 or not len(steps):
        return 0.0
    width = min(abs(float(values[j] - values[k])) for j in (k - 1, k + 1) if 0 <= j < len(values))
    return (2.0 * width if width > 1.5 * float(np.min(steps)) else width) / float(np.sqrt(12.0))


def _line(values: Array) -> Array:
    """Return the straight line through samples, (N, k)."""
    x = np.linspace(-1.0, 1.0, len(values))[:, None]
    return np.asarray(values.mean(axis=0) + x * (x * values).sum(axis=0) / (x * x).sum())


def scale_finding(stream: InertialStream, quiet: AtRest | None, gravity: float) -> Finding:
    """Judge the scale of the accelerometers by gravity at the place, m/s²: a log that fails cannot be navigated.
    Without quiet spans, the median of the whole log is compared, with twice the tolerance. An error has the unit that
    would explain the number."""
    _, _, force = rates_of(stream)
    sizes = np.linalg.norm(force, axis=1)
    if quiet is None:
        size, low, high = float(np.nanmedian(sizes)), *IN_MOTION
        where = "over the whole log (median; no span is quiet, and manoeuvres increase it)"
    else:
        size, low, high = float(np.linalg.norm(quiet.specific_force)), 1.0 - TOLERANCE, 1.0 + TOLERANCE
        where = "in the quiet spans"
    ratio = size / gravity
    impossible = IMPOSSIBLE if quiet is not None else OTHER_UNITS
    text = f"The specific force {where} is {size:.5g} m/s², {ratio:.5g} times gravity ({gravity:.5g} m/s²)."
    numbers = {"specific_force_mps2": size, "of_gravity": ratio}
    if low <= ratio <= high:
        return fact("accelerometers", text, **numbers)
    interval = float(np.median(np.diff(stream.time)))
    scales = dict(_SCALES)
    if stream.kind == "rates":
        scales["the numbers are increments (velocity over each interval), not rates"] = interval
    else:
        scales["the numbers are rates (specific force), not increments"] = 1.0 / interval
    meaning, factor = min(scales.items(), key=lambda item: abs(np.log(max(ratio, 1e-300) / item[1])))
    if abs(ratio / factor - 1.0) <= 2.0 * TOLERANCE:
        fix = f"This fits if {meaning}: correct the unit or the kind."
        return wrong("accelerometers", text, fix, of_right_unit=factor, **numbers)
    if impossible[0] <= ratio <= impossible[1]:
        fix = "The accelerometers have a large bias or scale error, or the span was not at rest: calibrate them."
        if quiet is None:
            fix = "Is it the motion, of a rocket, a runner or a centrifuge? Otherwise the unit is another one."
        return doubt("accelerometers", text, fix, **numbers)
    return wrong(
        "accelerometers",
        text,
        "No common unit explains this: the columns, their unit, or the time differ from the description.",
        **numbers,
    )


def rest_findings(quiet: AtRest | None, moves: Moves | None = None) -> list[Finding]:
    """Describe the quiet spans: their place, the rate of turn there, and the noise. `moves`: motion that the fixes
    show; None if nothing is known."""
    if quiet is None:
        slow = "" if moves is None else f" while the fixes move by less than {moves.limit:.2g} m/s"
        return [
            doubt(
                "standing",
                f"No span of {SHORTEST:g} s or longer is quiet{slow}.",
                "Alignment at rest is impossible; biases and noise at rest are unknown.",
            )
        ]
    shown = ", ".join(span_text(a, b, "–") for a, b in quiet.spans[:8])
    more = f" and {len(quiet.spans) - 8} more" if len(quiet.spans) > 8 else ""
    lasting = sum(b - a for a, b in quiet.spans)
    left = ""
    if moves is not None and quiet.in_motion:
        left = (
            f" Another {quiet.in_motion:.4g} s are as quiet, but the fixes move there by {moves.limit:.2g} m/s or more."
        )
    gyro, accel = quiet.gyro_density / DEG, 1e6 * quiet.accel_density / G0
    return [
        fact("standing", f"Quiet spans, {lasting:.5g} s in all: {shown}{more}.{left}", spans_s=quiet.spans),
        fact(
            "noise",
            f"White noise there: gyros {', '.join(f'{d:.3g}' for d in gyro)} °/s/√Hz, accelerometers "
            f"{', '.join(f'{d:.4g}' for d in accel)} µg/√Hz.",
            gyro_deg_s_sqrt_hz=gyro.tolist(),
            accel_ug_sqrt_hz=accel.tolist(),
        ),
        *_hidden_noise("gyros", quiet.hidden[0] / DEG, "°/s"),
        *_hidden_noise("accelerometers", quiet.hidden[1] / G0, "g"),
        _mean_rate(quiet.rate, float(np.linalg.norm(quiet.gyro_density / np.sqrt(lasting)))),
    ]


def _hidden_noise(subject: str, hidden: Array, unit: str) -> Iterator[Finding]:
    """Yield the doubt on a noise that a dead band may hide, (3,) in that unit."""
    if hidden.any():
        axes = ", ".join(f"{name} {h:.2g} {unit}" for name, h in zip("xyz", hidden, strict=True) if h)
        text = (
            f"Most samples of the {subject} are equal at rest: a dead band or a coarse resolution, which may hide a "
            f"noise of {axes}."
        )
        yield doubt(subject, text, "The noise at rest is not known: see the data sheet.")


def _mean_rate(rate: Array, uncertain: float) -> Finding:
    """Return the finding on the mean rate at rest, (3,) rad/s, whose noise is uncertain, rad/s."""
    size = float(np.linalg.norm(rate))
    text = f"The gyros read {size / DEG_H:.4g} °/h in the quiet spans (noise of this mean {uncertain / DEG_H:.2g} °/h"
    numbers = {"rate_deg_h": size / DEG_H, "noise_deg_h": uncertain / DEG_H}
    if abs(size - OMEGA_IE) < 0.1 * OMEGA_IE and uncertain < 0.1 * OMEGA_IE:
        return fact("gyros", f"{text}); the Earth turns by 15.04 °/h: they sense it.", **numbers)
    biases = ", ".join(f"{r / DEG:.3g}" for r in rate)
    if float(np.max(np.abs(rate))) > _LARGEST_BIAS:
        text = f"{text}): {biases} °/s about x, y, z. Is that a bias? Data sheets have 20 °/s at most."
        fix = "See the unit and the columns of the gyros, and whether the vehicle turns there."
        return doubt("gyros", text, fix, **numbers)
    return fact("gyros", f"{text}; the Earth's rate is 15.04 °/h): biases of x, y, z of {biases} °/s.", **numbers)


def fast_noise(time: Array, values: Array, rows: NDArray[np.bool_]) -> Array:
    """Return the density of what changes from one sample (N, 3) to the next, as if it were white noise, (3,) unit·√s,
    where the samples count."""
    # third differences of white noise of unit variance have variance 20
    high = np.diff(values, n=3, axis=0)[rows[3:]]
    return np.asarray(np.sqrt(float(np.median(np.diff(time))) / 20.0 * np.mean(high * high, axis=0)))


def vibration_finding(time: Array, rate: Array, force: Array, quiet: AtRest | None) -> list[Finding]:
    """Compare the noise in motion with that at rest; there are no findings without quiet spans, or without others.
    Motion of a vehicle is slower than a few hertz; what changes from one sample to the next is vibration."""
    if quiet is None or quiet.rows[3:].all():
        return []
    gyro, accel = fast_noise(time, rate, ~quiet.rows) / DEG, fast_noise(time, force, ~quiet.rows) / (1e-6 * G0)
    still = quiet.gyro_density / DEG, quiet.accel_density * 1e6 / G0
    if not (np.min(still[0]) > 0.0 and np.min(still[1]) > 0.0):
        return []  # readings without noise at rest: frozen channels or ideal sensors
    ratio = max(float(np.max(gyro / still[0])), float(np.max(accel / still[1])))
    numbers = {"gyro_deg_s_sqrt_hz": gyro.tolist(), "accel_ug_sqrt_hz": accel.tolist(), "times_at_rest": ratio}
    text = (
        "In motion, the fast part of the data (third differences, treated as white noise) has: gyros "
        f"{', '.join(f'{g:.3g}' for g in gyro)} °/s/√Hz, accelerometers {', '.join(f'{a:.4g}' for a in accel)} µg/√Hz, "
        f"up to {ratio:.3g} times that at rest."
    )
    if ratio < LOUDER:
        return [fact("vibration", text, **numbers)]
    fix = "A filter that uses the noise at rest becomes overconfident: increase the noise, or set vibration_noise."
    return [doubt("vibration", text, fix, **numbers)]
