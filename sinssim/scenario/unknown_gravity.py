"""The gravity that a scenario's filter does not know: its size along the plan, and the process that describes it.

A disturbance δg acts like an error of the accelerometers. With their white noise N, the largest signal-to-noise ratio
that any filter can have for it is that of the matched filter (as in `filter_model`),

    d² = ∫|δg|² dt / N².                                                                                            (1)

The tests of the innovations and xᵀP⁻¹x grow by at most d². A state that absorbs the disturbance does not remove it: the
constant part goes into the tilts and the biases, which are then wrong by it, and their sum is known to N/√T. The part
that changes along the way shows in the innovations, too, as far as the noise of the aiding sensors allows.

The states of a filter describe δg as Gauss-Markov processes over the distance s travelled, with the correlation
exp(−s/D). Their 1σ is the root mean square along the plan, the same for both deflections. D follows from the mean
square γ of the changes over a tenth l of the plan's length, γ = 2σ²(1 − exp(−l/D)), for the deflections or the
disturbance down, whichever changes more.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sinssim.data import Array
from sinssim.earth import gravity_ned
from sinssim.estimation.state_model import GRAVITY, Block
from sinssim.scenario import Scenario
from sinssim.scenario.planned_limits import expected_duration
from sinssim.scenario.true_motion import true_motion, unknown_field
from sinssim.truth.flight.flight_plan import planned_path
from sinssim.units import ARCSEC, G0, MGAL, UG, number_text

_POINTS = 200
"""Points of the path at which the field is evaluated."""

MATTERS = 1.0
"""Least d that is reported: a disturbance below it adds less than 1 to the sum of all squared errors."""

_UNAIDED = 60.0
"""Time without aiding over which the effect on velocity and position is reported, s."""

_LAG = _POINTS // 10
"""Number of intervals between the points between which changes are counted."""

_FARTHEST, _LEAST, _UNCORRELATED = 5e6, 100.0, 0.02
"""Longest correlation distance, m; length, m, below which a vehicle hardly moves; least correlation of a change."""


class UnknownGravity(NamedTuple):
    """Gravity that a filter does not know, along the plan of a run."""

    sigma: Array  # 1σ of the states north, east, down, (3,) m/s²
    changing: float  # rms of the part that changes along the way, m/s²
    distance: float  # D, m
    duration: float  # of the plan, s

    @property
    def rms(self) -> float:
        """Root mean square of the magnitude, m/s²."""
        return float(np.linalg.norm(self.sigma))

    def ratio(self, noise: float) -> float:
        """Return d of (1) for the density of the accelerometers' noise, m/s/√s; infinite without noise."""
        return self.rms * math.sqrt(self.duration) / noise if noise else math.inf

    def block(self) -> Block:
        """Return the states that describe it."""
        return Block(GRAVITY, self.sigma, correlation_distance=self.distance)


def unknown_gravity(scenario: Scenario) -> UnknownGravity | None:
    """Return the gravity that a scenario's filter does not know, along the planned path; None if the filter knows the
    true field. A recording has no true field."""
    if scenario.gravity is None or scenario.log is not None:
        return None
    field, remainder = unknown_field(scenario), scenario.gravity.remainder_model()
    if field is None and remainder is None:
        return None
    latitude, longitude, height = _path(scenario)
    steps = np.hypot(np.diff(latitude), np.diff(longitude) * np.cos(latitude[1:])) * 6.371e6
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    length = float(travelled[-1])
    mean, variance, changes = np.zeros((3, 3))
    if field is not None:
        disturbance = field.at(latitude, longitude, height).gravity_ned
        mean, variance = disturbance.mean(axis=0) ** 2, disturbance.var(axis=0)
        apart = np.linspace(0.0, length, _POINTS)
        along = np.column_stack([np.interp(apart, travelled, axis) for axis in disturbance.T])
        changes = np.mean((along[_LAG:] - along[:-_LAG]) ** 2, axis=0)
    if remainder is not None:
        normal = float(gravity_ned(latitude[0], height[0])[2])
        size = np.array([normal * remainder.sigma[0], normal * remainder.sigma[1], remainder.sigma[2]]) ** 2
        lag = np.array(length * _LAG / (_POINTS - 1))
        changes = changes + 2.0 * size * (1.0 - remainder.correlation(lag))
        # it is a constant for a vehicle that hardly moves
        if length > remainder.distance:
            variance = variance + size
        else:
            mean = mean + size
    square = mean + variance
    for values in (square, changes):
        values[:2] = values[:2].mean()
    changing, lasts = float(np.sqrt(np.sum(variance))), expected_duration(scenario)
    return UnknownGravity(np.sqrt(square), changing, _distance(square, changes, length), lasts)


def _distance(square: Array, changes: Array, length: float) -> float:
    """Return D, m, for mean squares of δg and of its changes, (3,) m²/s⁴, over a tenth of a length, m."""
    correlation = 1.0 - float(np.max(np.divide(changes, 2.0 * square, out=np.zeros(3), where=square > 0.0)))
    if length < _LEAST or correlation >= 1.0:
        return _FARTHEST
    return min(-length * _LAG / (_POINTS - 1) / math.log(max(correlation, _UNCORRELATED)), _FARTHEST)


def gravity_block(scenario: Scenario) -> Block:
    """Return the states of a scenario's filter for the gravity that it does not know.

    What [filter.gravity] leaves out follows from the true field along the plan; without a true field, as for recorded
    sensors, from the degree variances of Tscherning and Rapp (1974) beyond the degree that the navigator knows.
    """
    from sinssim.earth.harmonic_coefficients import omission

    assert scenario.filter is not None
    given, along = scenario.filter.gravity, unknown_gravity(scenario)
    if along is None:
        left = omission(scenario.navigation.gravity_degree or 2)
        sigma, distance = np.array([G0 * left.deflection, G0 * left.deflection, left.anomaly]), left.distance
    else:
        sigma, distance = along.sigma, along.distance
    if given.deflection_sigma_arcsec is not None:
        sigma = np.array([*2 * [G0 * given.deflection_sigma_arcsec * ARCSEC], sigma[2]])
    if given.anomaly_sigma_mgal is not None:
        sigma = np.array([*sigma[:2], given.anomaly_sigma_mgal * MGAL])
    if given.correlation_km is not None:
        distance = 1e3 * given.correlation_km
    return Block(GRAVITY, sigma, correlation_distance=distance)


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


def gravity_notes(scenario: Scenario, bias: float, noise: float, states: Block | None) -> Iterator[str]:
    """Report gravity that a scenario's navigator does not know and that its readings show, beside what the filter
    assumes of the accelerometers, 1σ of their bias, m/s², and density of their noise, m/s/√s, and the states that
    describe it; None for none."""
    size = unknown_gravity(scenario)
    if size is None or size.ratio(noise) < MATTERS:
        return
    model = None if scenario.gravity is None else scenario.gravity.coefficients()
    changing = f"; {size.changing / MGAL:.2g} mGal of it change along the way" if size.changing > 0.01 * MGAL else ""
    t = _UNAIDED
    who = "filter" if states is None else "navigator"
    yield (
        f"The {who} does not know the true gravity ([gravity]), which differs from the known one by "
        f"{size.rms / MGAL:.3g} mGal (rms along the plan, {size.rms / UG:.3g} µg){changing}. The filter assumes a "
        f"bias of {bias / UG:.3g} µg (1σ) and a noise of {noise / UG:.3g} µg/√Hz of the accelerometers. In {t:g} s "
        f"without aiding, the disturbance makes {size.rms * t:.2g} m/s and {0.5 * size.rms * t**2:.2g} m, and the "
        f"noise {noise * math.sqrt(t):.2g} m/s and {noise * math.sqrt(t**3 / 3.0):.2g} m. Over the run the disturbance "
        f"is up to {number_text(size.ratio(noise), 2)} times the noise: "
        + _what_follows(states, None if model is None else model.degree)
    )


def _what_follows(states: Block | None, degree: int | None) -> str:
    if states is not None:
        xi, _, down = np.broadcast_to(np.asarray(states.sigma), 3)
        return (
            f"the filter has states for it, with a 1σ of {xi / G0 / ARCSEC:.2g}″ of each deflection and of "
            f"{down / MGAL:.3g} mGal down, and a correlation distance of {states.correlation_distance / 1e3:.3g} km."
        )
    remedy = "" if degree is None else f" set navigation.gravity_degree = {degree},"
    return (
        "tilts and biases take it up and are wrong by it, beyond the 1σ of their sum, and the filter is then not "
        f'consistent. Add "{GRAVITY}" to filter.states or omit filter.states,{remedy} or use a larger '
        "filter.inertial_noise_factor."
    )
