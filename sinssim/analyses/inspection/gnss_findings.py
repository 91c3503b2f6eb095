"""Findings about the fixes of a satellite receiver: place, quality, steps, claimed precision, age of the velocities."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.analyses.inspection.stream_findings import Finding, doubt, fact, span_text, time_text, wrong
from sinssim.analyses.inspection.velocity_match import scatter
from sinssim.data import Array
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.logs.recorded_streams import FixStream, geoid_height

Mask = NDArray[np.bool_]

_STEP_SIGMAS = 6.0
"""A step of this many σ of the claimed precision of two fixes contradicts it: by chance once in 5e8."""
_FASTEST = 1000.0
"""Speed that no vehicle of the users has, m/s; orbit is refused by receivers themselves."""
_SHOWN_FIXES = 6


def fix_findings(fixes: FixStream, delay: float) -> list[Finding]:
    """Judge fixes by themselves. `delay`: age of the velocities at their stamps, s."""
    whole = fixes
    fixes = whole.rows(whole.has_fix) if whole.has_fix.any() else whole
    findings = _place(fixes)
    if whole.quality is not None:
        codes, counts = np.unique(whole.quality, return_counts=True)
        words = [
            f"{whole.quality_words.get(int(c), f'code {c}')} {100.0 * n / len(whole):.3g} %"
            for c, n in zip(codes, counts, strict=True)
        ]
        of_code = {int(c): int(n) for c, n in zip(codes, counts, strict=True)}
        findings.append(fact("fixes", f"Quality: {', '.join(words)}.", codes=of_code))
    geoid = geoid_height(fixes)
    if fixes.datum != "ellipsoid" and geoid is not None:
        findings.append(
            doubt(
                "fixes",
                f"The heights refer to {'an unknown surface' if fixes.datum == 'unknown' else 'mean sea level'}.",
                f"{'Give' if fixes.datum == 'mean sea level' else 'If it is mean sea level, give'} geoid_height_m = "
                f"{geoid:.1f}, the geoid of EGM2008 there.",
            )
        )
    if fixes.position_sigma is None and fixes.covariance is None:
        findings.append(
            doubt(
                "fixes", "The fixes have no standard deviations.", "Give the filter those of the receiver's datasheet."
            )
        )
    return [*findings, *_jumps(fixes), *_steps(fixes, delay)]


def _place(fixes: FixStream) -> list[Finding]:
    """Return findings on latitude and longitude as such."""
    latitude, longitude = fixes.latitude, fixes.longitude
    missing = ~(np.isfinite(latitude) & np.isfinite(longitude) & np.isfinite(fixes.height))
    findings = []
    if missing.any():
        findings.append(fact("fixes", f"{int(missing.sum())} of {len(fixes)} fixes have no position."))
        latitude, longitude = latitude[~missing], longitude[~missing]
    if not len(latitude):
        return [wrong("fixes", "No fix has a position.", "Give another file.")]
    if float(np.max(np.abs(latitude))) > 0.5 * np.pi + 1e-9:
        k = int(np.argmax(np.abs(latitude)))
        text = f"The latitude reaches {np.degrees(latitude[k]):.6g}° (row {k + 1})."
        return [*findings, wrong("fixes", text, "Latitude and longitude are swapped, or in another unit.")]
    if float(np.max(np.abs(latitude))) + float(np.max(np.abs(longitude))) < 1e-3:
        text = "All fixes are within 6 km of latitude 0, longitude 0."
        return [*findings, doubt("fixes", text, "The numbers may be in another unit, or the receiver had no fix.")]
    span = f"latitude {_range(latitude)}, longitude {_range(longitude)}, height {np.nanmin(fixes.height):.5g} to "
    return [*findings, fact("fixes", f"Place: {span}{np.nanmax(fixes.height):.5g} m.")]


def _range(angle: Array) -> str:
    return f"{np.degrees(np.min(angle)):.6f}° to {np.degrees(np.max(angle)):.6f}°"


_OUTLIERS = 3
"""Fixes between two jumps up to which they are outliers, which the filter's gate refuses."""


def _jumps(fixes: FixStream) -> Iterator[Finding]:
    """Yield the doubt on steps of the position that no vehicle makes, with the longest part without such a step.

    A receiver that has lost its satellites may report a wrong or an old position for some time.
    """
    good = np.isfinite(fixes.latitude) & np.isfinite(fixes.longitude) & np.isfinite(fixes.height)
    good &= np.append(True, np.diff(fixes.time) > 0.0)
    time = fixes.time[good]
    place = earth.geodetic_to_ecef(fixes.latitude[good], fixes.longitude[good], fixes.height[good], ELLIPSOIDS["wgs84"])
    speed = np.linalg.norm(np.diff(place, axis=0), axis=1) / np.diff(time)
    jumps = np.flatnonzero(speed > _FASTEST)
    if not len(jumps):
        return
    k = int(np.argmax(speed))
    text = f"Between {time_text(time[k])} and {time_text(time[k + 1])} the position moves at {speed[k]:.4g} m/s."
    fix, numbers = "One of the two fixes is wrong, or the times are.", dict[str, Any](time_s=float(time[k]))
    parts: list[tuple[int, int]] = []
    for first, last in zip(np.append(0, jumps + 1), np.append(jumps, len(time) - 1), strict=True):
        before = parts[-1] if parts else None
        if last - first < _OUTLIERS:
            continue
        if before and np.linalg.norm(place[first] - place[before[1]]) < _FASTEST * (time[first] - time[before[1]]):
            parts[-1] = (before[0], last)
        else:
            parts.append((first, last))
    if len(parts) > 1:
        begin, end = max(((float(time[a]), float(time[b])) for a, b in parts), key=lambda part: part[1] - part[0])
        fix = f"Which fixes are wrong? The scenario uses the longest part without one, {span_text(begin, end)}."
        numbers["sound_s"] = begin, end
    elif parts and parts[0][0] > 0:  # outliers, but navigation would start from them
        begin = float(time[parts[0][0]])
        fix = f"The first fixes are wrong: the scenario begins at {time_text(begin)}."
        numbers["sound_s"] = begin, float(time[-1])
    yield doubt("fixes", text, fix, **numbers)


def _steps(fixes: FixStream, delay: float) -> list[Finding]:
    """Compare steps of the position with the velocity in between."""
    good = np.isfinite(fixes.latitude) & np.isfinite(fixes.longitude) & np.isfinite(fixes.height)
    good &= np.append(True, np.diff(fixes.time) > 0.0)
    if fixes.velocity_ned is None or int(good.sum()) < 10:
        return []
    time, velocity = fixes.time[good], fixes.velocity_ned[good]
    ellipsoid = ELLIPSOIDS["wgs84"]
    latitude, longitude = fixes.latitude[good], fixes.longitude[good]
    place = earth.geodetic_to_ecef(latitude, longitude, fixes.height[good], ellipsoid)
    q_en = earth.q_en(latitude[:-1], longitude[:-1])
    moved = rotation.rotate(rotation.conjugate(q_en), np.diff(place, axis=0))
    length = np.diff(time)
    middle = 0.5 * (time[1:] + time[:-1]) + delay
    mean = np.stack([np.interp(middle, time, axis) for axis in velocity.T], axis=1)
    short = length < 1.5 * float(np.median(length))
    findings: list[Finding] = []
    misfit = (moved - mean * length[:, None])[short, :2]
    size = np.linalg.norm(misfit, axis=1)
    usual = 1.4826 * float(np.median(np.abs(misfit)))
    shown = f"{1e3 * usual:.3g} mm" if usual < 1.0 else f"{usual:.3g} m"
    findings.append(
        fact(
            "fixes",
            f"Steps of the horizontal position agree with the velocities to {shown} (1σ per component).",
            step_sigma_m=usual,
        )
    )
    if fixes.position_sigma is None:
        return findings
    claimed = fixes.position_sigma[good][:, :2]
    both = np.sqrt(claimed[1:] ** 2 + claimed[:-1] ** 2)[short]
    findings += _too_small(usual, both, velocity, length, fixes.velocity_sigma)
    limit = _STEP_SIGMAS * np.maximum(np.linalg.norm(both, axis=1) / np.sqrt(2.0), usual)
    beyond = np.flatnonzero(size > limit)
    if len(beyond):
        at, order = time[1:][short], np.argsort(size[beyond])[::-1][:_SHOWN_FIXES]
        codes = _doubtful_codes(fixes, good, short, beyond)
        of_codes = f" They are at fixes of quality {', '.join(map(str, codes))}." if codes else ""
        named = ", ".join(f"{100.0 * size[k]:.3g} cm at {time_text(at[k])}" for k in sorted(beyond[order]))
        findings.append(
            doubt(
                "fixes",
                f"{len(beyond)} step{'s' * (len(beyond) > 1)} of the position contradict{'s' * (len(beyond) == 1)} the "
                f"claimed precision and the velocities; the largest: {named}.{of_codes}",
                "The filter's gate has to refuse such fixes, or their standard deviations have to be larger.",
                steps=len(beyond),
                doubtful_codes=codes,
            )
        )
    return findings


_TOO_SMALL = 3.0
"""Factor from which the scatter of the steps contradicts all of the claimed 1σ, or may not be the motion between."""
_VELOCITY_SIGMA = 0.1
"""1σ of a velocity without a stated one, m/s, by data sheets."""


def _too_small(usual: float, both: Array, velocity: Array, length: Array, sigma: Array | None) -> list[Finding]:
    """Return the doubt on 1σ of positions, with their factor, that the usual 1σ of a step's difference from the mean
    velocity, per component, m, contradicts. The mean of two velocities, (G, 3), is wrong by a twelfth of the second
    difference of the velocities (trapezoidal rule), and by their claimed noise, sigma. Only what is clearly larger is
    noise of the positions, of which `both` is claimed for the steps, (S, 2) m."""
    step, claimed = float(np.median(length)), float(np.median(both))
    if len(velocity) < 10 or not claimed > 0.0:
        return []
    curved = 1.4826 * float(np.median(np.abs(np.diff(velocity[:, :2], n=2, axis=0)))) / 12.0
    noise = _VELOCITY_SIGMA if sigma is None else float(np.nanmedian(sigma[:, :2]))
    if not usual > _TOO_SMALL * max(claimed, step * float(np.hypot(curved, noise))):
        return []
    text = (
        f"Are the stated 1σ of the positions too small? Their steps scatter by {usual:.3g} m (1σ per component) about "
        f"the velocities, {usual / claimed:.3g} times the stated {claimed:.3g} m."
    )
    fix = f"Multiply them: sigma_factor = {usual / claimed:.3g}."
    return [doubt("fixes", text, fix, sigma_factor=usual / claimed)]


def _doubtful_codes(fixes: FixStream, good: Mask, short: Mask, beyond: NDArray[np.intp]) -> list[int]:
    """Return the codes of quality at whose beginning or end a step contradicts the claimed precision: of the two codes
    at such a step, of which `beyond` numbers those among the short ones between good fixes, the rarer one is
    doubtful."""
    if fixes.quality is None:
        return []
    quality = fixes.quality[good]
    before, after = quality[:-1][short][beyond], quality[1:][short][beyond]
    count = {int(code): int(np.sum(quality == code)) for code in np.unique(quality)}
    changed = [(int(a), int(b)) for a, b in zip(before, after, strict=True) if a != b]
    return sorted({min(pair, key=lambda code: count[code]) for pair in changed})


_CHANGES = 5.0  # s; changes of velocity within twice this time show a delay, slower ones only its edges
_LEAST_CHANGE = 0.1  # m/s
_ALIKE = 0.9  # least correlation of velocities and differences of positions


@dataclass(frozen=True)
class Delay:
    """By how much the velocities of a receiver are older than its positions."""

    value: float  # s
    sigma: float  # 1σ from the scatter between parts of the log, s; NaN if they do not give it


def velocity_delay(fixes: FixStream) -> Delay | None:
    """Find by how much the velocities of a receiver are older than its positions, s; None without velocities, motion,
    or positions precise enough to show it. A velocity that is the mean over the last interval is half an interval old.
    Central differences of the positions are compared with the velocities, equally smoothed and at another time; the
    delay has the largest correlation. A least difference would be biased, because interpolation changes the noise."""
    from scipy.interpolate import CubicSpline
    from scipy.optimize import minimize_scalar

    if fixes.velocity_ned is None:
        return None
    good = np.isfinite(fixes.velocity_ned[:, :2]).all(axis=1) & np.isfinite(fixes.latitude) & np.isfinite(fixes.height)
    good &= np.append(True, np.diff(fixes.time) > 0.0)
    if int(good.sum()) < 50:
        return None
    time, velocity = fixes.time[good], fixes.velocity_ned[good]
    ellipsoid = ELLIPSOIDS["wgs84"]
    place = earth.geodetic_to_ecef(fixes.latitude[good], fixes.longitude[good], fixes.height[good], ellipsoid)
    c = rotation.dcm_from_quaternion(earth.q_en(fixes.latitude[good][0], fixes.longitude[good][0]))
    step = float(np.median(np.diff(time)))
    middle = slice(1, -1)
    moved = (((place - place[0]) @ c)[2:] - ((place - place[0]) @ c)[:-2])[:, :2] / (time[2:] - time[:-2])[:, None]
    # The same mean over two intervals of the velocities, and of both what changes within seconds.
    mean = 0.25 * velocity[:-2, :2] + 0.5 * velocity[1:-1, :2] + 0.25 * velocity[2:, :2]
    width = 2 * max(round(_CHANGES / step), 1) + 1
    fast, fast_mean = _without_slow(moved, width), _without_slow(mean, width)
    if len(fast) < 2 * width or float(np.std(fast_mean)) < _LEAST_CHANGE:
        return None
    curve = CubicSpline(time[middle], fast_mean)
    inside = slice(3, -5)  # the delays of the grid stay inside
    regular = np.diff(time[middle], prepend=time[0]) < 1.5 * step
    at, to = time[middle][inside], fast[inside] * regular[inside][:, None]

    def cost(delay: float) -> float:
        return -float(np.sum(curve(at + delay) * to))

    grid = step * np.arange(-2.0, 4.01, 0.1)
    costs = np.array([cost(d) for d in grid])
    best = int(np.argmin(costs))
    alike = -costs[best] / max(float(np.sqrt(np.sum(curve(at + grid[best]) ** 2) * np.sum(to**2))), 1e-300)
    if not 0 < best < len(grid) - 1 or alike < _ALIKE:
        return None
    bounds = (grid[best - 1], grid[best + 1])
    value = float(minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-4}).x)
    h = 0.1 * step
    # differences scatter by the noise alone, correlations also by the motion at both ends of a part
    same = regular[inside][:, None]
    low, here, high = (0.5 * np.sum((curve(at + value + d) * same - to) ** 2, axis=1) for d in (-h, 0.0, h))
    return Delay(value, scatter(low, here, high, h))


def _without_slow(values: Array, width: int) -> Array:
    """Return values minus their running mean over an odd number of rows, (N, k)."""
    from scipy.ndimage import uniform_filter1d

    return np.asarray(values - uniform_filter1d(values, width, axis=0, mode="nearest"))


def delay_findings(fixes: FixStream, delay_of_velocities: Delay | None, described: float) -> list[Finding]:
    """Return the finding on the delay of the velocities, which a description may give already."""
    if delay_of_velocities is None:
        return []
    delay, sigma = delay_of_velocities.value, delay_of_velocities.sigma
    step = interval_of(fixes)
    numbers = {"velocity_delay_s": delay, "sigma_s": sigma if np.isfinite(sigma) else None}
    if not sigma < _SHOWN_DELAY * step:
        text = "The motion does not show whether the velocities are older than the positions; no delay is described."
        return [doubt("fixes", text, "See the manual of the receiver.", **numbers)]
    text = f"The velocities are {1e3 * delay:.0f} ± {1e3 * sigma:.0f} ms older than the positions of the same stamp"
    if described and abs(delay - described) < 0.1 * step:
        return [fact("fixes", f"{text}; {1e3 * described:.0f} ms are described.", **numbers)]
    if described:
        text += f"; {1e3 * described:.0f} ms are described"
    elif not delayed(delay_of_velocities, step):
        return [fact("fixes", f"{text}: no delay is described.", **numbers)]
    why = " (half an interval: they are means over it)" if abs(delay / step - 0.5) < 0.15 else ""
    return [doubt("fixes", f"{text}{why}.", f"Describe a velocity delay of {delay:.3f} s.", **numbers)]


_SHOWN_DELAY = 1.0 / 6.0
"""Largest 1σ of a delay that the data show, in intervals of the fixes: half an interval is then 3σ."""


def delayed(delay: Delay, step: float) -> bool:
    """Return whether the data show that velocities are older, by a tenth of the interval of the fixes or more."""
    return delay.sigma < _SHOWN_DELAY * step and abs(delay.value) >= max(0.1 * step, 3.0 * delay.sigma)


def interval_of(fixes: FixStream) -> float:
    """Return the usual interval of fixes, s."""
    return float(np.median(np.diff(fixes.time)))
