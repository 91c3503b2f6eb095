"""A one-component run of four instants whose every number is chosen; only what reports and recordings show of it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

TIME = np.array([100.0, 2100.0, 6100.0, 10_100.0])
ARCMIN = np.pi / 10_800.0
PERIOD = 5000.0
COORDINATE = np.array([0.5, -2.0, 4.0, 3.0])
"""Error of the simulation's coordinate, arcmin; of an equation, times its factor."""
FACTORS = {"along_motion": 1.01, "pendulum": 1.02, "first_order": 1.5, "closed": 2.5}


def errors(factor: float) -> Any:
    """Return errors: velocity 10, 20, −40 and 30 mm/s, pitch 3, 6, 12 and −24 arcmin, times the factor."""
    return SimpleNamespace(
        time=TIME, coordinate=factor * COORDINATE * ARCMIN, velocity=factor * np.array([0.01, 0.02, -0.04, 0.03]),
        pitch=factor * np.array([3.0, 6.0, 12.0, -24.0]) * ARCMIN,
    )  # fmt: skip


def source(name: str, simulated: float, closed: float) -> Any:
    return SimpleNamespace(name=name, simulated=errors(simulated), closed=errors(closed))


def result(*, steady: bool = False) -> Any:
    moving = 0.0 if steady else 1.0
    truth = SimpleNamespace(
        time=TIME, velocity=200.0 + moving * np.array([0.0, 10.0, 30.0, -5.0]),
        height=900.0 + moving * np.array([0.0, 50.0, 20.0, 70.0]),
        body_pitch=np.radians(5.0 + moving * np.array([0.0, 2.0, -4.0, 1.0])),
        horizontal=np.array([0.25, 0.5, -0.75, 0.125]), vertical=np.array([9.5, 9.75, 10.5, 9.875]),
    )  # fmt: skip
    section = SimpleNamespace(variant="one-integral", rate_hz=20.0, radius_m=6_371_000.0, gravity_mps2=9.8)
    return SimpleNamespace(
        section=section, truth=truth, error=errors(1.0), caused=errors(0.99), perfect=errors(0.01),
        by_source=(source("gyro bias", 0.5, 0.75), source("tilt <0>", 3.0, 3.5)),
        **{name: errors(factor) for name, factor in FACTORS.items()},
    )  # fmt: skip


def statistics(final: float, rms: float, most: float | None, velocity: float, pitch: float) -> dict[str, Any]:
    return {"final_position_error_m": final, "rms_position_error_m": rms, "max_position_error_m": most,
            "max_velocity_error_mps": velocity, "max_pitch_error_arcsec": pitch}  # fmt: skip


NUMBERS: dict[str, Any] = {
    "variant": "one-integral", "schuler_period_s": PERIOD,
    "errors": {
        "simulation": statistics(-5559.75, 4321.5, 7413.25, 0.04, 1440.0),
        "perfect_sensors": statistics(1.5, 2.5, 3.5, 0.001, 6.0),
        "equation_8_11": statistics(5670.0, 4400.0, 7500.0, 0.05, 1500.0),
    },
    "differences": {"equation_8_11": {"max_m": 12.345, "relative": 0.00167}},
}  # fmt: skip
