"""The power of time with which a block of six accelerometers drifts."""

from __future__ import annotations

import math

from sinssim.experiments.studies.claims import power_of_time as law
from sinssim.experiments.studies.claims.outcome import Evidence, Outcome, Point, overall, undecided
from sinssim.formatting import number_text

SQUARE, WITHIN = 2.0, 0.2
"""The chapter's power of time, and how far a fit may be from it."""

_BLOCK = "six-accelerometers-"
_FORM = "power {measured:.2f} {band} (closed form {closed:.2f})"


def gyro_free(evidence: Evidence) -> Outcome:
    """Find the power of time with which six accelerometers drift, below 1000 s and beyond a Schuler period.

    Returns:
        The outcome, with a verdict on each block and band while its tilt is small.
    """
    numbers: dict[str, float] = {}
    points: list[Point] = []
    bands = {f"below {law.EARLY:g} s": (0.0, law.EARLY), "beyond a Schuler period": (law.SCHULER_PERIOD, math.inf)}
    found: dict[str, list[tuple[float, float]]] = {band: [] for band in bands}
    for row in evidence.rows:
        growth = evidence.growth(row)
        if not row.variant.startswith(_BLOCK) or row.sensors == "ideal" or growth is None:
            continue
        arm = row.variant.removeprefix(_BLOCK)
        name = f"{row.motion}, {row.sensors}, arms of {arm}"
        numbers[f"{name}, m"] = row.final_horizontal_error_m
        time, error = law.linear_part(growth, float(arm.removesuffix("m")))
        for band, (start, end) in bands.items():
            measured, closed = law.fitted_power(time, error, start, end)
            if math.isfinite(measured):
                found[band].append((measured, closed))
                numbers[f"{name}, power of time {band}"] = measured
                verdict = "confirmed" if abs(measured - SQUARE) <= WITHIN else "refuted"
                points.append(Point(f"{name}: {_FORM.format(measured=measured, band=band, closed=closed)}", verdict))
        points.append(
            Point(
                f"{name}: {number_text(row.final_horizontal_error_m)} m after {row.duration_s:g} s, tilted by up to "
                f"{number_text(row.max_attitude_error_arcsec / 3600.0)}°"
            )
        )
    if not all(found.values()):
        return undecided(
            f"a block of six accelerometers with errors, tilted by less than {law.SMALL_TILT_DEG:g}° for more than one "
            "and a half Schuler periods"
        )
    reason = (
        "A constant error of the accelerometers causes a constant error of the angular acceleration. The rate error "
        "grows with time, the tilt with its square, and until the Schuler loop acts gravity moves the block with the "
        "fourth power. Beyond one Schuler period "
        f"({law.SCHULER_PERIOD:.0f} s) the computed vertical follows the tilt, and the error grows with the square, "
        f"which is the chapter's. While the tilt is below {law.SMALL_TILT_DEG:g}°:"
    )
    shown = ", then ".join(f"t^{max(fits)[0]:.2f}" for fits in found.values())
    return Outcome(overall(points), reason, tuple(points), numbers, shown, "t² (theory: t⁴, then t²)")
