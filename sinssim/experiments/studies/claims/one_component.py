"""The terms of the one-component system's errors: 2Δa/g by an accelerometer, Δω₀ t by a gyro."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sinssim.data import Array
from sinssim.experiments.studies.claims.outcome import Outcome, Point, overall
from sinssim.formatting import number_text
from sinssim.strapdown import one_component
from sinssim.units import ARCMIN, DEG_H, UG

WITHIN = 1e-3
"""Relative distance from the closed form up to which a term is confirmed: the tilt, which is neglected, is smaller."""
PERIODS = 3
"""Whole Schuler periods that are simulated; both closed forms hold at the end of each."""

_STEPS = 1200  # per Schuler period: the error of the fourth-order integration is then below 1e-9


def accelerometer_term(periods: int = PERIODS) -> Outcome:
    """Simulate the largest error of the coordinate by a constant accelerometer error, which is 2Δa/g by (8.13).

    Returns:
        The outcome, with a verdict on each size of the error.
    """

    def figures(size: float) -> tuple[float, float]:
        _, coordinate = _simulated(periods, bias=size)
        return float(coordinate.max()) / ARCMIN, 2.0 * size / one_component.GRAVITY / ARCMIN

    sizes = {f"{size:g} µg": size * UG for size in (1.0, 10.0, 100.0)}
    reason = (
        "The one-component system at rest, integrated without linearisation. Its error oscillates with the Schuler "
        "period and returns to zero after each. Largest error of the coordinate and 2Δa/g:"
    )
    return _outcome(sizes, figures, "′", "2Δa/g", reason)


def gyro_term(periods: int = PERIODS) -> Outcome:
    """Simulate the error of the coordinate by a constant gyro error, which is Δω₀ t after whole periods by (8.15).

    Returns:
        The outcome, with a verdict on each size of the error.
    """

    def figures(size: float) -> tuple[float, float]:
        time, coordinate = _simulated(periods, drift=size)
        return float(coordinate[-1] / time[-1]) * 3600.0 / ARCMIN, size * 3600.0 / ARCMIN

    sizes = {f"{size:g} deg/h": size * DEG_H for size in (0.001, 0.01, 0.1)}
    reason = (
        f"The one-component system at rest, integrated without linearisation over {periods} Schuler periods, at the "
        "end of which the sine in (8.15) vanishes. Mean growth of the coordinate's error and Δω₀:"
    )
    return _outcome(sizes, figures, "′/h", "Δω₀", reason)


def _outcome(
    sizes: dict[str, float], figures: Callable[[float], tuple[float, float]], unit: str, term: str, reason: str
) -> Outcome:
    numbers, points = {}, []
    for name, size in sizes.items():
        measured, expected = figures(size)
        numbers[f"{name}, measured"], numbers[f"{name}, {term}"] = measured, expected
        verdict = "confirmed" if abs(measured / expected - 1.0) <= WITHIN else "refuted"
        points.append(Point(f"{name}: {number_text(measured, 5)}{unit}, {number_text(expected, 5)}{unit}", verdict))
    shown = f"{number_text(measured, 4)}{unit} for {name}"
    return Outcome(overall(points), reason, tuple(points), numbers, shown, f"{term} = {number_text(expected, 4)}{unit}")


def _simulated(periods: int, bias: float = 0.0, drift: float = 0.0) -> tuple[Array, Array]:
    """Return time and coordinate of the system at rest with an accelerometer error and a gyro error, nose-down."""
    period = 2.0 * np.pi / one_component.schuler_rate()
    time = np.linspace(0.0, periods * period, periods * _STEPS + 1)
    step = np.diff(time)
    force = step[:, None] * np.array([bias, one_component.GRAVITY])
    return time, one_component.simulate(time, -drift * step, force).coordinate
