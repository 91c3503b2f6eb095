"""The size of the gravity that a scenario's filter does not know, against what its accelerometer states can absorb.

A disturbance δg acts like an error of the accelerometers. With their white noise N, the largest signal-to-noise ratio
that any filter can have for it is that of the matched filter (as in `filter_states`),

    d² = ∫|δg|² dt / N².                                                                                            (1)

The tests of the innovations and xᵀP⁻¹x grow by at most d². A state that absorbs the disturbance does not remove it: the
constant part goes into the tilts and the biases, which are then wrong by it, and their sum is known to N/√T. The part
that changes along the way shows in the innovations, too, as far as the noise of the aiding sensors allows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sinssim.earth import gravity_ned
from sinssim.estimation.state_model import error_model
from sinssim.formatting import number_text
from sinssim.scenario.filter_model import inertial_sigma
from sinssim.scenario.planned_limits import expected_duration
from sinssim.scenario.true_motion import true_motion, unknown_field
from sinssim.truth.flight.flight_plan import planned_path
from sinssim.units import MGAL, UG

if TYPE_CHECKING:
    from sinssim.data import Array
    from sinssim.scenario import Scenario

_POINTS = 200
"""Points of the path at which the field is evaluated."""

MATTERS = 1.0
"""Least d that is reported: a disturbance below it adds less than 1 to the sum of all squared errors."""


class UnknownGravity(NamedTuple):
    """Gravity that a filter does not know, along the plan of a run."""

    rms: float  # of its magnitude, m/s²
    changing: float  # rms of the part that changes along the way, m/s²
    # 1σ of the accelerometers' bias, m/s², and density of their noise, m/s/√s, as the filter assumes
    bias: float
    noise: float
    ratio: float  # d of (1), for the plan


def unknown_gravity(scenario: Scenario) -> UnknownGravity | None:
    """Return the gravity that a scenario's filter does not know: its size along the planned path; None if the filter
    knows the true field. A recording has no true field."""
    if scenario.gravity is None or scenario.log is not None:
        return None
    field, remainder = unknown_field(scenario), scenario.gravity.remainder_model()
    if field is None and remainder is None:
        return None
    latitude, longitude, height = _path(scenario)
    steps = np.hypot(np.diff(latitude), np.diff(longitude) * np.cos(latitude[1:])) * 6.371e6
    mean, variance = np.zeros(3), np.zeros(3)
    if field is not None:
        disturbance = field.at(latitude, longitude, height).gravity_ned
        mean, variance = disturbance.mean(axis=0) ** 2, disturbance.var(axis=0)
    if remainder is not None:
        normal = float(gravity_ned(latitude[0], height[0])[2])
        size = np.array([normal * remainder.sigma[0], normal * remainder.sigma[1], remainder.sigma[2]]) ** 2
        # it is a constant for a vehicle that hardly moves
        if float(steps.sum()) > remainder.distance:
            variance = variance + size
        else:
            mean = mean + size
    lasts = expected_duration(scenario)
    model = error_model(inertial_sigma(scenario), duration=lasts)
    bias = float(np.max(model.sigma[model.slices["accelerometer bias"]]))
    rms, changing = float(np.sqrt(np.sum(mean + variance))), float(np.sqrt(np.sum(variance)))
    ratio = rms * math.sqrt(lasts) / model.accel_noise if model.accel_noise else math.inf  # (1)
    return UnknownGravity(rms, changing, bias, model.accel_noise, ratio)


def _path(scenario: Scenario) -> tuple[Array, Array, Array]:
    """Return latitude, longitude and height along the plan, evenly in time."""
    if scenario.flight is not None:
        path = planned_path(scenario.flight)
        time = np.linspace(path.time[0], path.time[-1], _POINTS)
        latitude, longitude, height = (
            np.interp(time, path.time, v) for v in (path.latitude, path.longitude, path.height)
        )
        return latitude, longitude, height
    motion = true_motion(scenario.model_copy(update={"gravity": None}))
    state = motion.state(np.linspace(motion.start, motion.end, _POINTS))
    return state.latitude, np.unwrap(state.longitude), state.height


def gravity_notes(scenario: Scenario) -> Iterator[str]:
    """Report gravity that a scenario's filter does not know and that its readings show."""
    size = unknown_gravity(scenario)
    if size is None or size.ratio < MATTERS:
        return
    model = None if scenario.gravity is None else scenario.gravity.coefficients()
    remedy = "Use" if model is None else f"Set navigation.gravity_degree = {model.degree}, or use"
    changing = f"; {size.changing / MGAL:.2g} mGal of it change along the way" if size.changing > 0.01 * MGAL else ""
    yield (
        "The filter does not know the true gravity ([gravity]), which differs from the known one by "
        f"{size.rms / MGAL:.3g} mGal (rms along the plan, {size.rms / UG:.3g} µg){changing}. The filter assumes a "
        f"bias of {size.bias / UG:.3g} µg (1σ) and a noise of {size.noise / UG:.3g} µg/√Hz of the accelerometers. "
        f"Over the run the disturbance is up to {number_text(size.ratio, 2)} times the noise: tilts and biases take "
        "it up and are wrong by it, beyond the 1σ of their sum, and the filter is then not consistent. "
        f"{remedy} a larger filter.inertial_noise_factor."
    )
