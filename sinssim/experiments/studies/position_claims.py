"""Claims about position and gravity.

Simplified radii of curvature, the rate of latitude, series of gravity, one-component systems (chapter (8.13),
(8.15)), and the power of time of blocks without gyros.

An error δω̇ of the angular acceleration tilts a level block by ½ δω̇ t². By (8.14) the position error of a block at
rest is

    Δp = R δω̇ (½ t² − (1 − cos ω_s t)/ω_s²)  →  g δω̇ t⁴/24 for ω_s t → 0

With θ = ω_s t its local power of time, d log Δp/d log t, is (θ² − θ sin θ)/(½ θ² − 1 + cos θ): 4 at first, exactly 2
after every Schuler period, and around 2 beyond the first.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.earth.ellipsoids import MEAN_RADIUS, WGS84
from sinssim.earth.gravity import gravity_ned
from sinssim.experiments.studies.study_results import (
    ErrorGrowth,
    Evidence,
    Outcome,
    Point,
    Row,
    by,
    of_motion,
    overall,
    undecided,
)
from sinssim.strapdown import one_component_system
from sinssim.strapdown.one_component_system import gyro_error
from sinssim.units import ARCMIN, DEG, DEG_H, UG, listed, number_text

CEILING = 20e3
"""Greatest height of the chapter's aircraft, m."""

_SERIES: dict[str, tuple[float, Callable[[float], float]]] = {
    "order-1e-5": (1e-5, lambda x: 4.0 * x**3),
    "order-1e-4": (1e-4, lambda x: 3.0 * x**2),
    "order-1e-2": (1e-2, lambda x: WGS84.beta),
}
"""Order of each series, and the largest of the terms that it omits, relative to gravity, at x = H/a."""


def gravity_series(ceiling: float = CEILING) -> Outcome:
    """Compute the largest error of each series over all latitudes up to a height, m."""
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


TERM_WITHIN = 1e-3
"""Relative distance from the closed form up to which a term is confirmed: the tilt, which is neglected, is smaller."""
PERIODS = 3
"""Whole Schuler periods that are simulated; both closed forms hold at the end of each."""

_STEPS = 1200  # per Schuler period: the error of the fourth-order integration is then below 1e-9


def accelerometer_term(periods: int = PERIODS) -> Outcome:
    """Simulate the largest error of the coordinate by a constant accelerometer error, which is 2Δa/g by (8.13)."""

    def figures(size: float) -> tuple[float, float]:
        _, coordinate = _simulated(periods, bias=size)
        return float(coordinate.max()) / ARCMIN, 2.0 * size / one_component_system.GRAVITY / ARCMIN

    sizes = {f"{size:g} µg": size * UG for size in (1.0, 10.0, 100.0)}
    reason = (
        "The one-component system at rest, integrated without linearisation. Its error oscillates with the Schuler "
        "period and returns to zero after each. Largest error of the coordinate and 2Δa/g:"
    )
    return _outcome(sizes, figures, "′", "2Δa/g", reason)


def gyro_term(periods: int = PERIODS) -> Outcome:
    """Simulate the error of the coordinate by a constant gyro error, which is Δω₀ t after whole periods by (8.15)."""

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
        verdict = "confirmed" if abs(measured / expected - 1.0) <= TERM_WITHIN else "refuted"
        points.append(Point(f"{name}: {number_text(measured, 5)}{unit}, {number_text(expected, 5)}{unit}", verdict))
    shown = f"{number_text(measured, 4)}{unit} for {name}"
    return Outcome(overall(points), reason, tuple(points), numbers, shown, f"{term} = {number_text(expected, 4)}{unit}")


def _simulated(periods: int, bias: float = 0.0, drift: float = 0.0) -> tuple[Array, Array]:
    """Return time and coordinate of the system at rest with an accelerometer error and a gyro error, nose-down."""
    period = 2.0 * np.pi / one_component_system.schuler_rate()
    time = np.linspace(0.0, periods * period, periods * _STEPS + 1)
    step = np.diff(time)
    force = step[:, None] * np.array([bias, one_component_system.GRAVITY])
    return time, one_component_system.simulate(time, -drift * step, force).coordinate


SCHULER_RATE = np.sqrt(9.81 / 6371000.0)
"""ω_s, rad/s."""
SCHULER_PERIOD = 2.0 * np.pi / SCHULER_RATE
"""s, 84.4 min."""
EARLY = 1000.0
"""End of the first band, s: there the closed form's local power is still 3.90."""
SMALL_TILT_DEG = 5.0
"""Tilt up to which the errors of a block without gyros are linear."""

_LEAST_ERROR = 1e-4  # m; a smaller one contains rounding, and gravity's gradient over the arms
_FORCE_PART = 100.0  # at this multiple of 12 ℓ/g, t², the biases' direct effect ½ δf t² is below one percent
_FEWEST = 5


def coordinate(time: ArrayLike) -> Array:
    """Return the closed form of the position error for R δω̇ = 1, ½ t² − (1 − cos ω_s t)/ω_s², s².

    It is a series where the difference would lose digits.
    """
    x = (SCHULER_RATE * np.asarray(time, dtype=np.float64)) ** 2
    series = x * x / 24.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0))
    exact = 0.5 * x - 2.0 * np.sin(0.5 * np.sqrt(x)) ** 2
    return np.asarray(np.where(x < 0.01, series, exact) / SCHULER_RATE**2)


def local_power(time: ArrayLike) -> Array:
    """Return the local power of time of the closed form: d log Δp/d log t."""
    t = np.asarray(time, dtype=np.float64)
    theta = SCHULER_RATE * t
    x = theta * theta
    slope = np.where(x < 0.01, x * x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0)), x - theta * np.sin(theta))
    return np.asarray(slope / (SCHULER_RATE**2 * coordinate(t)))


def linear_part(growth: ErrorGrowth, arm: float) -> tuple[Array, Array]:
    """Return the part of an error's growth to which the closed form applies: time since the start, s, and error, m.

    It is from where the direct effect of the biases is below one percent, and the error above rounding, to a tilt of
    `SMALL_TILT_DEG`; the cube has an `arm`, m.
    """
    t = growth.time - growth.time[0]
    tilted = growth.attitude > SMALL_TILT_DEG * 3600.0
    end = int(np.argmax(tilted)) if tilted.any() else len(t)
    small = np.flatnonzero((growth.horizontal[:end] < _LEAST_ERROR) | (t[:end] ** 2 < _FORCE_PART * 12.0 * arm / 9.81))
    first = int(small[-1]) + 1 if len(small) else 0
    return t[first:end], growth.horizontal[first:end]


def fitted_power(time: Array, error: Array, start: float, end: float) -> tuple[float, float]:
    """Fit the power of time between two instants, with points spread evenly over the logarithm of time.

    Beside it is that of the closed form over the same instants. Both are NaN if the band is not covered.
    """
    low, high = max(start, time[0] if len(time) else np.inf), min(end, time[-1] if len(time) else 0.0)
    if np.count_nonzero((time >= low) & (time <= high)) < _FEWEST or high < 1.5 * low:
        return float("nan"), float("nan")
    at = np.geomspace(low, high, 64)
    x = np.log(at)
    measured = np.interp(x, np.log(time), np.log(error))
    return float(np.polyfit(x, measured, 1)[0]), float(np.polyfit(x, np.log(coordinate(at)), 1)[0])


GOOD_GYRO_DEG_H = 0.0035
"""A high-quality gyro: the bias of the grade laser-navigation."""
BIASED = "gyro-0_01-deg-h"
"""Name of the block with a bias of 0.01 deg/h of every gyro."""
LEVEL_BIASED = "east-gyro-0_01-deg-h"
"""Name of the block with a bias of 0.01 deg/h of the gyro to the right."""
COMPUTER_SHARE = 0.01
"""Error of a good computer at most, relative to that of the sensors."""
PLANE_WITHIN = 0.05
"""Distance of the plane's error (8.15) from that on the turning Earth within two hours: (Ωt)²/6 is 0.046."""


_WRITTEN = {
    "simplified": "to first order, 1/(R₁+H) ≈ (1/a)[1 + e²(1 − 3/2 sin²B) − H/a] and "
    "1/(R₂+H) ≈ (1/a)[1 − ½e² sin²B − H/a]",
    "spherical": "without e², 1/(a+H) for both",
    "no-height": "without H, 1/R₁ and 1/R₂",
    "spherical-no-height": "without e² and H, 1/a for both",
}
"""The forms of the radii, written out."""


def simplified_radii(evidence: Evidence) -> Outcome:
    """Find, for each form of simplified radii, the gyro bias that causes the same position error in a Schuler period.

    The error by the radii is bounded and reaches its largest value within one Schuler period, while that of a gyro
    grows without bound. So the comparison depends on its duration, and one Schuler period is the shortest that shows
    both.
    """
    numbers: dict[str, float] = {}
    points = []
    worst: dict[str, float] = {}
    for motion, rows in by(evidence.rows, of_motion).items():
        forms = [r for r in rows if r.curvature != "exact" and r.sensors == "ideal"]
        biased = [r for r in rows if r.curvature == "exact" and r.sensors == BIASED]
        if not forms or not biased:
            return undecided(f"simplified radii with perfect sensors, and exact radii with the block {BIASED}")
        by_bias = _in_a_period(biased[0], evidence)
        if by_bias is None:
            return undecided(f"motions of at least one Schuler period, {SCHULER_PERIOD:.0f} s")
        numbers[f"{motion}: gyros of 0.01 deg/h, m"] = by_bias
        for row in forms:
            error = _in_a_period(row, evidence) or 0.0
            equivalent = 0.01 * error / by_bias
            worst[row.curvature] = max(worst.get(row.curvature, 0.0), equivalent)
            numbers[f"{motion}: {row.curvature}, m"] = error
            numbers[f"{motion}: {row.curvature}, equivalent gyro bias, deg/h"] = equivalent
            text = f"{motion}, {row.curvature}: {number_text(error)} m, as much as {number_text(equivalent, 2)} deg/h"
            points.append(Point(text, "confirmed" if equivalent >= GOOD_GYRO_DEG_H else "refuted"))
    if not points:
        return undecided("any result")
    costly = [value >= GOOD_GYRO_DEG_H for value in worst.values()]
    verdict = "confirmed" if all(costly) else "partly" if any(costly) else "refuted"
    numbers |= {f"{form}: largest equivalent gyro bias, deg/h": value for form, value in worst.items()}
    shown = [f"{_WRITTEN.get(form, form)} ({number_text(value, 2)})" for form, value in worst.items()]
    as_much = [text for text, much in zip(shown, costly, strict=True) if much]
    less = [text for text, much in zip(shown, costly, strict=True) if not much]
    judged = [f"as much or more: {listed(as_much)}"] if as_much else []
    judged += [f"less: {listed(less)}"] if less else []
    reason = (
        f"A high-quality gyro has {GOOD_GYRO_DEG_H:g} deg/h. By their largest error in one Schuler period, deg/h in "
        f"brackets, these forms of the radii cost {'; '.join(judged)}. Largest position error with perfect sensors, "
        "and the gyro bias with the same error:"
    )
    measured = f"by form {' to '.join(number_text(of(worst.values()), 2) for of in (min, max))} deg/h"
    return Outcome(verdict, reason, tuple(points), numbers, measured, f"at least {GOOD_GYRO_DEG_H:g} deg/h")


def _in_a_period(row: Row, evidence: Evidence) -> float | None:
    """Return the largest horizontal error in the first Schuler period, m; None for a shorter motion."""
    growth = evidence.growth(row)
    if growth is None or growth.time[-1] - growth.time[0] < SCHULER_PERIOD * (1.0 - 1e-2):
        return None
    return float(growth.horizontal[growth.time - growth.time[0] <= SCHULER_PERIOD].max())


def latitude_rate(evidence: Evidence) -> Outcome:
    """Compute the rate of latitude on a true motion due north."""
    facts = evidence.facts
    best = max(
        facts.items(), key=lambda item: item[1].latitude_rate_deg_h / max(item[1].ground_speed_kmh, 1.0), default=None
    )
    if best is None:
        return undecided("a motion to the north")
    motion, fact = best
    rate = fact.latitude_rate_deg_h * 1100.0 / fact.ground_speed_kmh
    round_earth = 1100.0 / 3.6 / MEAN_RADIUS / DEG_H
    text = (
        f"On the motion “{motion}” latitude changes by {fact.latitude_rate_deg_h:.3f} deg/h at "
        f"{fact.ground_speed_kmh:.1f} km/h; at 1100 km/h that is {rate:.2f} deg/h. V/R of the mean Earth is "
        f"{round_earth:.2f} deg/h; R₁ at the equator is smaller by 0.6 %."
    )
    verdict = "confirmed" if abs(rate - 10.0) < 0.5 else "refuted"
    return Outcome(verdict, text, (), {"latitude rate, deg/h": rate}, f"{rate:.2f} deg/h", "10 ± 0.5 deg/h")


def computer_errors(evidence: Evidence) -> Outcome:
    """Compare the errors of the algorithm, with perfect sensors, with those that the sensors cause.

    On a motion at rest the closed form (8.15) is beside the errors.
    """
    numbers: dict[str, float] = {}
    points: list[Point] = []
    worst = 0.0
    for motion, rows in by(evidence.rows, of_motion).items():
        ideal = [row for row in rows if row.sensors == "ideal"]
        biased = [row for row in rows if row.sensors == LEVEL_BIASED]
        if not ideal or not biased:
            return undecided(f"perfect sensors and the block {LEVEL_BIASED} on the same motions")
        computer, sensors = ideal[0].max_horizontal_error_m, biased[0].max_horizontal_error_m
        share = computer / sensors
        worst = max(worst, share)
        numbers |= {f"{motion}: computer, m": computer, f"{motion}: sensors, m": sensors}
        text = f"{motion}: computer {number_text(computer, 2)} m, gyro {number_text(sensors, 4)} m"
        verdict = "confirmed" if share <= COMPUTER_SHARE else "refuted"
        if evidence.facts[motion].distance_m < 1.0:
            closed = MEAN_RADIUS * float(gyro_error(biased[0].duration_s, 0.01 * DEG_H))
            numbers[f"{motion}: (8.15), m"] = closed
            text += f", by (8.15) {number_text(closed, 4)} m"
            verdict = verdict if abs(sensors / closed - 1.0) <= PLANE_WITHIN else "refuted"
        points.append(Point(text, verdict))
    if not points:
        return undecided("any result")
    reason = (
        "A computer is good if its own error, with perfect sensors, is at most 1 % of that of one gyro of 0.01 deg/h. "
        f"At rest the gyro's error must also be that of (8.15), to {100.0 * PLANE_WITHIN:g} % because the chapter's "
        "plane does not turn with the Earth. Largest position errors:"
    )
    measured = f"{number_text(100.0 * worst, 2)} % of a gyro's"
    return Outcome(overall(points), reason, tuple(points), numbers, measured, f"at most {100.0 * COMPUTER_SHARE:g} %")


SQUARE, POWER_WITHIN = 2.0, 0.2
"""The chapter's power of time, and how far a fit may be from it."""

_BLOCK = "six-accelerometers-"
_FORM = "power {measured:.2f} {band} (closed form {closed:.2f})"


def gyro_free(evidence: Evidence) -> Outcome:
    """Find the power of time with which six accelerometers drift, below 1000 s and beyond a Schuler period."""
    numbers: dict[str, float] = {}
    points: list[Point] = []
    bands = {f"below {EARLY:g} s": (0.0, EARLY), "beyond a Schuler period": (SCHULER_PERIOD, math.inf)}
    fits: dict[str, list[tuple[float, float]]] = {band: [] for band in bands}
    for row in evidence.rows:
        growth = evidence.growth(row)
        if not row.variant.startswith(_BLOCK) or row.sensors == "ideal" or growth is None:
            continue
        arm = row.variant.removeprefix(_BLOCK)
        name = f"{row.motion}, {row.sensors}, arms of {arm}"
        numbers[f"{name}, m"] = row.final_horizontal_error_m
        time, error = linear_part(growth, float(arm.removesuffix("m")))
        for band, (start, end) in bands.items():
            measured, closed = fitted_power(time, error, start, end)
            if math.isfinite(measured):
                fits[band].append((measured, closed))
                numbers[f"{name}, power of time {band}"] = measured
                verdict = "confirmed" if abs(measured - SQUARE) <= POWER_WITHIN else "refuted"
                points.append(Point(f"{name}: {_FORM.format(measured=measured, band=band, closed=closed)}", verdict))
        points.append(
            Point(
                f"{name}: {number_text(row.final_horizontal_error_m)} m after {row.duration_s:g} s, tilted by up to "
                f"{number_text(row.max_attitude_error_arcsec / 3600.0)}°"
            )
        )
    if not all(fits.values()):
        return undecided(
            f"a block of six accelerometers with errors, tilted by less than {SMALL_TILT_DEG:g}° for more than one "
            "and a half Schuler periods"
        )
    reason = (
        "A constant error of the accelerometers causes a constant error of the angular acceleration. The rate error "
        "grows with time, the tilt with its square, and until the Schuler loop acts gravity moves the block with the "
        "fourth power. Beyond one Schuler period "
        f"({SCHULER_PERIOD:.0f} s) the computed vertical follows the tilt, and the error grows with the square, "
        f"which is the chapter's. While the tilt is below {SMALL_TILT_DEG:g}°:"
    )
    shown = ", then ".join(f"t^{max(fits)[0]:.2f}" for fits in fits.values())
    return Outcome(overall(points), reason, tuple(points), numbers, shown, "t² (theory: t⁴, then t²)")
