"""The power of time with which a block of six accelerometers drifts."""

from __future__ import annotations

import math

from sinssim.formatting import number_text
from sinssim.studies.claims import power_of_time as law
from sinssim.studies.claims.outcome import Evidence, Outcome, Point, undecided
from sinssim.studies.results import Row

EARLY_POWER, EARLY_WITHIN = 4.0, 0.1
"""Power of time below `power_of_time.EARLY`, and how far a fit may be from it."""
LATE_POWER, LATE_WITHIN = 2.0, 0.2
"""Power of time beyond one Schuler period, and how far a fit may be from it."""

_BLOCK = "six-accelerometers-"


def gyro_free(evidence: Evidence) -> Outcome:
    """Find the power of time with which six accelerometers drift, below 1000 s and beyond a Schuler period.

    Args:
        evidence: numbers of the deciding parts.

    Returns:
        The outcome, with a verdict on each block while its tilt is small.
    """
    numbers: dict[str, float] = {}
    points: list[Point] = []
    early: list[float] = []
    late: list[float] = []
    for row in evidence.rows:
        if not row.variant.startswith(_BLOCK) or row.sensors == "ideal":
            continue
        name = f"{row.motion}, {row.sensors}, arms of {row.variant.removeprefix(_BLOCK)}"
        numbers[f"{name}, m"] = row.final_horizontal_error_m
        text = f"{name}: {number_text(row.final_horizontal_error_m)} m after {row.duration_s:g} s"
        first, second, words = _powers(row, evidence)
        good = []
        if math.isfinite(first):
            early.append(first)
            numbers[f"{name}, power of time"] = first
            good.append(first > LATE_POWER)
        if math.isfinite(second):
            late.append(second)
            numbers[f"{name}, power of time beyond a Schuler period"] = second
            good.append(abs(second - LATE_POWER) <= LATE_WITHIN)
        if row.max_attitude_error_arcsec >= law.SMALL_TILT_DEG * 3600.0:
            words += f", tilted by up to {number_text(row.max_attitude_error_arcsec / 3600.0)}°"
        points.append(Point(text + words, ("confirmed" if all(good) else "refuted") if good else ""))
    if not early:
        return undecided(f"a block of six accelerometers with errors, tilted by less than {law.SMALL_TILT_DEG:g}°")
    reason = (
        f"While the tilt is small, below {law.SMALL_TILT_DEG:g}°, the error grows with the power {min(early):.2f} to "
        f"{max(early):.2f} of time below {law.EARLY:g} s: a bias tilts the IMU with the square of time, and gravity "
        "moves it with the fourth power"
    )
    if late:
        numbers["power beyond a Schuler period"] = late[0]
        reason += (
            f". Beyond one Schuler period, {law.SCHULER_PERIOD:.0f} s, the computed vertical follows the tilt and the "
            f"power is {min(late):.2f} to {max(late):.2f}, the chapter's square"
        )
    worse = min(early) > LATE_POWER
    square = all(abs(power - LATE_POWER) <= LATE_WITHIN for power in late)
    verdict = "confirmed" if worse and square else "partly" if worse or (late and square) else "refuted"
    return Outcome(verdict, reason + ":", tuple(points), numbers)


def _powers(row: Row, evidence: Evidence) -> tuple[float, float, str]:
    """Return the powers of time in both bands, NaN where a band is not covered, and the words on them."""
    growth = evidence.growth(row)
    if growth is None:  # an error ~ tᵖ has (final/rms)² = 2p + 1
        if row.max_attitude_error_arcsec >= law.SMALL_TILT_DEG * 3600.0:
            return math.nan, math.nan, ""
        power = 0.5 * ((row.final_horizontal_error_m / row.rms_horizontal_error_m) ** 2 - 1.0)
        return power, math.nan, f", power {power:.2f}"
    time, error = law.linear_part(growth, float(row.variant.removeprefix(_BLOCK).removesuffix("m")))
    first, expected = law.fitted_power(time, error, 0.0, law.EARLY)
    words = f", power {first:.2f} below {law.EARLY:g} s (closed form {expected:.2f})" if math.isfinite(first) else ""
    second, expected = law.fitted_power(time, error, law.SCHULER_PERIOD, math.inf)
    if math.isfinite(second):
        words += f", {second:.2f} beyond a Schuler period (closed form {expected:.2f})"
    return first, second, words
