"""Values of an aircraft's envelope between its points."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

from sinssim.truth.flight.aircraft import Envelope

SERVICE_CLIMB = 0.5
"""Rate of climb that is left at the service ceiling: 100 ft/min [m/s]."""


def _between(at: Sequence[float], value: float) -> tuple[int, float]:
    """Return the point below a value and the share of the way to the next one, 0 … 1."""
    row = max(0, min(len(at) - 2, bisect_right(at, value) - 1))
    return row, max(0.0, min(1.0, (value - at[row]) / (at[row + 1] - at[row])))


def _of_table(envelope: Envelope, table: Sequence[Sequence[float]], height: float, speed_kt: float) -> float:
    row, up = _between(envelope.height_m, height)
    column, on = _between(envelope.airspeed_kt, speed_kt)
    (a, b), (c, d) = table[row][column : column + 2], table[row + 1][column : column + 2]
    return (1.0 - up) * ((1.0 - on) * a + on * b) + up * ((1.0 - on) * c + on * d)


def climb_rate(envelope: Envelope, height: float, speed_kt: float) -> float:
    """Return the largest steady rate of climb at a calibrated airspeed; negative above the ceiling.

    Args:
        height: m.

    Returns:
        Rate, m/s.
    """
    return _of_table(envelope, envelope.climb_mps, height, speed_kt)


def descent_rate(envelope: Envelope, height: float, speed_kt: float) -> float:
    """Return the largest steady rate of descent without more speed, engines idle; the arguments are as above, m/s."""
    return _of_table(envelope, envelope.descent_mps, height, speed_kt)


def speed_range(envelope: Envelope, height: float) -> tuple[float, float]:
    """Return the slowest and the fastest level flight at a height.

    Args:
        height: m.

    Returns:
        Calibrated airspeeds, kt; both 0 where there is no level flight.
    """
    row, up = _between(envelope.height_m, height)
    if not envelope.max_kt[row] or (up > 0.0 and not envelope.max_kt[row + 1]):
        row, up = (row, 0.0) if up < 0.5 else (row + 1, 0.0)
    (slow, fast) = envelope.min_kt[row], envelope.max_kt[row]
    if up > 0.0:
        slow += up * (envelope.min_kt[row + 1] - slow)
        fast += up * (envelope.max_kt[row + 1] - fast)
    return slow, fast


def ceiling(envelope: Envelope, speed_kt: float, rate: float = SERVICE_CLIMB) -> float:
    """Return the height at which a rate of climb is left.

    Args:
        rate: m/s.

    Returns:
        Height, m; the envelope's largest if more is left there.
    """
    low, high = envelope.height_m[0], envelope.height_m[-1]
    if climb_rate(envelope, high, speed_kt) >= rate:
        return high
    steps = 200
    for step in range(1, steps + 1):
        height = low + (high - low) * step / steps
        if climb_rate(envelope, height, speed_kt) < rate:
            return low + (high - low) * (step - 1) / steps
    return high


def best_ceiling(envelope: Envelope) -> tuple[float, float]:
    """Return the highest ceiling of all airspeeds, m, and its airspeed, kt."""
    return max((ceiling(envelope, speed), speed) for speed in envelope.airspeed_kt)
