"""Fixes of a satellite receiver: their quality, their steps against the velocities, their claimed precision."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.analyses.inspection.finding import Finding, doubt, fact, wrong
from sinssim.data import Array
from sinssim.earth.models import ELLIPSOIDS
from sinssim.logs.streams import FixStream

Mask = NDArray[np.bool_]

_SIGMAS = 6.0
"""A step of this many σ of the claimed precision of two fixes contradicts it: by chance once in 5e8."""
_FASTEST = 1000.0
"""Speed that no vehicle of the users has, m/s; orbit is refused by receivers themselves."""
_SHOWN = 6


def fix_findings(fixes: FixStream, delay: float) -> list[Finding]:
    """Judge fixes by themselves.

    Args:
        delay: age of the velocities at their stamps, s.
    """
    found = _place(fixes)
    if fixes.quality is not None:
        codes, counts = np.unique(fixes.quality, return_counts=True)
        words = [
            f"{fixes.quality_words.get(int(c), f'code {c}')} {100.0 * n / len(fixes):.3g} %"
            for c, n in zip(codes, counts, strict=True)
        ]
        of_code = {int(c): int(n) for c, n in zip(codes, counts, strict=True)}
        found.append(fact("fixes", f"Quality: {', '.join(words)}.", codes=of_code))
    if fixes.datum != "ellipsoid":
        found.append(
            doubt(
                "fixes",
                f"The heights refer to {'an unknown surface' if fixes.datum == 'unknown' else 'mean sea level'}.",
                "Give the height of the geoid above the ellipsoid if positions matter to better than some 50 m; "
                "differences of heights are right without it.",
            )
        )
    if fixes.position_sigma is None and fixes.covariance is None:
        found.append(
            doubt(
                "fixes", "The fixes have no standard deviations.", "Give the filter those of the receiver's datasheet."
            )
        )
    return found + _steps(fixes, delay)


def _place(fixes: FixStream) -> list[Finding]:
    """Return findings on latitude and longitude as such."""
    latitude, longitude = fixes.latitude, fixes.longitude
    missing = ~(np.isfinite(latitude) & np.isfinite(longitude) & np.isfinite(fixes.height))
    found = []
    if missing.any():
        found.append(fact("fixes", f"{int(missing.sum())} of {len(fixes)} fixes have no position."))
        latitude, longitude = latitude[~missing], longitude[~missing]
    if not len(latitude):
        return [wrong("fixes", "No fix has a position.", "Give another file.")]
    if float(np.max(np.abs(latitude))) > 0.5 * np.pi + 1e-9:
        k = int(np.argmax(np.abs(latitude)))
        text = f"The latitude reaches {np.degrees(latitude[k]):.6g}° (row {k + 1})."
        return [*found, wrong("fixes", text, "Latitude and longitude are swapped, or in another unit.")]
    if float(np.max(np.abs(latitude))) + float(np.max(np.abs(longitude))) < 1e-3:
        text = "All fixes are within 6 km of latitude 0, longitude 0."
        return [*found, doubt("fixes", text, "The numbers may be in another unit, or the receiver had no fix.")]
    span = f"latitude {_range(latitude)}, longitude {_range(longitude)}, height {np.nanmin(fixes.height):.5g} to "
    return [*found, fact("fixes", f"Place: {span}{np.nanmax(fixes.height):.5g} m.")]


def _range(angle: Array) -> str:
    return f"{np.degrees(np.min(angle)):.6f}° to {np.degrees(np.max(angle)):.6f}°"


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
    fast = np.linalg.norm(moved, axis=1) / length
    found: list[Finding] = []
    if float(np.max(fast)) > _FASTEST:
        k = int(np.argmax(fast))
        text = f"Between {time[k]:.6g} s and {time[k + 1]:.6g} s the position moves at {fast[k]:.4g} m/s."
        found.append(doubt("fixes", text, "One of the two fixes is wrong, or the times are.", time_s=float(time[k])))
    misfit = (moved - mean * length[:, None])[short, :2]
    size = np.linalg.norm(misfit, axis=1)
    usual = 1.4826 * float(np.median(np.abs(misfit)))
    found.append(
        fact(
            "fixes",
            f"Steps of the horizontal position agree with the velocities to {1e3 * usual:.3g} mm (1σ per component).",
            step_sigma_m=usual,
        )
    )
    if fixes.position_sigma is None:
        return found
    claimed = fixes.position_sigma[good][:, :2]
    both = np.sqrt(claimed[1:] ** 2 + claimed[:-1] ** 2)[short]
    limit = _SIGMAS * np.maximum(np.linalg.norm(both, axis=1) / np.sqrt(2.0), usual)
    beyond = np.flatnonzero(size > limit)
    if len(beyond):
        at, order = time[1:][short], np.argsort(size[beyond])[::-1][:_SHOWN]
        codes = _doubtful_codes(fixes, good, short, beyond)
        of_codes = f" They are at fixes of quality {', '.join(map(str, codes))}." if codes else ""
        named = ", ".join(f"{100.0 * size[k]:.3g} cm at {at[k]:.6g} s" for k in sorted(beyond[order]))
        found.append(
            doubt(
                "fixes",
                f"{len(beyond)} step{'s' * (len(beyond) > 1)} of the position contradict{'s' * (len(beyond) == 1)} the "
                f"claimed precision and the velocities; the largest: {named}.{of_codes}",
                "The filter's gate has to refuse such fixes, or their standard deviations have to be larger.",
                steps=len(beyond),
                doubtful_codes=codes,
            )
        )
    return found


def _doubtful_codes(fixes: FixStream, good: Mask, short: Mask, beyond: NDArray[np.intp]) -> list[int]:
    """Return the codes of quality at whose beginning or end a step contradicts the claimed precision.

    Of the two codes at such a step the rarer one is doubtful.

    Args:
        good: usable fixes, (M,).
        short: usable steps between good fixes, (G−1,).
        beyond: numbers of the contradicting steps among the short ones.
    """
    if fixes.quality is None:
        return []
    quality = fixes.quality[good]
    before, after = quality[:-1][short][beyond], quality[1:][short][beyond]
    count = {int(code): int(np.sum(quality == code)) for code in np.unique(quality)}
    changed = [(int(a), int(b)) for a, b in zip(before, after, strict=True) if a != b]
    return sorted({min(pair, key=lambda code: count[code]) for pair in changed})
