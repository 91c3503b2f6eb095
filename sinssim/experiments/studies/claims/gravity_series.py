"""The accuracy of the chapter's three series of gravity, relative to the closed form of normal gravity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sinssim.earth.gravity import gravity_ned
from sinssim.earth.models import WGS84
from sinssim.experiments.studies.claims.outcome import Outcome, Point, overall
from sinssim.formatting import number_text
from sinssim.units import DEG

CEILING = 20e3
"""Greatest height of the chapter's aircraft, m."""

_SERIES: dict[str, tuple[float, Callable[[float], float]]] = {
    "order-1e-5": (1e-5, lambda x: 4.0 * x**3),
    "order-1e-4": (1e-4, lambda x: 3.0 * x**2),
    "order-1e-2": (1e-2, lambda x: WGS84.beta),
}
"""Order of each series, and the largest of the terms that it omits, relative to gravity, at x = H/a."""


def gravity_series(ceiling: float = CEILING) -> Outcome:
    """Compute the largest error of each series over all latitudes up to a height.

    Args:
        ceiling: greatest height, m.

    Returns:
        The outcome, with a verdict on each series.
    """
    latitude, height = np.linspace(-90.0, 90.0, 361)[:, None] * DEG, np.linspace(0.0, ceiling, 41)
    exact = gravity_ned(latitude, height)
    numbers, points, worst = {}, [], []
    for model, (order, omitted) in _SERIES.items():
        apart = np.linalg.norm(gravity_ned(latitude, height, model) - exact, axis=-1)
        error = float((apart / np.linalg.norm(exact, axis=-1)).max())
        term = omitted(ceiling / WGS84.a)
        numbers[f"{model}, relative error"], numbers[f"{model}, largest omitted term"] = error, term
        worst.append(error)
        text = f"{model}: {number_text(error, 2)} of gravity; omitted term {number_text(term, 2)}"
        points.append(Point(text, "confirmed" if error <= order else "refuted"))
    reason = (
        "The largest difference from the closed form of normal gravity, relative to gravity, over all latitudes and "
        f"heights up to {ceiling / 1e3:g} km. The largest terms of height and latitude that the series omit are "
        "4(H/a)³, 3(H/a)² and β sin²B; further ones are of the order f³ and f²:"
    )
    shown = ", ".join(number_text(error, 2) for error in worst)
    return Outcome(overall(points), reason, tuple(points), numbers, f"{shown} of g",
                   "at most 1e-5, 1e-4, 1e-2 of g")  # fmt: skip
